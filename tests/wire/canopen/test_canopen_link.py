"""The link against the virtual node, through real frames."""

from __future__ import annotations

import asyncio
import gc
import threading
import time

import pytest

from drivers.canopen.link import CanopenLink
from drivers.errors import LinkLost, LinkTimeout, NotAllowed, NotAsked, Rejected
from drivers.link import Address, LinkEvent
from drivers.texts.message import text
from drivers.virtual.wires.canopen import CanopenNode
from tests.wire.canopen.conftest import Bench, until
from tests.wire.canopen.small_device import SmallDevice

SMALL = Address(0x2000, 0, "UINT8")
LIMITED = Address(0x2001, 0, "INT16")
STATUS = Address(0x6041, 0, "UINT16")
NAME = Address(0x1008, 0, "STRING")
BIG = Address(0x1021, 0, "STRING")


async def test_reads_and_writes_expedited(bench: Bench, link: CanopenLink) -> None:
    assert await link.read(5, STATUS) == b"\x50\x02"
    await link.write(5, LIMITED, b"\xff\xff")
    assert await link.read(5, LIMITED) == b"\xff\xff"
    assert bench.device.value(0x2001) == -1


async def test_reads_text_in_segments(link: CanopenLink) -> None:
    assert await link.read(5, NAME) == b"Small drive of many letters"


@pytest.mark.parametrize("offers_block", [True, False])
async def test_long_objects_travel_with_and_without_block_transfer(
    bench: Bench, offers_block: bool
) -> None:
    node = CanopenNode(SmallDevice(), 9, time.monotonic_ns, offers_block=offers_block)
    bench.wire.do(lambda: bench.wire.nodes.append(node))
    link = CanopenLink(bench.url)
    await link.open()
    try:
        assert await link.read(9, BIG) == bytes(range(256)) * 8
        await link.write(9, BIG, b"new contents, longer than one block: " * 99)
        assert await link.read(9, BIG) == b"new contents, longer than one block: " * 99
    finally:
        await link.close()


async def test_an_abort_comes_back_in_words(link: CanopenLink) -> None:
    with pytest.raises(Rejected) as refused:
        await link.write(5, LIMITED, b"\x65\x00")
    assert refused.value.abort_code == 0x06090030
    assert "does not accept this value" in str(refused.value)
    assert refused.value.parameter == "2001:00"
    assert refused.value.drive is not None
    assert "node 5" in str(refused.value.drive)
    with pytest.raises(Rejected, match="no such object"):
        await link.read(5, Address(0x2FFF, 0, "UINT8"))


async def test_one_failure_does_not_spoil_a_batch(link: CanopenLink) -> None:
    results = await link.read_many(5, [SMALL, Address(0x2FFF, 0, "UINT8"), STATUS])
    assert results[0] == b"\x07"
    assert isinstance(results[1], Rejected)
    assert results[2] == b"\x50\x02"


async def test_what_only_modbus_reaches_is_refused_with_the_reason(link: CanopenLink) -> None:
    with pytest.raises(NotAllowed, match="only over Modbus"):
        await link.read(5, Address(None, 0, "UINT16", register=0x26))


async def test_a_late_answer_is_never_taken_for_a_new_one(bench: Bench, link: CanopenLink) -> None:
    """The field's defect: after a time-out the next read of the same object got the old value."""
    bench.node.delay_answers(0.25)
    with pytest.raises(LinkTimeout):
        await link.read(5, LIMITED)
    bench.wire.do(lambda: bench.device.write(0x2001, 0, b"\x22\x00"))
    # The late answer, with the old value 0, is still on its way.
    for _ in range(4):
        try:
            value = await link.read(5, LIMITED)
        except LinkTimeout:
            continue
        break
    assert value == b"\x22\x00"
    assert link.quality(5).details["late_answers"] >= 1
    assert link.quality(5).details["stray_answers"] == 0


async def test_a_mute_node_times_out_and_others_go_on(bench: Bench, link: CanopenLink) -> None:
    bench.wire.do(lambda: bench.wire.nodes.append(CanopenNode(SmallDevice(), 6, time.monotonic_ns)))
    bench.node.mute = True
    with pytest.raises(LinkTimeout, match="node 5 did not answer"):
        await link.read(5, STATUS)
    assert await link.read(6, STATUS) == b"\x50\x02"
    bench.node.mute = False
    assert await link.read(5, STATUS) == b"\x50\x02"
    assert link.quality(5).timeouts == 1


def slow_reads(link: CanopenLink, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Every read takes 20 ms; returns what was done, in order."""
    done: list[str] = []

    def read(_station: int, _address: Address) -> bytes:
        done.append("read")
        time.sleep(0.02)
        return b""

    monkeypatch.setattr(link, "_read_now", read)
    monkeypatch.setattr(link, "_sdo_write", lambda *_: done.append("write"))
    return done


@pytest.mark.long
async def test_a_write_overtakes_batches_of_reads(
    link: CanopenLink, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It may be the stop: at most the read under way goes before it."""
    done = slow_reads(link, monkeypatch)
    batches = [asyncio.create_task(link.read_many(5, [STATUS] * 16)) for _ in range(3)]
    await until(lambda: done)
    before = len(done)
    await link.write(5, SMALL, b"\x02")
    assert done.index("write") <= before + 1
    assert [len(await batch) for batch in batches] == [16] * 3


async def test_what_fails_after_it_was_cancelled_is_no_defect_in_the_log(
    link: CanopenLink,
) -> None:
    """Found by the chaos on real wires (CANopen, seed 133): "Future exception was never retrieved"
    after a read that was cancelled ended by its time-out."""
    reported: list[dict[str, object]] = []
    asyncio.get_running_loop().set_exception_handler(lambda _, what: reported.append(what))
    begun, go = threading.Event(), threading.Event()

    def fails() -> None:
        begun.set()
        go.wait(5)
        raise LinkTimeout("no answer")

    asked = asyncio.create_task(link._in_worker(fails))
    await asyncio.to_thread(begun.wait, 5)
    asked.cancel()
    await asyncio.sleep(0)
    go.set()
    await asyncio.wait([asked])
    assert asked.cancelled()
    # The error is reported when the last reference to its future is gone.
    del asked
    await asyncio.sleep(0)
    gc.collect()
    assert reported == []


async def test_cancelling_a_batch_waits_for_one_read_only(
    link: CanopenLink, monkeypatch: pytest.MonkeyPatch
) -> None:
    done = slow_reads(link, monkeypatch)
    batch = asyncio.create_task(link.read_many(5, [STATUS] * 16))
    await until(lambda: done)
    batch.cancel()
    await asyncio.wait([batch])
    assert len(done) <= 3


@pytest.mark.long
async def test_a_timed_out_write_is_sent_once(bench: Bench, link: CanopenLink) -> None:
    bench.node.mute = True
    written: list[bytes] = []
    original = bench.device.write

    def spy(index: int, subindex: int, data: bytes) -> None:
        written.append(data)
        original(index, subindex, data)

    bench.device.write = spy  # type: ignore[method-assign]
    with pytest.raises(LinkTimeout):
        await link.write(5, SMALL, b"\x09")
    bench.node.mute = False
    assert await link.read(5, SMALL) == b"\x09"
    assert written == [b"\x09"]


async def test_scan_tells_who_is_there(bench: Bench, link: CanopenLink) -> None:
    said: list[str] = []
    found = await link.scan(lambda _fraction, text: said.append(str(text)), range(1, 17))
    assert [f.station for f in found] == [5]
    drive = found[0]
    assert (drive.vendor_id, drive.product_code, drive.revision, drive.serial) == (
        0x1234,
        0x56,
        3,
        42,
    )
    assert drive.name == "Small drive of many letters"
    assert drive.notes == ()
    assert said[-1] == "1 nodes found"


async def test_two_nodes_with_one_number_are_noticed_by_a_scan(
    bench: Bench, link: CanopenLink
) -> None:
    bench.wire.do(lambda: bench.wire.nodes.append(CanopenNode(SmallDevice(), 5, time.monotonic_ns)))
    found = await link.scan(lambda *_: None, [4, 5])
    assert found[0].notes[0] == text("canopen.note-same-number", node_count=2, node=5)


async def test_two_nodes_with_one_number_are_noticed_in_operation(
    bench: Bench, link: CanopenLink
) -> None:
    events: list[LinkEvent] = []
    link.listen(events.append)
    await link.read(5, STATUS)
    bench.wire.do(lambda: bench.wire.nodes.append(CanopenNode(SmallDevice(), 5, time.monotonic_ns)))
    for _ in range(4):
        await link.read(5, STATUS)
    await until(lambda: any("two nodes answer as number 5" in e.text.words() for e in events))
    assert link.quality(5).state == text("canopen.state-same-number")


async def test_a_restart_is_noticed(bench: Bench, link: CanopenLink) -> None:
    events: list[LinkEvent] = []
    leave = link.listen(events.append)
    await link.write(5, SMALL, b"\x09")
    bench.wire.do(bench.node.reboot)
    await until(lambda: events)
    assert events[0].kind == "boot"
    assert events[0].station == 5
    assert "restarted" in events[0].text.words()
    assert await link.read(5, SMALL) == b"\x07"
    leave()
    bench.wire.do(bench.node.reboot)
    await link.read(5, SMALL)
    assert len(events) == 1


async def test_emergencies_come_in_words(bench: Bench, link: CanopenLink) -> None:
    events: list[LinkEvent] = []
    link.listen(events.append)
    bench.wire.do(lambda: bench.device.inject("3210"))
    await until(lambda: events)
    assert events[0].kind == "emergency"
    assert events[0].code == 0x3210
    assert "voltage inside the drive" in events[0].text.words()


async def test_a_lost_heartbeat_and_its_return_are_reported(
    bench: Bench, link: CanopenLink
) -> None:
    events: list[LinkEvent] = []
    link.listen(events.append)
    await link.write(5, Address(0x1017, 0, "UINT16"), b"\x14\x00")
    await until(lambda: link._watch.record(5).period_s is not None)
    bench.node.mute = True
    await until(lambda: any(e.kind == "lost" for e in events))
    bench.node.mute = False
    await until(lambda: any(e.kind == "back" for e in events))


async def test_node_guarding_notices_a_silent_node(bench: Bench) -> None:
    link = CanopenLink(bench.url + "&guard_ms=50")
    events: list[LinkEvent] = []
    link.listen(events.append)
    await link.open()
    try:
        await link.read(5, SMALL)
        # One answer alone could be a heartbeat: the toggle bit shows.
        await until(lambda: link._watch.record(5).guarded)
        assert link._watch.record(5).state == 127
        bench.node.mute = True
        await until(lambda: any("does not answer guarding" in e.text.words() for e in events))
    finally:
        await link.close()


async def test_a_device_type_that_comes_in_segments_is_no_other_device(
    bench: Bench, link: CanopenLink
) -> None:
    """CiA 301 lets a server send any length in segments; the first answer then shows a length."""
    server = bench.node._server
    whole, asked = server.request, []

    def in_segments(request: bytes) -> list[bytes]:
        asked.append(request)
        if request[:4] == b"\x40\x00\x10\x00":
            return [bytes.fromhex("4100100004000000")]
        return [bytes.fromhex("0792010200000000")] if request[0] == 0x60 else whole(request)

    bench.wire.do(lambda: setattr(server, "request", in_segments))
    (found,) = await link.scan(lambda *_: None, [5])
    assert found.notes == ()
    assert asked[1][:4] == b"\x80\x00\x10\x00", "what the probe began is ended"


async def test_bus_off_is_reported_and_recovered(slcan_bench: Bench) -> None:
    link = CanopenLink(slcan_bench.url)
    events: list[LinkEvent] = []
    link.listen(events.append)
    await link.open()
    try:
        assert await link.read(5, SMALL) == b"\x07"
        slcan_bench.wire.do(slcan_bench.wire.side.bus_off)
        with pytest.raises((LinkLost, LinkTimeout)):
            await link.read(5, SMALL)
        await until(lambda: any("bus-off" in e.text.words() for e in events))
        await until(lambda: any(e.kind == "back" for e in events))
        assert await link.read(5, SMALL) == b"\x07"
        assert link.quality().details["bus_offs"] == 1
    finally:
        await link.close()


async def test_bus_off_on_the_virtual_bus(bench: Bench, link: CanopenLink) -> None:
    events: list[LinkEvent] = []
    link.listen(events.append)
    bench.wire.do(bench.wire.side.bus_off)
    await until(lambda: any(e.kind == "back" for e in events))
    assert "bus-off" in events[0].text.words()
    assert await link.read(5, SMALL) == b"\x07"


async def test_an_unplugged_adapter_is_reported_and_comes_back(slcan_bench: Bench) -> None:
    from drivers.virtual.wires.slcan import SlcanSide

    side = slcan_bench.wire.side
    assert isinstance(side, SlcanSide)
    link = CanopenLink(slcan_bench.url)
    events: list[LinkEvent] = []
    link.listen(events.append)
    await link.open()
    try:
        assert await link.read(5, SMALL) == b"\x07"
        side.unplug()
        await until(lambda: any(e.kind == "lost" for e in events))
        with pytest.raises(LinkLost):
            await link.read(5, SMALL)
        assert not link.quality().connected
        side.plug()
        await until(lambda: any(e.kind == "back" for e in events))
        assert await link.read(5, SMALL) == b"\x07"
    finally:
        await link.close()


async def test_a_missing_adapter_says_so() -> None:
    link = CanopenLink("canopen://slcan//dev/ttyNoSuchAdapter")
    with pytest.raises(LinkLost, match="no such adapter"):
        await link.open()
    await link.close()


async def test_reading_from_a_closed_link_says_so() -> None:
    link = CanopenLink("canopen://virtual/nowhere")
    with pytest.raises(LinkLost, match="not open"):
        await link.read(1, STATUS)


async def test_a_node_that_is_not_there_is_not_asked_for_everything(link: CanopenLink) -> None:
    """Once what every node has (1000h) is not answered either, the rest of a list fails at once."""
    answers = await link.read_many(77, [STATUS, SMALL, LIMITED, NAME] * 4)
    assert isinstance(answers[0], LinkTimeout)
    assert all(isinstance(answer, NotAsked) for answer in answers[1:])
    assert link.quality(77).timeouts == 2


@pytest.mark.long
async def test_many_absent_nodes_keep_no_other_waiting(bench: Bench) -> None:
    # A second is far more than a busy computer needs for the one answer that comes.
    link = CanopenLink(bench.url.replace("timeout_ms=250", "timeout_ms=1000"))
    await link.open()
    try:
        absent = [asyncio.create_task(link.read(number, STATUS)) for number in range(60, 100)]
        await asyncio.sleep(0)
        assert await link.read(5, STATUS) == b"\x50\x02"
        assert not any(task.done() for task in absent)
        ends = await asyncio.gather(*absent, return_exceptions=True)
        assert all(isinstance(end, LinkTimeout) for end in ends)
    finally:
        await link.close()
