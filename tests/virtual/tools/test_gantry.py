"""Two virtual drives on one beam, measured together over EtherCAT frames.

Truth is what the beam was given; the tool sees positions, speeds and torques of the drives alone.
"""

from __future__ import annotations

import asyncio
import json
import math
import tempfile
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from backend.axis.axis import Axis
from backend.axis.cyclic import CyclicSession
from backend.commands.tools import lines_of
from backend.drive.drive import Drive
from backend.drive.ports import Port
from backend.tools.gantry.result import GantryResult
from backend.tools.gantry.run import TOOL
from backend.tools.gantry.settings import GantrySettings
from backend.tools.measuring.temporary import make_effective
from backend.tools.sweep.profile_speed import prepared
from backend.tools.tool import Run
from drivers.cia402 import State
from drivers.errors import MotionHalted, NotAllowed, OutOfRange
from drivers.ethercat.link import EthercatLink
from drivers.halt import HaltCause
from drivers.virtual.mechanics import GantrySpec, MechanicsSpec, gantry_response
from drivers.virtual.wires.ethercat.launch import VirtualSegment
from drivers.virtual.wires.netns import Namespace
from profiles.loader import load_profile
from tests.support.granted import set_up
from tests.unit.analysis.gantry_plant import Gantry
from tests.virtual.tools.rig import URL, At, settings_of, silent

pytestmark = pytest.mark.timeout(600)

RATED = 1.27
ASKED = GantrySettings(
    partner="R",
    travel_limit=3.0,
    speed_limit=600.0,
    torque_limit=60.0,
    lead_mm=10.0,
    resolution_hz=4.0,
)
SQUARE = GantrySpec(
    axes=("L", "R"), inertia_kgm2=2e-4, yaw_inertia_kgm2=4e-5, off_centre=0.15,
    joint_stiffness_nm_per_rad=25.0, joint_damping_nms_per_rad=3e-3,
    yaw_stiffness_nm_per_rad=4.0, yaw_damping_nms_per_rad=2e-3,
)  # fmt: skip


def motor(brake: bool = False) -> MechanicsSpec:
    return MechanicsSpec.model_validate({
        "motor": {
            "inertia_kgm2": 5e-5, "rated_torque_nm": RATED, "rated_speed_rpm": 3000,
            "brake": brake,
        },
        "friction": {"viscous_nms": 2e-4, "coulomb_nm": 0.03},
        "encoder": {"noise_counts": 4},
    })  # fmt: skip


@dataclass
class Two:
    axes: tuple[Axis, Axis]
    session: CyclicSession
    segment: VirtualSegment

    async def positions(self) -> list[float]:
        return [(await a.units()).position(await a.position_raw()) for a in self.axes]

    async def settings(self) -> list[dict[str, object]]:
        return [await settings_of(axis.drive, "6060:00") for axis in self.axes]

    def run(self, **more: Any) -> Run:
        given = {"progress": silent(), **more}
        return Run(self.axes[0], self.session, partner=self.axes[1], **given)


@asynccontextmanager
async def gantry(
    namespace: Namespace, spec: GantrySpec = SQUARE, *, brake: bool = False
) -> AsyncIterator[Two]:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "bench.json"
        mechanics = motor(brake).model_dump(exclude_defaults=True)
        axes = [
            {"name": name, "drive": "mms7", "on": URL, "station": n, "mechanics": mechanics}
            for n, name in enumerate(spec.axes, 1)
        ]
        bench = {"axis": axes, "gantry": [spec.model_dump(mode="json")]}
        file.write_text(json.dumps(bench), "utf-8")
        arguments = [
            "--bench", str(file), "--on", URL, "--sdo-ms", "0.2", "--eeprom-us", "5", "--lockstep",
        ]  # fmt: skip
        with VirtualSegment.start("ec0s", arguments, namespace) as segment:
            link = EthercatLink("ec0m", url=URL, launcher=namespace.command([]), lockstep=1.2)
            await link.open()
            try:
                profile = load_profile("mms7")
                await link.scan(lambda _share, _text: None)
                found = []
                for station, name in enumerate(spec.axes, 1):
                    link.attach(station, profile)
                    port = Port(link, station, profile.link("ethercat"))
                    axis = Axis(Drive(name.lower(), name, profile, [port]))
                    # 80 Hz with the inertia of one motor: loops that a cycle of 1 ms shows whole.
                    await set_up(axis, {"2005:03": 800})
                    await make_effective(axis)
                    found.append(axis)
                session = CyclicSession(link, [axis.drive for axis in found])
                await session.start(1e-3)
                for axis in found:
                    axis.session = session
                try:
                    yield Two((found[0], found[1]), session, segment)
                finally:
                    await session.stop()
            finally:
                await link.close()


async def measured(two: Two, asked: GantrySettings = ASKED, **more: Any) -> GantryResult:
    async with AsyncExitStack() as held:
        for axis in two.axes:
            held.enter_context(axis.granted("gantry", asked.envelope))
            await held.enter_async_context(prepared(axis, two.session, asked.envelope, False))
        found = await TOOL.run(two.run(**more), asked)
    return GantryResult.model_validate(found.model_dump(mode="json"))


def codes(found: GantryResult) -> list[str]:
    return [each.code for each in found.findings]


def between(found: Any, truth: float) -> bool:
    low, high = found.ci95
    return bool(low <= truth <= high)


def static_stiffness(spec: GantrySpec) -> float:
    joints = spec.joint_stiffness_nm_per_rad / 2
    return joints * spec.yaw_stiffness_nm_per_rad / (joints + spec.yaw_stiffness_nm_per_rad)


async def test_a_square_gantry(namespace: Namespace) -> None:
    kept: list[tuple[Any, Any]] = []

    def keep(_name: str, arrays: Any, meta: Any) -> None:
        kept.append((arrays, json.loads(json.dumps(meta))))

    async with gantry(namespace) as two:
        places = await two.positions()
        found = await measured(two, keep=keep)
        assert await two.positions() == pytest.approx(places, abs=0.004)
        for axis in two.axes:
            assert await axis.state() is not State.OPERATION_ENABLED
    f = np.array(found.frequency_hz)
    truth = gantry_response(SQUARE, (motor(), motor()), f)
    use = f < 180.0
    inside = []
    for entry in found.entries:
        true_db = 20 * np.log10(np.abs(truth[:, entry.speed - 1, entry.torque - 1]))
        off, half = np.abs(np.array(entry.magnitude_db) - true_db), np.array(entry.half_db)
        inside += list(off <= half)
        assert np.median(off[use]) < 0.3, entry.torque
        assert np.median(half[use]) < 0.5, entry.torque
    assert np.mean(inside) >= 0.93
    # Motion alike by the sum of both torques, and the skew by half of their difference.
    common = np.sum(truth, axis=(1, 2)) / 4
    skew = truth[:, 0, 0] - truth[:, 0, 1] - truth[:, 1, 0] + truth[:, 1, 1]
    assert [motion.kind for motion in found.motions] == ["common", "skew"]
    for motion, exact in zip(found.motions, (common, skew), strict=True):
        off = np.abs(np.array(motion.magnitude_db) - 20 * np.log10(np.abs(exact)))
        assert np.mean(off <= np.array(motion.half_db)) >= 0.93, motion.kind
        assert np.median(np.array(motion.half_db)[use]) < 0.5, motion.kind
    assert codes(found)[0] == "square"
    # The modes of the equations of motion, which are those of this beam and these motors.
    assert [m.kind for m in found.modes] == ["skew", "common", "skew"]
    for mode, (frequency_hz, damping, share) in zip(found.modes, Gantry().modes(), strict=True):
        low, high = mode.frequency_ci95_hz
        assert low <= frequency_hz <= high
        low, high = mode.damping_ci95
        assert low <= damping <= high
        assert mode.skew_share == pytest.approx(share, abs=0.05)
    assert between(found.inertia_kgm2, 3e-4)
    assert between(found.skew_stiffness_nm_per_rad, static_stiffness(SQUARE))
    for friction in found.friction_percent:
        # Coulomb and viscous friction at the steady speed.
        assert 100 * 0.03 / RATED < friction.value < 100 * 0.036 / RATED
    assert found.margins is not None
    assert found.margins.stable is True
    assert "pair_sound" in codes(found)
    assert "factor" in codes(found)
    ((arrays, meta),) = kept
    again = TOOL.reevaluate(arrays, meta)
    assert again.model_dump(mode="json") == found.model_dump(mode="json")


async def test_a_gantry_out_of_square_is_named_with_its_way(namespace: Namespace) -> None:
    """Brakes hold the beam where both motors show the same, which is not where it rests."""
    spec = SQUARE.model_copy(update={"square_error_rad": 0.12})
    async with gantry(namespace, spec, brake=True) as two:
        found = await measured(two)
    stiffness = static_stiffness(spec)
    # Axis 1 would rest ahead of axis 2, so that it is behind where both show the same.
    assert codes(found)[0] == "out_of_square"
    assert between(found.fight_percent, -100 * stiffness * 0.12 / RATED)
    assert found.out_of_square_rev is not None
    assert between(found.out_of_square_rev, -0.12 / math.tau)
    assert found.out_of_square_mm is not None
    assert between(found.out_of_square_mm, -0.12 / math.tau * 10.0)
    assert "Axis 2 is ahead of axis 1" in "\n".join(lines_of(TOOL, found))


async def stands(two: Two) -> None:
    for axis in two.axes:
        assert await axis.standstill(1.0)
        assert await axis.state() is not State.OPERATION_ENABLED


async def test_whatever_stops_one_axis_stops_both(namespace: Namespace) -> None:
    async with gantry(namespace) as two:
        before, places = await two.settings(), await two.positions()
        await refused_before_anything_moves(two)
        assert await two.positions() == pytest.approx(places, abs=1e-4)
        await a_skew_beyond_its_limit(two)
        await a_halt_of_one_axis(two)
        assert await two.settings() == before
        # Last, since the fault stays.
        await a_fault_of_one_axis(two)


async def refused_before_anything_moves(two: Two) -> None:
    with pytest.raises(OutOfRange) as refused:
        await measured(two, ASKED.model_copy(update={"travel_limit": 0.01}))
    assert refused.value.code == "gantry.no-room"
    with pytest.raises(OutOfRange) as refused:
        await measured(two, ASKED.model_copy(update={"time_limit_s": 5.0}))
    assert refused.value.code == "gantry.no-time"
    with pytest.raises(NotAllowed) as alone, two.axes[0].granted("gantry"):
        await TOOL.run(Run(two.axes[0], two.session, silent()), ASKED)
    assert alone.value.code == "gantry.no-partner"


async def a_skew_beyond_its_limit(two: Two) -> None:
    asked = ASKED.model_copy(update={"skew_limit_rev": 0.0005})
    with pytest.raises(MotionHalted) as halted:
        await measured(two, asked)
    assert halted.value.halt.cause is HaltCause.SKEW
    await stands(two)


async def a_halt_of_one_axis(two: Two) -> None:
    """As STOP of one station reaches the loop: this axis alone is commanded."""
    stopped: list[asyncio.Task[None]] = []

    def stop() -> None:
        stopped.append(asyncio.ensure_future(two.session.cyclic.halt(2)))

    at = At("experiment 1", stop, fraction=0.1)
    with pytest.raises(NotAllowed) as ended:
        await measured(two, progress=at.progress)
    assert at.done
    assert ended.value.drive == "R"
    await stands(two)


async def a_fault_of_one_axis(two: Two) -> None:
    seen: list[np.ndarray] = []
    keys = [axis.drive.require("position_actual") for axis in two.axes]
    names = [f"{axis.drive.id}/{key}" for axis, key in zip(two.axes, keys, strict=True)]

    def take(block: Any) -> None:
        seen.append(block.samples[:, [block.channels.index(name) for name in names]])

    def fault() -> None:
        two.segment.command("inject", slave=0, what="over_temperature")

    at = At("experiment 1", fault, fraction=0.1)
    unsubscribe = two.session.cyclic.blocks(take)
    try:
        with pytest.raises(NotAllowed):
            await measured(two, progress=at.progress)
    finally:
        unsubscribe()
    assert at.done
    await stands(two)
    ways = np.concatenate(seen) - seen[0][0]
    rev = abs((await two.axes[0].units()).position(1.0))
    # Neither went on alone: without that the beam would be twisted by the whole way of one axis.
    assert np.max(np.abs(ways[:, 0] - ways[:, 1])) * rev < 0.1
