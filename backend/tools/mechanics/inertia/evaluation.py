"""Inertia and friction from recorded moves; also works on stored recordings."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from backend.analysis.mechanics.slow_moves.inertia import InertiaResult, Interval, estimate_inertia
from backend.analysis.signals.spectrum import power_density
from backend.axes.axis.axis import Envelope
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.measuring.recording import Recording
from backend.tools.mechanics.inertia.result import InertiaAnswer, InertiaIntervals, RatioReference
from backend.tools.thresholds import inertia_evaluation as threshold
from backend.tools.tool import Arrays, Meta
from backend.tools.tuning.sweep.velocity_noise import velocity_without_noise
from drivers.errors import NotAllowed
from drivers.texts.message import reason_of

Scheme = Literal["free", "limited", "taught"]

CUTOFF_HZ = threshold.CUTOFF_HZ


@dataclass(frozen=True, slots=True)
class InertiaSettings:
    """Scheme and limits.

    ``envelope`` bounds every move; its travel counts from the start (free), or is the longest
    distance that the search for an end may move (limited). ``ends_rev`` are taught ends in the
    axis' own position. ``search_torque_percent`` and ``search_speed_rpm`` apply to the search.
    """

    envelope: Envelope
    scheme: Scheme = "free"
    ends_rev: tuple[float, float] | None = None
    search_torque_percent: float = 20.0
    search_speed_rpm: float = 30.0
    repetitions: int = 4
    rated_torque_nm: float | None = None
    motor_inertia_kgm2: float | None = None


@dataclass(frozen=True)
class InertiaOutcome:
    """Result of the regression, its method, and the ends of the travel, if any [rev]."""

    result: InertiaResult
    method: str
    torque_known: bool
    ends_rev: tuple[float, float] | None
    motion_s: float
    ratio_against: RatioReference | None
    """Reference of the inertia ratio; None where there is no ratio."""


def evaluate(recording: Recording, settings: InertiaSettings, facts: AxisFacts) -> InertiaResult:
    """Evaluate a recording by regression; also a stored one.

    Raises:
        NotAllowed: the moves are too short to be evaluated.
    """
    try:
        found = estimate_inertia(
            recording.torque_nm,
            velocity_without_noise(recording, CUTOFF_HZ),
            recording.sample_rate_hz,
            cutoff_hz=CUTOFF_HZ,
            torque_limit_nm=settings.envelope.torque_percent / 100.0 * facts.rated_torque_nm,
            motor_inertia_kgm2=facts.motor_inertia_kgm2,
            valid=recording.valid,
            position_rad=recording.position_rad if np.any(recording.position_rad) else None,
            loop_nms=_loop_gain(recording),
        )
    except ValueError as error:
        raise NotAllowed(
            "inertia.moves-too-short-evaluated",
            limit=f"{settings.envelope.travel_rev:g} rev",
            cause=reason_of(error),
        ) from error
    reference = _reference_inertia(facts)
    if found.load_ratio is None and reference and np.isfinite(found.inertia_kgm2.value):
        return replace(found, load_ratio=found.inertia_kgm2.value / reference - 1.0)
    return found


def _loop_gain(recording: Recording) -> float | None:
    """Gain [Nm·s] of the speed loop that made the moves; None where they do not show it.

    The torque is regressed on speed error and its integral. Setpoints and torque offset are in the
    drive's units, whose scale the columns of the setpoint, its integral and the offset absorb.
    """
    use, sent, velocity = recording.valid, recording.sent, recording.velocity_rad_s
    power = float(np.dot(sent[use], sent[use]))
    if np.count_nonzero(use) < 8 or not np.isfinite(power) or power == 0.0:
        return None
    wanted = sent * (float(np.dot(sent[use], velocity[use])) / power)
    best, gain = threshold.LOOP_EXPLAINED, None
    torque = recording.torque_nm[use]
    for late in range(threshold.LOOP_LATEST):
        set_before = np.concatenate([np.zeros(late), wanted[: wanted.size - late]])
        error = set_before - velocity
        rows = [error, set_before, np.cumsum(error), np.cumsum(set_before), np.ones(error.size)]
        if np.any(recording.offset):
            rows.append(recording.offset)
        columns = np.column_stack(rows)[use]
        scale = np.maximum(np.max(np.abs(columns), axis=0), 1e-300)
        x = np.linalg.lstsq(columns / scale, torque, rcond=None)[0]
        spread = float(np.var(torque))
        share = 1.0 - float(np.var(torque - columns / scale @ x)) / spread if spread else 0.0
        if share > best and x[0] > 0.0:
            best, gain = share, float(x[0] / scale[0])
    return gain


def uncertainty_of(result: InertiaResult) -> float:
    """Half the relative interval of the inertia; infinite where it is not identified."""
    inertia = result.inertia_kgm2
    if not result.identifiable:
        return float("inf")
    return 0.5 * (inertia.high - inertia.low) / inertia.value


def oscillation_hz(recording: Recording, result: InertiaResult) -> float | None:
    """Frequency of a torque oscillation that inertia and friction do not explain; else None [Hz].

    Under the speed loop the motor follows its setpoint, and the load oscillates behind the coupling
    at the antiresonance of the mechanics.
    """
    if not np.isfinite(result.inertia_kgm2.value) or result.r2 > threshold.EXPLAINED:
        return None
    rate, velocity = recording.sample_rate_hz, recording.velocity_rad_s
    rest = recording.torque_nm - result.inertia_kgm2.value * np.gradient(velocity) * rate
    rest = rest - result.viscous_nms.value * velocity - result.gravity_nm.value
    rest = rest - result.coulomb_nm.value * np.sign(velocity)
    if result.load_terms.torque_nm.size:
        rest = rest - result.load_terms.torque_nm
    density = power_density(rest, rate, round(2.0 * rate))
    band = (density.frequency_hz >= threshold.SWING_HZ[0]) & (
        density.frequency_hz <= threshold.SWING_HZ[1]
    )
    levels = density.value[band]
    peak = int(np.argmax(levels))
    if levels[peak] < 8.0 * float(np.median(levels)):
        return None
    return float(density.frequency_hz[band][peak])


def _reference_inertia(facts: AxisFacts) -> float | None:
    """The motor's inertia, or if unknown the inertia stored in the drive."""
    return facts.motor_inertia_kgm2 or facts.drive_inertia_kgm2


def ratio_against(facts: AxisFacts, settings: InertiaSettings) -> RatioReference | None:
    """Reference of the inertia ratio; None where there is no ratio."""
    if settings.motor_inertia_kgm2:
        return "given"
    if facts.motor_inertia_kgm2:
        return "drive"
    if facts.drive_inertia_kgm2:
        return "stored"
    return None


def raw_of(
    recording: Recording, settings: InertiaSettings, facts: AxisFacts
) -> tuple[dict[str, npt.NDArray[np.generic]], dict[str, object]]:
    """Arrays and facts from which `reevaluate` reproduces the result."""
    return recording.arrays(), {
        "tool": "inertia",
        "sample_rate_hz": recording.sample_rate_hz,
        "facts": asdict(facts),
        "settings": asdict(settings),
    }


def reevaluate(arrays: Arrays, meta: Meta) -> InertiaAnswer:
    """Evaluate stored raw data again.

    Raises:
        ValueError: not the raw data of an inertia measurement.
    """
    given, reported = meta.get("settings"), meta.get("facts")
    if not isinstance(given, dict) or not isinstance(reported, dict) or "torque_nm" not in arrays:
        raise ValueError("not the raw data of an inertia measurement")
    ends = given.get("ends_rev")
    settings = InertiaSettings(
        **{
            **given,
            "envelope": Envelope(**given["envelope"]),
            "ends_rev": None if ends is None else (float(ends[0]), float(ends[1])),
        }
    )
    valid = np.asarray(arrays["valid"], np.bool_)
    columns = {k: np.asarray(v, np.float64) for k, v in arrays.items() if k != "valid"}
    rate = float(str(meta["sample_rate_hz"]))
    facts = AxisFacts(**reported)
    recording = Recording(rate, **columns, valid=valid)
    return answer_of(
        InertiaOutcome(
            evaluate(recording, settings, facts),
            f"host, {settings.scheme}",
            facts.torque_known,
            settings.ends_rev,
            recording.velocity_rad_s.size / rate,
            ratio_against(facts, settings),
        )
    )


def answer_of(outcome: InertiaOutcome) -> InertiaAnswer:
    """The result in the form that page, report, files and command line use."""
    r = outcome.result
    parts: dict[str, Interval] = {
        "inertia_kgm2": r.inertia_kgm2,
        "viscous_nms": r.viscous_nms,
        "coulomb_nm": r.coulomb_nm,
        "gravity_nm": r.gravity_nm,
    }
    ratio, spread = r.load_ratio, None
    if ratio is not None and np.isfinite(r.inertia_kgm2.value):
        rotor = r.inertia_kgm2.value / (1.0 + ratio)
        spread = (r.inertia_kgm2.low / rotor - 1.0, r.inertia_kgm2.high / rotor - 1.0)
    values = {name: _number(part.value) for name, part in parts.items()}
    ends = {name: (_number(part.low), _number(part.high)) for name, part in parts.items()}
    answer = InertiaAnswer(
        method=outcome.method, **values, load_ratio=ratio,
        load_ratio_reference=outcome.ratio_against,
        ci95=InertiaIntervals(**ends, load_ratio=spread),
        place_nm=r.load_terms.place_nm or None,
        place_periods_rev=tuple(period / (2 * np.pi) for period in r.load_terms.periods_rad),
        fan_nm=r.load_terms.fan_nm or None, r2=r.r2, reasons=r.reasons, identifiable=r.identifiable,
        unit="SI" if outcome.torque_known else "torque as a share of rated torque",
        ends_rev=outcome.ends_rev, motion_s=outcome.motion_s,
    )  # fmt: skip
    return answer.in_language("en")


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
