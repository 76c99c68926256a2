"""Virtual drives as Modbus RTU slaves on a pty, for Modbus and MLink families."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

from drivers.computer.timing.scheduling import fine_timers
from drivers.errors import NotAllowed
from drivers.mlink.link import register_of
from drivers.modbus.framing import (
    MAX_READ_REGISTERS,
    READ,
    WRITE_MANY,
    WRITE_ONE,
    Request,
    RequestParser,
    exception_response,
    read_response,
    write_response,
)
from drivers.modbus.registers import Place, to_bytes, to_words
from drivers.objects.codec import size_of
from drivers.virtual.device import (
    ABORT_LENGTH,
    ABORT_NO_OBJECT,
    ABORT_NO_SUBINDEX,
    ABORT_TOO_HIGH,
    ABORT_TOO_LONG,
    ABORT_TOO_LOW,
    ABORT_TOO_SHORT,
    ABORT_VALUE_RANGE,
    Device,
    SdoAbort,
)
from drivers.virtual.wires.pty import PtyWire

_ILLEGAL_FUNCTION = 1
_ILLEGAL_ADDRESS = 2
_ILLEGAL_DATA = 3
_REFUSED = 4
_EXCEPTION_OF_ABORT = {
    ABORT_NO_OBJECT: _ILLEGAL_ADDRESS,
    ABORT_NO_SUBINDEX: _ILLEGAL_ADDRESS,
    ABORT_LENGTH: _ILLEGAL_DATA,
    ABORT_TOO_LONG: _ILLEGAL_DATA,
    ABORT_TOO_SHORT: _ILLEGAL_DATA,
    ABORT_VALUE_RANGE: _ILLEGAL_DATA,
    ABORT_TOO_HIGH: _ILLEGAL_DATA,
    ABORT_TOO_LOW: _ILLEGAL_DATA,
}
#: Longest interval between updates of the physics without requests.
_TICK_S = 0.005
#: A pause of this length ends a request. Generous: a pty has no bit times.
_FRAME_GAP_S = 0.005


class Registers(Protocol):
    """Registers of a drive. Both methods raise SdoAbort and then change nothing."""

    def read(self, start: int, count: int) -> Sequence[int]:
        """Return the values of ``count`` registers."""

    def write(self, start: int, values: Sequence[int]) -> None:
        """Write registers."""


class TableRegisters:
    """A family with its own register table."""

    def __init__(self, device: Device) -> None:
        self._device = device

    def read(self, start: int, count: int) -> Sequence[int]:
        """See `Registers.read`."""
        return self._device.read_register(start, count)

    def write(self, start: int, values: Sequence[int]) -> None:
        """See `Registers.write`."""
        self._device.write_registers(start, values)


class ObjectRegisters:
    """A family whose registers are derived from the objects by MLink's rule.

    A request covers one object or several consecutive ones without a gap; an object is read or
    written as a whole. If two objects have the same register, the lower index has priority, then
    subindex 1 over 0.
    """

    def __init__(self, device: Device) -> None:
        self._device = device
        self._places: dict[int, tuple[int, int, Place]] = {}
        for index in sorted(device.indices(), reverse=True):
            for subindex in sorted(device.subindices(index)):
                self._add(index, subindex)

    def _add(self, index: int, subindex: int) -> None:
        data_type = self._device.entry(index, subindex).type
        size = size_of(data_type)
        try:
            start = register_of(index, subindex)
        except NotAllowed:
            return
        if size is None or size > 4:
            return
        self._places[start] = (
            index,
            subindex,
            Place(start, max(1, size // 2), data_type, "low_first"),
        )

    def _covered(self, start: int, count: int) -> list[tuple[int, int, Place]]:
        found = []
        at = start
        while at < start + count:
            entry = self._places.get(at)
            if entry is None:
                raise SdoAbort(ABORT_NO_OBJECT)
            found.append(entry)
            at = entry[2].end
        if at != start + count:
            raise SdoAbort(ABORT_LENGTH)
        return found

    def read(self, start: int, count: int) -> Sequence[int]:
        """See `Registers.read`."""
        words: list[int] = []
        for index, subindex, place in self._covered(start, count):
            words.extend(to_words(place, self._device.read(index, subindex)))
        return words

    def write(self, start: int, values: Sequence[int]) -> None:
        """See `Registers.write`. Objects before a refused one are written."""
        for index, subindex, place in self._covered(start, len(values)):
            first = place.start - start
            words = values[first : first + place.count]
            raw = b"".join(word.to_bytes(2, "big") for word in words)
            self._device.write(index, subindex, _narrowed(place, raw))


def _narrowed(place: Place, raw: bytes) -> bytes:
    """Return register bytes as the object's value; out of range if they do not fit 8 bits."""
    if size_of(place.type) == 1:
        value = int.from_bytes(raw, "big", signed=place.type == "INT8")
        low, high = (-128, 127) if place.type == "INT8" else (0, 255)
        if not low <= value <= high:
            raise SdoAbort(ABORT_TOO_HIGH if value > high else ABORT_TOO_LOW)
    return to_bytes(place, raw)


@dataclass(frozen=True, slots=True)
class Trouble:
    """One fault injected into an answer.

    ``seconds`` is the delay of ``delay``; ``data`` the bytes of ``noise`` before the answer;
    ``keep`` the number of bytes sent of a truncated answer; ``code`` the exception of ``refuse``.
    """

    kind: Literal["drop", "delay", "truncate", "corrupt", "double", "noise", "refuse"]
    seconds: float = 0.0
    data: bytes = b"\x00\xff\x55"
    keep: int = 3
    code: int = 6


class ModbusSlave:
    """A thread that answers for one or several drives on one wire.

    ``stations`` maps addresses to ``(device, registers)``. ``lock`` is held during every call of a
    device; use the same lock for the other wires of a device, and hold it for your own calls. With
    ``client_baudrate`` the drives ignore a client that uses another baud rate.
    """

    def __init__(
        self,
        wire: PtyWire,
        stations: Mapping[int, tuple[Device, Registers]],
        *,
        lock: threading.RLock | None = None,
        now_ns: Callable[[], int] = time.monotonic_ns,
        client_baudrate: int | None = None,
    ) -> None:
        self.wire = wire
        self.stations = dict(stations)
        self.lock = lock or threading.RLock()
        self.mute = False
        self.mute_stations: set[int] = set()
        """Stations whose answers are not sent; the others answer normally."""
        self.echo = False
        self.requests = 0
        self._now_ns = now_ns
        self._client_baudrate = client_baudrate
        self._troubles: deque[Trouble] = deque()
        self._parser = RequestParser()
        self._stop = threading.Event()
        self._serving = threading.Event()
        self._thread = threading.Thread(target=self._serve, name=f"slave {wire.path}", daemon=True)

    def start(self) -> None:
        """Open the wire and answer requests; returns when requests can be answered."""
        self.wire.open()
        self._thread.start()
        self._serving.wait()

    def stop(self) -> None:
        """Stop the thread and remove the wire."""
        self._stop.set()
        if self._thread.is_alive():
            self._thread.join()
        self.wire.close()

    def trouble(self, *troubles: Trouble) -> None:
        """Inject faults into the next answers, one each."""
        self._troubles.extend(troubles)

    def _serve(self) -> None:
        fine_timers()
        self._advance(self._now_ns())
        self._serving.set()
        ticked_s = started_s = time.monotonic()
        while not self._stop.is_set():
            data = self.wire.read(_TICK_S)
            if data:
                started_s = time.monotonic()
                self._received(data)
            elif started_s and time.monotonic() - started_s > _FRAME_GAP_S:
                started_s = 0.0
                for request in self._parser.end_of_frame():
                    self._answer(request)
            if time.monotonic() - ticked_s >= _TICK_S:
                ticked_s = time.monotonic()
                self._advance(self._now_ns())

    def _received(self, data: bytes) -> None:
        if self.echo:
            self.wire.write(data)
        wanted = self._client_baudrate
        if wanted is not None and self.wire.client_baudrate() != wanted:
            return
        for request in self._parser.feed(data):
            self._answer(request)

    def _advance(self, t_ns: int) -> None:
        with self.lock:
            for device, _ in self.stations.values():
                device.advance(t_ns)

    def _answer(self, request: Request) -> None:
        self.requests += 1
        if self.mute or request.station in self.mute_stations:
            return
        # A drive acts when the request is received; its clock is set to that time.
        ahead_ns = int((self.wire.arrival_s - time.monotonic()) * 1e9)
        self._advance(self._now_ns() + max(0, ahead_ns))
        with self.lock:
            if request.station == 0:
                for device, registers in self.stations.values():
                    if device.powered:
                        _execute(registers, request)
                return
            station = self.stations.get(request.station)
            if station is None or not station[0].powered:
                return
            frame = _execute(station[1], request)
        self._send(frame)

    def _send(self, frame: bytes) -> None:
        trouble = self._troubles.popleft() if self._troubles else None
        if trouble is None:
            self.wire.write(frame)
            return
        if trouble.kind == "drop":
            return
        if trouble.kind == "delay":
            self._stop.wait(trouble.seconds)
        elif trouble.kind == "truncate":
            frame = frame[: trouble.keep]
        elif trouble.kind == "corrupt":
            middle = len(frame) // 2
            frame = frame[:middle] + bytes((frame[middle] ^ 0x10,)) + frame[middle + 1 :]
        elif trouble.kind == "double":
            frame = frame + frame
        elif trouble.kind == "noise":
            frame = trouble.data + frame
        elif trouble.kind == "refuse":
            frame = exception_response(frame[0], frame[1], trouble.code)
        self.wire.write(frame)


def _execute(registers: Registers, request: Request) -> bytes:
    """Execute a request and return the answer."""
    try:
        if request.function == READ:
            if not 1 <= request.count <= MAX_READ_REGISTERS:
                return exception_response(request.station, READ, _ILLEGAL_DATA)
            return read_response(request.station, registers.read(request.start, request.count))
        if request.function in (WRITE_ONE, WRITE_MANY):
            if not request.values:
                # A complete frame whose count and length contradict each other or the standard.
                return exception_response(request.station, request.function, _ILLEGAL_DATA)
            registers.write(request.start, request.values)
            return write_response(request)
    except SdoAbort as abort:
        code = _EXCEPTION_OF_ABORT.get(abort.code, _REFUSED)
        return exception_response(request.station, request.function, code)
    return exception_response(request.station, request.function, _ILLEGAL_FUNCTION)
