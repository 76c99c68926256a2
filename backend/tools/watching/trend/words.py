"""Texts of a finding and of its next step, as messages of the catalogue."""

from __future__ import annotations

from backend.tools.watching.health.result import Quantity
from backend.tools.watching.trend.compare import Code, Direction, Finding
from drivers.texts.message import Text, text

_QUANTITIES: dict[Quantity, Text] = {
    "resonance": text("health.resonance"),
    "antiresonance": text("health.antiresonance"),
    "friction": text("health.friction"),
    "inertia": text("health.inertia"),
    "step_rise": text("health.step-rise"),
    "step_overshoot": text("health.step-overshoot"),
}
_CHANGED: dict[tuple[Quantity, Direction], str] = {
    ("resonance", "lower"): "health.resonance-lower",
    ("resonance", "higher"): "health.resonance-higher",
    ("friction", "higher"): "health.friction-higher",
    ("friction", "lower"): "health.friction-lower",
    ("inertia", "higher"): "health.inertia-higher",
    ("inertia", "lower"): "health.inertia-lower",
}
_OTHERS: dict[Code, str] = {
    "suspected": "health.suspected",
    "same": "health.same",
    "undecided": "health.undecided",
    "not_seen": "health.not-seen",
    "few_runs": "health.few-runs",
    "no_check": "health.no-check",
}
_SHOWN = "health.shown-only"


def name_of(finding: Finding) -> Text:
    """Name of the quantity, such as *resonance 1*."""
    name = _QUANTITIES[finding.quantity]
    if finding.quantity not in ("resonance", "antiresonance"):
        return name
    return text("health.numbered", name=name, number=finding.number)


def message_of(finding: Finding) -> Text:
    """Message of a finding; its `remedy` is the next step."""
    code = _OTHERS.get(finding.code, "")
    if finding.code == "changed":
        code = _CHANGED[finding.quantity, finding.direction]
    if finding.looked_for is None and finding.change is not None:
        code = _SHOWN
    change = finding.change or 0.0
    return text(
        code,
        name=name_of(finding),
        change_percent=100.0 * change,
        low_percent=100.0 * (finding.low or 0.0),
        high_percent=100.0 * (finding.high or 0.0),
        # The frequency of a resonance is proportional to the square root of the stiffness.
        stiffness_percent=100.0 * ((1.0 + change) ** 2 - 1.0),
        looked_for_percent=100.0 * (finding.looked_for or 0.0),
    )
