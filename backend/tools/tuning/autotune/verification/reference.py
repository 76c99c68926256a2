"""Reference that measures a tuned speed loop: its size and corner, from the loop's prediction.

Without a prediction a reference is sized by the torque that the inertia needs at the corner, as in
a loop that is faster than it. A slower loop takes far less: the torque of its gain alone. Its lines
then vanish in noise and friction, although the axis could bear a multiple of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.analysis.loop.design import Candidate
from backend.analysis.loop.margins import closed_from_open
from backend.analysis.loop.measured_plant import MeasuredPlant
from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.axes.axis.axis import Axis, Envelope
from backend.axes.axis.cyclic import CyclicSession
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.measuring.excite import Room, band_for
from backend.tools.measuring.recording import cycle_s
from backend.tools.measuring.waveform import grid
from backend.tools.thresholds import autotune_reference as threshold
from backend.tools.tuning.autotune.verification.verdict import loops_of
from backend.tools.tuning.sweep.plan import drive_limit_percent, reference_speed
from drivers.errors import NotAllowed

_TURN = 2.0 * np.pi


@dataclass(frozen=True)
class Reference:
    """Peak of the excitation [rad/s]; its lines fall with frequency above ``corner_hz``."""

    peak_rad_s: float
    corner_hz: float

    def lines(self, frequency_hz: FloatArray) -> FloatArray:
        """Amplitudes of the lines, up to a common factor that depends little on the corner."""
        falling = 1.0 / np.hypot(1.0, frequency_hz / self.corner_hz)
        return np.asarray(self.peak_rad_s * falling / np.sqrt(np.sum(falling**2)))


async def reference_for(
    axis: Axis,
    session: CyclicSession,
    envelope: Envelope,
    facts: AxisFacts,
    inertia_kgm2: float,
    plant: MeasuredPlant | None,
    candidate: Candidate,
) -> Reference | None:
    """The reference for this design; None where the usual one is as good, or nothing is predicted.

    Raises:
        DriveError: a parameter cannot be read.
    """
    if plant is None:
        return None
    rate = 1.0 / cycle_s(session)
    f = grid("multisine", rate, band_for(rate, threshold.LOWEST_HZ, None)).line_hz
    try:
        loops = loops_of(axis, facts, candidate, f, _each(plant, f))
    except (NotAllowed, ValueError):
        return None
    percent = min(envelope.torque_percent, await drive_limit_percent(axis))
    room = Room(
        percent / 100.0 * facts.rated_torque_nm,
        envelope.speed_rpm * _TURN / 60.0,
        envelope.travel_rev * _TURN,
    )
    return larger(f, loops, _each(plant, f), room, inertia_kgm2)


def larger(
    frequency_hz: FloatArray,
    loops: ComplexArray,
    plants: ComplexArray,
    room: Room,
    inertia_kgm2: float,
) -> Reference | None:
    """The reference with the largest lines where the loop crosses 0 dB for the last time.

    ``loops`` and ``plants`` [m, n] on the lines are all that the axis may be: the worst of them
    limits torque, speed and reference. None where no reference has lines that are clearly larger
    than those of the usual one, and nowhere smaller ones.
    """
    usual = Reference(reference_speed(room, inertia_kgm2), threshold.CORNERS_HZ[0])
    closed = closed_from_open(loops)
    torque_nm = np.abs(closed / plants)
    f = frequency_hz
    over = np.flatnonzero(np.any(np.abs(loops) > 1.0, axis=0))
    if not over.size:
        return None
    at = int(over[-1])
    best: Reference | None = None
    for corner_hz in threshold.CORNERS_HZ:
        unit = Reference(1.0, corner_hz).lines(f)

        def peak(share: FloatArray, unit: FloatArray = unit) -> float:
            """Peak of a signal whose lines have this share of the reference's."""
            rms = np.sqrt(np.sum((share * unit) ** 2, axis=-1))
            return float(threshold.CREST / threshold.CREST_SENT * np.max(rms))

        peak_rad_s = min(
            threshold.TORQUE_SHARE * room.torque_nm / peak(torque_nm),
            min(threshold.SPEED_SHARE * room.speed_rad_s, threshold.SPEED_RAD_S)
            / peak(np.abs(closed)),
            threshold.REFERENCE_SHARE * room.speed_rad_s,
        )
        found = Reference(peak_rad_s, corner_hz)
        if np.any(found.lines(f) < threshold.AS_LARGE * usual.lines(f)):
            continue
        if best is None or found.lines(f)[at] > best.lines(f)[at]:
            best = found
    if best is None or best.lines(f)[at] < threshold.WORTH * usual.lines(f)[at]:
        return None
    return best


def _each(plant: MeasuredPlant, frequency_hz: FloatArray) -> ComplexArray:
    """All plants of the design on these lines [m, n]."""
    log_f, log_dense = np.log(frequency_hz), np.log(plant.frequency_hz)
    rows = []
    for row in plant.shifted():
        turns = np.log(np.abs(row)) + 1j * np.unwrap(np.angle(row))
        rows.append(
            np.interp(log_f, log_dense, turns.real) + 1j * np.interp(log_f, log_dense, turns.imag)
        )
    return np.asarray(np.exp(np.array(rows)))
