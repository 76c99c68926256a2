"""STOP out of motions of every family, judged by the shaft (``python -m benchmarks.stopping``).

A representative part of the matrix: every motion once, every trouble, every family.
"""

from __future__ import annotations

import pytest

from benchmarks.stopping.cells import Outcome, cells, run_cell

PART = [
    ("mms7", "profile velocity", "none"),
    ("mms7", "identification", "none"),
    ("mms7", "identification", "605Ah tampered"),
    ("mms7", "homing", "605Ah tampered"),
    ("m6l", "own jog by input", "none"),
    ("m6l", "own homing", "none"),
    ("m6l", "identification", "none"),
    ("m6l", "torque", "605Ah tampered"),
    ("m6l", "own homing", "process data lost"),
    ("m6l", "torque", "process data lost"),
    ("r6l", "own jog by input", "none"),
    ("r6l", "own jog by parameter", "none"),
    ("r6l", "own jog by parameter", "605Ah tampered"),
    ("r6l", "jog", "605Ah tampered"),
    ("r6l", "homing", "process data lost"),
    ("r6l", "identification", "process data lost"),
    ("ep3e", "jog by process data", "mailbox mute"),
    ("ep3e", "jog by process data", "process data lost"),
    ("ds_c", "torque", "none"),
    ("ds_c", "profile velocity", "mailbox mute"),
]


@pytest.mark.long(keep=4)
@pytest.mark.parametrize(("family", "motion", "trouble"), PART)
def test_stop_brings_the_shaft_to_rest_or_says_that_it_turns(
    family: str, motion: str, trouble: str
) -> None:
    outcome = run_cell(family, motion, trouble)
    assert outcome.truthful, outcome
    assert outcome.held, outcome


def test_the_part_is_of_the_matrix() -> None:
    assert set(PART) <= set(cells())


def outcome(**parts: object) -> Outcome:
    values = {
        "family": "m6l", "motion": "jog", "trouble": "none", "verdict": "stopped",
        "answer_s": 0.3, "stood_s": 0.1, "degrees": 9.0, "shaft_rpm_at_answer": 0.0,
        "steps": (), "speed_reported": 0.0,
    }  # fmt: skip
    return Outcome(**{**values, **parts})  # type: ignore[arg-type]


def test_the_judge_sees_an_answer_that_is_not_the_shaft() -> None:
    assert outcome().held
    assert not outcome(stood_s=None).truthful
    assert not outcome(shaft_rpm_at_answer=300.0).truthful
    assert not outcome(verdict="still_moving").truthful
    assert not outcome(verdict="coasting", shaft_rpm_at_answer=90.0).held
    assert not outcome(verdict="unreachable", shaft_rpm_at_answer=90.0).truthful
