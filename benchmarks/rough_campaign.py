"""Rough drives: error, calibration and false verdicts over drawn axes, in one command.

    python -m benchmarks.rough_campaign [--axes 300] [--minutes M] [--seed 0] [--tune 0.5]

Every axis is drawn: family (an unlisted drive included), mechanics, and one or more nuisances of
`RoughTorqueSpec`, whose structure the analysis does not assume. The product's own tools run beside
the real firmware at accelerated time. Printed are, per class, the errors of the response; the share
of stated 95 % intervals that hold the truth (magnitude and phase of each line, inertia, friction,
frequency and damping of modes, margins); and false verdicts of autotune: kept designs whose true
margins (analytic loop, all frequencies) are more than 5° or 1 dB below the promise, stated
figures above the truth by more than their interval, and sound designs (the true loop keeps the
whole promise) that were rejected, of all verifications of sound ones. It ends after ``--minutes``
with what it has; 90 to 99 % is aimed at, and what misses is marked ``!``.
"""

from __future__ import annotations

import argparse
import asyncio
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any
from unittest.mock import patch

import numpy as np

from backend.tools.autotune import apply, present
from backend.tools.autotune import verify as verification
from backend.tools.autotune.run import AutotuneResult, AutotuneSettings, autotune
from backend.tools.autotune.verify import Verified
from backend.tools.inertia.evaluation import InertiaSettings
from backend.tools.inertia.run import inertia
from backend.tools.sweep.evaluation import SweepResult, SweepSettings
from backend.tools.sweep.run import sweep
from backend.work.jobs import Progress
from benchmarks._true_loop import true_margins
from benchmarks._tune_figures import true_modes
from benchmarks.tune_accuracy import drawn
from drivers.errors import DriveError
from drivers.virtual.mechanics import MechanicsSpec, RoughTorqueSpec, analytic_response
from tests.virtual.tools.direct import direct
from tests.virtual.tools.rig import WIDE

_CI95 = 1.96
#: Of 95 % intervals so many hold the truth at least.
_HELD = 0.9
#: An axis that takes longer is given up.
_LONGEST_S = 150.0
FAMILIES = ("mms7", "m6l", "r6l", "generic402")
#: One class of behaviour each: how it is drawn.
CLASSES: dict[str, dict[str, tuple[float, float] | bool | str]] = {
    "as assumed": {},
    "held setpoints": {"holds_torque": True, "holds_speed": True},
    "filtered 6077h": {"reported_filter_s": (3e-4, 2e-3)},
    "6077h is the demand": {"reported": "demand"},
    "torque low-pass": {"torque_filter_s": (2e-4, 8e-4)},
    "loop period": {"loop_period_s": (62.5e-6, 250e-6)},
    "torque constant": {"torque_constant": (0.9, 1.1)},
    "cogging, pre-sliding": {"cogging_nm": (0.005, 0.03), "presliding_rad": (2e-4, 3e-3)},
    "cable drag": {"drag_nm": (0.01, 0.06), "drag_rad": (0.2, 2.0)},
    "inertia by place": {"inertia_share": (0.02, 0.15)},
    "stiffness by place": {"stiffness_share": (0.02, 0.2)},
    "belt slip": {"slip_per_s": (0.5, 20.0)},
    "supply dip": {"dip_share": (0.2, 0.8), "dip_s": (5e-3, 3e-2), "dip_every_s": (0.4, 1.5)},
    "encoder interpolation": {"interpolation_rad": (2e-6, 3e-5)},
    "jitter": {"jitter_s": (50e-6, 150e-6)},
}


@dataclass(frozen=True)
class Case:
    """One drawn axis."""

    number: int
    kind: str
    drive: str
    spec: MechanicsSpec


def case_of(number: int) -> Case:
    """The axis of this number; classes and families come in turn."""
    rng = np.random.default_rng(7919 * number + 13)
    kind = list(CLASSES)[number % len(CLASSES)]
    turn, place = divmod(number, len(CLASSES))
    drive = FAMILIES[(turn + place) % len(FAMILIES)]
    options: dict[str, Any] = {}
    for name, given in CLASSES[kind].items():
        options[name] = float(rng.uniform(*given)) if isinstance(given, tuple) else given
    # Vertical axes (every fifth) need a brake by family; here all turn freely.
    base = drawn(100_000 + 5 * number + int(rng.integers(0, 4)))
    base = base.model_copy(
        update={"friction": base.friction.model_copy(update={"gravity_nm": 0.0})}
    )
    rough = RoughTorqueSpec(**options)
    return Case(number, kind, drive, base.model_copy(update={"rough_torque": rough}))


@dataclass
class Tally:
    """Counts of one class."""

    axes: int = 0
    refused: list[str] = field(default_factory=list)
    db: list[float] = field(default_factory=list)
    deg: list[float] = field(default_factory=list)
    held: dict[str, list[bool]] = field(default_factory=lambda: defaultdict(list))
    kept: int = 0
    false: list[str] = field(default_factory=list)
    sound: int = 0
    rejected: list[str] = field(default_factory=list)

    def share(self, name: str) -> float | None:
        """Of intervals that hold the truth; None without any."""
        rows = self.held[name]
        return float(np.mean(rows)) if rows else None


def lines_of(result: SweepResult, spec: MechanicsSpec, tally: Tally) -> None:
    """Errors and calibration of a response's lines and modes.

    Figures rest on the rated torque: an error of the torque constant is the drive's, and stated.
    """
    frf = result.frf
    use = frf.in_band & (frf.coherence >= 0.9) & np.isfinite(frf.std_db)
    if not np.any(use):
        return
    f = frf.frequency_hz[use]
    ratio = frf.response[use] / (analytic_response(spec, f) * spec.rough_torque.torque_constant)
    db, deg = 20 * np.log10(np.abs(ratio)), np.degrees(np.angle(ratio))
    tally.db.append(float(np.median(np.abs(db))))
    tally.deg.append(float(np.median(np.abs(deg))))
    tally.held["magnitude"] += (np.abs(db) <= _CI95 * frf.std_db[use]).tolist()
    tally.held["phase"] += (np.abs(deg) <= _CI95 * frf.std_deg[use]).tolist()
    truth = true_modes(spec)
    for r in result.resonances:
        if r.kind != "resonance":
            continue
        hz, damping = min(truth, key=lambda m: abs(np.log(m[0] / r.frequency_hz)), default=(0, 0))
        if not hz or abs(hz / r.frequency_hz - 1) > 0.2:
            tally.held["mode"].append(False)
            continue
        if r.frequency_ci95_hz:
            low, high = r.frequency_ci95_hz
            tally.held["mode"].append(bool(low <= hz <= high))
        if r.damping_ci95:
            low, high = r.damping_ci95
            tally.held["damping"].append(bool(low <= damping <= high))


async def measured(case: Case, tally: Tally) -> None:
    """Inertia and response, without tuning."""
    rated = case.spec.motor.rated_torque_nm
    constant = case.spec.rough_torque.torque_constant
    async with direct(case.spec, drive=case.drive) as d:
        moves = await inertia(
            d.axis, d.session, InertiaSettings(WIDE, rated_torque_nm=rated), _silent()
        )
        found = moves.result
        if found.identifiable:
            # A cable's hysteresis is friction over moves that are longer than its rest length.
            j = case.spec.total_inertia_kgm2
            tc = case.spec.friction.coulomb_nm + case.spec.rough_torque.drag_nm
            for name, interval, truth in (
                ("J", found.inertia_kgm2, j / constant), ("Tc", found.coulomb_nm, tc / constant)
            ):  # fmt: skip
                tally.held[name].append(bool(interval.low <= truth <= interval.high))
        result = await sweep(
            d.axis, d.session, SweepSettings(WIDE, rated_torque_nm=rated), _silent()
        )
    lines_of(result, case.spec, tally)


async def tuned(case: Case, tally: Tally) -> None:
    """Autotune, and its verdict against the true loop."""
    spec = case.spec
    rotor = None if case.drive == "mms7" else spec.motor.inertia_kgm2
    settings = AutotuneSettings(
        WIDE, motor_inertia_kgm2=rotor, rated_torque_nm=spec.motor.rated_torque_nm
    )
    async with direct(spec, drive=case.drive) as d:
        with every_verification(d.link.device, case, tally):
            found = await autotune(d.axis, d.session, settings, _silent())
        judged(found, d.link.device, case, tally)


@contextmanager
def every_verification(device: Any, case: Case, tally: Tally) -> Iterator[None]:
    """Compare each design that is verified, kept or not, with its true loop while it is in force.

    A sound one keeps its whole promise at all frequencies. One that hums is rightly taken back,
    whatever its margins.
    """
    verify = verification.verify

    async def compared(*args: Any, **given: Any) -> Verified:
        verified = await verify(*args, **given)
        true, promised = true_margins(device), verified.promised
        sound = true.meets(promised) and verified.hum_percent is None
        tally.sound += sound
        if sound and not verified.kept:
            tally.rejected.append(
                f"{case.number} {case.drive}: true {true.phase_margin_deg:.0f}° "
                f"{true.gain_margin_db:.1f} dB Ms {true.ms:.2f}, said: {verified.why}"
            )
        return verified

    with patch.object(apply, "verify", compared), patch.object(present, "verify", compared):
        yield


def judged(found: AutotuneResult, device: Any, case: Case, tally: Tally) -> None:
    """A kept design's promise and stated figures against the loop that it really has."""
    verified = found.verified
    if verified is None or verified.verdict is None:
        return
    tally.kept += 1
    true, promised, verdict = true_margins(device), verified.promised, verified.verdict
    short_deg = promised.phase_margin_deg - true.phase_margin_deg
    short_db = promised.gain_margin_db - true.gain_margin_db
    if not true.stable or short_deg > 5.0 or short_db > 1.0:
        tally.false.append(
            f"{case.number} {case.drive}: promised {promised.phase_margin_deg:.0f}° "
            f"{promised.gain_margin_db:.0f} dB, true {true.phase_margin_deg:.0f}° "
            f"{true.gain_margin_db:.1f} dB Ms {true.ms:.2f}"
        )
    worst = verdict.worst
    tally.held["PM"].append(bool(true.phase_margin_deg >= worst.phase_margin_deg))
    tally.held["GM"].append(bool(true.gain_margin_db >= worst.gain_margin_db))
    tally.held["Ms"].append(bool(true.ms <= worst.ms))


def _silent() -> Progress:
    return Progress(lambda: None)


async def run(cases: list[Case], tune: float, until_s: float) -> dict[str, Tally]:
    """All cases until the time is up; a ``tune`` share of them is tuned, the others measured."""
    tallies: dict[str, Tally] = {kind: Tally() for kind in CLASSES}
    for place, case in enumerate(cases):
        if time.time() > until_s:
            break
        tally = tallies[case.kind]
        tally.axes += 1
        tunes = int((place + 1) * tune) > int(place * tune)
        work = tuned if tunes and case.drive != "generic402" else measured
        begun = time.process_time()
        try:
            # By the drive's clock, which `direct` makes the program's.
            await asyncio.wait_for(work(case, tally), _LONGEST_S)
            word = "ok"
        except TimeoutError:
            word = f"refused: no answer within {_LONGEST_S:.0f} s of the drive's time"
            tally.refused.append(f"{case.number} {case.drive}: {word}")
        except (DriveError, ValueError) as error:
            word = f"refused: {getattr(error, 'message', str(error))}"
            tally.refused.append(f"{case.number} {case.drive}: {word}")
        took = time.process_time() - begun
        print(
            f"{case.number:4} {case.kind:22} {case.drive:11} {work.__name__:8} {took:5.1f} s "
            f"{tally.db[-1] if tally.db and work is measured else float('nan'):6.2f} dB "
            f"{word[:300]}",
            flush=True,
        )
    return tallies


_QUANTITIES = ("magnitude", "phase", "J", "Tc", "mode", "damping", "PM", "GM", "Ms")


def table(tallies: dict[str, Tally]) -> str:
    """Errors, calibration and false verdicts by class."""
    head = f"{'class':22} {'axes':>4} {'dB':>6} {'deg':>6} " + " ".join(
        f"{name[:9]:>9}" for name in _QUANTITIES
    )
    lines = [head + f" {'kept':>5} {'false':>5} {'refused':>7} {'rejected':>9}"]
    whole = Tally()
    for kind, tally in tallies.items():
        whole.axes += tally.axes
        whole.kept += tally.kept
        whole.db += tally.db
        whole.deg += tally.deg
        whole.false += tally.false
        whole.refused += tally.refused
        whole.sound += tally.sound
        whole.rejected += tally.rejected
        for name, rows in tally.held.items():
            whole.held[name] += rows
        lines.append(_row(kind, tally))
    lines.append(_row("all", whole))
    reported = [f"FALSE {each}" for each in whole.false]
    reported += [f"REJECTED THOUGH SOUND {each}" for each in whole.rejected]
    return "\n".join([*lines, *reported])


def _row(kind: str, tally: Tally) -> str:
    db = f"{np.median(tally.db):6.2f}" if tally.db else f"{'–':>6}"
    deg = f"{np.median(tally.deg):6.2f}" if tally.deg else f"{'–':>6}"
    cells = []
    for name in _QUANTITIES:
        share = tally.share(name)
        if share is None:
            cells.append(f"{'–':>9}")
        else:
            count = "" if name in _LINES else f"/{len(tally.held[name])}"
            cells.append(f"{share:.0%}{'!' if share < _HELD else ''}{count}")
    counts = f" {tally.kept:5} {len(tally.false):5} {len(tally.refused):7} "
    counts += f"{f'{len(tally.rejected)}/{tally.sound}':>9}"
    return f"{kind:22} {tally.axes:4} {db} {deg} " + " ".join(f"{c:>9}" for c in cells) + counts


_LINES = ("magnitude", "phase")


def main() -> None:
    """Print each axis and the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--axes", type=int, default=300)
    parser.add_argument("--minutes", type=float, default=float("inf"))
    parser.add_argument("--seed", type=int, default=0, help="number of the first axis")
    parser.add_argument("--tune", type=float, default=0.5, help="share of the axes that is tuned")
    options = parser.parse_args()
    cases = [case_of(number) for number in range(options.seed, options.seed + options.axes)]
    until_s = time.time() + 60.0 * options.minutes
    print(table(asyncio.run(run(cases, options.tune, until_s))))


if __name__ == "__main__":
    main()
