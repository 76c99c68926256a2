"""No file makes the readers crash or hang: they return a profile or say why not."""

from __future__ import annotations

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from importer_samples import GOOD_EDS, GOOD_ESI, ODD_EDS

from profiles.importer import ImportFailed, import_file
from profiles.schema import INTEGER_RANGE, Profile

_ALL_EDS = GOOD_EDS + "\n".join(ODD_EDS.values())
_VALUES = st.sampled_from(
    ["", "0", "-1", "0x", "0xFFFFFFFFFFFFFFFF", "1e999", "nan", "$NODEID", "9" * 50, "０x１", "\0",
     "0x1B", "08", "254", "#x6040", "ARRAY [0..999] OF UINT", "DT6099", "&lt;", "١٢", "-0x1"]
)  # fmt: skip


def survive(data: bytes) -> None:
    try:
        profile = import_file(data, "fuzz").profile
    except ImportFailed:
        return
    _check(profile)


def _check(profile: Profile) -> None:
    for parameter in profile.parameters:
        low, high = INTEGER_RANGE.get(parameter.type, (None, None))
        for value in (parameter.min_raw, parameter.max_raw, parameter.default_raw):
            if low is not None and high is not None and value is not None:
                assert isinstance(value, int)
                assert low <= value <= high


@given(st.binary(max_size=3000))
def test_any_bytes(data: bytes) -> None:
    survive(data)


@pytest.mark.long
@settings(deadline=None, max_examples=150)
@given(st.randoms(use_true_random=False), st.booleans())
def test_damaged_files(chance: random.Random, eds: bool) -> None:
    data = bytearray((_ALL_EDS if eds else GOOD_ESI).encode())
    for _ in range(chance.randint(1, 12)):
        start = chance.randrange(len(data))
        action = chance.randrange(3)
        if action == 0:
            data[start] = chance.randrange(256)
        elif action == 1:
            del data[start : start + chance.randint(1, 60)]
        else:
            data[start:start] = data[start : start + chance.randint(1, 60)]
    survive(bytes(data))


@pytest.mark.long
@settings(deadline=None, max_examples=150)
@given(st.data())
def test_odd_values_in_eds_files(data: st.DataObject) -> None:
    lines = _ALL_EDS.splitlines()
    for _ in range(data.draw(st.integers(1, 10))):
        number = data.draw(st.integers(0, len(lines) - 1))
        key, equals, _old = lines[number].partition("=")
        if equals:
            lines[number] = f"{key}={data.draw(_VALUES)}"
    survive("\n".join(lines).encode("utf-8", "replace"))


@pytest.mark.long
@settings(deadline=None, max_examples=150)
@given(st.data())
def test_odd_values_in_esi_files(data: st.DataObject) -> None:
    parts = GOOD_ESI.split(">")
    for _ in range(data.draw(st.integers(1, 10))):
        number = data.draw(st.integers(1, len(parts) - 2))
        text, mark, tag = parts[number].partition("<")
        if text.strip() and mark:
            parts[number] = data.draw(_VALUES).replace("\0", "") + mark + tag
    survive(">".join(parts).encode())
