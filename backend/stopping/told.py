"""What STOP reached, in words for the log and for programs that show no verdicts."""

from __future__ import annotations

from backend.stopping.facts import AxisStop, Verdict


def told(name: str, found: AxisStop) -> str:
    """One sentence; empty for an axis that stands."""
    speed = "" if found.speed is None else f" at {found.speed:.4g} {found.speed_unit}"
    match found.verdict:
        case Verdict.STOPPED:
            return ""
        case Verdict.COASTING:
            return f"{name} has no power and coasts{speed} after STOP: keep away until it stands"
        case Verdict.STILL_MOVING:
            return f"{name} still moves{speed} after STOP: use the machine's emergency stop"
        case Verdict.UNREACHABLE:
            why = f" ({found.problem})" if found.problem else ""
            return f"STOP did not reach {name}{why}: use the machine's emergency stop"
