"""A virtual CANopen node: CiA 301 around a `Device`, without I/O.

`CanopenNode` takes frames and returns frames with their due times; a wire
(`drivers.virtual.wires.can_wire`) transfers them. Faults are injected by attributes and methods:
``mute``, ``delay_answers``, ``reboot``, ``guard_repeats`` …; a duplicate node number is two nodes
on one wire.
"""

from __future__ import annotations

import struct
from collections.abc import Callable

from drivers.canopen import frames
from drivers.canopen.frames import Frame
from drivers.canopen.lss import codes
from drivers.canopen.lss.codes import LssIdentity
from drivers.virtual.device import (
    ABORT_LENGTH,
    ABORT_NO_DATA,
    ABORT_NO_OBJECT,
    ABORT_NO_SUBINDEX,
    ABORT_READ_ONLY,
    ABORT_VALUE_RANGE,
    Device,
    SdoAbort,
)
from drivers.virtual.wires.canopen_objects import CommunicationObjects, Pdo
from drivers.virtual.wires.lss import LssSlave
from drivers.virtual.wires.sdo_server import SdoServer

_STOPPED, _OPERATIONAL, _PREOPERATIONAL = 4, 5, 127
_HEARTBEAT_LOST = 0x8130
_PDO_TOO_SHORT = 0x8210
_OWN_CONSTANTS = (0x1000, 0x1001, 0x1018)
"""Device type, error register, identity: present even where the device has no such objects."""
_SERVO_DEVICE_TYPE = 0x00020192
_HISTORY = 8
#: Bits of the error register (CiA 301 clause 7.5.2.2): generic and communication error.
_COMMUNICATION_ERROR = 0x11


class CanopenNode:
    """One node. ``clock`` returns nanoseconds; called by one thread at a time."""

    def __init__(
        self,
        device: Device,
        node_id: int,
        clock: Callable[[], int],
        *,
        offers_block: bool = True,
    ) -> None:
        self.device = device
        self.lss = LssSlave(_identity(device), node_id)
        """With node-ID 255 (none) the node serves only LSS."""
        self.deaf = False
        """Set to another bit rate than the bus: receives nothing."""
        self.state = _PREOPERATIONAL
        self.mute = False
        """Receives everything and sends nothing."""
        self.guard_repeats = False
        """Answers node guarding with the same toggle bit each time."""
        self.stays_preoperational = False
        """Ignores NMT start."""
        self.deaf_to_sync = False
        self.silent_sdo = False
        """Answers no SDO request; everything else works."""
        self.refused: dict[int, int] = {}
        """Abort codes by object index: writes of these objects are refused."""
        self._clock = clock
        self._objects = self._objects_now()
        self._server = SdoServer(
            self._read, self._write, offers_block=offers_block, size=self._size
        )
        self._outbox: list[tuple[int, Frame]] = []
        self._answers_due_ns = 0
        self._delays: list[int] = []
        self._guard_toggle = 0
        self._own_errors: set[int] = set()
        self._history: list[int] = []
        self._heartbeat_due_ns = 0
        self._master_seen_ns: int | None = None
        self._syncs = 0
        self._pending: dict[int, bytes] = {}
        self._sent: dict[int, tuple[int, bytes]] = {}
        self._was_powered = False

    @property
    def node_id(self) -> int:
        """Present node-ID; 255 if it has none."""
        return self.lss.active_node

    def _objects_now(self) -> CommunicationObjects:
        return CommunicationObjects(self.device, min(self.node_id, 127))

    def delay_answers(self, seconds: float, count: int = 1) -> None:
        """Delay the next ``count`` SDO answers by ``seconds``; the order is kept."""
        self._delays += [round(seconds * 1e9)] * count

    def reboot(self) -> None:
        """Restart node and drive as after a power cycle."""
        self.device.power_cycle()
        self._boot(self._clock())

    def take(self, frame: Frame) -> None:
        """Process a frame received from the bus."""
        now = self._clock()
        self._follow_power(now)
        if not self.device.powered:
            return
        self.device.advance(now)
        if frame.cob_id == codes.REQUEST and not frame.remote:
            self._set_layers(frame.data, now)
        elif self.lss.unconfigured:
            return
        elif frame.cob_id == frames.NMT and len(frame.data) == 2:
            if frame.data[1] in (0, self.node_id):
                self._command(frame.data[0], now)
        elif frame.cob_id == self._objects.sync_cob & 0x7FF and not frame.remote:
            if not self.deaf_to_sync:
                self._sync(now)
        elif frame.cob_id == frames.SDO_REQUEST + self.node_id and self.state != _STOPPED:
            self._answer(frame.data, now)
        elif frame.cob_id == frames.HEARTBEAT + self.node_id and frame.remote:
            self._guard(now)
        elif frame.cob_id >> 7 == 0x0E and not frame.remote:
            if frame.cob_id & 0x7F == self._objects.consumer >> 16 & 0x7F:
                self._master_seen_ns = now
                self._clear_own(_HEARTBEAT_LOST, now)
        else:
            self._take_pdo(frame, now)

    def due(self) -> list[Frame]:
        """Return the frames that are due; also run all time-dependent functions."""
        now = self._clock()
        self._follow_power(now)
        if not self.device.powered:
            self._outbox.clear()
            return []
        self.device.advance(now)
        if not self.lss.unconfigured:
            self._beat(now)
            self._watch_master(now)
            self._report_emergencies(now)
        if self.state == _OPERATIONAL and not self.lss.unconfigured:
            self._send_events(now)
        ready = [frame for at, frame in self._outbox if at <= now]
        self._outbox = [(at, frame) for at, frame in self._outbox if at > now]
        return [] if self.mute else ready

    def next_due_s(self, longest_s: float) -> float:
        """Return the seconds until the next frame now queued is due, at most ``longest_s``."""
        if not self._outbox:
            return longest_s
        earliest = min(at for at, _ in self._outbox)
        return min(max((earliest - self._clock()) / 1e9, 0.0), longest_s)

    # Power, NMT and error control

    def _follow_power(self, now: int) -> None:
        if not self.device.powered:
            self.device.advance(now)
        if self.device.powered and not self._was_powered:
            self._boot(now)
        self._was_powered = self.device.powered

    def _boot(self, now: int) -> None:
        self._was_powered = self.device.powered
        self.lss.power_on()
        self._reset_communication(now)

    def _set_layers(self, data: bytes, now: int) -> None:
        """Process an LSS request.

        A node without node-ID that was given one starts when it is switched to the waiting state;
        any other node takes a new node-ID with the next reset communication (CiA 305 clause 3.5).
        """
        answer = self.lss.take(data)
        if answer is not None:
            self._say(codes.ANSWER, answer, now)
        waiting = data[:2] == bytes([codes.SWITCH_ALL, codes.WAITING])
        if waiting and self.lss.unconfigured and self.lss.pending_node != codes.NO_NODE_ID:
            self._reset_communication(now)

    def _reset_communication(self, now: int) -> None:
        if self.lss.active_node != self.lss.pending_node:
            self.lss.active_node = self.lss.pending_node
            self._objects = self._objects_now()
        self._objects.reset()
        self._outbox.clear()
        self._answers_due_ns = 0
        self._guard_toggle = 0
        self._master_seen_ns = None
        self._syncs = 0
        self._pending.clear()
        self._sent.clear()
        self._own_errors.clear()
        self._server.reset()
        self.state = _PREOPERATIONAL
        if not self.lss.unconfigured:
            self._say(frames.HEARTBEAT + self.node_id, b"\0", now)

    def _command(self, command: int, now: int) -> None:
        if command == frames.NMT_RESET_NODE:
            self.reboot()
        elif command == frames.NMT_RESET_COMMUNICATION:
            self._reset_communication(now)
        elif command == frames.NMT_START and self.stays_preoperational:
            return
        elif command == frames.NMT_START:
            self._objects.bind()
            self.state = _OPERATIONAL
        elif command == frames.NMT_STOP:
            self.state = _STOPPED
            self.device.communication_lost("NMT stopped")
        elif command == frames.NMT_PREOPERATIONAL:
            self.state = _PREOPERATIONAL

    def _guard(self, now: int) -> None:
        if self._objects.heartbeat_ms:
            # A node uses one of the two, and heartbeat has priority (CiA 301 clause 7.2.8.2.2).
            return
        self._say(
            frames.HEARTBEAT + self.node_id, bytes([self.state | self._guard_toggle << 7]), now
        )
        if not self.guard_repeats:
            self._guard_toggle ^= 1

    def _beat(self, now: int) -> None:
        period = self._objects.heartbeat_ms * 1_000_000
        if self._objects.take_heartbeat_change():
            # A newly written period starts now.
            self._heartbeat_due_ns = now
        if period and now >= self._heartbeat_due_ns:
            self._heartbeat_due_ns += period * (1 + (now - self._heartbeat_due_ns) // period)
            self._say(frames.HEARTBEAT + self.node_id, bytes([self.state]), now)

    def _watch_master(self, now: int) -> None:
        limit = (self._objects.consumer & 0xFFFF) * 1_000_000
        if limit and self._master_seen_ns is not None and now - self._master_seen_ns > limit:
            self._master_seen_ns = None
            self._raise_own(_HEARTBEAT_LOST, now)
            self.device.communication_lost("heartbeat of the master")

    # SDO

    def _answer(self, request: bytes, now: int) -> None:
        answers = self._server.request(request)
        if not answers or self.silent_sdo:
            return
        delay = self._delays.pop(0) if self._delays else 0
        # A drive answers in order: no answer overtakes a delayed one.
        self._answers_due_ns = max(self._answers_due_ns, now + delay)
        for data in answers:
            self._say(frames.SDO_ANSWER + self.node_id, data, self._answers_due_ns)

    def _read(self, index: int, subindex: int) -> bytes:
        if self._objects.owns(index):
            return self._objects.read(index, subindex)
        if (index, subindex) == (0x1001, 0):
            return bytes([self._error_register()])
        try:
            value = self.device.read(index, subindex)
        except SdoAbort as refusal:
            if refusal.code not in (ABORT_NO_OBJECT, ABORT_NO_SUBINDEX):
                raise
            return self._standard(index, subindex, refusal)
        if (index, subindex) == (0x1000, 0) and not any(value):
            # Manuals list no value for the device type, but drives have one.
            return struct.pack("<I", _SERVO_DEVICE_TYPE)
        return value

    def _standard(self, index: int, subindex: int, refusal: SdoAbort) -> bytes:
        """Return mandatory objects of CiA 301 that the drive's dictionary does not contain."""
        identity = self.device.profile.identity
        if (index, subindex) == (0x1000, 0):
            return struct.pack("<I", _SERVO_DEVICE_TYPE)
        if index == 0x1003:
            return self._past_error(subindex)
        if index == 0x1018 and identity.vendor_id is not None:
            known = [identity.vendor_id, identity.product_code, identity.revision]
            values = [v for v in known if v is not None]
            if subindex == 0:
                return bytes([len(values)])
            if subindex <= len(values):
                return struct.pack("<I", values[subindex - 1])
            raise SdoAbort(ABORT_NO_SUBINDEX)
        raise refusal

    def _past_error(self, subindex: int) -> bytes:
        """Return 1003h; an empty entry aborts with "no data" (CiA 301 clause 7.5.2.4)."""
        if subindex == 0:
            return bytes([len(self._history)])
        if subindex > _HISTORY:
            raise SdoAbort(ABORT_NO_SUBINDEX)
        if subindex > len(self._history):
            raise SdoAbort(ABORT_NO_DATA)
        return struct.pack("<I", self._history[subindex - 1])

    def _write(self, index: int, subindex: int, data: bytes) -> None:
        if index in self.refused:
            raise SdoAbort(self.refused[index])
        if self._objects.owns(index):
            self._objects.write(index, subindex, data)
        elif index == 0x1003 and index not in self.device.indices():
            if subindex > _HISTORY:
                raise SdoAbort(ABORT_NO_SUBINDEX)
            if subindex:
                raise SdoAbort(ABORT_READ_ONLY)
            if data != b"\0":
                # Only 0 may be written; it clears the list.
                raise SdoAbort(ABORT_VALUE_RANGE if len(data) == 1 else ABORT_LENGTH)
            self._history.clear()
        elif index in _OWN_CONSTANTS and index not in self.device.indices():
            self._read(index, subindex)
            raise SdoAbort(ABORT_READ_ONLY)
        else:
            self.device.write(index, subindex, data)

    def _size(self, index: int, subindex: int) -> int | None:
        """Return the bytes of an object with fixed length, for writes without a length."""
        if self._objects.owns(index):
            return len(self._objects.read(index, subindex))
        try:
            return self.device.entry(index, subindex).bit_length // 8 or None
        except SdoAbort:
            return None

    # Emergencies

    def _report_emergencies(self, now: int) -> None:
        for code, register, extra in self.device.take_emergencies():
            self._emergency(code, register, extra, now)

    def _error_register(self) -> int:
        """Return 1001h: the drive's errors, if it has the object, plus network errors."""
        try:
            register = self.device.read(0x1001, 0)[0]
        except SdoAbort:
            register = 0
        return register | (_COMMUNICATION_ERROR if self._own_errors else 0)

    def _raise_own(self, code: int, now: int) -> None:
        """Send a network error once while it is present (CiA 301 clause 7.2.7.1)."""
        if code not in self._own_errors:
            self._own_errors.add(code)
            self._emergency(code, self._error_register(), bytes(5), now)

    def _clear_own(self, code: int, now: int) -> None:
        """Report the end of a network error: code 0 and the remaining error register."""
        if code in self._own_errors:
            self._own_errors.discard(code)
            self._emergency(0, self._error_register(), bytes(5), now)

    def _emergency(self, code: int, register: int, extra: bytes, now: int) -> None:
        if code:
            self._history = [code, *self._history][:_HISTORY]
        if self.state != _STOPPED:
            head = struct.pack("<HB", code, register | self._error_register())
            data = head + extra[:5].ljust(5, b"\0")
            self._say(frames.EMERGENCY + self.node_id, data, now)

    # Process data

    def _take_pdo(self, frame: Frame, now: int) -> None:
        if self.state != _OPERATIONAL:
            return
        for pdo in self._objects.pdos:
            if not pdo.valid or pdo.image is None or pdo.identifier != frame.cob_id:
                continue
            if pdo.direction == "tx" and frame.remote and pdo.answers_remote:
                self._say(pdo.identifier, pdo.image.pack(), now)
            elif pdo.direction == "rx" and not frame.remote:
                if len(frame.data) < pdo.image.size:
                    self._raise_own(_PDO_TOO_SHORT, now)
                    continue
                self._clear_own(_PDO_TOO_SHORT, now)
                if pdo.kind <= 240:
                    self._pending[pdo.number] = frame.data
                else:
                    pdo.image.unpack(frame.data[: pdo.image.size])

    def _sync(self, now: int) -> None:
        if self.state != _OPERATIONAL:
            return
        self._syncs += 1
        # Inputs are sampled at this SYNC, before the outputs of the last cycle are applied.
        for pdo in self._of("tx"):
            if pdo.kind == 0:
                self._send_if_changed(pdo, now)
            elif pdo.kind <= 240 and self._syncs % pdo.kind == 0 and pdo.image is not None:
                self._say(pdo.identifier, pdo.image.pack(), now)
        for pdo in self._of("rx"):
            data = self._pending.pop(pdo.number, None)
            if data is not None and pdo.image is not None:
                pdo.image.unpack(data[: pdo.image.size])

    def _of(self, direction: str) -> list[Pdo]:
        return [
            p
            for p in self._objects.pdos
            if p.direction == direction and p.valid and p.image is not None
        ]

    def _send_events(self, now: int) -> None:
        for pdo in self._of("tx"):
            if pdo.kind < 254:
                continue
            last = self._sent.get(pdo.number)
            if last is not None and now - last[0] < pdo.inhibit_100us * 100_000:
                continue
            timed = (
                pdo.event_ms > 0 and last is not None and now - last[0] >= pdo.event_ms * 1_000_000
            )
            self._send_if_changed(pdo, now, anyway=timed)

    def _send_if_changed(self, pdo: Pdo, now: int, *, anyway: bool = False) -> None:
        if pdo.image is None:
            return
        data = pdo.image.pack()
        last = self._sent.get(pdo.number)
        if anyway or last is None or last[1] != data:
            self._sent[pdo.number] = (now, data)
            self._say(pdo.identifier, data, now)

    def _say(self, cob_id: int, data: bytes, at: int) -> None:
        self._outbox.append((at, Frame(cob_id, data)))


def _identity(device: Device) -> LssIdentity:
    """Return 1018h, or the profile's identity if the device has no such object."""
    own = device.profile.identity
    stated = (own.vendor_id, own.product_code, own.revision, 0)
    parts = []
    for subindex, number in enumerate(stated, start=1):
        try:
            parts.append(int.from_bytes(device.read(0x1018, subindex), "little"))
        except SdoAbort:
            parts.append(number or 0)
    return LssIdentity(*parts)
