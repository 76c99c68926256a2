"""The flight recorder's files, read by programs that are not ours."""

from __future__ import annotations

import json
import shutil
import struct
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from drivers.flight.kinds import can_data, can_ring, ethercat_ring, serial_ring
from drivers.flight.pcapng import ETHERNET, Frame, Note, file_of
from drivers.flight.ring import FrameRing

NOW = 1_800_000_000_123_456_789


@dataclass
class Packet:
    """A packet as tshark shows it."""

    time_ns: int
    outbound: bool
    comments: list[str]
    data: bytes
    interface: str
    encapsulation: str
    layers: dict[str, Any]


Decoder = Callable[[bytes], list[Packet]]


@pytest.fixture
def packets(tmp_path: Path) -> Decoder:
    if shutil.which("tshark") is None:
        pytest.skip("tshark is not installed: .ci/run installs it")

    def run(data: bytes) -> list[Packet]:
        path = tmp_path / "frames.pcapng"
        path.write_bytes(data)
        done = subprocess.run(
            ["tshark", "-r", str(path), "-T", "json", "-x"],
            capture_output=True,
            check=True,
            env={"PATH": "/usr/bin:/bin", "HOME": str(tmp_path)},
        )
        found = json.loads(done.stdout, object_pairs_hook=_merged)
        return [_packet(each["_source"]["layers"]) for each in found]

    return run


def _merged(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """tshark repeats the name of a field that a packet has several times."""
    found: dict[str, Any] = {}
    for name, value in pairs:
        if name in found:
            before = found[name]
            found[name] = [*(before if isinstance(before, list) else [before]), value]
        else:
            found[name] = value
    return found


def _packet(layers: dict[str, Any]) -> Packet:
    frame = layers["frame"]
    seconds, _, fraction = frame["frame.time_epoch"].partition(".")
    flags = frame.get("frame.packet_flags_tree", {})
    comment = layers.get("pkt_comment", {}).get("frame.comment", [])
    return Packet(
        time_ns=int(seconds) * 1_000_000_000 + int(fraction.ljust(9, "0")),
        outbound=int(flags["frame.packet_flags_direction"], 0) == 2,
        comments=[comment] if isinstance(comment, str) else list(comment),
        data=bytes.fromhex(layers["frame_raw"][0]),
        interface=frame["frame.interface_id_tree"]["frame.interface_name"],
        encapsulation=frame["frame.encap_type"],
        layers=layers,
    )


def fprd(station: int, register: int) -> bytes:
    """A frame that reads two bytes of a register of one station (ETG.1000.4 clause 5.4)."""
    datagram = struct.pack("<BBHHHH", 4, 7, 0x1000 + station, register, 2, 0) + bytes(4)
    head = b"\xff" * 6 + b"\x01" * 6 + b"\x88\xa4"
    return (head + struct.pack("<H", len(datagram) | 0x1000) + datagram).ljust(60, b"\0")


def test_structure_times_directions_and_comments(packets: Decoder) -> None:
    frames = [Frame(NOW, True, b"\x01" * 60), Frame(NOW + 1, False, b"\x02" * 61)]
    notes = [Note(NOW + 1, "state: OP"), Note(NOW + 9, "fault: 7305h", 1)]
    sent, received = packets(file_of(frames, notes, ETHERNET, "eth0"))
    assert [p.time_ns for p in (sent, received)] == [NOW, NOW + 1], "nanoseconds"
    assert [p.data for p in (sent, received)] == [f.data for f in frames]
    assert [p.outbound for p in (sent, received)] == [True, False]
    assert sent.interface == "eth0"
    assert sent.comments == []
    assert received.comments == ["state: OP", "fault: 7305h"]


def test_a_bus_without_frames_is_a_whole_file(packets: Decoder) -> None:
    data = file_of([], [Note(NOW, "lost")], ETHERNET, "eth0")
    assert packets(data) == []
    assert b"lost" in data


def test_nothing_says_who_or_where() -> None:
    """Neither hardware (2) nor system (3) stands among the options of the section."""
    data = file_of([], [], ETHERNET, "eth0")
    assert struct.unpack_from("<HH", data, 24) == (4, len("servodeck")), "the programme alone"
    assert struct.unpack_from("<HH", data, 24 + 4 + 12) == (0, 0)


def test_a_minute_is_kept_and_no_more(packets: Decoder) -> None:
    ring = ethercat_ring("eth0")
    for second in range(100):
        ring.put(NOW + second * 1_000_000_000, True, fprd(1, 0x130))
    kept = packets(ring.file())
    assert len(kept) == 61
    assert kept[0].time_ns == NOW + 39_000_000_000
    assert ring.dropped == 0


def test_memory_is_bounded(packets: Decoder) -> None:
    ring = FrameRing(ETHERNET, "eth0", lambda _data, _station: True, max_bytes=100_000)
    for number in range(2_000):
        ring.put(NOW + number, True, bytes(1000))
    assert ring.bytes_held <= 100_000
    assert ring.dropped > 1_800
    assert len(packets(ring.file())) == 2_000 - ring.dropped


def test_one_station_of_a_segment(packets: Decoder) -> None:
    ring = ethercat_ring("eth0")
    ring.put(NOW, True, fprd(1, 0x130))
    ring.put(NOW + 1, True, fprd(2, 0x130))
    assert [p.data for p in packets(ring.file(2))] == [fprd(2, 0x130)]


def test_one_node_of_a_can_bus(packets: Decoder) -> None:
    ring = can_ring("can0")
    for identifier, data in ((0x181, b"\1"), (0x182, b"\2"), (0x080, b""), (0, b"\x01\x02")):
        ring.put(NOW, True, can_data(identifier, data, remote=False))
    found = packets(ring.file(2))
    identifiers = [int.from_bytes(p.data[:4], "big") for p in found]
    assert identifiers == [0x182, 0x080, 0x000]


def test_one_address_of_a_serial_line(packets: Decoder) -> None:
    ring = serial_ring("/dev/ttyUSB0")
    ring.put(NOW, True, bytes.fromhex("010300000001840a"))
    ring.put(NOW, True, bytes.fromhex("020300000001840a"))
    (found,) = packets(ring.file(2))
    assert (ring.link_type, found.data[0]) == (147, 2)
    # tshark's own number of LINKTYPE_USER0 (WTAP_ENCAP_USER0).
    assert found.encapsulation == "45"


def test_ethercat_is_decoded(packets: Decoder) -> None:
    ring = ethercat_ring("eth0")
    ring.put(NOW, True, fprd(3, 0x130))
    (packet,) = packets(ring.file())
    assert packet.layers["frame"]["frame.protocols"].startswith("eth:ethertype:ecatf:ecat")
    text = json.dumps(packet.layers["ecat"])
    assert '"ecat.adp": "0x1003"' in text
    assert '"ecat.ado": "0x0130"' in text


def test_a_can_frame_is_decoded(packets: Decoder) -> None:
    ring = can_ring("can0")
    ring.put(NOW, True, can_data(0x605, bytes.fromhex("4018100100000000"), remote=False))
    (packet,) = packets(ring.file())
    assert int(packet.layers["can"]["can.id"], 0) == 0x605
