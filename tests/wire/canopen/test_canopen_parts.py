"""URLs, node watching, PDO planning and setpoints: the pure parts."""

from __future__ import annotations

import errno
from pathlib import Path
from typing import Any

import can
import pytest
import serial
from hypothesis import given
from hypothesis import strategies as st

from drivers.canopen.adapters.adapter import open_bus, translate
from drivers.canopen.exchange.cyclic import CanopenCyclic
from drivers.canopen.exchange.drive_setup import DriveSetup
from drivers.canopen.exchange.images import Images
from drivers.canopen.exchange.pdo import PdoPlan, plan, plan_within_load, set_up
from drivers.canopen.frames import Frame, exact_bits, worst_case_bits
from drivers.canopen.nodes import NodeWatch, emergency_text
from drivers.canopen.sdo.scanning import readable
from drivers.canopen.sdo.transfers import fitted
from drivers.canopen.url import INTERFACES, parse_canopen_url
from drivers.errors import LinkLost, NotAllowed, OutOfRange, Rejected
from drivers.halt import HaltCause, Halted
from drivers.link import Address, CyclicSignal
from drivers.texts.message import text
from drivers.virtual.wires.can_wire import CanWire
from drivers.virtual.wires.slcan import SlcanSide


def test_urls_of_the_documentation() -> None:
    url = parse_canopen_url("canopen://socketcan/can0?bitrate=500000")
    assert (url.interface, url.channel, url.bitrate) == ("socketcan", "can0", 500_000)
    assert parse_canopen_url("canopen://slcan//dev/ttyACM0").channel == "/dev/ttyACM0"
    assert parse_canopen_url("canopen://pcan/").channel == "PCAN_USBBUS1"
    assert parse_canopen_url("canopen://slcan/COM8?timeout_ms=200&guard_ms=1000").timeout_s == 0.2
    assert parse_canopen_url("canopen://udp_multicast").channel == "239.74.163.2"


@pytest.mark.parametrize(
    ("url", "says"),
    [
        ("canopen://can0", "socketcan, slcan"),
        ("canopen://slcan", "names no channel"),
        ("canopen://socketcan/can0?bitrate=123", "not a CANopen bit rate"),
        ("canopen://socketcan/can0?bitrate=fast", "must be a number"),
        ("canopen://socketcan/can0?bitrate=nan", "must be a number"),
        ("canopen://socketcan/can0?speed=1", "unknown option speed"),
        ("modbus:///dev/ttyS0", "not a canopen://"),
    ],
)
def test_wrong_urls_say_what_is_wrong(url: str, says: str) -> None:
    with pytest.raises(OutOfRange) as refused:
        parse_canopen_url(url)
    assert says in f"{refused.value} {refused.value.limit}"


MISSING = {
    "socketcan": "no-such-can7",
    "slcan": "/dev/ttyNoSuch7",
    "pcan": "PCAN_USBBUS16",
    "kvaser": "97",
    "usb2can": "NOSUCH77",
}


@pytest.mark.parametrize("interface", sorted(set(INTERFACES) - {"virtual", "udp_multicast"}))
def test_an_adapter_that_is_not_there_is_a_lost_link(interface: str) -> None:
    with pytest.raises(LinkLost) as lost:
        open_bus(parse_canopen_url(f"canopen://{interface}/{MISSING[interface]}"))
    assert lost.value.remedy


@pytest.mark.parametrize(
    ("code", "says"),
    [
        (errno.EACCES, "no permission"),
        (errno.EBUSY, "in use"),
        (errno.ENODEV, "no such adapter"),
        (errno.ENETDOWN, "interface is down"),
        (errno.ENOBUFS, "nobody acknowledges"),
    ],
)
def test_the_adapters_errors_are_translated(code: int, says: str) -> None:
    url = parse_canopen_url("canopen://socketcan/can0")
    wrapped = can.CanOperationError("wrapped")
    wrapped.__cause__ = OSError(code, "text")
    error = translate(url, wrapped)
    assert says in error.message
    assert error.remedy


@pytest.mark.parametrize(
    ("failure", "says", "remedy"),
    [
        (serial.SerialTimeoutException("Write timeout"), "nobody acknowledges", "termination"),
        (serial.SerialException("device disconnected"), "adapter is gone", "USB cable"),
    ],
)
def test_an_adapter_that_is_full_is_distinguished_from_one_that_is_unplugged(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, failure: OSError, says: str, remedy: str
) -> None:
    """An slcan adapter on a bus where nobody acknowledges keeps its frames until it is full."""
    path = tmp_path / "ttyCAN"

    def fails(_data: bytes) -> None:
        raise failure

    with CanWire(SlcanSide(path), []):
        url = parse_canopen_url(f"canopen://slcan/{path}")
        bus = open_bus(url)
        try:
            with monkeypatch.context() as patch:
                patch.setattr(bus.serialPortOrig, "write", fails)  # type: ignore[attr-defined]
                with pytest.raises(can.CanOperationError) as caught:
                    bus.send(can.Message(arbitration_id=0x605, is_extended_id=False))
        finally:
            bus.shutdown()
    error = translate(url, caught.value)
    assert says in error.message
    assert remedy in (error.remedy or "")


def test_a_silent_node_is_reported_once_and_its_return_too() -> None:
    watch = NodeWatch()
    beat = Frame(0x705, b"\x05")
    for tick in range(5):
        assert watch.observe(beat, tick * 0.1) == []
        assert watch.overdue(tick * 0.1) == []
    # 0.1 s period: late after 2.5 periods and 0.1 s.
    assert watch.overdue(0.4 + 0.34) == []
    assert [e.kind for e in watch.overdue(0.4 + 0.36)] == ["lost"]
    assert watch.overdue(2.0) == []
    assert [e.kind for e in watch.observe(beat, 3.0)] == ["back"]


def reported_by(watch: NodeWatch, beats: list[tuple[float, int]], until_s: float) -> list[str]:
    """Losses that are reported while node 5 sends these states at these times."""
    reported: list[str] = []
    waiting = list(beats)
    for now_ms in range(round(until_s * 1000)):
        while waiting and waiting[0][0] <= now_ms / 1000:
            watch.observe(Frame(0x705, bytes([waiting.pop(0)[1]])), now_ms / 1000)
        reported += [
            event.text.words() for event in watch.overdue(now_ms / 1000) if event.kind == "lost"
        ]
    return reported


def test_a_heartbeat_at_once_after_boot_or_a_change_of_state_tells_no_period() -> None:
    """As CANopenNode does it; the period here is 1 s, and the exchange begins with NMT start."""
    beats = [(0.0, 0), (0.001, 127), (0.4, 5), (1.4, 5), (2.4, 5), (2.41, 127), (3.41, 127)]
    watch = NodeWatch()
    assert reported_by(watch, beats, 4.4) == []
    assert watch.record(5).period_s == pytest.approx(1.0)


def test_a_heartbeat_that_came_late_makes_the_next_one_no_period() -> None:
    watch = NodeWatch()
    assert reported_by(watch, [(0, 5), (1, 5), (2.9, 5), (3, 5), (4, 5), (5, 5)], 5.9) == []
    assert len(reported_by(NodeWatch(), [(0, 5), (1, 5), (2, 5)], 5)) == 1


def test_a_node_with_a_slow_heartbeat_is_not_taken_for_one_that_answers_guarding() -> None:
    watch = NodeWatch()
    watch.record(5).in_use = True
    events = []
    for now_ms in range(0, 20_000, 50):
        if now_ms % 2000 == 1700:
            events += watch.observe(Frame(0x705, b"\x05"), now_ms / 1000)
        events += watch.guard_due(0.5, now_ms / 1000)[1] + watch.overdue(now_ms / 1000)
    assert events == []
    assert watch.record(5).period_s == pytest.approx(2.0)


def test_state_changes_and_restarts_are_reported() -> None:
    watch = NodeWatch()
    watch.record(5).in_use = True
    watch.observe(Frame(0x705, b"\x05"), 0.0)
    stopped = watch.observe(Frame(0x705, b"\x04"), 0.1)
    assert [e.text.words() for e in stopped] == ["node 5 is stopped"]
    boot = watch.observe(Frame(0x705, b"\x00"), 0.2)
    assert [e.kind for e in boot] == ["boot"]
    assert "restarted" in boot[0].text.words()


def test_guarding_notices_a_toggle_bit_that_stands_still() -> None:
    watch = NodeWatch()
    watch.record(5).in_use = True
    assert watch.guard_due(0.1, 0.0) == ([5], [])
    assert watch.observe(Frame(0x705, b"\x7f"), 0.01) == []
    watch.guard_due(0.1, 0.2)
    assert watch.observe(Frame(0x705, b"\xff"), 0.21) == []
    watch.guard_due(0.1, 0.4)
    events = watch.observe(Frame(0x705, b"\xff"), 0.41)
    assert "two nodes have this number" in events[0].text.words()


def test_answers_that_nobody_asked_for_are_two_nodes_only_while_they_come() -> None:
    watch = NodeWatch()
    record = watch.record(5)
    assert watch.stray_answer(5, 0.0) is None
    reported = watch.stray_answer(5, 3.0)
    assert reported is not None
    assert "two nodes answer as number 5" in reported.text.words()
    assert watch.stray_answer(5, 50.0) is None, "reported once"
    watch.overdue(100.0)
    assert record.conflict == text("canopen.state-same-number")
    watch.overdue(110.1)
    assert record.conflict is None, "none for a minute"
    assert watch.stray_answer(5, 111.0) is None
    assert watch.stray_answer(5, 112.0) is not None, "reported again"


@pytest.mark.parametrize(
    ("code", "text"),
    [
        (0x0000, "error reset or no error"),
        (0x8150, "two nodes send with the same identifier"),
        (0x3210, "voltage inside the drive"),
        (0x7305, "additional modules"),
        (0xFF12, "specific to the maker"),
    ],
)
def test_emergency_codes(code: int, text: str) -> None:
    assert emergency_text(code).words() == text


def test_a_storm_of_emergencies_does_not_fill_the_log() -> None:
    """1000 in half a second, as from a flickering contact: ten are reported, then a count."""
    watch = NodeWatch()
    storm = [Frame(0x85, bytes([0x10, 0x50, 1]) + bytes(5))] * 999
    storm.append(Frame(0x85, bytes([0x00, 0x00, 0]) + bytes(5)))
    reported = [e for n, frame in enumerate(storm) for e in watch.observe(frame, n * 0.0005)]
    assert len(reported) == 10
    assert watch.record(5).emergencies == 1000
    assert watch.overdue(0.9) == []
    (summary,) = watch.overdue(1.0)
    assert "990 more emergencies" in summary.text.words()
    assert "0000h" in summary.text.words()
    assert watch.overdue(3.0) == []
    assert len(watch.observe(storm[0], 3.1)) == 1


@given(st.binary(max_size=9), st.integers(0, 0x7FF), st.booleans())
def test_the_watch_survives_any_frame(data: bytes, cob_id: int, remote: bool) -> None:
    watch = NodeWatch()
    watch.observe(Frame(cob_id, data, remote), 1.0)


@given(st.binary(max_size=8), st.integers(0, 0x7FF))
def test_no_frame_is_longer_than_the_worst_case(data: bytes, cob_id: int) -> None:
    bits = exact_bits(Frame(cob_id, data))
    assert 47 + 8 * len(data) <= bits <= worst_case_bits(len(data))


def _signal(index: int, kind: str = "INT32", station: int = 3) -> CyclicSignal:
    return CyclicSignal(station, Address(index, 0, kind), f"{index:04X}")  # type: ignore[arg-type]


def test_signals_are_packed_into_pdos_of_eight_bytes() -> None:
    inputs = [_signal(0x6064), _signal(0x606C), _signal(0x6041, "UINT16"), _signal(0x6077, "INT16")]
    pdos, left = plan(inputs, [_signal(0x607A)])
    assert left == ()
    assert [(p.direction, p.cob_id, p.size) for p in pdos] == [
        ("tx", 0x183, 8),
        ("tx", 0x283, 4),
        ("rx", 0x203, 4),
    ]
    assert (pdos[1].communication, pdos[1].mapping) == (0x1801, 0x1A01)


def test_the_ninth_long_signal_of_a_node_finds_no_room() -> None:
    inputs = [_signal(0x2000 + n) for n in range(9)]
    pdos, left = plan(inputs, [])
    assert len(pdos) == 4
    assert left == (inputs[8],)


def test_a_pdo_is_invalid_while_it_is_mapped() -> None:
    pdos, _ = plan([_signal(0x6064)], [])
    writes = [(w.index, w.subindex, w.data.hex()) for w in set_up(pdos[0])]
    assert writes == [
        (0x1800, 1, "83010080"),
        (0x1800, 2, "01"),
        (0x1A00, 0, "00"),
        (0x1A00, 1, "20006460"),
        (0x1A00, 0, "01"),
        (0x1800, 1, "83010000"),
    ]


def test_the_less_important_signals_make_room() -> None:
    inputs = [_signal(0x6041, "UINT16"), *(_signal(0x6064 + n) for n in range(7))]
    outputs = [_signal(0x6040, "UINT16"), _signal(0x607A), _signal(0x60FF)]
    # 750 bit times. With 6066h: PDOs of 6 and 8 bytes in, 6 and 4 out, and SYNC are
    # 115 + 135 + 115 + 95 + 55 = 515 bits (69 %); with 6067h too 610 bits (81 %).
    planned = plan_within_load(inputs, outputs, 0.0015, 500_000)
    assert planned.load is not None
    assert planned.load.bits_per_cycle == 515
    kept = {s.address.index for p in planned.pdos for s in p.signals}
    assert {0x6041, 0x6064, 0x6065, 0x6040, 0x607A, 0x60FF} <= kept
    assert [s.address.index for s, _ in planned.left_over] == [0x606A, 0x6069, 0x6068, 0x6067]
    assert all("80% full" in why.words() for _, why in planned.left_over)


def test_a_lost_station_is_made_harmless() -> None:
    outputs = [_signal(0x6040, "UINT16"), _signal(0x607A), _signal(0x60FF)]
    pdos, _ = plan([_signal(0x6064)], outputs)
    images = Images(pdos, 0.001, lambda *_: None)
    images.set_output((3, 0x6040, 0), b"\x0f\0")
    images.set_output((3, 0x607A, 0), b"\x39\x30\0\0")
    images.set_output((3, 0x60FF, 0), b"\x39\x30\0\0")
    images.neutralise(3, Halted(HaltCause.LOST))
    images.pack_axis(3)
    assert [bytes(f).hex() for f in images.frames.values()] == ["060039300000", "00000000"]
    assert images.axes[3].halted == Halted(HaltCause.LOST)


def test_padding_is_cut_and_other_bytes_are_kept() -> None:
    assert fitted(b"\x05\0\0\0", 2) == b"\x05\0"
    assert fitted(b"\xfe\xff\xff\xff", 2) == b"\xfe\xff"
    assert fitted(b"\x05\0\x01\0", 2) == b"\x05\0\x01\0"
    assert fitted(b"\x05", 2) == b"\x05"


def test_version_numbers_and_texts() -> None:
    assert readable(b"V1.2\0\0") == "V1.2"
    assert readable(b"\x65\x00") == "101"
    assert readable(b"M\xfcller 90\xb0\0rest") == "Müller 90°", "as the parameter itself is shown"


class LoopOnADeadBus:
    """As much of the SYNC loop as a halt needs."""

    bus_lost = True

    def __init__(self) -> None:
        self.halted: list[int | None] = []

    def halt(self, station: int | None, _why: Halted) -> None:
        self.halted.append(station)


async def test_a_halt_that_nobody_receives_does_not_say_that_it_was_received() -> None:
    """STOP reported that it had reached the axis while the adapter was gone."""
    nothing: Any = None
    url = parse_canopen_url("canopen://virtual/can0")
    cyclic = CanopenCyclic(nothing, url, nothing, nothing, nothing)
    cyclic._loop = loop = LoopOnADeadBus()  # type: ignore[assignment]
    with pytest.raises(LinkLost, match="bus is lost"):
        await cyclic.halt(3)
    assert loop.halted == [3], "for when it is back"
    loop.bus_lost = False
    await cyclic.halt(3)


def test_a_fixed_mapping_is_reported_as_such_and_leaves_nothing_behind() -> None:
    """The put-back of what never changed was refused as well, and hid the reason."""
    objects = {
        (0x1800, 1): (0x40000185).to_bytes(4, "little"),
        (0x1800, 2): b"\xff",
        (0x1A00, 0): b"\x01",
        (0x1A00, 1): (0x60410010).to_bytes(4, "little"),
    }
    before = dict(objects)

    def read(_station: int, index: int, subindex: int) -> bytes:
        if (index, subindex) not in objects:
            raise Rejected("the drive has no such object", abort_code=0x06020000)
        return objects[index, subindex]

    def write(_station: int, index: int, subindex: int, data: bytes) -> None:
        if index == 0x1A00:
            raise Rejected("the object can only be read", abort_code=0x06010002)
        objects[index, subindex] = data

    setup = DriveSetup(read, write, own_id=127)
    signal = CyclicSignal(5, Address(0x6064, 0, "INT32"), "position")
    with pytest.raises(NotAllowed, match="does not accept 6064:00 in the mapping of PDO 1"):
        setup.map_pdos([PdoPlan(5, "tx", 0, (signal,))])
    setup.undo()
    assert objects == before
