"""A profile as an ESI file: an independent reader finds in it what the maker's file had."""

from __future__ import annotations

from xml.etree import ElementTree

import pytest

from profiles import load_profile
from profiles.importer import export_esi, import_file
from profiles.schema import Parameter
from tests.wire.makers_files.samples import SAMPLES
from tests.wire.makers_files.strict_slave import File

_FIELDS = ("type", "access", "pdo", "default_raw", "min_raw", "max_raw", "name")
_REGISTERS = ("Reg0400", "Reg0410", "Reg0420")


def read(data: bytes) -> File:
    device = ElementTree.fromstring(data).find("Descriptions/Devices/Device")
    assert device is not None
    return File(device)


def told(parameter: Parameter) -> dict[str, object]:
    return {name: getattr(parameter, name) for name in _FIELDS}


@pytest.mark.parametrize("name", SAMPLES)
def test_the_way_to_operational_is_that_of_the_makers_file(name: str) -> None:
    """Compared by the reader of the strict slave, which shares nothing with the importer."""
    original = SAMPLES[name]
    exported = export_esi(import_file(original, "a.xml").profile)
    ours, theirs = read(exported), read(original)
    assert ours.pdos == theirs.pdos
    assert ours.managers == theirs.managers
    assert ours.modes == theirs.modes
    assert ours.commands == theirs.commands
    assert [ours.register(n) for n in _REGISTERS] == [theirs.register(n) for n in _REGISTERS]
    for flag in ("SdoInfo", "PdoAssign", "PdoConfig", "PdoUpload", "CompleteAccess"):
        said = [None if f.coe is None else f.coe.get(flag) for f in (ours, theirs)]
        assert len({{"true": "1", "false": "0"}.get(str(s), s) for s in said}) == 1, flag


@pytest.mark.parametrize("name", SAMPLES)
def test_it_imports_as_the_same_profile(name: str) -> None:
    before = import_file(SAMPLES[name], "a.xml").profile
    data = export_esi(before)
    after = import_file(data, "a.xml").profile
    assert after.bring_up == before.bring_up
    assert after.pdo == before.pdo
    assert after.identity == before.identity
    assert [told(p) for p in after.parameters] == [told(p) for p in before.parameters]
    assert export_esi(after) == data


@pytest.mark.parametrize("family", ["mms7", "m6l", "r6l", "ep3e", "el7"])
def test_objects_of_a_family(family: str) -> None:
    profile = load_profile(family)
    taken = import_file(export_esi(profile), "a.xml").profile
    objects = {p.key: p for p in profile.parameters if p.index is not None}
    # A count of subindices is no value of its own; it is written and read as such.
    keys = set(taken.by_key)
    assert {key for key in objects if key not in keys} <= {k for k in objects if k.endswith(":00")}
    for key in keys & set(objects):
        ours, theirs = taken.by_key[key], objects[key]
        assert (ours.type, ours.min_raw, ours.max_raw) == (
            theirs.type, theirs.min_raw, theirs.max_raw,
        ) or theirs.min_raw == theirs.max_raw == 0, key  # fmt: skip
        if not isinstance(theirs.default_raw, str):
            assert ours.default_raw == theirs.default_raw, key
