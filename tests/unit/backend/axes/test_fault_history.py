"""The drive's own fault record: slots, selectors, and records that nobody can read."""

from __future__ import annotations

from typing import Any

import pytest

from backend.axes.axis.axis import Axis
from backend.axes.axis.fault_history import named_fault, read_history
from backend.axes.drive.drive import Drive
from backend.axes.drive.ports import Port
from backend.station.drives.connected_drive import ConnectedDrive
from backend.station.recording.facts import past_faults
from drivers.errors import NotAllowed, Rejected
from drivers.link import Address
from profiles import load_profile
from profiles.functions import FaultHistory, Functions, HistorySlot
from profiles.schema import Fault, Parameter, Profile
from tests.support.memory_link import MemoryLink
from tests.unit.backend.conftest import SPEC, changed

#: A support bundle asks the drive, not what the monitor last saw of it.
NO_MONITOR: Any = None


def _with(profile: Profile, history: FaultHistory | None) -> Profile:
    keys = ("200A:13", "200A:14", "200A:16", "200D:24", "200D:25", "200D:2A")
    extra = tuple(
        Parameter(key=key, name=key, group="Faults", type="UINT16", source="t") for key in keys
    )
    fault = Fault(code="Er.002", name="Overvoltage", causes=("a",), remedies=("b",), source="t")
    return changed(
        profile,
        parameters=(*profile.parameters, *extra),
        faults=(fault,),
        functions=Functions(history=history),
    )


def _axis(profile: Profile, link: MemoryLink, history: FaultHistory | None) -> Axis:
    return Axis(Drive("x", "X axis", _with(profile, history), [Port(link, 1, SPEC)]))


def _slots() -> FaultHistory:
    return FaultHistory(
        kind="slots",
        size=2,
        code_format="Er.{:03d}",
        source="t",
        slots=(
            HistorySlot(name="last fault", code_key="200A:13", fields=("200A:16",)),
            HistorySlot(name="second fault", code_key="200A:14"),
        ),
    )


async def test_slots_with_snapshots(profile: Profile, link: MemoryLink) -> None:
    link.objects |= {(0x200A, 0x13): b"\2\0", (0x200A, 0x14): b"\0\0", (0x200A, 0x16): b"\x37\1"}
    (past,) = await read_history(_axis(profile, link, _slots()))
    assert (past.name.words(), past.code, past.code_text) == ("last fault", 2, "Er.002")
    assert past.fault is not None
    assert past.fault.name == "Overvoltage"
    assert [value.raw for value in past.values] == [0x137]
    assert link.written == []


async def test_a_code_that_is_not_in_the_profile_is_shown_as_it_is(
    profile: Profile, link: MemoryLink
) -> None:
    link.objects |= {(0x200A, 0x13): b"\x63\0", (0x200A, 0x14): b"\0\0", (0x200A, 0x16): b"\0\0"}
    (past,) = await read_history(_axis(profile, link, _slots()))
    assert (past.code_text, past.fault) == ("Er.099", None)


async def test_an_unreadable_slot_says_so_and_the_others_are_read(
    profile: Profile, link: MemoryLink
) -> None:
    link.objects |= {(0x200A, 0x14): b"\2\0", (0x200A, 0x16): b"\0\0"}
    first, second = await read_history(_axis(profile, link, _slots()))
    assert first.code is None
    assert first.problem is not None
    assert "does not exist" in first.problem.words()
    assert second.code == 2


class Recorder(MemoryLink):
    """A drive that shows another record for each selected number."""

    RECORDS = ((2, 310), (7, 305), (0, 0))

    async def write(self, station: int, address: Address, data: bytes) -> None:
        await super().write(station, address, data)
        if (address.index, address.subindex) == (0x200D, 0x24):
            code, volts = self.RECORDS[int.from_bytes(data, "little")]
            self.objects[0x200D, 0x25] = code.to_bytes(2, "little")
            self.objects[0x200D, 0x2A] = volts.to_bytes(2, "little")


def _selected(size: int = 3) -> FaultHistory:
    return FaultHistory(
        kind="selected",
        size=size,
        select_key="200D:24",
        code_key="200D:25",
        fields=("200D:2A",),
        code_format="Er.{:03d}",
        source="t",
    )


async def test_a_selector_brings_every_record_and_is_put_back(
    profile: Profile, link: MemoryLink
) -> None:
    recorder = Recorder({**link.objects, (0x200D, 0x24): b"\1\0"})
    axis = _axis(profile, recorder, _selected())
    found = await read_history(axis)
    assert [(past.name.words("zh"), past.code_text) for past in found] == [
        ("记录 0", "Er.002"),
        ("记录 1", "Er.007"),
    ]
    assert [past.values[0].raw for past in found] == [310, 305]
    assert recorder.objects[0x200D, 0x24] == b"\1\0"
    assert axis.drive.unsaved == frozenset()


async def test_a_selector_that_is_refused_is_put_back(profile: Profile, link: MemoryLink) -> None:
    recorder = Recorder({**link.objects, (0x200D, 0x24): b"\2\0"})
    recorder.write_errors.append(Rejected("no", abort_code=0x06090030))
    with pytest.raises(Rejected):
        await read_history(_axis(profile, recorder, _selected()))
    assert recorder.objects[0x200D, 0x24] == b"\2\0"


@pytest.mark.parametrize(
    "history", [None, FaultHistory(kind="unreadable", size=20, source="t")], ids=["none", "hidden"]
)
async def test_nothing_is_pretended(
    profile: Profile, link: MemoryLink, history: FaultHistory | None
) -> None:
    with pytest.raises(NotAllowed, match="no fault history"):
        await read_history(_axis(profile, link, history))


async def test_a_support_bundle_takes_what_reading_alone_brings(
    profile: Profile, link: MemoryLink
) -> None:
    link.objects |= {(0x200A, 0x13): b"\2\0", (0x200A, 0x14): b"\0\0", (0x200A, 0x16): b"\x37\1"}
    axis = _axis(profile, link, _slots())
    found = await past_faults(ConnectedDrive(axis.drive, axis, NO_MONITOR), timeout_s=5)
    (record,) = found["records"]
    assert (record["code"], record["title"], record["values"][0]["value"]) == (
        "Er.002",
        "Overvoltage",
        0x137,
    )
    axis = _axis(profile, link, _selected())
    found = await past_faults(ConnectedDrive(axis.drive, axis, NO_MONITOR), timeout_s=5)
    assert found["records"] == []
    assert "writing 200D:24" in found["why"]
    assert link.written == [], "nobody asked for a write"


def test_codes_of_the_families() -> None:
    m6l = load_profile("m6l")
    assert m6l.functions.history is not None
    found = named_fault(m6l.faults, m6l.functions.history, 2)
    assert found is not None
    assert found.name == "Drive main circuit overvoltage"  # 000:3845
    # CiA 301: the low word of 1003h is the error code of 603Fh.
    standard = FaultHistory(kind="slots", size=1, source="t")
    over_voltage = Fault(code="x", name="DC link over-voltage", code_raw=0x3210, source="t")
    assert named_fault([over_voltage], standard, 0x0001_3210) is over_voltage
