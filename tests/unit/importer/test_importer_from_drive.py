"""A profile from what a drive lists of itself."""

from __future__ import annotations

from typing import Any

import pytest
from importer_samples import GOOD_EDS

from backend.station.drives.description import dictionary_entries, profile_of_drive
from drivers.errors import NotAllowed, Rejected
from drivers.link import Address, Found
from drivers.objects.dictionary import EntryDescription, ObjectInfo
from drivers.urls import bus_kind
from profiles.importer import ImportFailed

REPORTED: list[EntryDescription | ObjectInfo] = [
    ObjectInfo(0x6040, "Controlword", 6, 7, 0),
    EntryDescription(0x6040, 0, 6, 16, 0x7F, "Controlword"),
    ObjectInfo(0x6041, "Statusword", 6, 7, 0),
    EntryDescription(0x6041, 0, 6, 16, 0x87, "Statusword"),
    ObjectInfo(0x6091, "Gear ratio", 7, 9, 2),
    EntryDescription(0x6091, 0, 5, 8, 0x07, "SubIndex 000"),
    EntryDescription(0x6091, 1, 7, 32, 0x3F, "Motor revolutions", default=b"\x01\0\0\0"),
    EntryDescription(0x6091, 2, 7, 32, 0x3F, "Shaft revolutions"),
]


class FakeEthercat:
    kind = "ethercat"
    traits = bus_kind("ethercat").traits

    def __init__(self, reported: list[EntryDescription | ObjectInfo]) -> None:
        self.reported = reported

    async def enumerate(self, station: int, progress: Any) -> list[EntryDescription | ObjectInfo]:
        assert station == 4
        return self.reported


FOUND = Found(station=4, vendor_id=0xA2B, product_code=0x190, revision=2, name="ES4")


async def test_the_drives_list_becomes_a_profile() -> None:
    link: Any = FakeEthercat(REPORTED)
    imported = await profile_of_drive(link, FOUND, "my_es4", lambda *_: None)
    profile = imported.profile
    assert profile.drive == "my_es4"
    assert (profile.identity.vendor_id, profile.identity.product_code) == (0xA2B, 0x190)
    assert list(profile.by_key) == ["6040:00", "6041:00", "6091:01", "6091:02"]
    gear = profile.by_key["6091:01"]
    assert (gear.name, gear.default_raw) == ("Gear ratio: Motor revolutions", 1)
    assert profile.by_role["control_word"].pdo == "rx"


async def test_a_drive_that_lists_nothing_is_reported() -> None:
    link: Any = FakeEthercat([])
    with pytest.raises(ImportFailed, match=r"description.no-objects-listed"):
        await profile_of_drive(link, FOUND, "x", lambda *_: None)


class FakeCanopen:
    """A node with some objects; the others are aborted as CiA 301 says."""

    kind = "canopen"
    traits = bus_kind("canopen").traits

    def __init__(self, objects: dict[int, bytes]) -> None:
        self.objects = objects

    async def read(self, station: int, address: Address) -> bytes:
        assert station == 4
        assert address.index is not None
        if address.index not in self.objects:
            raise Rejected("the object does not exist", abort_code=0x06020000)
        return self.objects[address.index]


async def test_a_canopen_drive_may_carry_its_own_eds() -> None:
    link: Any = FakeCanopen({0x1021: GOOD_EDS.encode(), 0x1022: b"\0"})
    imported = await profile_of_drive(link, FOUND, "carried", lambda *_: None)
    assert imported.profile.drive == "carried"
    assert imported.profile.identity.product_code == 0x190
    assert imported.profile.by_key["2010:00"].unit == "1/s"


async def test_plain_text_is_taken_where_no_format_is_reported() -> None:
    link: Any = FakeCanopen({0x1021: GOOD_EDS.encode()})
    assert (await profile_of_drive(link, FOUND, "carried", lambda *_: None)).profile.parameters


async def test_a_packed_eds_is_not_guessed_at() -> None:
    link: Any = FakeCanopen({0x1021: b"\x1f\x8b", 0x1022: b"\x80"})
    with pytest.raises(NotAllowed, match="own format"):
        await profile_of_drive(link, FOUND, "x", lambda *_: None)


async def test_canopen_has_no_such_service() -> None:
    link: Any = FakeCanopen({})
    with pytest.raises(NotAllowed, match="cannot list its own objects") as refused:
        await profile_of_drive(link, FOUND, "x", lambda *_: None)
    assert "EDS" in (refused.value.remedy or "")


def test_entries_without_an_object_are_kept() -> None:
    entries = dictionary_entries([EntryDescription(0x2000, 0, 6, 16, 7, "Alone")])
    assert [(e.name, e.object_name, e.members) for e in entries] == [("Alone", "", 0)]
