"""The result of STOP as messages for the log and for clients that do not show verdicts."""

from __future__ import annotations

from backend.axes.axis.stop.facts import AxisStop, Verdict
from drivers.texts.message import Text, text


def stop_message(name: str, found: AxisStop) -> Text | None:
    """Return the result for this axis and what to do; None for an axis at standstill."""
    # Without a measured speed the texts leave it out.
    speed = "none" if found.speed is None else f"{found.speed:.4g}"
    match found.verdict:
        case Verdict.STOPPED:
            return None
        case Verdict.STILL_MOVING if found.superseded:
            return text("stopping.superseded", drive=name)
        case Verdict.COASTING:
            return text("stopping.coasts", drive=name, speed=speed, unit=found.speed_unit)
        case Verdict.STILL_MOVING:
            return text("stopping.still-moves", drive=name, speed=speed, unit=found.speed_unit)
        case Verdict.UNREACHABLE if found.problem is None:
            return text("stopping.not-reached", drive=name)
        case Verdict.UNREACHABLE:
            return text("stopping.not-reached-why", drive=name, why=found.problem)
