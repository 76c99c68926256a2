"""Help of CiA 402 objects where a profile has none of its own."""

from __future__ import annotations

import pytest
import yaml

from profiles import load_profile
from profiles.language.standard_help import HELP_FILE

KNOWN: dict[str, str] = yaml.safe_load(HELP_FILE.read_text("utf-8"))


def test_every_entry_is_an_object_of_the_standard() -> None:
    assert set(KNOWN) <= set(load_profile("generic402").by_key)


@pytest.mark.parametrize("family", ["mms7", "ds_c", "ep3e", "m6l", "r6l", "el7", "generic402"])
def test_no_writable_object_of_the_table_is_without_help(family: str) -> None:
    without = [
        p.key
        for p in load_profile(family).parameters
        if p.key in KNOWN and p.access != "ro" and not p.help
    ]
    assert without == []


@pytest.mark.parametrize("family", ["mms7", "ds_c", "ep3e", "m6l", "r6l", "el7", "generic402"])
def test_every_writable_parameter_has_help(family: str) -> None:
    parameters = load_profile(family).parameters
    assert [p.key for p in parameters if p.access != "ro" and not p.help] == []


def test_the_help_of_a_profile_comes_first() -> None:
    ours = load_profile("m6l").by_key["605A:00"].help
    assert ours
    assert ours != KNOWN["605A:00"]
