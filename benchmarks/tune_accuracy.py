"""Errors of frequency response and inertia over EtherCAT frames, for a set of mechanics.

    python -m benchmarks.tune_accuracy [--khz 1 4] [--drive mms7] [--only NAME ...] [--real-time]

Against the analytic response of the chain; the limits are those of the design (tuning.md).
"""

from __future__ import annotations

import argparse
import asyncio

from backend.jobs import Progress
from backend.tools.inertia import InertiaSettings, Scheme, inertia
from backend.tools.sweep import sweep
from backend.tools.sweep_evaluation import Loop, SweepSettings
from drivers.cia402 import State
from drivers.errors import DriveError
from drivers.virtual.mechanics import MechanicsSpec
from drivers.virtual.wires.netns import Namespace
from tests.virtual.tools.rig import WIDE, Bench, bench, errors, mechanics

AXES: dict[str, MechanicsSpec] = {
    "motor alone": mechanics(),
    "ratio 2, stiff": mechanics((1e-4, 2000.0, 0.02)),
    "ratio 10": mechanics((5e-4, 1000.0, 0.03)),
    "ratio 30": mechanics((1.5e-3, 300.0, 0.05), viscous=1e-3, coulomb=0.06),
    "ratio 60": mechanics((3e-3, 300.0, 0.05), viscous=1e-3, coulomb=0.06),
    "one resonance": mechanics((1e-4, 20.0, 0.002)),
    "two resonances": mechanics((1e-4, 20.0, 0.002), (5e-5, 100.0, 0.005)),
    "three resonances": mechanics((1e-4, 20.0, 0.002), (5e-5, 100.0, 0.005), (3e-5, 150.0, 0.004)),
    "compliant": mechanics((5e-4, 12.0, 0.004), viscous=5e-4, coulomb=0.05),
    "stiff, light": mechanics((6e-5, 150.0, 0.003), motor=3e-5, viscous=1e-4, coulomb=0.02),
    "vertical": mechanics((1e-4, 40.0, 0.003), coulomb=0.04, gravity=0.2),
    "noisy encoder": mechanics((1e-4, 60.0, 0.006), noise=60.0),
    "backlash": mechanics((1e-4, 200.0, 0.01), backlash=0.002),
    "limited travel": mechanics((1e-4, 200.0, 0.005), travel=(-1.5, 1.5)),
}


async def _ready(b: Bench) -> None:
    if await b.axis.state() is State.FAULT:
        await b.axis.reset_fault()


async def _one(namespace: Namespace, name: str, khz: float, lockstep: bool, drive: str) -> str:
    spec = AXES[name]
    vertical = spec.friction.gravity_nm != 0
    limited = spec.travel.max_rev < 100
    brake = {"2108:01": 1} if vertical and drive == "mms7" else None
    async with bench(
        namespace, spec, 1e-3 / khz, lockstep=lockstep, settings=brake, drive=drive
    ) as b:
        await _ready(b)
        loop: Loop = "speed" if vertical or limited else "auto"
        envelope = WIDE if not limited else type(WIDE)(1.2, 1500.0, 100.0, 60.0)
        try:
            found = await sweep(
                b.axis, b.session, SweepSettings(envelope, loop=loop), Progress(lambda: None)
            )
        except DriveError as error:
            return f"{name:18} {khz:g} kHz  {error.message}"
        fs = 1000.0 * khz
        top = min(1000.0, 0.25 * fs) if loop == "auto" else min(1000.0, 0.2 * fs)
        near, far = errors(found.direct, spec, 5, top), errors(found.frf, spec, 5, 0.4 * fs)
        line = (
            f"{name:18} {khz:g} kHz {found.loop:5} direct {near.magnitude_db:5.2f} dB "
            f"{near.phase_deg:5.2f}°  model {far.magnitude_db:5.2f} dB {far.phase_deg:5.2f}°  in "
            f"band {far.covered:4.0%}"
        )
        if khz > 1:
            return line
        try:
            scheme: Scheme = "limited" if limited else "free"
            settings = InertiaSettings(WIDE, scheme, search_speed_rpm=60.0)
            outcome = await inertia(b.axis, b.session, settings, Progress(lambda: None))
        except DriveError as error:
            return f"{line}  {error.message}"
        r, f = outcome.result, spec.friction
        return (
            f"{line}  J {100 * (r.inertia_kgm2.value / spec.total_inertia_kgm2 - 1):+5.1f} %  Tc "
            f"{100 * (r.coulomb_nm.value / f.coulomb_nm - 1):+5.1f} %  {r.verdict.splitlines()[0]}"
        )


async def _all(names: list[str], rates: list[float], lockstep: bool, drive: str) -> None:
    with Namespace.create() as namespace:
        for khz in rates:
            for name in names:
                print(await _one(namespace, name, khz, lockstep, drive), flush=True)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--khz", type=float, nargs="+", default=[1.0, 4.0])
    parser.add_argument("--drive", default="mms7", choices=["mms7", "m6l", "r6l"])
    parser.add_argument("--only", nargs="+", default=list(AXES), choices=list(AXES))
    parser.add_argument("--real-time", action="store_true", help="not in lockstep with the frames")
    options = parser.parse_args()
    asyncio.run(_all(options.only, options.khz, not options.real_time, options.drive))


if __name__ == "__main__":
    main()
