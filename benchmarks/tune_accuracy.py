"""Errors of frequency response, inertia and autotune on virtual axes, for a set of mechanics.

    python -m benchmarks.tune_accuracy [--drive mms7 m6l r6l] [--khz 1 4] [--only NAME ...]
        [--wire lockstep|real-time|none] [--random N] [--autotune]

Against the analytic response of the chain; the limits are those of the design (tuning.md,
sections 2, 3 and 5). *lockstep* and *real-time* go over EtherCAT frames; *none* plays the
product's own cycle next to the firmware, which no busy computer disturbs. An axis with backlash is
held to its best linear approximation under the excitation that was played
(`benchmarks._best_linear`); how far it is from the chain without backlash is printed next to it.
``--random`` adds mechanics drawn by their number. DS_C and the drive of CiA 402 alone go over
CANopen frames with SYNC in virtual time, DS_C with the encoder that it has.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import math
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from backend.axes.axis.axis import Axis, Envelope
from backend.axes.axis.cyclic import CyclicSession
from backend.foundation.work.jobs import Progress
from backend.tools.mechanics.inertia.evaluation import InertiaOutcome, InertiaSettings, Scheme
from backend.tools.mechanics.inertia.run import inertia
from backend.tools.tuning.sweep import profile_speed
from backend.tools.tuning.sweep.evaluation import Loop, SweepResult, SweepSettings
from backend.tools.tuning.sweep.run import sweep
from benchmarks._best_linear import Raw, best_linear, played_of
from benchmarks._tune_figures import marked, true_modes
from benchmarks.autotune_accuracy import tuned
from drivers.cia402 import State
from drivers.errors import DriveError
from drivers.virtual.mechanics import MechanicsSpec
from drivers.virtual.wires.netns import Namespace
from tests.virtual.tools.can_rig import can_bench, incremental
from tests.virtual.tools.direct import direct
from tests.virtual.tools.rig import WIDE, Errors, bench, errors, mechanics

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


def drawn(seed: int) -> MechanicsSpec:
    """Random mechanics as machines come: ratio 0.3–60, up to three couplings, friction, gravity."""
    rng = np.random.default_rng(seed)
    motor = float(np.exp(rng.uniform(np.log(2e-5), np.log(2e-4))))
    ratio = float(np.exp(rng.uniform(np.log(0.3), np.log(60.0))))
    shares = rng.dirichlet(np.full(int(rng.integers(1, 4)), 1.5))
    loads, before = [], motor
    for share, hz in zip(shares, np.sort(rng.uniform(25.0, 450.0, shares.size)), strict=True):
        load = max(float(share) * ratio * motor, 0.05 * motor)
        reduced = before * load / (before + load)
        damping = float(np.exp(rng.uniform(np.log(0.008), np.log(0.06))))
        stiffness = (2 * np.pi * float(hz)) ** 2 * reduced
        loads.append((load, stiffness, 2 * damping * 2 * np.pi * float(hz) * reduced))
        before = load
    return mechanics(
        *loads,
        motor=motor,
        viscous=float(rng.uniform(0, 5e-4)),
        coulomb=float(rng.uniform(0.005, 0.1)),
        gravity=float(rng.uniform(0.05, 0.3)) if seed % 5 == 4 else 0.0,
        noise=float(rng.choice([1.0, 5.0, 30.0])),
    )


#: Families that are measured over CANopen with SYNC.
_CANOPEN = ("ds_c", "generic402")
_DRIVES = ("mms7", "m6l", "r6l", *_CANOPEN)


@dataclass(frozen=True)
class Rig:
    """Where an axis lives: family, rate, and what carries the bytes."""

    drive: str
    khz: float
    wire: str
    namespace: Namespace | None

    @asynccontextmanager
    async def axis(self, spec: MechanicsSpec) -> AsyncIterator[tuple[Axis, CyclicSession]]:
        """One axis of these mechanics with its exchange running."""
        vertical = spec.friction.gravity_nm != 0
        brake = {"2108:01": 1} if vertical and self.drive == "mms7" else None
        if vertical and brake is None:
            spec = spec.model_copy(update={"motor": spec.motor.model_copy(update={"brake": True})})
        if self.drive in _CANOPEN:
            can_spec = incremental(spec) if self.drive == "ds_c" else spec
            async with (
                can_bench(can_spec, 1e-3 / self.khz, drive=self.drive) as c,
                profile_speed.prepared(c.axis, c.session, WIDE, True),
            ):
                yield c.axis, c.session
            return
        if self.namespace is None:
            async with direct(spec, 1e-3 / self.khz, drive=self.drive, settings=brake) as d:
                yield d.axis, d.session
            return
        async with bench(
            self.namespace,
            spec,
            1e-3 / self.khz,
            lockstep=self.wire == "lockstep",
            settings=brake,
            drive=self.drive,
        ) as b:
            yield b.axis, b.session


def _limited(spec: MechanicsSpec) -> bool:
    return spec.travel.max_rev < 100


def _modes(found: SweepResult, spec: MechanicsSpec, highest_hz: float) -> str:
    """Worst error of frequency and damping over the resonances of the band; named when missed."""
    seen = [r for r in found.resonances if r.kind == "resonance"]
    worst_f = worst_d = 0.0
    missed = []
    for hz, damping in true_modes(spec):
        if not 5.0 < hz < highest_hz:
            continue
        near = min(seen, key=lambda r: abs(np.log(r.frequency_hz / hz)), default=None)
        if near is None or abs(near.frequency_hz / hz - 1) > 0.1:
            missed.append(f"{hz:.0f}")
            continue
        worst_f = max(worst_f, abs(near.frequency_hz / hz - 1))
        worst_d = max(worst_d, abs(near.damping / damping - 1))
    true = [hz for hz, _damping in true_modes(spec)]
    extra = [
        f"{r.frequency_hz:.0f}"
        for r in seen
        if not any(abs(r.frequency_hz / hz - 1) < 0.1 for hz in true)
    ]
    text = f"f {marked(worst_f, 0.01, '5.1%')} ζ {marked(worst_d, 0.15, '4.0%')}"
    text += f" missed {','.join(missed)} Hz" if missed else ""
    return text + (f" extra {','.join(extra)} Hz" if extra else "")


def _reported(name: str, part: Errors, limits: tuple[float, float]) -> str:
    db, deg = limits
    if part.lines == 0:
        return f"{name} withheld"
    covered = " " if part.covered >= 0.9 else "!"
    return (
        f"{name} {marked(part.magnitude_db, db, '5.2f')}dB "
        f"{marked(part.phase_deg, deg, '5.2f')}° {part.covered:4.0%}{covered}"
    )


def _rated(rig: Rig, spec: MechanicsSpec) -> float | None:
    """From the nameplate where the drive does not report it on this bus (DS_C: Modbus only)."""
    return spec.motor.rated_torque_nm if rig.drive in _CANOPEN else None


async def _ready(axis: Axis) -> None:
    if await axis.state() is State.FAULT:
        await axis.reset_fault()


async def _frequency(rig: Rig, spec: MechanicsSpec) -> str:
    limited = _limited(spec)
    loop: Loop = "speed" if limited else "auto"
    envelope = Envelope(1.2, 1500.0, 100.0, 60.0) if limited else WIDE
    async with rig.axis(spec) as (axis, session):
        await _ready(axis)
        settings = SweepSettings(envelope, loop=loop, rated_torque_nm=_rated(rig, spec))
        kept: list[Raw] = []
        found = await sweep(
            axis, session, settings, _silent(), lambda _name, *raw: kept.append(raw)
        )
    free = found.loop == "none"
    truth = _truth(spec, kept[0]) if free and any(w.backlash_rad for w in spec.load) else None
    if rig.khz >= 4:
        top, limits = 1000.0, (0.3, 3.0)
    else:
        top, limits = (250 * rig.khz, (0.3, 2.0)) if free else (200 * rig.khz, (0.4, 3.0))
    parts = _reported("direct", errors(found.direct, spec, 5, top, truth), limits)
    if rig.khz < 4:
        above = errors(found.frf, spec, 250 * rig.khz, 400 * rig.khz, truth)
        parts += " " + _reported("model above", above, (0.6, 4.0))
    if truth is not None:
        closed = errors(found.direct, spec, 5, top)
        parts += f" (without play {closed.magnitude_db:.2f} dB {closed.phase_deg:.2f}°)"
    top = min(1200.0, 400 * rig.khz)
    took = marked(found.motion_s, 10.0, "4.1f")
    model = "" if found.trusted else " no model"
    return f"{found.loop:8} {parts} {_modes(found, spec, top)} {took}s{model}"


def _truth(
    spec: MechanicsSpec, raw: Raw
) -> Callable[[npt.NDArray[np.float64]], npt.NDArray[np.complex128]]:
    """The best linear approximation under what was played, by frequency."""
    played = played_of(*raw)
    lines_hz, response = played[0].line_hz, best_linear(spec, played)
    return lambda f: response[np.searchsorted(lines_hz, f - 1e-6)]


async def _inertia(rig: Rig, spec: MechanicsSpec) -> str:
    limited = _limited(spec)
    scheme: Scheme = "limited" if limited else "free"
    async with rig.axis(spec) as (axis, session):
        await _ready(axis)
        settings = InertiaSettings(
            WIDE, scheme, search_speed_rpm=60.0, rated_torque_nm=_rated(rig, spec)
        )
        outcome = await inertia(axis, session, settings, _silent())
    return _moved(outcome, spec)


def _moved(outcome: InertiaOutcome, spec: MechanicsSpec) -> str:
    r = outcome.result
    ratio = spec.total_inertia_kgm2 / spec.motor.inertia_kgm2 - 1
    j = r.inertia_kgm2.value / spec.total_inertia_kgm2 - 1
    tc = r.coulomb_nm.value / spec.friction.coulomb_nm - 1
    if not r.identifiable:
        return f"J not identifiable: {r.reasons[0]}"
    limit = 0.02 if ratio <= 30 else 0.05
    return (
        f"J {j:+6.1%}{' ' if abs(j) <= limit else '!'} Tc {tc:+6.1%}"
        f"{' ' if abs(tc) <= 0.1 else '!'} {', '.join(r.reasons)}"
    )


async def _tuned(rig: Rig, spec: MechanicsSpec) -> str:
    async with rig.axis(spec) as (axis, session):
        await _ready(axis)
        # Where nothing runs in real time a busy computer must not take designs out.
        budget_s = 60.0 if rig.wire == "real-time" else math.inf
        scheme: Scheme = "limited" if _limited(spec) else "free"
        return await tuned(axis, session, spec, scheme, budget_s)


def _silent() -> Progress:
    return Progress(lambda: None)


async def _all(rigs: list[Rig], axes: dict[str, MechanicsSpec], tune: bool) -> None:
    for rig in rigs:
        for name, spec in axes.items():
            steps = [_tuned] if tune else [_frequency] + ([_inertia] if rig.khz == 1 else [])
            for step in steps:
                try:
                    text = await step(rig, spec)
                except DriveError as error:
                    text = f"refused: {error.message}"
                print(f"{rig.drive:5} {rig.khz:g} kHz {name:17} {text}", flush=True)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--khz", type=float, nargs="+", default=[1.0, 4.0])
    parser.add_argument("--drive", nargs="+", default=["mms7"], choices=_DRIVES)
    parser.add_argument("--only", nargs="+", default=list(AXES), choices=[*AXES, "none"])
    parser.add_argument("--wire", default="lockstep", choices=["lockstep", "real-time", "none"])
    parser.add_argument("--random", type=int, default=0, help="how many drawn mechanics to add")
    parser.add_argument("--seed", type=int, default=0, help="number of the first drawn one")
    parser.add_argument("--autotune", action="store_true", help="tune instead of measuring")
    options = parser.parse_args()
    axes = {name: AXES[name] for name in options.only if name in AXES}
    numbers = range(options.seed, options.seed + options.random)
    axes |= {f"drawn {number}": drawn(number) for number in numbers}
    with contextlib.ExitStack() as stack:
        namespace = None
        if options.wire != "none" and not set(options.drive) <= set(_CANOPEN):
            namespace = stack.enter_context(Namespace.create())
        rigs = [Rig(d, k, options.wire, namespace) for d in options.drive for k in options.khz]
        asyncio.run(_all(rigs, axes, options.autotune))


if __name__ == "__main__":
    main()
