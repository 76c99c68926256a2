"""The analysis compared with other methods on axes of known truth, and the time that it takes.

    python -m benchmarks.analysis_comparison [NAME …]

Frequency response against plain H1 (scipy's csd and welch) on the same data, and against a
stepped sine that moves the axis for as long. Resonance frequency against the highest peak of the
acceleration's power spectrum under a swept sine of the same length, which is how Klipper's
resonance test reads it (Kaiser window of 0.5 s with β = 6, half overlap; its documentation,
"Measuring resonances"). Analysis of about 10 s at 4 kHz aims at less than 0.3 s.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

sys.path[:0] = [str(Path(__file__).parents[1] / "tests" / "unit" / "analysis")]

import numpy as np  # noqa: E402
from drive_sim import Mechanics, simulate  # noqa: E402
from measured_axes import NAMED, Measurement, measure, tuned_drive  # noqa: E402
from scipy.signal import csd, find_peaks, welch  # noqa: E402

from backend.analysis.mechanics.identification.identify import Identification, identify_mechanics  # noqa: E402
from backend.analysis.response.frf_stepped import estimate_stepped  # noqa: E402
from backend.analysis.response.signal_path.sampling import SignalPath  # noqa: E402
from backend.analysis.signals.arrays import ComplexArray, FloatArray  # noqa: E402
from backend.analysis.signals.chirp import chirp  # noqa: E402
from backend.analysis.signals.excitation import scaled  # noqa: E402
from backend.analysis.signals.line_spectra import Record  # noqa: E402
from backend.analysis.signals.stepped_sine import stepped_sine  # noqa: E402

_Answer = TypeVar("_Answer")

RATES_HZ = (1000.0, 4000.0)
#: A frequency further off than this share belongs to something else.
_SAME = 0.15
#: Torque of the stepped sine and the sweep, as the multisine's, in Nm.
AMPLITUDE_NM = 0.35 * 1.27


def _fastest(what: Callable[[], _Answer], tries: int = 5) -> tuple[_Answer, float]:
    """The answer and the processor time of the fastest of some tries."""
    spent = []
    for _ in range(tries):
        start = time.process_time()
        answer = what()
        spent.append(time.process_time() - start)
    return answer, min(spent)


def _error(hz: FloatArray, response: ComplexArray, mechanics: Mechanics) -> str:
    """Median errors in dB and degrees."""
    ratio = response / mechanics.response(hz)
    return (
        f"{np.median(np.abs(20 * np.log10(np.abs(ratio)))):7.3f} "
        f"{np.median(np.abs(np.degrees(np.angle(ratio)))):6.2f}"
    )


def _h1(m: Measurement) -> tuple[FloatArray, ComplexArray]:
    """Sampled torque to sampled velocity: cross spectrum over the torque's power."""
    n, rate = m.records[0].excitation.period_samples, m.path.sample_rate_hz
    u = np.concatenate([r.torque for r in m.records if r.torque is not None])
    y = np.concatenate([r.response for r in m.records])
    f, cross = csd(u, y, rate, nperseg=n)
    _, power = welch(u, rate, nperseg=n)
    return f, np.asarray(cross / power)


def _stepped(mechanics: Mechanics, rate: float, seconds: float) -> tuple[FloatArray, ComplexArray]:
    """As many tones up to a quarter of the sample rate as the time allows; path known."""
    for count in range(80, 5, -2):
        tones = np.geomspace(5.0, min(0.25 * rate, 1000.0), count)
        e = stepped_sine(sample_rate_hz=rate, frequency_hz=tones, settle_cycles=2, measure_cycles=4)
        if e.duration_s <= seconds:
            break
    e = scaled(e, AMPLITUDE_NM)
    run = simulate(mechanics, tuned_drive(mechanics, 0.0), rate, torque=e.samples)
    path = SignalPath(rate, current_bandwidth_hz=1000.0, response_delay_s=25e-6)
    frf = estimate_stepped(Record(e, run.velocity, run.torque), path, "torque_mode")
    return frf.frequency_hz, frf.response


def _spectral_peaks(mechanics: Mechanics, rate: float, seconds: float) -> FloatArray:
    """Peaks of the acceleration's power spectrum under a swept sine, as frequencies."""
    top = min(0.4 * rate, 1000.0)
    e = chirp(sample_rate_hz=rate, f_min_hz=5.0, f_max_hz=top, duration_s=seconds, integrations=2)
    e = scaled(e, AMPLITUDE_NM)
    run = simulate(mechanics, tuned_drive(mechanics, 0.0), rate, torque=e.samples)
    acceleration = np.gradient(run.velocity) * rate
    n = int(2 ** np.ceil(np.log2(0.5 * rate)))
    f, power = welch(acceleration, rate, window=("kaiser", 6.0), nperseg=n, noverlap=n // 2)
    level = 10 * np.log10(power + 1e-12)
    peaks, _ = find_peaks(level, prominence=3.0)
    return np.asarray(f[peaks][f[peaks] < top])


def _nearest(found: FloatArray, truth: float) -> str:
    if found.size == 0:
        return "   none"
    best = float(found[np.argmin(np.abs(found / truth - 1.0))])
    off = 100 * (best / truth - 1.0)
    return f"{off:+6.2f} %" if abs(off) < 100 * _SAME else "   none"


def _responses(names: list[str]) -> dict[tuple[str, float], Identification]:
    print("median error in dB and degrees, 5 Hz to a quarter of the sample rate (1 kHz at most)")
    print("axis        rate   ours, all lines   H1, same data     stepped sine     ours    H1, s")
    kept = {}
    for rate in RATES_HZ:
        for name in names:
            mechanics, m = NAMED[name], measure(NAMED[name], rate)

            def ours(m: Measurement = m) -> Identification:
                return identify_mechanics(m.records, m.path, m.quantity)

            found, spent = _fastest(ours)
            (f, h1), plain = _fastest(lambda m=m: _h1(m))
            kept[name, rate] = found
            best = found.corrected
            use = best.frequency_hz <= min(0.25 * rate, 1000.0)
            hz = best.frequency_hz[use]
            same = h1[np.searchsorted(f, hz - 1e-6)]
            tones, stepped = _stepped(replace(mechanics, gravity_nm=0.0), rate, m.duration_s)
            print(
                f"{name:10s} {rate:5.0f}  {_error(hz, best.response[use], mechanics)} "
                f"({hz.size:3d})  {_error(hz, same, mechanics)}    "
                f"{_error(tones, stepped, mechanics)} ({tones.size:2d})  {spent:.3f}  {plain:.3f}"
            )
    return kept


def _resonances(kept: dict[tuple[str, float], Identification]) -> None:
    print("\nerror of resonance frequencies")
    print("axis        rate    true Hz   ours (damping)      peak of the acceleration's spectrum")
    for (name, rate), found in kept.items():
        mechanics = NAMED[name]
        seconds = measure(mechanics, rate).duration_s
        peaks = _spectral_peaks(replace(mechanics, gravity_nm=0.0), rate, seconds)
        modes = found.fit.model.modes
        for hz, damping in mechanics.modes()[0]:
            if hz > min(0.4 * rate, 1000.0):
                continue
            own = np.array([m.frequency_hz for m in modes])
            near = [m for m in modes if abs(m.frequency_hz / hz - 1) < _SAME]
            best = min(near, key=lambda m: abs(m.frequency_hz / hz - 1), default=None)
            ratio = "" if best is None else f"({100 * (best.damping / damping - 1):+5.1f} %)"
            print(
                f"{name:10s} {rate:5.0f}  {hz:8.1f}   {_nearest(own, hz)} {ratio:10s}"
                f"   {_nearest(peaks, hz)}"
            )


def main() -> None:
    """Print the tables."""
    names = sys.argv[1:] or list(NAMED)
    _resonances(_responses(names))


if __name__ == "__main__":
    main()
