"""A master made of bytes: frames are put together and split by the standard's layout."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from drivers.virtual.device import Device
from drivers.virtual.wires.ethercat.segment import Segment
from drivers.virtual.wires.ethercat.slave import Slave

from .dictionary_device import DictionaryDevice, make_profile

APRD, APWR, APRW, FPRD, FPWR, FPRW, BRD, BWR, BRW, LRD, LWR, LRW, ARMW, FRMW = range(1, 15)

INIT, PREOP, BOOT, SAFEOP, OP = 1, 2, 3, 4, 8
MBX_OUT, MBX_IN, MBX_SIZE = 0x1000, 0x1100, 256
OUT, IN = 0x1200, 0x1500


class ManualClock:
    """Time that only a test moves."""

    def __init__(self) -> None:
        self.time_ns = 0

    def arrival(self, process_data: bool, cycle_ns: int, age_ns: int = 0) -> int:
        return self.time_ns

    def now(self, until_ns: int | None = None) -> int:
        return self.time_ns if until_ns is None else min(self.time_ns, until_ns)

    def ahead_s(self, wire_ns: int) -> float | None:
        return (wire_ns - self.time_ns) * 1e-9

    def grid(self, start_ns: int, cycle_ns: int) -> int:
        return start_ns


@dataclass(frozen=True)
class Answer:
    """One datagram as it came back."""

    command: int
    adp: int
    ado: int
    data: bytes
    wkc: int


def frame(*parts: tuple[int, int, int, bytes]) -> bytes:
    """Ethernet frame with datagrams (command, ADP, ADO, data), working counters 0."""
    body = b""
    for number, (command, adp, ado, data) in enumerate(parts):
        more = 0x8000 if number + 1 < len(parts) else 0
        address = (
            struct.pack("<I", adp) if command in (LRD, LWR, LRW) else struct.pack("<HH", adp, ado)
        )
        body += bytes([command, number]) + address
        body += struct.pack("<HH", len(data) | more, 0) + data + b"\0\0"
    head = b"\xff" * 6 + b"\x01" * 6 + b"\x88\xa4" + struct.pack("<H", len(body) | 0x1000)
    return (head + body).ljust(60, b"\0")


def parse(raw: bytes) -> list[Answer]:
    answers = []
    at = 16
    while True:
        command = raw[at]
        adp, ado = struct.unpack_from("<HH", raw, at + 2)
        word = struct.unpack_from("<H", raw, at + 6)[0]
        length = word & 0x7FF
        data = raw[at + 10 : at + 10 + length]
        wkc = struct.unpack_from("<H", raw, at + 10 + length)[0]
        answers.append(Answer(command, adp, ado, data, wkc))
        if not word & 0x8000:
            return answers
        at += 12 + length


class Wire:
    """A segment of dictionary drives with a time that stands still, and a master's moves."""

    def __init__(self, count: int = 1, *, real: Device | None = None, **profile: object) -> None:
        self.clock = ManualClock()
        self.devices = [
            DictionaryDevice(make_profile(**profile))  # type: ignore[arg-type]
            for _ in range(count if real is None else 0)
        ]
        drives: list[Device] = list(self.devices) if real is None else [real]
        self.slaves = [Slave(device, self.clock) for device in drives]
        self.segment = Segment(self.slaves, self.clock)
        self._counter = 0
        self.boxes = (MBX_OUT, MBX_IN, MBX_SIZE)
        """Addresses and size of the two mailboxes."""

    @property
    def device(self) -> DictionaryDevice:
        return self.devices[0]

    def send(self, *parts: tuple[int, int, int, bytes]) -> list[Answer]:
        raw = self.segment.process_frame(frame(*parts))
        assert raw is not None, "the frame did not come back"
        return parse(raw)

    def one(self, command: int, adp: int, ado: int, data: bytes) -> Answer:
        return self.send((command, adp, ado, data))[0]

    def read(self, ado: int, length: int, station: int = 0x1001) -> Answer:
        return self.one(FPRD, station, ado, bytes(length))

    def value(self, ado: int, length: int, station: int = 0x1001) -> int:
        return int.from_bytes(self.read(ado, length, station).data, "little")

    def write(self, ado: int, data: bytes, station: int = 0x1001) -> Answer:
        return self.one(FPWR, station, ado, data)

    def number(self) -> None:
        """Station addresses 1001h, 1002h…"""
        for position in range(len(self.slaves)):
            address = struct.pack("<H", 0x1001 + position)
            assert self.one(APWR, -position & 0xFFFF, 0x0010, address).wkc == 1

    def state(self, station: int = 0x1001) -> tuple[int, int]:
        """AL status and AL status code."""
        data = self.read(0x0130, 6, station).data
        return struct.unpack_from("<H", data)[0], struct.unpack_from("<H", data, 4)[0]

    def request(self, state: int, station: int = 0x1001) -> tuple[int, int]:
        self.write(0x0120, struct.pack("<H", state), station)
        return self.state(station)

    def set_mailbox(self, station: int = 0x1001) -> None:
        out, back, size = self.boxes
        managers = struct.pack("<HHBBBB", out, size, 0x26, 0, 1, 0)
        managers += struct.pack("<HHBBBB", back, size, 0x22, 0, 1, 0)
        self.write(0x0800, managers, station)

    def to_preop(self) -> None:
        self.number()
        for n in range(len(self.slaves)):
            self.set_mailbox(0x1001 + n)
            assert self.request(PREOP, 0x1001 + n) == (PREOP, 0)

    def set_process_data(
        self, n: int = 0, out_size: int = 6, in_size: int = 8, control: int = 0x64
    ) -> None:
        """SM2/SM3 and two FMMUs: outputs one behind the other from 0, inputs from 0x100."""
        station = 0x1001 + n
        self.write(0x0810, struct.pack("<HHBBBB", OUT, out_size, control, 0, 1, 0), station)
        self.write(0x0818, struct.pack("<HHBBBB", IN, in_size, 0x20, 0, 1, 0), station)
        self.write(0x0600, fmmu(n * 6, 6, OUT, write=True), station)
        self.write(0x0610, fmmu(0x100 + n * 8, 8, IN, write=False), station)

    def to_safeop(self) -> None:
        self.to_preop()
        for n in range(len(self.slaves)):
            self.set_process_data(n)
            assert self.request(SAFEOP, 0x1001 + n) == (SAFEOP, 0)

    def outputs(self, control: int = 0, target: int = 0) -> bytes:
        return struct.pack("<Hi", control, target)

    def to_op(self) -> None:
        self.to_safeop()
        count = len(self.slaves)
        for n in range(count):
            self.write(0x0120, struct.pack("<H", OP), 0x1001 + n)
        assert self.one(LWR, 0, 0, self.outputs() * count).wkc == count
        for n in range(count):
            assert self.state(0x1001 + n) == (OP, 0)

    # -- mailbox --------------------------------------------------------------------------------

    def post(self, payload: bytes, kind: int = 3, counter: int | None = None) -> Answer:
        """Write one mailbox message, full length."""
        if counter is None:
            self._counter = self._counter % 7 + 1
            counter = self._counter
        message = struct.pack("<HHBB", len(payload), 0, 0, kind | counter << 4) + payload
        return self.write(self.boxes[0], message.ljust(self.boxes[2], b"\0"))

    def fetch(self) -> bytes:
        """Payload of the answer, with its mailbox type checked to be CoE."""
        raw = self.fetch_raw()
        length, _, _, kind = struct.unpack_from("<HHBB", raw)
        assert kind & 0x0F == 3
        return raw[6 : 6 + length]

    def fetch_raw(self) -> bytes:
        answer = self.read(self.boxes[1], self.boxes[2])
        assert answer.wkc == 1, "no answer in the mailbox"
        return answer.data

    def coe(self, service: int, body: bytes) -> bytes:
        """One CoE request and the payload of its answer."""
        assert self.post(struct.pack("<H", service << 12) + body).wkc == 1
        return self.fetch()

    def sdo(self, body: bytes) -> bytes:
        """One SDO request (8 bytes or more); answer behind the CoE header."""
        answer = self.coe(2, body)
        assert answer[:2] in (b"\x00\x30", b"\x00\x20")
        return answer[2:]

    def upload(self, index: int, subindex: int = 0) -> bytes:
        answer = self.sdo(struct.pack("<BHBI", 0x40, index, subindex, 0))
        assert answer[0] & 0xF3 == 0x43, answer.hex()
        return answer[4 : 8 - (answer[0] >> 2 & 3)]

    def download(self, index: int, subindex: int, data: bytes) -> bytes:
        command = 0x23 | (4 - len(data)) << 2
        head = struct.pack("<BHB", command, index, subindex)
        return self.sdo(head + data.ljust(4, b"\0"))


def fmmu(logical: int, length: int, physical: int, *, write: bool) -> bytes:
    kind = 2 if write else 1
    return struct.pack("<IHBBHBBB3x", logical, length, 0, 7, physical, 0, kind, 1)
