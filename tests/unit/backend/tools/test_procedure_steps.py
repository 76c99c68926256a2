"""What each step of a procedure is called, in both languages."""

from __future__ import annotations

from backend.tools.moving.moves.procedures import describe
from profiles.schema import Procedure

_PROCEDURE = Procedure.model_validate(
    {
        "name": "save",
        "title": "Save",
        "help": "x",
        "source": "001:1",
        "steps": [
            {"do": "confirm", "text": "The load is free."},
            {"do": "rewrite"},
            {"do": "write", "key": "2005:03", "raw": 0x65766173},
            {"do": "write", "key": "2005:10", "raw": "save"},
            {"do": "wait", "seconds": 1.5},
            {"do": "poll", "key": "2005:03", "equals": 1, "timeout_s": 10},
            {"do": "reconnect", "timeout_s": 30},
        ],
    }
)


def test_each_step_is_a_message_in_both_languages() -> None:
    steps = describe(_PROCEDURE)
    assert [step.words() for step in steps] == [
        "you confirm: The load is free.",
        "write again what was changed since the last save",
        "write 0x65766173 to 2005:03",
        "write save to 2005:10",
        "do not access the drive for 1.5 s",
        "wait until 2005:03 is 1 (≤ 10 s)",
        "wait until the drive answers again (≤ 30 s)",
    ]
    chinese = [step.words("zh") for step in steps]
    assert "写入 2005:03" in chinese[2]
    assert not any(en == zh for en, zh in zip([s.words() for s in steps], chinese, strict=True))
