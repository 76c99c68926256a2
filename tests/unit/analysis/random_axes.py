"""Random mechanics, drives and links, and whole measurements of them as the tools make them.

The truth comes from `drive_sim`, which shares nothing with the product's virtual drive; the
excitation and the evaluation are the product's own.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from drive_sim import TURN, Drive, Mechanics, simulate

from backend.axes.axis.axis import Envelope
from backend.tools.measuring import excite
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.measuring.recording import Recording
from backend.tools.tuning.sweep.evaluation import SweepResult, SweepSettings, evaluate

RATED_NM = 1.27
#: Most that the axis may do meanwhile: rad, rad/s, Nm.
ROOM = excite.Room(RATED_NM, 1500.0 * TURN / 60.0, 4.0 * TURN)
ENVELOPE = Envelope(4.0, 1500.0, 100.0, 60.0)


@dataclass(frozen=True)
class Case:
    """One axis behind one bus; ``loop_hz`` 0 is torque mode."""

    name: str
    mechanics: Mechanics
    drive: Drive
    rate_hz: float
    loop_hz: float = 0.0
    known_lag: bool = True
    """Whether the drive reports its current loop and its speed filter."""


@dataclass(frozen=True)
class Errors:
    """Medians over the coherent lines of a band, and the share inside the 95 % band."""

    magnitude_db: float
    phase_deg: float
    covered: float
    lines: int


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _chain(
    rng: np.random.Generator, motor: float, ratio: float, free_hz: list[float], damping: list[float]
) -> tuple[tuple[float, float, float], ...]:
    """Loads that share ``ratio`` times the motor; each coupling alone would swing at a frequency.

    The frequency of a coupling is that of the two inertias at its ends.
    """
    shares = rng.dirichlet(np.full(len(free_hz), 1.5)) * ratio * motor
    loads, before = [], motor
    for share, hz, zeta in zip(shares, free_hz, damping, strict=True):
        inertia = max(float(share), 0.05 * motor)
        reduced = 1.0 / (1.0 / before + 1.0 / inertia)
        stiffness = (TURN * hz) ** 2 * reduced
        loads.append((inertia, stiffness, 2.0 * zeta * TURN * hz * reduced))
        before = inertia
    return tuple(loads)


def random_case(seed: int, rate_hz: float) -> Case:
    """One of the kinds that machines come in, drawn by its seed."""
    rng = np.random.default_rng(seed)
    motor = _log_uniform(rng, 2e-5, 2e-4)
    ratio = float(rng.choice([0.5, 1.0, 3.0, 10.0, 30.0, 60.0])) * _log_uniform(rng, 0.7, 1.4)
    count = int(rng.integers(0, 4))
    top = 0.45 * rate_hz if rate_hz < 2000 else 900.0
    kind = seed % 6
    free = sorted(_log_uniform(rng, 20.0, top) for _ in range(count))
    zeta = [_log_uniform(rng, 0.004, 0.06) for _ in range(count)]
    if kind == 1:  # three resonances close together
        center = _log_uniform(rng, 60.0, 0.5 * top)
        free = [
            center * f for f in (1.0, float(rng.uniform(1.1, 1.3)), float(rng.uniform(1.3, 1.6)))
        ]
        zeta = [_log_uniform(rng, 0.01, 0.05) for _ in range(3)]
    elif kind == 2:  # hardly damped
        free = sorted(_log_uniform(rng, 25.0, top) for _ in range(max(count, 1)))
        zeta = [_log_uniform(rng, 0.0015, 0.006) for _ in free]
    mechanics = Mechanics(
        motor,
        _chain(rng, motor, ratio, free, zeta),
        viscous_nms=_log_uniform(rng, 2e-5, 1e-3),
        coulomb_nm=float(rng.choice([0.0, 0.02, 0.04, 0.06])),
        gravity_nm=float(rng.choice([0.15, 0.3])) if kind == 3 else 0.0,
    )
    period = round(20_000 / rate_hz)
    drive = Drive(
        rated_nm=RATED_NM,
        limit_nm=3 * RATED_NM,
        current_hz=_log_uniform(rng, 600.0, 2500.0),
        counts_per_rev=int(rng.choice([10_000, 2**17, 2**20, 2**23])),
        noise_counts=float(rng.choice([0.0, 0.3, 2.0])),
        speed_filter_hz=float(rng.choice([400.0, 1000.0, 2000.0])),
        command_late_steps=int(rng.integers(round(1.5 * period), round(2.5 * period) + 1))
        if kind == 4
        else period * int(rng.integers(0, 2)),
        reported_late_steps=0,
        interpolates=bool(kind == 5 and rng.random() < 0.5),
        seed=seed,
    )
    loop = 0.0
    if kind == 3 or rng.random() < 0.2:
        loop = _log_uniform(rng, 4.0, 25.0)
        kp = TURN * loop * mechanics.total_kgm2
        drive = replace(drive, kp_nms=kp, ki_nm=kp * TURN * loop / 8)
    return Case(f"{seed}/{kind}", mechanics, drive, rate_hz, loop, bool(rng.random() < 0.5))


def played(case: Case) -> tuple[tuple[excite.Sequence, Recording], ...] | None:
    """All realisations; None where the axis is not stable with its loop, or hits a limit."""
    rate, drive, mechanics = case.rate_hz, case.drive, case.mechanics
    band, step = excite.band_for(rate, 5.0, None), drive.torque_step * drive.rated_nm
    if case.loop_hz:
        sequences = excite.torque_injection(
            rate, band, ROOM, step, share=0.35, realisations=2, position=False
        )
    else:
        rigid = excite.Rigid(mechanics.total_kgm2, mechanics.coulomb_nm)
        sequences = excite.torque_mode(rate, band, ROOM, rigid, step, share=0.35, realisations=2)
    out = []
    for number, s in enumerate(sequences):
        own = replace(drive, seed=97 * drive.seed + number)
        moving = {} if s.base is None else {"velocity": s.base}
        run = simulate(mechanics, own, rate, torque=s.excitation.samples, **moving)
        if np.max(np.abs(run.velocity)) > 1.5 * ROOM.speed_rad_s:
            return None
        zero = np.zeros(run.torque.size)
        valid = np.ones(run.torque.size, dtype=bool)
        out.append((s, Recording(rate, run.position, run.velocity, run.torque, zero, zero, valid)))
    return tuple(out)


def facts_of(case: Case) -> AxisFacts:
    drive = case.drive
    return AxisFacts(
        drive.rated_nm,
        True,
        3000.0,
        drive.current_hz if case.known_lag else None,
        drive.speed_filter_hz if case.known_lag else None,
        case.mechanics.motor_kgm2,
        None,
        drive.interpolates,
    )


def result_of(case: Case, records: tuple[tuple[excite.Sequence, Recording], ...]) -> SweepResult:
    settings = SweepSettings(ENVELOPE)
    loop = "speed" if case.loop_hz else "none"
    return evaluate(records, case.rate_hz, facts_of(case), settings, loop, dc=False)


def errors(frf, mechanics: Mechanics, low_hz: float, high_hz: float) -> Errors:
    f = frf.frequency_hz
    use = (f >= low_hz) & (f <= high_hz) & (frf.coherence >= 0.9)
    if not np.any(use):
        return Errors(np.nan, np.nan, np.nan, 0)
    ratio = frf.response[use] / mechanics.response(f[use])
    db = np.abs(20 * np.log10(np.abs(ratio)))
    deg = np.abs(np.degrees(np.angle(ratio)))
    inside = (db <= 1.96 * frf.std_db[use]) & (deg <= 1.96 * frf.std_deg[use])
    return Errors(
        float(np.median(db)), float(np.median(deg)), float(np.mean(inside)), int(use.sum())
    )


def missed_modes(result: SweepResult, case: Case, low_hz: float = 15.0) -> list[str]:
    """True modes that are not in the table of resonances within 1 % and 15 % of damping.

    Only such as the response shows: standing 3 dB above their surroundings.
    """
    top = min(0.4 * case.rate_hz, 1000.0)
    rows = [r for r in result.resonances if r.kind == "resonance"]
    words = []
    for f, z in case.mechanics.modes()[0]:
        if not low_hz <= f <= top:
            continue
        near = np.array([f * (1 - 3 * z), f, f * (1 + 3 * z)])
        db = 20 * np.log10(np.abs(case.mechanics.response(near)))
        if db[1] - 0.5 * (db[0] + db[2]) < 3.0:
            continue
        best = min(rows, key=lambda r: abs(r.frequency_hz / f - 1), default=None)
        if best is None or abs(best.frequency_hz / f - 1) > 0.01:
            words.append(f"{f:.1f} Hz ζ {z:.4f} not found")
        elif abs(best.damping / z - 1) > 0.15:
            words.append(f"{f:.1f} Hz: ζ {best.damping:.4f} for {z:.4f}")
    return words
