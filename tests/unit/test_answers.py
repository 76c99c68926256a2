"""Answers of tools carry messages next to their sentences; older ones the sentences alone."""

from __future__ import annotations

import json

from backend.tools.mechanics.inertia.result import InertiaAnswer, InertiaIntervals
from backend.tools.spoken import result_in_language
from drivers.texts.answers import in_language, sentence, sentences
from drivers.texts.message import joined, text

LOW = text("sweep.coherence-low")
LEFT_OUT = text("sweep.periods-left-out", periods=3)
NOTHING = (None, None)


def test_sentences_stand_beside_their_messages_and_survive_a_file() -> None:
    answer = json.loads(json.dumps(sentences("warnings", [LOW, LEFT_OUT], "warning")))
    assert answer["warnings"][1] == "3 periods had lost samples and were left out"
    chinese = in_language(answer, "zh")
    assert chinese["warnings"] == [
        "相干性偏低：请增大激励，或检查间隙和摩擦",
        "3 个周期因丢失采样而被舍弃",
    ]
    assert in_language(chinese, "en") == answer


def test_a_message_within_a_list_of_answers_and_one_alone() -> None:
    answer = {"slots": [sentence("note", text("notch.no-depth")), sentence("note", None)]}
    assert in_language(answer, "zh")["slots"] == [
        {**answer["slots"][0], "note": "手册未给出深度"},
        answer["slots"][1],
    ]


def test_a_file_of_an_older_version_is_shown_as_it_stands() -> None:
    answer = {"warnings": ["coherence is low"], "notes": [], "unit": "1"}
    assert in_language(answer, "zh") == answer


def inertia(**other: object) -> InertiaAnswer:
    ends = InertiaIntervals(
        inertia_kgm2=NOTHING,
        viscous_nms=NOTHING,
        coulomb_nm=NOTHING,
        gravity_nm=NOTHING,
        load_ratio=None,
    )
    plain = {
        "method": "host", "inertia_kgm2": None, "viscous_nms": None, "coulomb_nm": None,
        "gravity_nm": None, "load_ratio": None, "ci95": ends, "r2": 0.0, "identifiable": False,
        "unit": "SI", "ends_rev": None, "motion_s": 1.0,
    }  # fmt: skip
    return InertiaAnswer.model_validate({**plain, **other})


def test_reasons_of_an_inertia_are_said_in_both_languages() -> None:
    found = inertia(reasons=("at-limit", "backlash"), load_ratio_reference="given")
    lines = found.in_language("zh").verdict.splitlines()
    assert lines == [
        "转矩达到限值：请提高限值或降低加速度",
        "每次转矩换向后出现冲击：传动链存在间隙",
    ]
    shown = result_in_language(found.model_dump(mode="json"), "zh")
    assert shown["load_ratio_against"] == "输入的电机惯量"


def test_an_inertia_of_an_older_version_keeps_its_words() -> None:
    old = inertia(verdict="the torque was at its limit", load_ratio_against="the motor")
    assert old.in_language("zh") == old


def test_several_messages_are_joined_as_each_language_does() -> None:
    both = joined([LOW, LEFT_OUT])
    assert both.words("en").count("; ") == 1
    assert both.words("zh").count("；") == 1


def test_a_number_of_any_length_is_written() -> None:
    for number in (10**18 - 1, 10**18, -(10**30), 10**300):
        shown = text("sets.row-no-value", row=number, raw="x")
        assert str(number) in shown.words("en")
        assert str(number) in shown.words("zh")
