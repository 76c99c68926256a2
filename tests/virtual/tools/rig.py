"""One axis over EtherCAT frames to a lockstep segment, with the tools' own layers above it."""

from __future__ import annotations

import json
import tempfile
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from backend.axes.axis.axis import Axis, Envelope
from backend.axes.axis.cyclic import CyclicSession
from backend.axes.drive.drive import Drive
from backend.axes.drive.ports import Port
from backend.axes.parameters import set_file as parameter_set
from backend.foundation.work.jobs import Progress
from drivers.ethercat.link import EthercatLink
from drivers.link import Trajectory
from drivers.virtual.mechanics import MechanicsSpec, analytic_response
from drivers.virtual.wires.ethercat.launch import VirtualSegment
from drivers.virtual.wires.netns import Namespace
from profiles.loader import load_profile
from tests.support.granted import set_up

URL = "ethercat://virtual0"
#: How many times as fast as the computer's time a lockstep segment runs at most.
PACE = 1.2
WIDE = Envelope(travel_rev=4.0, speed_rpm=1500.0, torque_percent=100.0, time_s=60.0)
AMPLE_S = 600.0
"""Time budget of a tuning where the test is about something else: the analysis takes as long as the
computer needs for it beside other tests. `test_minute` is about the budget."""


def mechanics(
    *loads: tuple[float, float, float],
    motor: float = 5e-5,
    viscous: float = 2e-4,
    coulomb: float = 0.03,
    gravity: float = 0.0,
    noise: float = 2.0,
    travel: tuple[float, float] | None = None,
    backlash: float = 0.0,
) -> MechanicsSpec:
    """A 400 W motor and its chain of (inertia, stiffness, damping)."""
    return MechanicsSpec.model_validate(
        {
            "motor": {"inertia_kgm2": motor, "rated_torque_nm": 1.27, "rated_speed_rpm": 3000},
            "friction": {"viscous_nms": viscous, "coulomb_nm": coulomb, "gravity_nm": gravity},
            "encoder": {"noise_counts": noise},
            **({"travel": {"min_rev": travel[0], "max_rev": travel[1]}} if travel else {}),
            "load": [
                {
                    "inertia_kgm2": j,
                    "stiffness_nm_per_rad": k,
                    "damping_nms_per_rad": d,
                    "backlash_rad": backlash,
                }
                for j, k, d in loads
            ],
        }
    )


@dataclass
class Bench:
    axis: Axis
    session: CyclicSession
    segment: VirtualSegment
    link: EthercatLink
    spec: MechanicsSpec

    async def values(self) -> dict[str, object]:
        """See `settings_of`."""
        return await settings_of(self.axis.drive)


async def settings_of(drive: Drive, *more: str) -> dict[str, object]:
    """Every setting of the drive, motor's own ones included: a tool leaves all as it was.

    ``more``: objects that are no settings, such as the mode.
    """
    stored = parameter_set.storable(drive.profile, motor_individual=True)
    keys = [p.key for p in stored if not p.key.startswith("60FE")]
    reachable = [key for key in keys if not drive.unreachable_why(drive.parameter(key))]
    readings = await drive.read_many([*reachable, *more])
    return {key: reading.raw for key, reading in readings.items()}


@dataclass
class At:
    """A progress that does something once, when a step comes."""

    step: str
    act: Callable[[], object]
    fraction: float = 0.0
    done: bool = False
    progress: Progress = field(init=False)

    def __post_init__(self) -> None:
        self.progress = Progress(self._reported)

    def _reported(self) -> None:
        here = self.step in self.progress.step and self.progress.fraction >= self.fraction
        if here and not self.done:
            self.done = True
            self.act()


@asynccontextmanager
async def bench(
    namespace: Namespace,
    spec: MechanicsSpec,
    cycle_s: float = 1e-3,
    *,
    lockstep: bool = True,
    settings: Mapping[str, int] | None = None,
    drive: str = "mms7",
) -> AsyncIterator[Bench]:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "bench.json"
        axis_of = {
            "name": "X",
            "drive": drive,
            "on": URL,
            "station": 1,
            "mechanics": spec.model_dump(exclude_defaults=True),
        }
        file.write_text(json.dumps({"axis": [axis_of]}), "utf-8")
        arguments = ["--bench", str(file), "--on", URL, "--sdo-ms", "0.2", "--eeprom-us", "5"]
        if lockstep:
            arguments.append("--lockstep")
        with VirtualSegment.start("ec0s", arguments, namespace) as segment:
            link = EthercatLink(
                "ec0m", url=URL, launcher=namespace.command([]), lockstep=PACE if lockstep else 0.0
            )
            await link.open()
            try:
                profile = load_profile(drive)
                await link.scan(lambda _share, _text: None)
                link.attach(1, profile)
                axis = Axis(Drive("x", "X", profile, [Port(link, 1, profile.link("ethercat"))]))
                await set_up(axis, settings or {})
                if settings:
                    from backend.tools.measuring.temporary import make_effective

                    await make_effective(axis)
                session = CyclicSession(link, [axis.drive])
                if lockstep:
                    outlive(session)
                await session.start(cycle_s)
                axis.session = session
                try:
                    yield Bench(axis, session, segment, link, spec)
                finally:
                    await session.stop()
            finally:
                await link.close()


def outlive(session: CyclicSession) -> None:
    """Let setpoints outlive that simulated time passes faster than the tools' clock."""
    play = session.cyclic.play

    async def patiently(trajectories: Sequence[Trajectory], *more: Any, **named: Any) -> int:
        living = [replace(each, renew_s=100.0) for each in trajectories]
        return await play(living, *more, **named)

    session.cyclic.play = patiently  # type: ignore[method-assign]


def silent() -> Progress:
    return Progress(lambda: None)


@dataclass(frozen=True)
class Errors:
    magnitude_db: float
    phase_deg: float
    covered: float
    lines: int


def errors(frf, spec: MechanicsSpec, low_hz: float, high_hz: float, truth=None) -> Errors:
    """Median errors over coherent lines of a band, against the analytic response or ``truth``.

    Lines beyond the band that the answer states for itself are none of it.
    """
    f = np.asarray(frf.frequency_hz)
    use = (f >= low_hz) & (f <= high_hz) & (frf.coherence >= 0.9) & frf.in_band
    if not np.any(use):
        return Errors(np.nan, np.nan, np.nan, 0)
    true = analytic_response(spec, f[use]) if truth is None else truth(f[use])
    ratio = frf.response[use] / true
    db, deg = np.abs(20 * np.log10(np.abs(ratio))), np.abs(np.degrees(np.angle(ratio)))
    inside = (db <= 1.96 * frf.std_db[use]) & (deg <= 1.96 * frf.std_deg[use])
    return Errors(
        float(np.median(db)), float(np.median(deg)), float(np.mean(inside)), int(use.sum())
    )
