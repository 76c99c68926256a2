"""Descriptions of the families' functions, and their completion from standard objects."""

from __future__ import annotations

import pytest

from backend.axes.drive.catalog import functions_of
from profiles import load_all, load_profile
from profiles.schema import Parameter, Profile
from tests.unit.backend.conftest import changed

PROFILES = load_all()


@pytest.mark.parametrize("name", sorted(PROFILES))
def test_terminals_that_are_overruled_or_shown_exist(name: str) -> None:
    profile = PROFILES[name]
    known = {terminal.name for terminal in profile.terminals}
    facts = profile.functions.terminals
    places = [*facts.states, *facts.polarities]
    for forcing in facts.forcing:
        places += [place for place in (forcing.enable, forcing.value) if place is not None]
        if forcing.enable is not None:
            assert forcing.enable.bits.keys() == forcing.value.bits.keys()
    for place in places:
        assert place.bits.keys() <= known, place.key


@pytest.mark.parametrize("name", sorted(PROFILES))
def test_polarity_bits_agree_with_the_labels_of_the_parameter(name: str) -> None:
    profile = PROFILES[name]
    for place in profile.functions.terminals.polarities:
        labels = profile.by_key[place.key].bits
        for terminal, bit in place.bits.items():
            assert labels[str(bit)].startswith(terminal), place.key


@pytest.mark.parametrize("name", sorted(PROFILES))
def test_state_bits_agree_with_the_labels_of_the_parameter(name: str) -> None:
    profile = PROFILES[name]
    for place in profile.functions.terminals.states:
        labels = profile.by_key[place.key].bits
        for terminal, bit in place.bits.items():
            same = {terminal, terminal.replace("DI", "IN", 1)}
            assert labels[str(bit)].split()[0] in same, place.key


@pytest.mark.parametrize("name", sorted(PROFILES))
def test_procedures_and_faults_of_guides_exist(name: str) -> None:
    profile = PROFILES[name]
    codes = {fault.code for fault in profile.faults}
    for guide in profile.functions.guides:
        assert set(guide.failures) <= codes


@pytest.mark.parametrize("name", sorted(PROFILES))
def test_no_parameter_stands_twice_in_one_gain_block(name: str) -> None:
    blocks = PROFILES[name].functions.gain_blocks
    for block in blocks:
        assert len(set(block.keys)) == len(block.keys)
    keys = [key for block in blocks for key in block.keys]
    assert len(set(keys)) == len(keys)


def test_m6l_remembers_three_faults_with_thirteen_values_each() -> None:
    # 000:3497 and drives.md.
    history = load_profile("m6l").functions.history
    assert history is not None
    assert [len(slot.fields) for slot in history.slots] == [13, 13, 13]


def test_r6l_remembers_ten_faults_behind_a_selector() -> None:
    history = load_profile("r6l").functions.history
    assert history is not None
    assert (history.kind, history.size, history.select_key) == ("selected", 10, "200D:24")


def test_mms7_keeps_twenty_faults_that_nobody_can_read() -> None:
    history = load_profile("mms7").functions.history
    assert history is not None
    assert (history.kind, history.size) == ("unreadable", 20)


def test_an_imported_drive_gets_the_functions_of_its_standard_objects(profile: Profile) -> None:
    extra = tuple(
        Parameter(key=key, name=key, group="402", type="UINT32", source="t")
        for key in ("1003:01", "1003:02", "605A:00", "60F2:00", "60B8:00", "60B9:00", "60BA:00")
    )
    imported = changed(profile, parameters=(*profile.parameters, *extra))
    functions = functions_of(imported)
    assert {group.name for group in functions.groups} == {"stopping", "modulo"}
    assert functions.history is not None
    assert [slot.code_key for slot in functions.history.slots] == ["1003:01", "1003:02"]
    assert functions.probe is not None
    assert functions.probe.probes[0].rising_key == "60BA:00"
    assert len(functions.probe.probes) == 1


def test_a_drive_without_such_objects_gets_none(profile: Profile) -> None:
    functions = functions_of(profile)
    assert functions.groups == ()
    assert functions.history is None
    assert functions.probe is None
