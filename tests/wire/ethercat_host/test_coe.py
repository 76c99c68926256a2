"""SDO bytes against ETG.1000.6 clause 5.6.2, and what unusual slaves send."""

from __future__ import annotations

import struct

import pytest

from drivers.errors import LinkLost, LinkTimeout, NotInUse, ProtocolError, Rejected
from drivers.ethercat.process.stations.station import Station
from drivers.ethercat.wire import coe as sdo
from drivers.ethercat.wire import information
from drivers.ethercat.wire.reading import read_items
from tests.wire.ethercat_host.scripted import ScriptedSlave, coe


def expedited(index: int, sub: int, data: bytes) -> bytes:
    return coe(
        3, struct.pack("<BHB", 0x43 | (4 - len(data)) << 2, index, sub) + data.ljust(4, b"\0")
    )


def test_expedited_upload_sends_and_takes_the_bytes_of_the_standard() -> None:
    slave = ScriptedSlave(lambda _: [expedited(0x6041, 0, b"\x37\x02")])
    assert slave.run(sdo.upload(slave.box(), 0x6041, 0)) == b"\x37\x02"
    assert slave.requests == [bytes.fromhex("0020 40 4160 00 00000000")]


def test_normal_upload_in_one_mail() -> None:
    text = b"MMS7 servo drive"
    slave = ScriptedSlave(
        lambda _: [coe(3, struct.pack("<BHBI", 0x41, 0x1008, 0, len(text)) + text)]
    )
    assert slave.run(sdo.upload(slave.box(), 0x1008, 0)) == text


def test_segmented_upload_alternates_the_toggle_bit() -> None:
    whole = bytes(range(200))
    parts = [whole[:100], whole[100:195], whole[195:]]

    def react(request: bytes) -> list[bytes]:
        if request[2] == 0x40:
            return [coe(3, struct.pack("<BHBI", 0x41, 0x2000, 1, len(whole)) + parts[0])]
        if request[2] == 0x60:
            return [coe(3, b"\x00" + parts[1])]
        assert request[2] == 0x70
        # Five bytes: padded to seven, bits 1–3 say that two are unused, bit 0 ends it.
        return [coe(3, bytes([0x10 | 2 << 1 | 1]) + parts[2] + b"\0\0")]

    slave = ScriptedSlave(react)
    assert slave.run(sdo.upload(slave.box(), 0x2000, 1)) == whole


def test_a_slave_that_dies_between_segments_is_reported_and_does_not_hang() -> None:
    slave: ScriptedSlave

    def react(request: bytes) -> list[bytes]:
        if request[2] == 0x40:
            return [coe(3, struct.pack("<BHBI", 0x41, 0x2000, 1, 500) + bytes(100))]
        slave.alive = False
        return []

    slave = ScriptedSlave(react)
    with pytest.raises(LinkLost, match="no longer answers"):
        slave.run(sdo.upload(slave.box(), 0x2000, 1))
    assert slave.now < 0.1


def test_more_segments_than_announced_end_the_transfer() -> None:
    def react(request: bytes) -> list[bytes]:
        if request[2] == 0x40:
            return [coe(3, struct.pack("<BHBI", 0x41, 0x2000, 1, 10) + bytes(5))]
        return [coe(3, bytes([request[2] & 0x10]) + bytes(90))] if request[2] != 0x80 else []

    slave = ScriptedSlave(react)
    with pytest.raises(ProtocolError, match="more than the 10 bytes"):
        slave.run(sdo.upload(slave.box(), 0x2000, 1))
    assert slave.requests[-1][2] == 0x80, "the slave is reported"


@pytest.mark.parametrize("service", [2, 3])
@pytest.mark.parametrize("command", [0x80, 0x84, 0x90])
def test_aborts_are_understood_whatever_service_and_low_bits(service: int, command: int) -> None:
    body = struct.pack("<BHBI", command, 0x6060, 0, 0x06090030)
    slave = ScriptedSlave(lambda _: [coe(service, body)])
    with pytest.raises(Rejected, match="does not accept this value") as caught:
        slave.run(sdo.download(slave.box(), 0x6060, 0, b"\x63"))
    assert caught.value.abort_code == 0x06090030
    assert caught.value.parameter == "6060:00"


def test_expedited_download_bytes() -> None:
    slave = ScriptedSlave(lambda _: [coe(3, bytes.fromhex("60 6060 00 00000000"))])
    slave.run(sdo.download(slave.box(), 0x6060, 0, b"\x08"))
    assert slave.requests == [bytes.fromhex("0020 2f 6060 00 08000000")]


def test_long_download_is_cut_to_the_mailbox() -> None:
    data = bytes(range(256)) * 2

    def react(request: bytes) -> list[bytes]:
        if request[2] & 0xE0 == 0x20:
            return [coe(3, struct.pack("<BHB4x", 0x60, 0x2000, 0))]
        return [coe(3, bytes([0x20 | request[2] & 0x10]) + bytes(7))]

    slave = ScriptedSlave(react)
    slave.run(sdo.download(slave.box(), 0x2000, 0, data))
    first, *segments = slave.requests
    assert first[2] == 0x21
    assert int.from_bytes(first[6:10], "little") == 512
    assert len(first) == 128 - 6
    assert first[10:] + b"".join(s[3:] for s in segments) == data
    assert [s[2] & 0x10 for s in segments] == [0, 0x10, 0, 0x10][: len(segments)]
    assert [s[2] & 1 for s in segments] == [0] * (len(segments) - 1) + [1]


@pytest.mark.parametrize(("out", "back"), [(128, 1024), (1024, 128), (49, 37), (17, 16)])
def test_mailboxes_may_have_any_two_sizes(out: int, back: int) -> None:
    """An SDO server of the standard's bytes (ETG.1000.6 clauses 5.6.2.2 to 5.6.2.5)."""
    text = bytes(range(256)) * 3 + b"end"
    taken = bytearray()
    place = toggle = 0

    def react(request: bytes) -> list[bytes]:
        nonlocal place, toggle
        assert len(request) <= out - 6
        command, mux = request[2], request[3:6]
        if command == 0x40:
            place, toggle = back - 16, 0
            return [coe(3, b"\x41" + mux + struct.pack("<I", len(text)) + text[:place])]
        if command == 0x21:
            assert struct.unpack_from("<I", request, 6)[0] == len(text)
            taken[:], toggle = request[10:], 0
            return [coe(3, b"\x60" + mux + bytes(4))]
        assert command & 0x10 == toggle
        toggle ^= 0x10
        if command & 0xE0 == 0x60:
            part = text[place : place + back - 9]
            place += len(part)
            unused = max(7 - len(part), 0)
            reported = command & 0x10 | unused << 1 | (place == len(text))
            return [coe(3, bytes([reported]) + part.ljust(7, b"\0"))]
        unused = command >> 1 & 7 if len(request) == 10 else 0
        taken.extend(request[3 : len(request) - unused])
        return [coe(3, bytes([0x20 | command & 0x10]) + bytes(7))]

    slave = ScriptedSlave(react, size=out, answer_size=back)
    box = slave.box()
    assert slave.run(sdo.upload(box, 0x3000, 0)) == text
    slave.run(sdo.download(box, 0x3000, 0, text))
    assert bytes(taken) == text


def test_a_late_answer_never_answers_the_next_question() -> None:
    """Field lesson: after a time-out the old value came back for the next read of the object."""
    slow = {"on": True}

    def react(request: bytes) -> list[bytes]:
        index = struct.unpack_from("<H", request, 3)[0]
        if index == 0x6064 and slow["on"]:
            slow["on"] = False
            slave.queue(expedited(0x6064, 0, b"\xde\xad\xde\xad"), delay_s=0.3)
            return []
        return [expedited(index, request[5], b"\x01\0\0\0")]

    slave = ScriptedSlave(react)
    box = slave.box(timeout_s=0.1)
    with pytest.raises(LinkTimeout):
        slave.run(sdo.upload(box, 0x6064, 0))
    slave.now += 0.25
    assert slave.run(sdo.upload(box, 0x6064, 0)) == b"\x01\0\0\0"


def test_a_mute_mailbox_times_out_in_its_time() -> None:
    slave = ScriptedSlave(lambda _: [])
    with pytest.raises(LinkTimeout, match="did not answer in time"):
        slave.run(sdo.upload(slave.box(timeout_s=0.2), 0x6041, 0))
    assert 0.2 <= slave.now < 0.22


def test_an_emergency_within_a_transfer_is_reported_once() -> None:
    emergency = bytes.fromhex("1084 20 0102030405")

    slave = ScriptedSlave(lambda _: [coe(1, emergency), expedited(0x6041, 0, b"\x08\0")])
    assert slave.run(sdo.upload(slave.box(), 0x6041, 0)) == b"\x08\0"
    assert slave.emergencies == [emergency]


@pytest.mark.parametrize("lost", [0, 2])
def test_a_lost_frame_costs_no_answer(lost: int) -> None:
    """Frame 0 writes the mailbox, frame 2 reads the answer: each once lost on the way back."""
    slave = ScriptedSlave(lambda _: [expedited(0x6041, 0, b"\x37\x02")], lose={lost})
    assert slave.run(sdo.upload(slave.box(), 0x6041, 0)) == b"\x37\x02"
    assert len(slave.requests) == 1, "the slave executed it once"


def test_counters_run_from_2_to_7_and_never_repeat() -> None:
    slave = ScriptedSlave(lambda _: [expedited(0x6041, 0, b"\0\0")])
    box = slave.box()
    for _ in range(8):
        slave.run(sdo.upload(box, 0x6041, 0))
    assert slave.counters == [2, 3, 4, 5, 6, 7, 2, 3]


def test_mailbox_errors_come_in_words() -> None:
    slave = ScriptedSlave(lambda _: [])
    slave.queue(struct.pack("<HH", 1, 2), protocol=0)
    with pytest.raises(ProtocolError, match="protocol is not supported") as refused:
        slave.run(sdo.upload(slave.box(), 0x6041, 0))
    assert "不支持该邮箱协议" in refused.value.text.words("zh")


def test_complete_access_with_and_without_the_pad_byte() -> None:
    entries = [b"\x11", b"\x22\x33", b"\x44\x55\x66\x77"]
    body = b"".join(entries)
    sizes = {1: 1, 2: 2, 3: 4}
    whole = {0: b"\x03"} | dict(enumerate(entries, start=1))
    split = sdo.split_complete
    assert split(b"\x03\x00" + body, sizes, proven=False) == whole
    assert split(b"\x03" + body, sizes, proven=False) == whole
    assert split(b"\x03\x00" + body + b"\0", sizes, proven=False) == {}, "a byte too many"
    assert split(b"\x04\x00" + body, sizes, proven=False) == {}, "an entry we do not know"
    assert split(b"\x04\x00" + body, sizes, proven=True) == whole | {0: b"\x04"}
    first = split(b"\x02\x00" + body[:3], sizes, proven=False)
    assert first == {0: b"\x02", 1: entries[0], 2: entries[1]}, "only so many are in use"
    gap = split(b"\x05\x00" + body, {1: 1, 2: 2, 5: 4}, proven=False)
    assert gap == {0: b"\x05", 1: entries[0], 2: entries[1], 5: entries[2]}


def test_information_service() -> None:
    def react(request: bytes) -> list[bytes]:
        if request[2] == 1:
            first = coe(8, bytes.fromhex("82 00 0100 0100 0010 0810"))
            return [first, coe(8, bytes.fromhex("02 00 0000 4160 4060"))]
        if request[2] == 3:
            return [coe(8, bytes.fromhex("04 00 0000 4160 0600 00 07") + b"Statusword")]
        return [coe(8, bytes.fromhex("06 00 0000 4160 00 00 0600 1000 8700") + b"Statusword")]

    slave = ScriptedSlave(react)
    box = slave.box()
    assert slave.run(information.list_objects(box)) == [0x1000, 0x1008, 0x6040, 0x6041]
    found = slave.run(information.describe_object(box, 0x6041))
    assert (found.name, found.data_type, found.object_code) == ("Statusword", 6, 7)
    entry = slave.run(information.describe_entry(box, 0x6041, 0))
    assert (entry.bit_length, entry.access, entry.name) == (16, 0x87, "Statusword")
    assert slave.requests[0] == bytes.fromhex("0080 01 00 0000 0100")


def test_a_missing_part_of_a_description_is_not_passed_over() -> None:
    """The parts that follow are counted down (ETG.1000.6 clause 5.6.3.2): 2, then 0."""

    def react(_request: bytes) -> list[bytes]:
        return [
            coe(8, b"\x82\0\x02\0" + b"\x01\0\x00\x10"),
            coe(8, b"\x02\0\x00\0" + b"\x18\x10"),
        ]

    slave = ScriptedSlave(react)
    box = slave.box()
    with pytest.raises(ProtocolError, match="list of its objects is incomplete"):
        slave.run(information.list_objects(box))
    assert box.unsettled, "the next question is asked after what may still come"


def test_information_service_abort() -> None:
    slave = ScriptedSlave(lambda _: [coe(8, bytes.fromhex("07 00 0000 00000206"))])
    with pytest.raises(Rejected, match="no such object"):
        slave.run(information.describe_object(slave.box(), 0x7777))


def test_a_mailbox_taken_over_from_soem_may_drop_the_first_mail() -> None:
    """Its last counter may be the one that we begin with (ETG.1000.4 clause 5.6)."""
    slave = ScriptedSlave(lambda r: [expedited(*struct.unpack_from("<HB", r, 3), b"\1\0\0\0")])
    slave.counters.append(2)
    box = slave.box()
    slave.run(sdo.settle(box, force=True))
    assert slave.run(sdo.upload(box, 0x6041, 0)) == b"\1\0\0\0"
    assert slave.now < 0.2


def test_waiting_for_the_usual_answer_time_does_not_make_it_longer() -> None:
    """A pause that is learnt from its own length would grow for ever."""
    slave = ScriptedSlave(lambda _: [expedited(0x6041, 0, b"\0\0")], delay_s=0.001)
    box = slave.box()
    for _ in range(30):
        slave.run(sdo.upload(box, 0x6041, 0))
    began, frames = slave.now, slave.frames
    for _ in range(30):
        slave.run(sdo.upload(box, 0x6041, 0))
    assert (slave.now - began) / 30 < 0.00135, "1 ms and little more"
    assert (slave.frames - frames) / 30 < 2.6, "mostly two frames: the request and its answer"


@pytest.mark.parametrize("delay_s", [0.0, 0.005])
@pytest.mark.parametrize("counts", [True, False])
def test_a_first_look_whose_frame_is_lost_brings_no_old_answer(
    counts: bool, delay_s: float
) -> None:
    """The box was emptied (0 s), or the answer was still to come and the repeat is an old mail."""
    values = iter(range(1, 100))
    slave = ScriptedSlave(
        lambda _: [expedited(0x6041, 0, next(values).to_bytes(4, "little"))],
        delay_s=0.001,
        counts=counts,
    )
    box = slave.box()
    for number in range(1, 21):
        if number == 20:
            slave.lose, slave.delay_s = {slave.frames + 1}, delay_s
        answer = slave.run(sdo.upload(box, 0x6041, 0))
        assert int.from_bytes(answer, "little") == number
    assert box.repeats == (0 if delay_s else 1)
    assert len(slave.requests) == 20


def test_a_repeated_mail_is_known_by_its_number() -> None:
    """Asked to repeat before it has answered, a slave repeats its last mail (ETG.1000.4 5.6)."""
    values = iter(range(1, 100))
    slave = ScriptedSlave(
        lambda _: [expedited(0x6041, 0, next(values).to_bytes(4, "little"))], delay_s=0.001
    )
    box = slave.box()
    for _ in range(5):
        slave.run(sdo.upload(box, 0x6041, 0))
    slave.lose, slave.delay_s = {slave.frames + 1}, 0.05
    assert slave.run(sdo.upload(box, 0x6041, 0)) == b"\x06\0\0\0"
    assert box.repeats == 1


@pytest.mark.parametrize(("last", "reads"), [(3, 2), (4, 5)])
def test_the_drives_own_dictionary_proves_the_layout_of_a_whole_object(
    last: int, reads: int
) -> None:
    """Its subindex 0 is a value of its own, so it cannot determine how many entries follow."""
    entries = {0: b"\x11", 1: b"\x01", 2: b"\x02\0", 3: b"\x03\0\0\0"}

    def react(request: bytes) -> list[bytes]:
        if request[1] >> 4 == 8:
            return [coe(8, struct.pack("<BBHHHBB", 4, 0, 0, 0x2005, 0, last, 9) + b"gains")]
        mux = request[3:6]
        if request[2] == 0x50:
            whole = b"\x11\0" + entries[1] + entries[2] + entries[3]
            return [coe(3, b"\x51" + mux + struct.pack("<I", len(whole)) + whole)]
        value = entries[request[5]]
        return [coe(3, bytes([0x43 | (4 - len(value)) << 2]) + mux + value.ljust(4, b"\0"))]

    slave = ScriptedSlave(react)
    station = Station(1, mailbox=slave.box())
    items = [(0x2005, 0, 1), (0x2005, 1, 1), (0x2005, 2, 2), (0x2005, 3, 4)]
    for again in (False, True):
        before = len(slave.requests)
        assert slave.run(read_items(station, items, lambda _n: None)) == list(entries.values())
        asked = len(slave.requests) - before
        assert asked == (1 if again else reads + (last == 4)), "the proof is kept"


@pytest.mark.parametrize("complete", [True, False])
def test_entries_beyond_the_count_of_a_list_are_not_asked_for(complete: bool) -> None:
    """1600h with 2 of 4 entries in use (ETG.1000.6 clause 5.6.7.4: subindex 0 counts them).

    A slave of the usual stack denies that the others exist; by itself each is asked all the same.
    """
    entries = {0: b"\x02", 1: b"\x10\x00\x40\x60", 2: b"\x20\x00\x7a\x60"}

    def react(request: bytes) -> list[bytes]:
        mux, sub = request[3:6], request[5]
        if request[2] == 0x50:
            if not complete:
                return [coe(2, b"\x80" + mux + struct.pack("<I", 0x06010000))]
            whole = b"\x02\0" + entries[1] + entries[2]
            return [coe(3, b"\x51" + mux + struct.pack("<I", len(whole)) + whole)]
        if sub not in entries:
            return [coe(2, b"\x80" + mux + struct.pack("<I", 0x06090011))]
        value = entries[sub]
        return [coe(3, bytes([0x43 | (4 - len(value)) << 2]) + mux + value.ljust(4, b"\0"))]

    slave = ScriptedSlave(react)
    station = Station(1, mailbox=slave.box())
    items = [*((0x1600, sub, 4) for sub in (4, 3, 2, 1)), (0x1600, 0, 1)]
    asked = []
    for _ in range(2):
        before = len(slave.requests)
        reported = slave.run(read_items(station, items, lambda _n: None))
        assert reported[2:] == [entries[2], entries[1], entries[0]]
        for answer, sub in zip(reported, (4, 3), strict=False):
            assert isinstance(answer, NotInUse)
            assert answer.message == "not in use: 1600:00 counts 2 entries"
            assert answer.parameter == f"1600:0{sub}"
        asked.append(len(slave.requests) - before)
    assert asked == ([1, 1] if complete else [4, 3])
    with pytest.raises(Rejected):
        slave.run(sdo.upload(station.box, 0x1600, 3))


def test_a_count_that_is_printed_wider_comes_as_wide() -> None:
    """1C12:00 is UINT16 in the manual of the MMS7 (004:1437), and one byte of the whole object."""

    def react(request: bytes) -> list[bytes]:
        assert request[2] == 0x50
        whole = b"\x01\x00\x00\x16"
        return [coe(3, b"\x53" + request[3:6] + whole)]

    slave = ScriptedSlave(react)
    station = Station(1, mailbox=slave.box())
    items = [(0x1C12, 0, 2), (0x1C12, 1, 2)]
    reported = slave.run(read_items(station, items, lambda _n: None))
    assert reported == [b"\x01\x00", b"\x00\x16"]
