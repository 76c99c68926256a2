"""What a tool makes of rows of the exchange that were lost."""

from __future__ import annotations

import numpy as np

from backend.tools.watching.safety_check.run import held
from drivers.cia402 import State, decode_state


def test_a_lost_status_word_is_the_one_before() -> None:
    """Between 1237h (enabled) and 0250h (disabled) lies 0744h, and 0237h would be enabled again."""
    words = np.array([0.0, 0x1237, 0.0, 0.0, 0x0250, 0.0])
    valid = np.array([False, True, False, False, True, False])
    states = [decode_state(int(word)) for word in held(words, valid)]
    enabled, disabled = State.OPERATION_ENABLED, State.SWITCH_ON_DISABLED
    assert states == [enabled, enabled, enabled, enabled, disabled, disabled]


def test_without_any_valid_row_nothing_is_made_up() -> None:
    words = np.zeros(3)
    assert held(words, np.zeros(3, np.bool_)) is words
