"""Errors in a person's own profile are one message, and hide no other drive."""

from __future__ import annotations

from pathlib import Path

import pytest
from importer_samples import GOOD_EDS

from profiles.importer import import_file
from profiles.importer.files import profile_yaml
from profiles.language.overlay import parse_overlay
from profiles.loader import ProfileError, broken_profiles, load_all, parse_profile

ODD = [
    "manual: 2024-13-45",  # YAML takes it for a date, of which there is no month 13
    f"manual: {'1' * 5000}",
    "quirks: [{kind: no_watchdog, help: a, source: b}]\nnotes:",
    "quirks: [{kind: no_watchdog, help: a, source: b}]\nnotes: 5",
]


@pytest.mark.parametrize("line", ODD[:2])
def test_a_value_that_yaml_cannot_read_is_named_with_its_file(
    line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SERVODECK_PROFILES", str(tmp_path))
    monkeypatch.setenv("SERVODECK_CACHE", str(tmp_path / "cache"))
    folder = tmp_path / "mine"
    folder.mkdir()
    text = profile_yaml(import_file(GOOD_EDS.encode(), "g.eds").profile)
    (folder / "profile.yaml").write_text(text + line + "\n", "utf-8")
    assert [error.code for error in broken_profiles().values()] == ["profile.no-yaml"]
    assert "generic402" in load_all()


def test_notes_of_an_old_profile_that_are_left_empty() -> None:
    text = profile_yaml(import_file(GOOD_EDS.encode(), "g.eds").profile)
    profile = parse_profile({"profile.yaml": f"{text}{ODD[2]}\n"})
    assert [note.help for note in profile.notes] == ["a"]
    with pytest.raises(ProfileError, match=r"profile.refused"):
        parse_profile({"profile.yaml": f"{text}{ODD[3]}\n"})


@pytest.mark.parametrize("line", ODD[:2])
def test_the_same_in_a_translation(line: str) -> None:
    with pytest.raises(ProfileError, match=r"profile.no-yaml"):
        parse_overlay("mine/zh", {"a.yaml": line})


def test_texts_given_twice_under_keys_of_two_kinds() -> None:
    texts = dict.fromkeys(("a", "b"), "homing_methods:\n  1: {name: a}\n  b: {name: c}\n")
    with pytest.raises(ProfileError, match=r"profile.text-twice"):
        parse_overlay("mine/zh", texts)


def test_a_name_pattern_that_is_no_expression_is_named_when_it_is_loaded() -> None:
    """It ended the search for the profiles of every drive that was found."""
    text = profile_yaml(import_file(GOOD_EDS.encode(), "g.eds").profile)
    text = text.replace("identity:\n", "identity:\n  name_patterns: ['servo (']\n")
    with pytest.raises(ProfileError, match=r"name_patterns.*unterminated"):
        parse_profile({"profile.yaml": text})
