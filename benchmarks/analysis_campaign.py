"""Frequency responses of random mechanics on an independent simulator, against the design's limits.

    python -m benchmarks.analysis_campaign [--seeds FIRST LAST] [--khz 1 4] [--all]

Every seed is one axis (no to three resonances, close together or hardly damped, inertia ratio up
to 80, friction, gravity, encoders from 2500 lines up) behind one bus (hold and delay of up to 2.5
cycles, current loop and speed filter showed or not). The excitation and the evaluation are the
product's. Printed is what misses the table of tuning.md, section 2, with its figures.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[1] / "tests" / "unit" / "analysis")]

import numpy as np  # noqa: E402
from random_axes import (  # noqa: E402
    Case,
    errors,
    missed_modes,
    played,
    random_case,
    result_of,
)

from backend.analysis.response.frf import Frf  # noqa: E402
from backend.tools.tuning.sweep.evaluation import SweepResult  # noqa: E402

#: Fewer coherent lines than this say nothing of a band.
_FEW = 6


def _bands(case: Case, result: SweepResult) -> list[tuple[str, Frf, float, float, float, float]]:
    """Name, response, ends in Hz, limits in dB and degrees."""
    if case.rate_hz > 2000:
        limit = 0.4 if case.loop_hz else 0.3
        return [("model", result.frf, 5.0, 1000.0, limit, 3.0)]
    if case.loop_hz:
        return [("model", result.frf, 5.0, 200.0, 0.4, 3.0)]
    return [
        ("direct", result.direct, 5.0, 250.0, 0.3, 2.0),
        ("model", result.frf, 250.0, 400.0, 0.6, 4.0),
    ]


def _judged(case: Case, result: SweepResult) -> tuple[str, bool, bool, list[str]]:
    """What was measured as text, whether accuracy and coverage are met, and missed modes."""
    words, accurate, covered = [], result.trusted, True
    for name, frf, low, high, db, deg in _bands(case, result):
        e = errors(frf, case.mechanics, low, high)
        if e.lines < _FEW:
            words.append(f"{name} {low:g}-{high:g} Hz: {e.lines} lines")
            continue
        accurate &= e.magnitude_db <= db and e.phase_deg <= deg
        covered &= e.covered >= 0.9
        words.append(
            f"{name} {low:g}-{high:g} Hz: {e.magnitude_db:.2f} dB {e.phase_deg:.2f}° "
            f"{e.covered:.0%}"
        )
    modes = missed_modes(result, case) if result.trusted else ["no model"]
    return "  ".join(words), bool(accurate), bool(covered), modes


def main() -> None:
    """Print what misses, and how much does not."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, nargs=2, default=[0, 36])
    parser.add_argument("--khz", type=float, nargs="+", default=[1.0, 4.0])
    parser.add_argument("--all", action="store_true", help="print what meets the limits, too")
    options = parser.parse_args()
    counts, spent = np.zeros(4, dtype=int), []
    for khz in options.khz:
        for seed in range(*options.seeds):
            case = random_case(seed, 1000.0 * khz)
            records = played(case)
            if records is None:
                print(f"{seed:3d} at {khz:g} kHz: the axis is not stable; left out")
                continue
            start = time.process_time()
            result = result_of(case, records)
            spent.append(time.process_time() - start)
            text, accurate, covered, modes = _judged(case, result)
            counts += [1, accurate, covered, not modes]
            if options.all or not accurate or not covered or modes:
                loop = f"speed loop {case.loop_hz:.0f} Hz" if case.loop_hz else "no loop"
                missed = "; ".join(modes)
                print(f"{seed:3d} at {khz:g} kHz, {loop}: {text}  {missed}", flush=True)
    total, accurate, covered, modes = counts
    print(
        f"{total} axes: {accurate} within the limits, {covered} with 90 % of the lines in the "
        f"band, {modes} with every resonance within 1 % and 15 % of damping; evaluated in "
        f"{np.median(spent):.2f} s (median), {max(spent):.2f} s at most"
    )


if __name__ == "__main__":
    main()
