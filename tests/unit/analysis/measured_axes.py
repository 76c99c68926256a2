"""Axes with known truth and complete simulated measurements of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from drive_sim import TURN, Drive, Mechanics, simulate

from backend.analysis.response.frf import Frf
from backend.analysis.response.signal_path.sampling import SignalPath
from backend.analysis.signals.excitation import BaseMotion, choose_lines, multisine, scaled
from backend.analysis.signals.line_spectra import Quantity, Record

RIGID = Mechanics()
ONE = Mechanics(loads=((1e-4, 20.0, 0.002),))
TWO = Mechanics(loads=((1e-4, 20.0, 0.002), (5e-5, 100.0, 0.005)))
THREE = Mechanics(loads=((1e-4, 20.0, 0.002), (5e-5, 100.0, 0.005), (3e-5, 150.0, 0.004)))
STIFF = Mechanics(3e-5, ((6e-5, 150.0, 0.003),), 1e-4, 0.02)
COMPLIANT = Mechanics(5e-5, ((5e-4, 12.0, 0.004),), 5e-4, 0.05)
HEAVY = Mechanics(5e-5, ((1.5e-3, 90.0, 0.01),), 1e-3, 0.06)
VERTICAL = Mechanics(5e-5, ((1e-4, 40.0, 0.003),), 2e-4, 0.04, 0.2)
NAMED = {
    "rigid": RIGID, "one": ONE, "two": TWO, "three": THREE,
    "stiff": STIFF, "compliant": COMPLIANT, "heavy": HEAVY, "vertical": VERTICAL,
}  # fmt: skip


@dataclass(frozen=True)
class Measurement:
    records: tuple[Record, ...]
    path: SignalPath
    quantity: Quantity
    duration_s: float
    travel_rad: float


def tuned_drive(mechanics: Mechanics, bandwidth_hz: float, position: bool = False) -> Drive:
    kp = TURN * bandwidth_hz * mechanics.total_kgm2
    return Drive(
        kp_nms=kp,
        ki_nm=kp * TURN * bandwidth_hz / 8,
        position_gain=TURN * bandwidth_hz / 4 if position else 0.0,
    )


@cache
def measure(
    mechanics: Mechanics,
    sample_rate_hz: float,
    loop_hz: float = 0.0,
    *,
    position: bool = False,
    drive: Drive | None = None,
    share: float = 0.35,
    base_rad_s: float = 20.0,
) -> Measurement:
    """Four realisations (two pairs of opposite sign), each one settling and two used periods."""
    period = 3 * int(sample_rate_hz) // 4
    step_hz = sample_rate_hz / period
    top = 0.4 * sample_rate_hz if sample_rate_hz < 2000 else 1200.0
    lines = choose_lines(5.0, top, step_hz, count=200 if sample_rate_hz < 2000 else 300)
    f = lines * step_hz
    shape = f / np.hypot(f, 60.0) if loop_hz else None
    drive = drive or tuned_drive(mechanics, loop_hz, position)
    records = []
    travel = 0.0
    for i in range(4):
        e = multisine(
            sample_rate_hz=sample_rate_hz, period_samples=period, lines=lines, realisation=i // 2,
            invert=bool(i % 2), amplitude=shape, integrations=0 if loop_hz else 2,
            iterations=80, base=None if loop_hz else BaseMotion(0.5), ramp_samples=period // 8,
        )  # fmt: skip
        e = scaled(e, share * drive.rated_nm, drive.torque_step * drive.rated_nm)
        moving = base_rad_s * np.sin(TURN * np.arange(e.samples.size) / period)
        place = (
            base_rad_s
            * period
            / sample_rate_hz
            / TURN
            * -np.cos(TURN * np.arange(e.samples.size) / period)
        )
        if not loop_hz:
            run = simulate(mechanics, drive, sample_rate_hz, torque=e.samples)
        elif position:
            run = simulate(
                mechanics,
                drive,
                sample_rate_hz,
                torque=e.samples,
                velocity=moving,
                position=place - place[0],
            )
        else:
            run = simulate(mechanics, drive, sample_rate_hz, torque=e.samples, velocity=moving)
        travel = max(travel, float(np.ptp(run.position)))
        records.append(Record(e, run.velocity, run.torque))
    return Measurement(
        tuple(records),
        SignalPath(sample_rate_hz, current_bandwidth_hz=drive.current_hz),
        "torque_injection" if loop_hz else "torque_mode",
        sum(r.excitation.duration_s for r in records),
        travel,
    )


@dataclass(frozen=True)
class Errors:
    """Median errors and coverage over coherent lines of a band."""

    magnitude_db: float
    phase_deg: float
    covered: float
    lines: int


def errors(frf: Frf, mechanics: Mechanics, low_hz: float, high_hz: float) -> Errors:
    f = frf.frequency_hz
    use = (f >= low_hz) & (f <= high_hz) & (frf.coherence >= 0.9)
    ratio = frf.response[use] / mechanics.response(f[use])
    db = np.abs(20 * np.log10(np.abs(ratio)))
    deg = np.abs(np.degrees(np.angle(ratio)))
    inside = (db <= 1.96 * frf.std_db[use]) & (deg <= 1.96 * frf.std_deg[use])
    return Errors(
        float(np.median(db)), float(np.median(deg)), float(np.mean(inside)), int(use.sum())
    )
