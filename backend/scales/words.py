"""Why a loop ended a motion, in the units of the axis and in words. Made once, here."""

from __future__ import annotations

from backend.scales.units import AxisUnits
from drivers.halt import ENVELOPE_CAUSES, HaltCause, Halted
from drivers.motion.feedback import Disagreement, disagreement

_TEACH = "set it under “Scales” on the Overview page"
_MEANING = {
    Disagreement.SCALE: "the scale of 606Ch is not what the profile or the drive states",
    Disagreement.SIGN: "one of the two has the wrong sign",
    Disagreement.SPEED_STANDS: "606Ch does not follow the motion",
    Disagreement.POSITION_STANDS: "6064h does not follow the motion",
}
_REMEDY = {
    Disagreement.SCALE: f"find the true unit of 606Ch, and {_TEACH}",
    Disagreement.SIGN: "look at the polarity 607Eh: its bits 6 and 7 belong together",
    Disagreement.SPEED_STANDS: "look whether this drive fills 606Ch in this mode and maps it; "
    f"where its unit is coarser than stated, {_TEACH}",
    Disagreement.POSITION_STANDS: "look at the encoder and its plug; do not move the axis until "
    "its position is told again",
}


def halt_words(halt: Halted, units: AxisUnits | None) -> str:
    """The cause with its figures in rev, rpm and %; in raw units where ``units`` are not known."""
    if units is None or halt.value is None or halt.limit is None:
        return halt.words
    if halt.cause is HaltCause.CONTRADICTION:
        told, seen = units.velocity(halt.value), units.velocity(halt.limit)
        name = units.names["velocity"]
        meaning = _MEANING[disagreement(halt.value, halt.limit)]
        return (
            f"606Ch says {_figure(told)} {name}, the position says {_figure(seen)} {name}: "
            f"{meaning}. The axis is braked and disabled"
        )
    if halt.cause not in ENVELOPE_CAUSES:
        return halt.words
    convert, unit = {
        HaltCause.SPEED: (units.velocity, units.names["velocity"]),
        HaltCause.TORQUE: (units.torque, "%"),
    }.get(halt.cause, (units.position, units.names["position"]))
    value, limit = apart(convert(halt.value), convert(halt.limit))
    return (
        f"{halt.quantity} {value} {unit} is beyond the limit of {limit} {unit}: "
        "the axis is braked and disabled"
    )


def halt_remedy(halt: Halted, otherwise: str) -> str:
    """What to do about it: for a contradiction its own, else what the tool says."""
    if halt.cause is not HaltCause.CONTRADICTION or halt.value is None or halt.limit is None:
        return otherwise
    return _REMEDY[disagreement(halt.value, halt.limit)]


def apart(value: float, limit: float) -> tuple[str, str]:
    """Both with as few digits as show that they differ."""
    for digits in range(4, 10):
        shown = f"{value:.{digits}g}", f"{limit:.{digits}g}"
        if shown[0] != shown[1]:
            return shown
    return f"{value:.10g}", f"{limit:.10g}"


def _figure(speed: float) -> str:
    return f"{speed:.0f}" if abs(speed) >= 100 else f"{speed:.3g}"
