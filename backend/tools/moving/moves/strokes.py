"""Reciprocating strokes of constant speed about one position."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from backend.axes.motion.envelope import Envelope
from backend.axes.scales.units import AxisUnits
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.mechanics.inertia.probe import RoughFit
from backend.tools.moving.moves.raised_cosine import raised_cosine
from backend.tools.thresholds import moves_strokes as threshold

FloatArray = npt.NDArray[np.float64]
_TURN = 2 * np.pi


@dataclass(frozen=True)
class Stroke:
    """One speed: ``strokes`` plateaus, alternately forwards and backwards."""

    speed_rps: float
    ramp_s: float
    plateau_s: float
    strokes: int

    @property
    def length_rev(self) -> float:
        """Length of one stroke [rev]."""
        return self.speed_rps * (self.ramp_s + threshold.SETTLE_S + self.plateau_s)

    @property
    def duration_s(self) -> float:
        """Approximate duration with the ways to its start and back [s]."""
        one = 2 * self.ramp_s + threshold.SETTLE_S + self.plateau_s + threshold.DWELL_S
        return self.strokes * one + 2 * threshold.DWELL_S + 1.0


@dataclass(frozen=True)
class Room:
    """Limits of the plan: rev to each side, rev/s, s, and the duration of a ramp per rev/s."""

    travel_rev: float
    speed_rps: float
    time_s: float
    ramp_s_per_rps: float

    def ramp_s(self, speed_rps: float) -> float:
        """Duration of the ramp to this speed [s]."""
        return max(threshold.RAMP_S, self.ramp_s_per_rps * speed_rps)

    def plateau_rev(self, speed_rps: float) -> float:
        """Length of a plateau at this speed, after ramp and settling, within the travel [rev]."""
        return 2 * self.travel_rev - speed_rps * (self.ramp_s(speed_rps) + threshold.SETTLE_S)


def room_of(envelope: Envelope, facts: AxisFacts, rough: RoughFit) -> Room:
    """Shares of the envelope, and ramps that use a share of the torque beyond friction."""
    permitted_nm = envelope.torque_percent / 100.0 * facts.rated_torque_nm
    free_nm = permitted_nm - rough.coulomb_nm - abs(rough.gravity_nm)
    # The highest slope of a raised cosine is π/2 times its mean.
    per_rps = np.pi / 2 * rough.inertia_kgm2 * _TURN / max(threshold.RAMP_SHARE * free_nm, 1e-9)
    return Room(
        threshold.USED * envelope.travel_rev,
        threshold.FAST * envelope.speed_rpm / 60.0,
        envelope.time_s,
        per_rps,
    )


def representable(speeds_rps: FloatArray, units: AxisUnits) -> list[float]:
    """The nearest speeds that can be commanded to the drive [rev/s], without duplicates and 0."""
    raws = sorted({int(units.velocity_raw(60.0 * v)) for v in speeds_rps} - {0})
    return [float(units.velocity(raw)) / 60.0 for raw in raws]


def speeds_of(stroke: Stroke, rate: float, slow_rps: float) -> tuple[FloatArray, FloatArray]:
    """Speed [n] in rpm and, per sample, the signed number of its plateau.

    The axis first moves back by half a stroke, and returns to its position at the end.
    """
    half = raised_cosine(-0.5 * stroke.length_rev, max(stroke.length_rev / slow_rps, 0.4), rate)
    still = np.zeros(round(threshold.DWELL_S * rate))
    n = max(2, round(stroke.ramp_s * rate))
    rise = 0.5 * (1.0 - np.cos(np.pi * (np.arange(n) + 0.5) / n))
    settle, plateau = round(threshold.SETTLE_S * rate), round(stroke.plateau_s * rate)
    one = np.concatenate([rise, np.ones(settle + plateau), rise[::-1], still])
    counts = np.zeros(one.size)
    counts[n + settle : n + settle + plateau] = 1.0
    speed, number = [half, still], [np.zeros(half.size + still.size)]
    for index in range(stroke.strokes):
        sign = 1.0 if index % 2 == 0 else -1.0
        speed.append(sign * one * stroke.speed_rps)
        number.append(sign * (index + 1) * counts)
    speed += [-half, still]
    number.append(np.zeros(half.size + still.size))
    return np.concatenate(speed) * 60.0, np.concatenate(number)
