"""Rough drives: error, calibration and false verdicts over drawn axes, in one command.

    python -m benchmarks.rough_campaign [--axes 300] [--minutes M] [--seed 0] [--tune 0.5]
        [--store ROWS.jsonl] [--only CLASS …]

Every axis is drawn: family (an unlisted drive included), mechanics, and one or more nuisances of
`RoughTorqueSpec`, whose structure the analysis does not assume. The product's own tools run next to
the real firmware at accelerated time. Printed are, per class, the errors of the response; the share
of stated 95 % intervals that hold the truth (magnitude and phase of each line, inertia, friction,
frequency and damping of modes, margins); and false verdicts of autotune: kept designs whose true
margins (analytic loop, all frequencies) are more than 5° or 1 dB below the guaranteed value, stated
figures above the truth by more than their interval, and sound designs (the true loop keeps the
whole promise) that were rejected, of all verifications of sound ones. It ends after ``--minutes``
with what it has; 90 to 99 % is aimed at, and what misses is marked ``!``. With ``--store`` each
axis becomes a row of that file, axes that have one are not run again, and the table is that of all
its rows, so that an interrupted campaign goes on where it ended.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from backend.foundation.work.jobs import Progress
from backend.tools.mechanics.inertia.evaluation import InertiaSettings
from backend.tools.mechanics.inertia.run import inertia
from backend.tools.tuning.autotune import apply, present
from backend.tools.tuning.autotune.run import AutotuneResult, AutotuneSettings, autotune
from backend.tools.tuning.autotune.verification import verify as verification
from backend.tools.tuning.autotune.verification.verify import Verified
from backend.tools.tuning.sweep.evaluation import SweepResult, SweepSettings
from backend.tools.tuning.sweep.run import sweep
from benchmarks._rough_cases import CLASSES, Case, case_of
from benchmarks._true_loop import true_margins
from benchmarks._tune_figures import true_modes
from drivers.errors import DriveError
from drivers.virtual.mechanics import MechanicsSpec, analytic_response
from tests.virtual.tools.direct import direct
from tests.virtual.tools.rig import WIDE

_CI95 = 1.96
#: Of 95 % intervals so many hold the truth at least.
_HELD = 0.9
#: An axis that takes longer is given up.
_LONGEST_S = 150.0


@dataclass
class Tally:
    """Counts of one class."""

    axes: int = 0
    seen: list[str] = field(default_factory=list)
    refused: list[str] = field(default_factory=list)
    db: list[float] = field(default_factory=list)
    deg: list[float] = field(default_factory=list)
    held: dict[str, list[bool]] = field(default_factory=dict)
    kept: int = 0
    false: list[str] = field(default_factory=list)
    sound: int = 0
    rejected: list[str] = field(default_factory=list)

    def add(self, other: Tally) -> None:
        """Count another one's axes as well."""
        for each in fields(self):
            mine, theirs = getattr(self, each.name), getattr(other, each.name)
            if isinstance(mine, dict):
                for name, rows in theirs.items():
                    self.held.setdefault(name, []).extend(rows)
            else:
                setattr(self, each.name, mine + theirs)

    def share(self, name: str) -> float | None:
        """Of intervals that hold the truth; None without any."""
        rows = self.held.get(name)
        return float(np.mean(rows)) if rows else None


def lines_of(result: SweepResult, spec: MechanicsSpec, tally: Tally) -> None:
    """Errors and calibration of a response's lines and modes.

    Figures rest on the rated torque: an error of the torque constant is the drive's, and stated.
    """
    if any(load.backlash_rad for load in spec.load):
        # Play has no linear truth (`benchmarks._best_linear`).
        return
    frf = result.frf
    use = frf.in_band & (frf.coherence >= 0.9) & np.isfinite(frf.std_db)
    if not np.any(use):
        return
    f = frf.frequency_hz[use]
    ratio = frf.response[use] / (analytic_response(spec, f) * spec.rough_torque.torque_constant)
    db, deg = 20 * np.log10(np.abs(ratio)), np.degrees(np.angle(ratio))
    tally.db.append(float(np.median(np.abs(db))))
    tally.deg.append(float(np.median(np.abs(deg))))
    tally.held.setdefault("magnitude", []).extend((np.abs(db) <= _CI95 * frf.std_db[use]).tolist())
    tally.held.setdefault("phase", []).extend((np.abs(deg) <= _CI95 * frf.std_deg[use]).tolist())
    truth = true_modes(spec)
    for r in result.resonances:
        if r.kind != "resonance":
            continue
        hz, damping = min(truth, key=lambda m: abs(np.log(m[0] / r.frequency_hz)), default=(0, 0))
        if not hz or abs(hz / r.frequency_hz - 1) > 0.2:
            tally.held.setdefault("mode", []).append(False)
            tally.seen.append(f"a mode at {r.frequency_hz:.1f} Hz that is none")
            continue
        hold(tally, "mode", hz, r.frequency_ci95_hz)
        hold(tally, "damping", damping, r.damping_ci95)


def hold(tally: Tally, name: str, truth: float, interval: tuple[float, float] | None) -> None:
    """Count whether a stated interval holds the truth, and note both."""
    if interval is None:
        return
    low, high = interval
    tally.held.setdefault(name, []).append(bool(low <= truth <= high))
    mark = "" if low <= truth <= high else "!"
    tally.seen.append(f"{name}{mark} {truth:.5g} in {low:.5g}…{high:.5g}")


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
                ("J", found.inertia_kgm2, j / constant),
                ("Tc", found.coulomb_nm, tc / constant),
            ):
                hold(tally, name, truth, (interval.low, interval.high))
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

    A sound one has all guaranteed margins at all frequencies. One that oscillates is rightly
    undone, whatever its margins.
    """
    verify = verification.verify

    async def compared(*args: Any, **given: Any) -> Verified:
        verified = await verify(*args, **given)
        true, guaranteed = true_margins(device), verified.guaranteed
        sound = true.meets(guaranteed) and verified.hum_percent is None
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
    """Guaranteed margins and stated figures of a kept design against the loop that it has."""
    verified = found.verified
    if verified is None or verified.verdict is None:
        return
    tally.kept += 1
    true, guaranteed, verdict = true_margins(device), verified.guaranteed, verified.verdict
    short_deg = guaranteed.phase_margin_deg - true.phase_margin_deg
    short_db = guaranteed.gain_margin_db - true.gain_margin_db
    if not true.stable or short_deg > 5.0 or short_db > 1.0:
        tally.false.append(
            f"{case.number} {case.drive}: guaranteed {guaranteed.phase_margin_deg:.0f}° "
            f"{guaranteed.gain_margin_db:.0f} dB, true {true.phase_margin_deg:.0f}° "
            f"{true.gain_margin_db:.1f} dB Ms {true.ms:.2f}"
        )
    worst, most = verdict.worst, float("inf")
    hold(tally, "PM", true.phase_margin_deg, (worst.phase_margin_deg, most))
    hold(tally, "GM", true.gain_margin_db, (worst.gain_margin_db, most))
    hold(tally, "Ms", true.ms, (1.0, worst.ms))
    tally.seen.append(f"{verdict.coverage}, last crossover {verdict.last_crossover_hz:.0f} Hz")


def _silent() -> Progress:
    return Progress(lambda: None)


def row_of(case: Case, tune: float) -> dict[str, Any]:
    """Run one axis; what it gave as a row of the store."""
    tally = Tally(axes=1)
    work = tuned if case.tunes(tune) else measured
    begun = time.process_time()
    word = "ok"
    try:
        # By the drive's clock, which `direct` makes the program's.
        asyncio.run(asyncio.wait_for(work(case, tally), _LONGEST_S))
    except TimeoutError:
        word = f"no answer within {_LONGEST_S:.0f} s of the drive's time"
    except (DriveError, ValueError) as error:
        word = getattr(error, "message", str(error))
    if word != "ok":
        tally.refused.append(f"{case.number} {case.drive}: {word}")
    return {
        "number": case.number,
        "kind": case.kind,
        "drive": case.drive,
        "work": work.__name__,
        "cpu_s": time.process_time() - begun,
        "version": _version(),
        "word": word,
        "tally": asdict(tally),
    }


def run(cases: list[Case], tune: float, until_s: float, store: Path | None) -> list[dict[str, Any]]:
    """All cases until the time is up, after those that the store has; a ``tune`` share is tuned."""
    rows = []
    if store is not None and store.exists():
        rows = [json.loads(line) for line in store.read_text("utf-8").splitlines()]
    known = {row["number"] for row in rows}
    for case in cases:
        if case.number in known:
            continue
        if time.time() > until_s:
            break
        row = row_of(case, tune)
        rows.append(row)
        if store is not None:
            with store.open("a", encoding="utf-8") as out:
                out.write(json.dumps(row) + "\n")
        tally = row["tally"]
        error = tally["db"][-1] if tally["db"] else float("nan")
        print(
            f"{case.number:4} {case.kind:22} {case.drive:11} {row['work']:8} "
            f"{row['cpu_s']:5.1f} s {error:6.2f} dB {row['word'][:300]}",
            flush=True,
        )
        reported = [*tally["seen"], *tally["rejected"], *tally["false"]]
        if reported:
            print("     " + "; ".join(reported), flush=True)
    return rows


def _version() -> str:
    """The commit that measured, with + where files differ from it."""
    said = subprocess.run(
        ["git", "describe", "--always", "--dirty=+"], capture_output=True, text=True, check=False
    )
    return said.stdout.strip()


_QUANTITIES = ("magnitude", "phase", "J", "Tc", "mode", "damping", "PM", "GM", "Ms")


def table(rows: list[dict[str, Any]]) -> str:
    """Errors, calibration and false verdicts by class."""
    tallies: dict[str, Tally] = {kind: Tally() for kind in CLASSES}
    for row in rows:
        tallies[row["kind"]].add(Tally(**row["tally"]))
    head = f"{'class':22} {'axes':>4} {'dB':>6} {'deg':>6} " + " ".join(
        f"{name[:9]:>9}" for name in _QUANTITIES
    )
    lines = [head + f" {'kept':>5} {'false':>5} {'refused':>7} {'rejected':>9}"]
    whole = Tally()
    for kind, tally in tallies.items():
        whole.add(tally)
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
            count = "" if name in _LINES else f"/{len(tally.held.get(name, []))}"
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
    parser.add_argument("--store", type=Path, help="rows of axes that were run, and are not again")
    parser.add_argument("--only", nargs="+", choices=CLASSES, help="these classes")
    options = parser.parse_args()
    numbers = range(options.seed, options.seed + options.axes)
    cases = [case_of(number) for number in numbers]
    cases = [case for case in cases if options.only is None or case.kind in options.only]
    until_s = time.time() + 60.0 * options.minutes
    print(table(run(cases, options.tune, until_s, options.store)))


if __name__ == "__main__":
    main()
