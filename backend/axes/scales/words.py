"""Texts for why a loop ended a motion, in the units of the axis."""

from __future__ import annotations

from backend.axes.scales.units import AxisUnits
from drivers.halt import ENVELOPE_CAUSES, HaltCause, Halted, quantity_key
from drivers.objects.feedback import Disagreement, disagreement
from drivers.texts.message import Text, text

_MEANING = {
    Disagreement.SCALE: "scales.speed-scale-wrong",
    Disagreement.SIGN: "scales.speed-sign-wrong",
    Disagreement.SPEED_STANDS: "scales.speed-does-not-follow",
    Disagreement.POSITION_STANDS: "scales.position-does-not-follow",
}


def halt_words(halt: Halted, units: AxisUnits | None) -> Text:
    """The cause with its figures in rev, rpm and %; in raw units where ``units`` are not known."""
    if units is None or halt.value is None or halt.limit is None:
        return halt.text
    if halt.cause is HaltCause.CONTRADICTION:
        reported, seen = units.velocity(halt.value), units.velocity(halt.limit)
        return text(
            "scales.speed-contradicts-position",
            speed=_figure(reported),
            from_position=_figure(seen),
            unit=units.names["velocity"],
            meaning=text(_meaning(halt.value, halt.limit)),
        )
    if halt.cause not in ENVELOPE_CAUSES:
        return halt.text
    convert, unit = {
        HaltCause.SPEED: (units.velocity, units.names["velocity"]),
        HaltCause.TORQUE: (units.torque, "%"),
    }.get(halt.cause, (units.position, units.names["position"]))
    value, limit = apart(convert(halt.value), convert(halt.limit))
    return text(
        "motion.beyond-limit-in",
        quantity=quantity_key(halt.quantity),
        value=value,
        limit=limit,
        unit=unit,
    )


def halt_remedy(halt: Halted, otherwise: Text) -> Text:
    """Remedy for a halt: its own for a contradiction, ``otherwise`` for any other cause."""
    if halt.cause is not HaltCause.CONTRADICTION or halt.value is None or halt.limit is None:
        return otherwise
    return text(_meaning(halt.value, halt.limit)).remedy() or otherwise


def _meaning(speed: float, from_position: float) -> str:
    return _MEANING[disagreement(speed, from_position)]


def apart(value: float, limit: float) -> tuple[str, str]:
    """Both numbers as text, with as few digits (at least 4) as show that they differ."""
    for digits in range(4, 10):
        shown = f"{value:.{digits}g}", f"{limit:.{digits}g}"
        if shown[0] != shown[1]:
            return shown
    return f"{value:.10g}", f"{limit:.10g}"


def _figure(speed: float) -> str:
    return f"{speed:.0f}" if abs(speed) >= 100 else f"{speed:.3g}"
