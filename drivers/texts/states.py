"""Names of the power states, as messages of the catalogue."""

from __future__ import annotations

from collections.abc import Mapping

from drivers.cia402 import State
from drivers.texts.message import Text

_CODES: Mapping[State, str] = {
    State.NOT_READY: "state.not-ready-to-switch-on",
    State.SWITCH_ON_DISABLED: "state.switch-on-disabled",
    State.READY: "state.ready-to-switch-on",
    State.SWITCHED_ON: "state.switched-on",
    State.OPERATION_ENABLED: "state.operation-enabled",
    State.QUICK_STOP_ACTIVE: "state.quick-stop-active",
    State.FAULT_REACTION: "state.fault-reaction-active",
    State.FAULT: "state.fault",
    State.UNKNOWN: "state.unknown",
}


def state_text(state: State) -> Text:
    """The state's name in CiA 402-2; in Chinese with the English name in brackets."""
    return Text(_CODES[state])
