"""Results for the load side from recordings of both encoders. Pure: also from stored data."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from backend.analysis.mechanics.load_side import LoadSide, Value, load_side
from backend.analysis.mechanics.load_side_samples import FewSamples, LoadStands, TwoSides
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.mechanics.load_side.result import ErrorOrder, Estimate, Finding, LoadSideResult
from backend.tools.mechanics.load_side.settings import LoadSideSettings
from backend.tools.thresholds import load_side_evaluate as threshold
from backend.tools.tool import Arrays, Meta
from drivers.errors import NotAllowed

FloatArray = npt.NDArray[np.float64]
_TURN = 2 * np.pi


@dataclass(frozen=True)
class Sides:
    """Raw data [n]; ``part`` as in `backend.analysis.mechanics.load_side.TwoSides`."""

    sample_rate_hz: float
    position_rad: FloatArray
    load_counts: FloatArray
    torque_nm: FloatArray
    valid: npt.NDArray[np.bool_]
    part: npt.NDArray[np.int64]

    def arrays(self) -> dict[str, npt.NDArray[np.generic]]:
        """The samples as arrays for storage."""
        return {
            "position_rad": self.position_rad,
            "load_counts": self.load_counts,
            "torque_nm": self.torque_nm,
            "valid": self.valid,
            "part": self.part,
        }


def evaluate(data: Sides, settings: LoadSideSettings, facts: AxisFacts) -> LoadSideResult:
    """Evaluate the recordings.

    Raises:
        NotAllowed: the load's position does not follow the motor, or too few samples arrived.
    """
    inertia = settings.motor_inertia_kgm2 or facts.motor_inertia_kgm2
    # With held setpoints the loop reacts within each cycle, between the samples of the torque.
    usable = inertia if facts.torque_known and facts.interpolates else None
    sides = TwoSides(
        data.sample_rate_hz,
        data.position_rad,
        data.load_counts,
        data.torque_nm,
        data.valid,
        data.part,
        settings.gear_ratio,
    )
    try:
        found = load_side(sides, usable)
    except LoadStands as error:
        raise NotAllowed("load-side.load-stands") from error
    except FewSamples as error:
        raise NotAllowed("load-side.few-samples") from error
    ratio = settings.gear_ratio
    degrees = 360.0 / _TURN / ratio
    stiffness, least = _stiffness(found, usable or 0.0)
    load_stiffness = None if stiffness is None else _times(stiffness, ratio**2)
    gap = found.backlash_rad
    return LoadSideResult(
        gear_ratio=ratio,
        counts_per_load_rev=found.counts_per_rev * ratio,
        lost_motion_deg=_estimate(found.lost_motion_rad, degrees),
        backlash_deg=None if gap is None else _positive(_estimate(gap, degrees)),
        backlash_motor_rev=None if gap is None else _positive(_estimate(gap, 1.0 / _TURN)),
        stiffness_nm_per_rad=load_stiffness,
        stiffness_at_least_nm_per_rad=None if least is None else least * ratio**2,
        locked_motor_hz=None if found.twist_s2 is None else _frequency(found.twist_s2),
        load_inertia_kgm2=None
        if found.load_inertia_kgm2 is None
        else _inertia(found.load_inertia_kgm2, usable or 0.0),
        error_span_deg=_positive(_estimate(found.error_span_rad, degrees)),
        error_orders=_orders(found, degrees),
        error_angle_deg=tuple(float(each) for each in found.error_angle_rad * degrees),
        error_deg=tuple(float(each) for each in found.error_rad * -degrees),
        residual_deg=found.residual_rad * degrees,
        findings=tuple(_findings(found, stiffness, inertia, facts, degrees)),
        motion_s=data.position_rad.size / data.sample_rate_hz,
    )


def reevaluate(arrays: Arrays, meta: Meta) -> LoadSideResult:
    """Evaluate stored raw data again.

    Raises:
        ValueError: not the raw data of a load side.
    """
    given, facts = meta.get("settings"), meta.get("facts")
    if not isinstance(given, dict) or not isinstance(facts, dict) or "load_counts" not in arrays:
        raise ValueError("not the raw data of a load side")
    data = Sides(
        float(str(meta["sample_rate_hz"])),
        np.asarray(arrays["position_rad"], np.float64),
        np.asarray(arrays["load_counts"], np.float64),
        np.asarray(arrays["torque_nm"], np.float64),
        np.asarray(arrays["valid"], np.bool_),
        np.asarray(arrays["part"], np.int64),
    )
    return evaluate(data, LoadSideSettings.model_validate(given), AxisFacts(**facts))


def _estimate(found: Value, factor: float) -> Estimate:
    half = abs(factor) * found.half
    value = factor * found.value
    return Estimate(value=value, ci95=(value - half, value + half))


def _positive(found: Estimate) -> Estimate:
    """An estimate of a quantity that cannot be negative."""
    low, high = found.ci95
    return Estimate(value=max(found.value, 0.0), ci95=(max(low or 0.0, 0.0), max(high or 0.0, 0.0)))


def _times(found: Estimate, factor: float) -> Estimate:
    low, high = (None if end is None else end * factor for end in found.ci95)
    return Estimate(value=found.value * factor, ci95=(low, high))


def _inertia(found: Value, motor_kgm2: float) -> Estimate:
    """Load inertia; an error of the motor's catalogue inertia adds to its interval."""
    half = math.hypot(found.half, threshold.CATALOGUE * motor_kgm2)
    return _estimate(Value(found.value, half), 1.0)


def _stiffness(found: LoadSide, motor_kgm2: float) -> tuple[Estimate | None, float | None]:
    """Stiffness J / (J/k) in Nm/rad at the motor shaft, or its lower bound."""
    if found.load_inertia_kgm2 is None or found.pulled:
        return None, None
    inertia = _inertia(found.load_inertia_kgm2, motor_kgm2)
    low, high = inertia.ci95
    if not low or low <= 0.0 or high is None:
        return None, None
    if found.twist_s2 is None:
        return None, low / found.most_twist_s2 if found.most_twist_s2 else None
    twist = found.twist_s2
    off = math.hypot((high - low) / 2.0 / inertia.value, twist.half / twist.value)
    value = inertia.value / twist.value
    return Estimate(value=value, ci95=(value / (1.0 + off), value * (1.0 + off))), None


def _frequency(twist: Value) -> Estimate:
    ends = (twist.value + twist.half, twist.value - twist.half)
    low, high = (1.0 / (_TURN * math.sqrt(end)) for end in ends)
    return Estimate(value=1.0 / (_TURN * math.sqrt(twist.value)), ci95=(low, high))


def _orders(found: LoadSide, degrees: float) -> tuple[ErrorOrder, ...]:
    """Orders that are larger than their uncertainty, largest first."""
    shown = [(order, size) for order, size in found.orders if size.value > size.half]
    shown.sort(key=lambda each: -each[1].value)
    return tuple(
        ErrorOrder(
            order_per_rev=order,
            amplitude_deg=size.value * degrees,
            amplitude_ci95_deg=(
                max(size.value - size.half, 0.0) * degrees,
                (size.value + size.half) * degrees,
            ),
        )
        for order, size in shown
    )


def _findings(
    found: LoadSide,
    stiffness: Estimate | None,
    inertia: float | None,
    facts: AxisFacts,
    degrees: float,
) -> list[Finding]:
    """Findings: the verdict first, then what the data do not show, and why."""
    gap, lost = found.backlash_rad, found.lost_motion_rad
    if gap is None:
        most = max(lost.value + lost.half, 0.0) * degrees
        findings = [Finding(code="flank_kept", value=most, unit="°")]
    elif gap.value <= gap.half:
        most = max(gap.value + gap.half, 0.0) * degrees
        findings = [Finding(code="backlash_not_seen", value=most, unit="°")]
    else:
        findings = [Finding(code="measured", value=gap.value * degrees, unit="°")]
    if not facts.torque_known:
        findings.append(Finding(code="rated_torque_unknown"))
    elif inertia is None:
        findings.append(Finding(code="motor_inertia_unknown"))
    elif not facts.interpolates:
        findings.append(Finding(code="setpoints_held"))
    elif found.pulled:
        findings.append(Finding(code="pull_large"))
    elif stiffness is None and gap is not None and found.twist_s2 is None:
        findings.append(Finding(code="stiffness_not_seen"))
    elif stiffness is None and gap is not None:
        findings.append(Finding(code="load_light"))
    if not found.whole_revolution:
        findings.append(Finding(code="revolution_not_covered"))
    return findings
