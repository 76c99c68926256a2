"""Imported responses: the real bench, and drawn rough benches whose other run is known.

    python benchmarks/import_accuracy.py [FILE.csv.gz] [--benches N] [--figure OUT.svg]

Prints, for the real file, modes and bands by the plain H1 estimate, the local polynomial method and
the periods; for drawn benches (two masses, Coulomb and Stribeck friction, backlash, ripple, current
sensor) the share of another run's lines that each 95 % band holds.
"""

from __future__ import annotations

import argparse
import gzip
import sys
from pathlib import Path

import numpy as np
from scipy.signal import coherence, csd, welch

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from backend.analysis.response.foreign_recordings import foreign  # noqa: E402
from tests.support.two_masses import Bench, multisine  # noqa: E402

RATE, LINES = 2500.0, np.arange(11, 251)
REAL = ROOT / "tests" / "data" / "two_mass_bench_a.csv.gz"
Estimate = tuple[np.ndarray, np.ndarray, np.ndarray]


def h1(u: np.ndarray, y: np.ndarray) -> Estimate:
    """Welch's H1 with a Hann window of 1 s; deviation by coherence (Bendat & Piersol)."""
    n = round(RATE)
    f, cross = csd(u, y, RATE, nperseg=n)
    _, power = welch(u, RATE, nperseg=n)
    _, gamma = coherence(u, y, RATE, nperseg=n)
    averages = 2 * u.size / n - 1
    relative = np.sqrt((1 - gamma) / np.maximum(2 * gamma * averages, 1e-12))
    return f[LINES], (cross / power)[LINES], relative[LINES]


def local(u: np.ndarray, y: np.ndarray) -> Estimate:
    """Local polynomials on the whole record, as for noise."""
    found = foreign._by_window(u, y, RATE)
    f, log = found.frequency_hz, np.log(found.response)
    response = np.exp(np.interp(LINES, f, log.real) + 1j * np.interp(LINES, f, np.unwrap(log.imag)))
    return LINES.astype(float), response, np.interp(LINES, f, found.noise)


def periods(u: np.ndarray, y: np.ndarray) -> Estimate:
    """Mean of the settled periods, noise alone."""
    found = foreign._by_periods(u, y, RATE, round(RATE))
    return found.frequency_hz, found.response, found.noise


METHODS = {"H1 (Hann)": h1, "local polynomial": local, "periods, noise alone": periods}


def db(x: np.ndarray) -> np.ndarray:
    return 20 / np.log(10) * x


def real(file: Path) -> None:
    with gzip.open(file, "rt") as opened:
        table = np.loadtxt(opened, delimiter=",", skiprows=1)
    u, y = table[:, 2], table[:, 3]
    found = foreign.evaluate(u, y, RATE)
    print(f"{file.name}: {found.excitation}, period {found.period_s} s, {found.periods_used} used")
    for mode in found.modes:
        low, high = mode.row.frequency_ci95_hz or (0.0, 0.0)
        print(f"  {mode.row.kind:15} {mode.row.frequency_hz:.2f} Hz ({low:.2f} … {high:.2f})")
    print(f"  {'this band':24} median ±{np.median(1.96 * found.std_db):.2f} dB")
    for name, method in METHODS.items():
        _, response, relative = method(u, y)
        far = np.abs(db(np.log(np.abs(response / found.response))))
        print(
            f"  {name:24} median ±{np.median(1.96 * db(relative)):.2f} dB, from the mean of the "
            f"periods: median {np.median(far):.2f} dB, largest {np.max(far):.1f} dB"
        )


def drawn(rng: np.random.Generator) -> Bench:
    ratio = 10 ** rng.uniform(-0.5, 0.7)
    motor = 10 ** rng.uniform(-3.5, -2.5)
    bench = Bench(
        motor, motor * ratio, rng.uniform(25, 90), 10 ** rng.uniform(-2.3, -1.3),
        motor * rng.uniform(1, 10), rng.uniform(0.01, 0.15), rng.uniform(1, 1.4), 0.0,
        rng.uniform(0, 0.02), float(rng.choice([20, 60, 400, 2000])), rng.uniform(0, 0.1), 1e-3,
    )  # fmt: skip
    gap = float(rng.choice([0.0, 0.0, 1.0])) * rng.uniform(0.02, 0.1) / bench.stiffness
    return Bench(**{**bench.__dict__, "backlash_rad": gap})


def truth_of(bench: Bench, torque: np.ndarray, seed: int) -> np.ndarray:
    u, y = bench.record(torque, RATE, seed)
    one, two = (np.fft.rfft(x.reshape(-1, round(RATE))[5:].mean(axis=0)) for x in (u, y))
    return np.asarray((two / one)[LINES])


def campaign(count: int) -> None:
    rng = np.random.default_rng(20)
    held: dict[tuple[str, str], list[float]] = {}
    for number in range(count):
        bench = drawn(rng)
        u, y = bench.record(multisine(RATE, LINES, 1.0, 10, 1000 + number), RATE, number)
        found = foreign.evaluate(u, y, RATE)
        estimates = {name: method(u, y) for name, method in METHODS.items()}
        for case, size in (
            ("other phases", 1.0),
            ("level × 0.7", 0.7),
            ("level × 0.5", 0.5),
            ("level × 2", 2.0),
        ):
            other = truth_of(bench, multisine(RATE, LINES, size, 10, 5000 + number), 99)
            left = np.log(other / found.response)
            size_held = np.abs(left.real) <= 1.96 * found.band.real
            turn_held = np.abs(left.imag) <= 1.96 * found.band.imag
            held.setdefault(("this band, size", case), []).append(float(np.mean(size_held)))
            held.setdefault(("this band, phase", case), []).append(float(np.mean(turn_held)))
            for name, (_f, response, relative) in estimates.items():
                gone = np.abs(np.log(other / response).real) <= 1.96 * relative
                held.setdefault((f"{name}, size", case), []).append(float(np.mean(gone)))
    print(f"share of another run's lines inside the 95 % band, {count} benches: mean (worst)")
    for (name, case), values in sorted(held.items()):
        print(f"  {name:28} {case:14} {np.mean(values):6.1%} ({np.min(values):.0%})")


def figure(file: Path, out: Path) -> None:
    """Magnitude with its band, for the docs."""
    with gzip.open(file, "rt") as opened:
        table = np.loadtxt(opened, delimiter=",", skiprows=1)
    found = foreign.evaluate(table[:, 2], table[:, 3], RATE)
    f, size, half = found.frequency_hz, found.magnitude_db, 1.96 * found.std_db
    x = 50 + 620 * np.log(f / 10) / np.log(25)
    y = 20 + 260 * (10 - size) / 60
    edge = 260 / 60 * half
    upper = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y - edge, strict=True))
    lower = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x[::-1], (y + edge)[::-1], strict=True))
    line = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
    ticks = "".join(
        f'<text x="{50 + 620 * np.log(t / 10) / np.log(25):.0f}" y="300" text-anchor="middle">{t}'
        "</text>"
        for t in (10, 20, 50, 100, 200)
    )
    marks = "".join(
        f'<text x="44" y="{24 + 260 * (10 - t) / 60:.0f}" text-anchor="end">{t}</text>'
        for t in (0, -20, -40)
    )
    out.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 690 325" font-family="sans-serif" '
        'font-size="12" role="img" aria-label="Response of the bench with its band">'
        '<rect width="690" height="325" fill="#fff"/>'
        f'<polygon points="{upper} {lower}" fill="#0072b2" fill-opacity="0.25"/>'
        f'<polyline points="{line}" fill="none" stroke="#0072b2" stroke-width="1.5"/>{ticks}{marks}'
        '<text x="360" y="318" text-anchor="middle">Hz</text><text x="8" y="16">dB re 1 '
        "(rad/s)/A</text></svg>\n"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", nargs="?", type=Path, default=REAL)
    parser.add_argument("--benches", type=int, default=20)
    parser.add_argument("--figure", type=Path)
    chosen = parser.parse_args()
    if chosen.figure:
        figure(chosen.file, chosen.figure)
    real(chosen.file)
    if chosen.benches:
        campaign(chosen.benches)


if __name__ == "__main__":
    main()
