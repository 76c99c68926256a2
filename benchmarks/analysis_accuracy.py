"""Table of frequency-response errors on simulated axes with known truth, and the time it takes.

    python benchmarks/analysis_accuracy.py

Columns: median magnitude (dB) and phase (deg) error of the corrected estimate inside the band of
tuning.md section 2, share of lines whose 95 % band holds the truth, delay found, resonances
found against true ones, duration of the motion and of the analysis.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

sys.path[:0] = [
    str(Path(__file__).parents[1]),
    str(Path(__file__).parents[1] / "tests" / "unit" / "analysis"),
]

from measured_axes import NAMED, errors, measure  # noqa: E402

from backend.analysis.mechanics.identification.identify import identify_mechanics  # noqa: E402

RATES_HZ = (1000.0, 4000.0)
LOOPS = ((0.0, False), (10.0, False), (40.0, False), (40.0, True), (80.0, False))


def main() -> None:
    only = sys.argv[1:] or list(NAMED)
    head = "axis       rate loop      band        dB    deg  cover  delay_us  motion_s  analysis_s"
    print(head)
    for rate in RATES_HZ:
        for name in only:
            mechanics = NAMED[name]
            for loop_hz, position in LOOPS:
                m = measure(mechanics, rate, loop_hz, position=position)
                start = time.perf_counter()
                found = identify_mechanics(m.records, m.path, m.quantity)
                spent = time.perf_counter() - start
                high = 1000.0 if rate > 2000 else 200.0 if loop_hz else 250.0
                bands = [(5.0, high)] + ([(250.0, 400.0)] if rate < 2000 and not loop_hz else [])
                for low, high in bands:
                    e = errors(found.corrected, mechanics, low, high)
                    kind = (
                        "torque" if not loop_hz else f"{'pos' if position else 'speed'}{loop_hz:g}"
                    )
                    print(
                        f"{name:10s} {rate:4.0f} {kind:8s} {low:4.0f}-{high:4.0f}  "
                        f"{e.magnitude_db:6.3f}"
                        f" {e.phase_deg:6.2f}   {e.covered:4.2f}  {found.fit.delay_s * 1e6:8.1f}"
                        f"  {m.duration_s:8.1f}  {spent:10.3f} "
                        f"{'' if found.trusted else 'untrusted'}"
                    )
                modes = " ".join(
                    f"{x.frequency_hz:.1f}/{x.damping:.3f}"
                    for x in sorted(found.fit.model.modes, key=lambda q: q.frequency_hz)
                )
                truth = " ".join(f"{f:.1f}/{z:.3f}" for f, z in mechanics.modes()[0])
                print(f"           found {modes or '-'}   true {truth or '-'}")


if __name__ == "__main__":
    main()
