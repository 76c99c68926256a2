"""Two virtual drives on one beam over EtherCAT frames, both measured as a job does it."""

from __future__ import annotations

import json
import tempfile
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from backend.axes.axis.axis import Axis
from backend.axes.axis.cyclic import CyclicSession
from backend.axes.drive.drive import Drive
from backend.axes.drive.ports import Port
from backend.tools.measuring.temporary import make_effective
from backend.tools.tool import Run
from backend.tools.tuning.gantry.result import GantryResult
from backend.tools.tuning.gantry.run import TOOL
from backend.tools.tuning.gantry.settings import GantrySettings
from backend.tools.tuning.sweep.profile_speed import prepared
from drivers.ethercat.link import EthercatLink
from drivers.virtual.defects import Defect
from drivers.virtual.mechanics import GantrySpec, MechanicsSpec
from drivers.virtual.wires.ethercat.launch import VirtualSegment
from drivers.virtual.wires.netns import Namespace
from profiles.loader import load_profile
from tests.support.granted import set_up
from tests.virtual.tools.rig import PACE, URL, outlive, settings_of, silent

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
    axes=("L", "R"),
    inertia_kgm2=2e-4,
    yaw_inertia_kgm2=4e-5,
    off_centre=0.15,
    joint_stiffness_nm_per_rad=25.0,
    joint_damping_nms_per_rad=3e-3,
    yaw_stiffness_nm_per_rad=4.0,
    yaw_damping_nms_per_rad=2e-3,
)


def motor(
    brake: bool = False,
    *,
    inertia_kgm2: float = 5e-5,
    rated_nm: float = RATED,
    coulomb_nm: float = 0.03,
) -> MechanicsSpec:
    return MechanicsSpec.model_validate(
        {
            "motor": {
                "inertia_kgm2": inertia_kgm2,
                "rated_torque_nm": rated_nm,
                "rated_speed_rpm": 3000,
                "brake": brake,
            },
            "friction": {"viscous_nms": 2e-4, "coulomb_nm": coulomb_nm},
            "encoder": {"noise_counts": 4},
        }
    )


def unequal(brake: bool = False) -> tuple[MechanicsSpec, MechanicsSpec]:
    """A motor, and one of about twice its size: another inertia, torque constant and friction."""
    larger = motor(brake, inertia_kgm2=1.1e-4, rated_nm=2.39, coulomb_nm=0.05)
    return motor(brake), larger


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
    namespace: Namespace,
    spec: GantrySpec = SQUARE,
    *,
    brake: bool = False,
    defects: tuple[Defect, ...] = (),
    joined: bool = True,
    motors: tuple[MechanicsSpec, MechanicsSpec] | None = None,
) -> AsyncIterator[Two]:
    """The beam between both drives, or nothing where they are not ``joined``; ``defects`` are those
    that the first axis has in the file. ``motors`` are two equal ones where not given.
    """
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "bench.json"
        both = motors or (motor(brake), motor(brake))
        axes: list[dict[str, Any]] = [
            {
                "name": name,
                "drive": "mms7",
                "on": URL,
                "station": n,
                "mechanics": each.model_dump(exclude_defaults=True),
            }
            for n, (name, each) in enumerate(zip(spec.axes, both, strict=True), 1)
        ]
        axes[0]["defects"] = list(defects)
        bench = {"axis": axes, "gantry": [spec.model_dump(mode="json")] if joined else []}
        file.write_text(json.dumps(bench), "utf-8")
        arguments = [
            "--bench", str(file), "--on", URL, "--sdo-ms", "0.2", "--eeprom-us", "5", "--lockstep",
        ]  # fmt: skip
        with VirtualSegment.start("ec0s", arguments, namespace) as segment:
            link = EthercatLink("ec0m", url=URL, launcher=namespace.command([]), lockstep=PACE)
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
                outlive(session)
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


def static_stiffness(spec: GantrySpec) -> float:
    joints = spec.joint_stiffness_nm_per_rad / 2
    return joints * spec.yaw_stiffness_nm_per_rad / (joints + spec.yaw_stiffness_nm_per_rad)


def codes(found: GantryResult) -> list[str]:
    return [each.code for each in found.findings]
