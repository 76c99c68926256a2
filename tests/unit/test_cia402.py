"""Status words and control words against the tables of CiA 402-2 (28 and 31)."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from drivers.cia402 import State, allowed_goals, decode_state, next_control_word
from drivers.texts.message import text
from drivers.texts.states import state_text

# CiA 402-2 table 31: xxxx xxxx x0xx 0000 and so on; x bits tried both ways.
WORDS = [
    (0b0000_0000, State.NOT_READY),
    (0b0100_0000, State.SWITCH_ON_DISABLED),
    (0b0010_0001, State.READY),
    (0b0010_0011, State.SWITCHED_ON),
    (0b0010_0111, State.OPERATION_ENABLED),
    (0b0000_0111, State.QUICK_STOP_ACTIVE),
    (0b0000_1111, State.FAULT_REACTION),
    (0b0000_1000, State.FAULT),
]


@pytest.mark.parametrize(("word", "state"), WORDS)
@pytest.mark.parametrize("others", [0x0000, 0x0290, 0xFF90])
def test_states(word: int, state: State, others: int) -> None:
    assert decode_state(word | others) is state


@pytest.mark.parametrize(
    ("word", "state"),
    # 003:301 and 003:305: bits 0–2 echo the control word, bit 7 is the alarm.
    [(0, State.SWITCH_ON_DISABLED), (1, State.READY), (3, State.SWITCHED_ON),
     (7, State.OPERATION_ENABLED), (0x87, State.FAULT), (0x1407, State.OPERATION_ENABLED)],
)  # fmt: skip
def test_echoing_status_word(word: int, state: State) -> None:
    assert decode_state(word, echoes_control=True) is state


def walk(state: State, goal: State) -> list[int]:
    """Words sent until the goal, in a drive that obeys (transitions of CiA 402-2 figure 28)."""
    after = {
        (State.SWITCH_ON_DISABLED, 0x06): State.READY,
        (State.READY, 0x07): State.SWITCHED_ON,
        (State.SWITCHED_ON, 0x0F): State.OPERATION_ENABLED,
        (State.OPERATION_ENABLED, 0x07): State.SWITCHED_ON,
        (State.OPERATION_ENABLED, 0x06): State.READY,
        (State.SWITCHED_ON, 0x06): State.READY,
        (State.OPERATION_ENABLED, 0x02): State.QUICK_STOP_ACTIVE,
        (State.FAULT, 0x80): State.SWITCH_ON_DISABLED,
    }
    words: list[int] = []
    previous = 0
    while (word := next_control_word(state, goal, previous)) is not None:
        words.append(word)
        state = State.SWITCH_ON_DISABLED if word == 0 else after.get((state, word), state)
        previous = word
        assert len(words) < 10, "does not arrive"
    assert state is goal
    return words


@pytest.mark.parametrize(
    ("start", "goal", "words"),
    [
        (State.SWITCH_ON_DISABLED, State.OPERATION_ENABLED, [0x06, 0x07, 0x0F]),
        (State.OPERATION_ENABLED, State.READY, [0x06]),
        (State.OPERATION_ENABLED, State.SWITCHED_ON, [0x07]),
        (State.OPERATION_ENABLED, State.SWITCH_ON_DISABLED, [0x00]),
        (State.FAULT, State.OPERATION_ENABLED, [0x80, 0x06, 0x07, 0x0F]),
        (State.QUICK_STOP_ACTIVE, State.SWITCH_ON_DISABLED, [0x00]),
        (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE, [0x02]),
    ],
)
def test_way_to_goal(start: State, goal: State, words: list[int]) -> None:
    assert walk(start, goal) == words


def test_fault_reset_needs_an_edge() -> None:
    assert next_control_word(State.FAULT, State.READY, previous=0x80) == 0


def test_nothing_can_be_asked_of_a_drive_in_fault_reaction() -> None:
    assert allowed_goals(State.FAULT_REACTION) == ()
    assert next_control_word(State.FAULT_REACTION, State.READY) is None


def test_states_have_the_names_of_the_term_base() -> None:
    terms = Path(__file__).resolve().parents[2] / "docs" / "glossary" / "terms.yaml"
    fields = yaml.safe_load(terms.read_text("utf-8")).values()
    chinese = {term["en"]: term["zh"] for field in fields for term in field}
    for state in State:
        name = state_text(state)
        assert name.words("en") == state.value
        if state is not State.UNKNOWN:
            assert name.words("zh") == chinese[state.value]


def test_a_refused_state_is_named_in_the_readers_language() -> None:
    refused = text(
        "axis.stays-not-go",
        drive="X",
        why=text("axis.cause-none"),
        state=state_text(State.FAULT),
        goal=state_text(State.OPERATION_ENABLED),
    )
    assert "“Fault”" in refused.words("en")
    assert "“故障（Fault）”" in refused.words("zh")
