"""Reads and writes of a drive: what is checked, what is sent, what is trusted afterwards."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import chain, pairwise

import pytest
from pydantic import ValidationError

from backend.api.drive.models_parameters import ParameterWrite
from backend.axes.drive.drive import Drive
from backend.axes.drive.ports import Port
from backend.axes.drive.value_check import checked
from backend.tools.parameters import read_all
from drivers.errors import (
    DriveError,
    LinkTimeout,
    NotAllowed,
    NotAsked,
    NotInUse,
    OutOfRange,
    Rejected,
)
from drivers.link import Address
from drivers.texts.message import Text
from profiles.loader import load_profile
from tests.support.memory_link import MemoryLink


async def test_value_is_in_engineering_units(drive: Drive) -> None:
    reading = await drive.read("2005:03")
    assert (reading.raw, reading.value) == (400, 40.0)


async def test_write_returns_what_the_drive_has(drive: Drive, link: MemoryLink) -> None:
    link.loses_writes = True  # a drive that takes the telegram and keeps its value
    reading = await drive.write("2005:03", 500)
    assert link.written == [((0x2005, 3), (500).to_bytes(2, "little"))]
    assert reading.raw == 400


async def test_write_in_engineering_units(drive: Drive, link: MemoryLink) -> None:
    await drive.write("2005:03", 123.4, raw=False)
    assert link.objects[0x2005, 3] == (1234).to_bytes(2, "little")


@pytest.mark.parametrize(
    ("key", "value", "error", "words"),
    [
        ("6041:00", 1, NotAllowed, ["X axis", "6041:00", "read-only"]),
        ("2005:03", 9, OutOfRange, ["X axis", "2005:03", "0.9 Hz", "1.0 Hz", "500.0 Hz"]),
        ("2005:03", 5001, OutOfRange, ["500.1 Hz"]),
        ("2005:10", 2, OutOfRange, ["0 (manual), 1 (table)"]),
        ("2005:10", 1.5, OutOfRange, ["whole number"]),
        ("2005:10", "fast", OutOfRange, ["not a UINT16"]),
        ("2100:00", 40000, OutOfRange, ["40000 is outside -32768 to 32767"]),
        ("2100:00", math.nan, OutOfRange, ["2100:00", "nan"]),
        ("PA_38", 1, NotAllowed, ["only over Modbus"]),
        ("9999:00", 1, NotAllowed, ["no parameter 9999:00"]),
    ],
)
async def test_bad_values_never_reach_the_bus(
    drive: Drive, link: MemoryLink, key: str, value: float | str, error: type, words: list[str]
) -> None:
    with pytest.raises(error) as caught:
        await drive.write(key, value)
    assert not link.written
    for word in words:
        assert word in str(caught.value)


def test_a_refusal_in_chinese_names_parameter_and_values_in_chinese() -> None:
    mode, bandwidth = (load_profile("mms7").by_key[key] for key in ("2005:10", "2005:03"))
    with pytest.raises(OutOfRange) as caught:
        checked("X axis", "mms7", mode, 9)
    assert "Second gain adjustment mode: 9 is not one of its values: 0 (manual)" in str(
        caught.value
    )
    said = caught.value.text.words("zh")
    for english in ("manual", "stiffness", mode.name):
        assert english not in said
    assert "0（手动）" in said
    assert "2005:10 第二增益调整模式" in said
    assert caught.value.text == Text.from_wire(caught.value.text.to_wire())
    with pytest.raises(OutOfRange) as caught:
        checked("X axis", "mms7", bandwidth, 70000)
    assert "原始值" in caught.value.text.words("zh")
    assert " to " not in caught.value.text.words("zh")


async def test_set_at_stop_is_refused_while_enabled(drive: Drive, link: MemoryLink) -> None:
    link.objects[0x6041, 0] = b"\x37\x02"  # Operation enabled
    with pytest.raises(NotAllowed, match="while the motor is not enabled"):
        await drive.write("2100:00", 5)
    assert not link.written


async def test_lost_answer_of_a_write_that_acted_is_no_error(
    drive: Drive, link: MemoryLink
) -> None:
    link.write_errors = [LinkTimeout("no answer")]
    reading = await drive.write("2005:03", 600)
    assert reading.raw == 600
    assert len(link.written) == 1, "a write is never repeated"


async def test_lost_write_is_an_error_and_not_repeated(drive: Drive, link: MemoryLink) -> None:
    link.loses_writes = True
    link.write_errors = [LinkTimeout("no answer")]
    with pytest.raises(LinkTimeout, match="X axis: 2005:03 Speed bandwidth"):
        await drive.write("2005:03", 600)
    assert len(link.written) == 1


async def test_unsaved_and_pending_marks(drive: Drive) -> None:
    await drive.write("2005:03", 500)
    assert drive.unsaved == {"2005:03"}
    assert drive.pending == {"2005:03": "write_settings"}
    await drive.write("2005:03", 400)
    assert drive.unsaved == frozenset(), "back at what the memory holds"
    await drive.write("2005:03", 500)
    drive.mark_saved()
    drive.mark_applied("write_settings")
    assert not drive.unsaved
    assert not drive.pending


async def test_commands_are_never_unsaved(drive: Drive) -> None:
    with drive.authority.granted(drive.id, drive.name, "a test") as grant:
        await drive.energise("6040:00", 6, grant)
    await drive.write("200D:01", 0x65766173)
    assert not drive.unsaved


async def test_one_failure_does_not_spoil_a_batch(drive: Drive, link: MemoryLink) -> None:
    link.read_errors[0x2005, 0x10] = Rejected("refused", abort_code=0x06010001)
    readings = await drive.read_many(["2005:03", "2005:10", "PA_38", "2105:00"])
    assert readings["2005:03"].raw == 400
    assert readings["2005:10"].error == "refused"
    assert "Modbus" in readings["PA_38"].error
    assert readings["2105:00"].raw == 1


async def test_what_is_not_in_use_is_no_failure_and_no_value(
    drive: Drive, link: MemoryLink
) -> None:
    link.read_errors[0x2005, 0x10] = NotInUse("not in use: 2005:00 counts 3 entries")
    reported = await read_all(drive, ["2005:03", "2005:10"], lambda _share, _text: None)
    assert reported == {"read": 1, "failed": {}, "failed_messages": {}}
    reading = drive.readings["2005:10"]
    assert (reading.raw, reading.unused) == (None, True)
    assert "counts 3 entries" in reading.error


def test_no_object_is_cut_between_two_batches_on_ethercat(link: MemoryLink) -> None:
    """An object that is cut is read entry by entry, whatever the drive can."""
    profile = load_profile("mms7")
    parameters = [p for p in profile.parameters if p.index is not None]
    port = Port(link, 1, profile.link("ethercat"))
    link.kind = "ethercat"
    parts = port.batches(parameters)
    assert list(chain(*parts)) == sorted(parameters, key=lambda p: p.index or 0)
    where = [{p.index for p in part} for part in parts]
    assert len(parts) > 1
    assert not any(one & other for one, other in pairwise(where))
    assert all(len(part) >= 128 for part in parts[:-1])
    link.kind = "mlink"
    assert max(len(part) for part in port.batches(parameters)) < 20, "a stop waits for no more"


async def test_wrong_length_from_newer_firmware_is_reported(drive: Drive, link: MemoryLink) -> None:
    link.objects[0x2005, 3] = b"\1\2\3\4"
    readings = await drive.read_many(["2005:03"])
    assert "4 bytes were received for a UINT16" in readings["2005:03"].error


async def test_forgetting_leaves_nothing_to_believe(drive: Drive) -> None:
    await drive.write("2005:03", 500)
    drive.forget()
    assert not drive.readings
    assert not drive.unsaved
    assert not drive.pending


@pytest.mark.parametrize("field", ["raw", "value"])
def test_true_is_not_taken_for_one(field: str) -> None:
    """A script that sends a truth value meant something else than 1 increment per second."""
    assert ParameterWrite.model_validate({field: 1}).model_dump()[field] == 1
    with pytest.raises(ValidationError, match="give the number"):
        ParameterWrite.model_validate({field: True})


class Slow(MemoryLink):
    """Answers nothing while ``silent`` batches are left, and asks nothing after the first."""

    def __init__(self, objects: dict[tuple[int, int], bytes], silent: int) -> None:
        super().__init__(objects)
        self.silent = silent
        self.batches = 0

    async def read_many(
        self, station: int, addresses: Sequence[Address]
    ) -> list[bytes | DriveError]:
        self.batches += 1
        if self.silent:
            self.silent -= 1
            left = [NotAsked("nothing was asked")] * (len(addresses) - 1)
            return [LinkTimeout("no answer"), *left]
        return await super().read_many(station, addresses)


def slow(silent: int) -> tuple[Drive, Slow, list[str]]:
    """An MMS7 and its list of many batches."""
    profile = load_profile("mms7")
    numbers = [p for p in profile.parameters if p.type == "UINT16" and p.access != "wo"]
    link = Slow({(p.index or 0, p.subindex or 0): b"\1\0" for p in numbers}, silent)
    drive = Drive("x", "X axis", profile, [Port(link, 1, profile.link("mlink"))])
    return drive, link, [p.key for p in numbers]


async def test_a_drive_that_answers_nothing_is_not_asked_for_a_whole_list() -> None:
    drive, link, keys = slow(silent=1000)
    readings = await drive.read_many(keys)
    assert len(readings) == len(keys) > 100
    assert all(reading.error for reading in readings.values())
    assert link.batches == 4


async def test_what_was_left_out_while_a_drive_was_slow_is_read_in_the_end() -> None:
    drive, _, keys = slow(silent=2)
    reported: list[float] = []
    readings = await drive.read_many(keys, lambda share, _: reported.append(share))
    late = [key for key, reading in readings.items() if reading.error]
    assert late == [keys[0], keys[16]], "only those that the drive was asked for and did not answer"
    assert reported == sorted(reported)
    assert reported[-1] == 1.0
