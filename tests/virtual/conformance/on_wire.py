"""Virtual drives behind their real wires: EtherCAT frames or CAN frames, in time that a test moves.

Every access is a datagram with a CoE mailbox, or SDO frames of a CAN bus, byte by byte; nothing
reaches into the drive but the troubles that are made on purpose.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from typing import Any

from drivers.canopen.frames import SDO_REQUEST, Frame
from drivers.virtual.firmware import make_device
from drivers.virtual.firmware.servo import VirtualServo
from drivers.virtual.mechanics import MechanicsSpec
from drivers.virtual.wires.canopen import CanopenNode
from profiles import load_profile
from profiles.schema import Profile
from tests.wire.ethercat_slave.frames import IN, LWR, OUT, SAFEOP, Wire, fmmu

_FORM = {
    "BOOL": "<B",
    "INT8": "<b",
    "UINT8": "<B",
    "INT16": "<h",
    "UINT16": "<H",
    "INT32": "<i",
    "UINT32": "<I",
}
ETHERCAT = ("mms7", "m6l", "r6l", "ep3e", "generic402")
EVERY = (*ETHERCAT, "ds_c")
NODE = 5
SDO_RESPONSE = 0x580


class Aborted(Exception):
    """The drive refused; ``code`` is the SDO abort code."""

    def __init__(self, code: int) -> None:
        super().__init__(f"{code:#010x}")
        self.code = code


class EthercatWire:
    """Frames of a master to one slave in Pre-Operational."""

    def __init__(self, device: VirtualServo) -> None:
        self.wire = Wire(real=device)
        self.wire.to_preop()
        self.emergencies: list[bytes] = []

    def _sdo(self, body: bytes) -> bytes:
        """One SDO request; emergencies that are in the mailbox first are kept."""
        answer = self.wire.coe(2, body)
        while answer[:2] == b"\x00\x10":
            self.emergencies.append(answer[2:])
            answer = self.wire.fetch()
        assert answer[:2] in (b"\x00\x30", b"\x00\x20")
        return answer[2:]

    def upload(self, index: int, subindex: int) -> bytes:
        answer = self._sdo(struct.pack("<BHBI", 0x40, index, subindex, 0))
        if answer[0] == 0x80:
            raise Aborted(struct.unpack_from("<I", answer, 4)[0])
        if answer[0] & 2:
            return bytes(answer[4 : 8 - (answer[0] >> 2 & 3)])
        size = struct.unpack_from("<I", answer, 4)[0]
        return bytes(answer[8 : 8 + size])

    def download(self, index: int, subindex: int, data: bytes) -> None:
        head = struct.pack("<BHB", 0x23 | (4 - len(data)) << 2, index, subindex)
        answer = self._sdo(head + data.ljust(4, b"\0"))
        if answer[0] == 0x80:
            raise Aborted(struct.unpack_from("<I", answer, 4)[0])
        assert answer[0] == 0x60

    def advance(self, nanoseconds: int) -> None:
        self.wire.clock.time_ns += nanoseconds
        self.wire.segment.settle()


class CanWire:
    """Expedited SDO frames to one node."""

    def __init__(self, device: VirtualServo) -> None:
        self.time_ns = 0
        self.node = CanopenNode(device, NODE, lambda: self.time_ns)

    def _ask(self, request: bytes) -> bytes:
        self.node.take(Frame(SDO_REQUEST + NODE, request))
        for _ in range(100):
            for frame in self.node.due():
                if frame.cob_id == SDO_RESPONSE + NODE:
                    if frame.data[0] == 0x80:
                        raise Aborted(struct.unpack_from("<I", frame.data, 4)[0])
                    return frame.data
            self.time_ns += 100_000
        raise AssertionError("no answer")

    def upload(self, index: int, subindex: int) -> bytes:
        answer = self._ask(struct.pack("<BHBI", 0x40, index, subindex, 0))
        return bytes(answer[4 : 8 - (answer[0] >> 2 & 3)])

    def download(self, index: int, subindex: int, data: bytes) -> None:
        head = struct.pack("<BHB", 0x23 | (4 - len(data)) << 2, index, subindex)
        assert self._ask(head + data.ljust(4, b"\0"))[0] == 0x60

    def advance(self, nanoseconds: int) -> None:
        end = self.time_ns + nanoseconds
        while self.time_ns < end:
            self.time_ns = min(end, self.time_ns + 5_000_000)
            self.node.due()


class OnWire:
    """One drive with typed access over its wire."""

    def __init__(self, drive: str, mechanics: MechanicsSpec | None, folder: Any = None) -> None:
        device = make_device(drive, mechanics, folder)
        assert isinstance(device, VirtualServo)
        self.drive = drive
        self.profile: Profile = load_profile(drive)
        self.device = device
        device.advance(0)
        self.wire = CanWire(device) if drive == "ds_c" else EthercatWire(device)
        units = device.core.units
        self.per_rev = abs(units.position_per_rad) * 6.283185307179586
        self.speed_per_rev_s = abs(units.speed_per_rad_s) * 6.283185307179586

    # --- access ----------------------------------------------------------------------------
    def get(self, key: str) -> int:
        parameter = self.profile.by_key[key]
        data = self.wire.upload(int(key[:4], 16), int(key[5:], 16))
        value: int = struct.unpack(_FORM[parameter.type], data)[0]
        return value

    def set(self, key: str, raw: float) -> None:
        parameter = self.profile.by_key[key]
        self.wire.download(
            int(key[:4], 16), int(key[5:], 16), struct.pack(_FORM[parameter.type], round(raw))
        )

    def set_all(self, values: Mapping[str, float]) -> None:
        for key, raw in values.items():
            self.set(key, raw)

    def has(self, key: str) -> bool:
        return key in self.profile.by_key

    def run(self, seconds: float) -> None:
        self.wire.advance(round(seconds * 1e9))

    def until(self, condition: Callable[[], bool], limit_s: float, step_s: float = 2e-3) -> float:
        """Seconds until the condition holds; fails the test after ``limit_s``."""
        passed = 0.0
        while not condition():
            assert passed < limit_s, "not reached in time"
            self.run(step_s)
            passed += step_s
        return passed

    def restart_network(self) -> None:
        """From Pre-Operational to Init and back."""
        assert isinstance(self.wire, EthercatWire)
        for state in (1, 2):
            assert self.wire.wire.request(state) == (state, 0)

    # --- process data ----------------------------------------------------------------------
    def operate(self, rx_pdo: int, tx_pdo: int, outputs: bytes, in_size: int) -> None:
        """Assign one PDO each way and go to Op with these outputs."""
        assert isinstance(self.wire, EthercatWire)
        wire, size = self.wire.wire, len(outputs)
        for assigned, pdo in (("1C12", rx_pdo), ("1C13", tx_pdo)):
            index = int(assigned, 16)
            size_0 = 2 if self.drive == "mms7" else 1
            self.wire.download(index, 0, bytes(size_0))
            self.wire.download(index, 1, struct.pack("<H", pdo))
            self.wire.download(index, 0, (1).to_bytes(size_0, "little"))
        wire.write(0x0810, struct.pack("<HHBBBB", OUT, size, 0x64, 0, 1, 0))
        wire.write(0x0818, struct.pack("<HHBBBB", IN, in_size, 0x20, 0, 1, 0))
        wire.write(0x0600, fmmu(0, size, OUT, write=True))
        wire.write(0x0610, fmmu(0x100, in_size, IN, write=False))
        assert wire.request(SAFEOP) == (SAFEOP, 0)
        wire.write(0x0120, struct.pack("<H", 8))
        self.cycle(outputs)  # lets it enter Op; outputs act from the next ones on
        assert wire.state() == (8, 0)
        self.cycle(outputs)

    def cycle(self, outputs: bytes) -> None:
        """One frame of process data."""
        assert isinstance(self.wire, EthercatWire)
        assert self.wire.wire.one(LWR, 0, 0, outputs).wkc == 1

    def exchange(self, outputs: bytes, seconds: float) -> None:
        """Frames every 10 ms, which the watchdog of the sync manager is content with."""
        for _ in range(round(seconds / 0.01)):
            self.cycle(outputs)
            self.run(0.01)

    def leave_operation(self) -> None:
        """Back to Safe-Op."""
        assert isinstance(self.wire, EthercatWire)
        assert self.wire.wire.request(SAFEOP)[0] == SAFEOP

    # --- state machine ---------------------------------------------------------------------
    @property
    def status(self) -> int:
        return self.get("6041:00")

    @property
    def state(self) -> int:
        """Bits that show the state; the echo of a DS_C."""
        return self.status & (0x87 if self.drive == "ds_c" else 0x6F)

    def command(self, *words: int) -> None:
        """Control words one behind the other, 12 ms apart as the DS_C requires (003:279)."""
        for word in words:
            self.set("6040:00", word)
            self.run(0.012)

    def enable(self, mode: int) -> None:
        self.set("6060:00", mode)
        self.command(6, 7, 15)

    @property
    def speed_mode(self) -> int:
        return 3 if 3 in self.profile.supported_modes else 9

    @property
    def speed_rev_s(self) -> float:
        """Real speed of the shaft."""
        return self.device.axis.speed_rad_s / 6.283185307179586

    @property
    def angle_rev(self) -> float:
        """Real angle of the shaft."""
        return self.device.axis.angle_rad / 6.283185307179586

    def ramp(self, rev_s2: float) -> float:
        """Raw value of a ramp object for this acceleration."""
        units = self.device.core.units
        if units.ramps_are_times_ms:
            return units.ramp_reference_rad_s / (rev_s2 * 6.283185307179586) * 1000
        return rev_s2 * self.per_rev

    def turn(self, rev_s: float, seconds: float = 1.0) -> None:
        """Enabled and at this speed."""
        self.set_ramps()
        self.enable(self.speed_mode)
        self.set("60FF:00", rev_s * self.speed_per_rev_s)
        self.run(seconds)
        assert abs(self.speed_rev_s - rev_s) < 0.02 * abs(rev_s), self.speed_rev_s

    def set_ramps(self) -> None:
        """6084h 50 rev/s², 6085h 100 rev/s², 60C6h 200 rev/s², where the drive has them."""
        for key, ramp in (("6083:00", 50), ("6084:00", 50), ("6085:00", 100), ("60C6:00", 200)):
            if self.has(key):
                self.set(key, self.ramp(ramp))
