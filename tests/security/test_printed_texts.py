"""What a drive is called and what is noted of it goes to logs, lists and reports: one is a line."""

from __future__ import annotations

import pytest

from tests.security.conftest import Cast


@pytest.mark.parametrize("sign", ["\r", "\n", "\0", "\x1b", "\x7f", "\x85", "\u2028", "\u202e"])
def test_a_name_holds_no_control_characters(cast: Cast, sign: str) -> None:
    before = cast.operator.ok("GET", "/drives/x")["name"]
    answer = cast.operator.ask("PATCH", "/drives/x", json={"name": f"X{sign}axis"})
    assert answer.status_code == 422, answer.text
    assert f"sign 2 (U+{ord(sign):04X})" in answer.text
    assert cast.operator.ok("GET", "/drives/x")["name"] == before
    asked = {"url": "mlink:/dev/none", "station": 2, "profile": "mms7", "name": f"Y{sign}"}
    answer = cast.operator.ask("POST", "/drives", json=asked)
    assert answer.status_code == 422, answer.text


@pytest.mark.parametrize("sign", ["\r", "\0", "\t", "\x1b", "\u2028", "\u202e"])
def test_notes_hold_lines_and_no_other_control_characters(cast: Cast, sign: str) -> None:
    answer = cast.operator.ask("PATCH", "/drives/x", json={"notes": f"belt{sign}new"})
    assert answer.status_code == 422, answer.text


def test_printable_names_and_lines_are_taken(cast: Cast) -> None:
    before = cast.operator.ok("GET", "/drives/x")
    given = {"name": "X\u3000轴 – Ω", "notes": "belt new\n2026-03-01: gains"}
    now = cast.operator.ok("PATCH", "/drives/x", given)
    assert (now["name"], now["notes"]) == (given["name"], given["notes"])
    cast.operator.ok("PATCH", "/drives/x", {"name": before["name"], "notes": before["notes"]})
