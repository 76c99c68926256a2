"""Analysis time for about 10 s at 4 kHz, and accuracy against plain H1 (scipy's csd and welch).

python benchmarks/analysis_speed.py
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

sys.path[:0] = [
    str(Path(__file__).parents[1]),
    str(Path(__file__).parents[1] / "tests" / "unit" / "analysis"),
]

import numpy as np  # noqa: E402
from measured_axes import NAMED, measure  # noqa: E402
from scipy.signal import csd, welch  # noqa: E402

from backend.analysis.identify import identify_mechanics  # noqa: E402


def main() -> None:
    print("axis        rate   ours dB/deg      H1 dB/deg     fastest of 5, s")
    for rate in (1000.0, 4000.0):
        for name, mechanics in NAMED.items():
            m = measure(mechanics, rate)
            spent = []
            for _ in range(5):
                start = time.perf_counter()
                found = identify_mechanics(m.records, m.path, m.quantity).corrected
                spent.append(time.perf_counter() - start)
            n = m.records[0].excitation.period_samples
            u = np.concatenate([r.torque for r in m.records if r.torque is not None])
            y = np.concatenate([r.response for r in m.records])
            f, cross = csd(u, y, rate, nperseg=n)
            _, power = welch(u, rate, nperseg=n)
            h1 = cross / power
            use = (found.frequency_hz <= 0.25 * rate) & (found.coherence > 0.9)
            hz = found.frequency_hz[use]
            truth = mechanics.response(hz)
            row = []
            for estimate in (found.response[use], h1[np.searchsorted(f, hz - 1e-6)]):
                ratio = estimate / truth
                row.append(
                    f"{np.median(np.abs(20 * np.log10(np.abs(ratio)))):6.3f} "
                    f"{np.median(np.abs(np.degrees(np.angle(ratio)))):6.2f}"
                )
            print(f"{name:10s} {rate:5.0f}  {row[0]}   {row[1]}    {min(spent):.3f}")


if __name__ == "__main__":
    main()
