"""The pysoem Master with safeguards.

Each safeguard prevents a crash or a leak that was reproduced with pysoem 1.1.13: interface names
longer than 15 characters overflow a buffer; ``close()`` on a master that never opened closes
descriptor 0, and a second one closes a foreign descriptor; a failed open leaks its socket; outputs
longer than the slave's overwrite memory; the IO map of 4096 bytes is not checked; errors of earlier
calls stay in a global queue and are raised by later ones.

SOEM also distinguishes answers by an index of four bits alone: when 16 late frames are in the
socket, each request is at once answered by one that is 16 frames old, permanently. So late frames
are discarded before anything is sent, and registers are read and written by frames of our own.

SOEM assumes that slaves of the same vendor, product and revision have the same EEPROM, and reads
only that of the first. Drives that state no identity all have 0, whatever they are.
"""

from __future__ import annotations

import os
import select
import socket
import time
from collections.abc import Sequence
from typing import BinaryIO

import pysoem

from drivers.adapters import require_ethercat_adapter
from drivers.computer import permissions
from drivers.computer.network import packet_capture
from drivers.computer.network.sockets import (
    MSG_DONTWAIT,
    RAW_FRAMES,
    hold_name,
    open_sockets,
    set_blocking,
)
from drivers.errors import Busy, LinkLost, NotAllowed, ProtocolError
from drivers.ethercat.process import promiscuous
from drivers.ethercat.process.library_wire import LibraryWire
from drivers.ethercat.wire import frames
from drivers.ethercat.wire.steps import Read, Write
from drivers.texts import limits
from drivers.texts.message import Text, joined, text

IO_MAP_BYTES = 4096
MAX_STATIONS = 199
_NAME_LIMIT = 15
_FRAME_TIMEOUT_US, _IDLE_FRAME_TIMEOUT_US = 2000, 10_000
"""Without and with process data: time-out of a frame [µs].

A mail is lost once it was read: a slave in software, on a busy computer, may send the frame with it
late.
"""
_MARGIN_US = 1000
_RECOVER_US = 2000
_STALL_S = 0.1
_MOST_STRAY = 64
"""Number of foreign frames that may arrive before the answer."""
_OTHER_FRAME, _TOO_MANY = -2, -4
"""Results of SOEM's search other than a number of slaves."""

_FIND_TRIES = 3
"""A briefly stalled segment answers not at all, or too late and to a different request."""


class InvalidMap(ProtocolError):
    """SOEM took a different mail for an answer while it requested the mapping.

    Only a new search helps: for every further mapping, SOEM adds FMMUs to those of the failed one,
    which then keep writing outputs and reading inputs at the wrong places, and the third mapping
    exceeds the end of its list.
    """


class Segment:
    """One interface with its slaves. Stations count from 1, in the order of the cable."""

    def __init__(self, interface: str, *, raw_frames: bool = True) -> None:
        """Without ``raw_frames`` everything uses SOEM's own calls, as on Windows and macOS."""
        self.interface = interface
        self._library = None if raw_frames else LibraryWire()
        self._master: pysoem.Master | None = None
        self._lock: socket.socket | BinaryIO | None = None
        self._index = 0
        self.socket_fd: int | None = None
        self.slaves: Sequence[pysoem.CdefSlave] = ()
        self.mapped = False
        self._fresh = False
        """No mapping has been made since the search."""
        self._waits = True
        """Calls wait for frames; not while process data are exchanged."""
        self.frame_timeout_us = _FRAME_TIMEOUT_US
        self.late_frames = 0
        """Frames that came back after their time-out."""
        self._ear: socket.socket | None = None
        self._scrap = bytearray(2048)
        self._number = 0
        self.silent = False
        """The last frame sent here did not come back."""

    def open(self) -> None:
        """Open the interface exclusively.

        Raises:
            LinkLost: no such interface, switched off, or not permitted; the message states which.
            Busy: another servodeck process uses it.
        """
        if self._master is not None:
            return
        self._check_interface()
        self._lock = _lock(self.interface)
        self._waits = True
        if self._library is not None:
            self._open_by_library()
            return
        master = pysoem.Master()
        was_promiscuous = promiscuous.is_set(self.interface)
        before = open_sockets()
        try:
            master.open(self.interface)
        except ConnectionError as error:
            # pysoem leaves the socket of a failed open behind.
            for descriptor in open_sockets() - before:
                os.close(descriptor)
            self._unlock()
            report = permissions.check(self.interface)
            raise LinkLost(
                "ethercat.interface-not-opened",
                remedy="; ".join(report.commands) or "ethercat.check-wired",
                interface=self.interface,
                check=report.text,
            ) from error
        self.socket_fd = min(open_sockets() - before)
        self._index = socket.if_nametoindex(self.interface)
        self._ear = socket.socket(fileno=os.dup(self.socket_fd))
        if not was_promiscuous:
            # SOEM sets it permanently; bound to the socket it ends with the socket, even on
            # SIGKILL.
            promiscuous.bind_to(self._ear, self.interface, self._index)
        self._master = master

    def _open_by_library(self) -> None:
        # SOEM repeats a frame after this time; ours time out earlier, so that each is sent once.
        pysoem.settings.timeouts.ret = self._patience_us() + _MARGIN_US
        master = pysoem.Master()
        try:
            master.open(_device(self.interface))
        except ConnectionError as error:
            self._unlock()
            report = permissions.check(self.interface)
            raise LinkLost(
                "ethercat.interface-not-opened",
                remedy=report.capture_remedy or "ethercat.check-wired",
                interface=self.interface,
                check=report.text,
            ) from error
        self._library = LibraryWire()
        self._master = master

    def close(self) -> None:
        """Close the interface once; further calls have no effect."""
        master, self._master = self._master, None
        self.slaves, self.socket_fd, self.mapped = (), None, False
        if self._ear is not None:
            self._ear.close()
            self._ear = None
        if master is not None:
            master.close()
        self._unlock()

    def replaced(self) -> bool:
        """Return whether the interface has to be opened again.

        It vanished or came back as another one, or old answers match new requests.
        """
        if self._library is not None:
            return self.mixed_up
        try:
            return socket.if_nametoindex(self.interface) != self._index
        except OSError:
            return True

    @property
    def mixed_up(self) -> bool:
        """Whether old answers match new requests; see `drivers.ethercat.process.library_wire`."""
        return self._library is not None and self._library.mixed_up

    @property
    def master(self) -> pysoem.Master:
        """The open master.

        Raises:
            LinkLost: it is not open.
        """
        if self._master is None:
            raise LinkLost("ethercat.interface-not-open", interface=self.interface)
        return self._master

    def find(self) -> int:
        """Reset the segment, give every slave its address and request PREOP.

        Returns the number of slaves; 0 if none answers.

        Raises:
            ProtocolError: more slaves than can be handled.
            LinkLost: answers come too late.
        """
        self.mapped, self._fresh = False, False
        self.master.manual_state_change = 0
        for attempt in range(_FIND_TRIES):
            if attempt:
                time.sleep(_STALL_S)
            if not self.in_step() and self.mixed_up:
                raise LinkLost("ethercat.answers-come-too-late", interface=self.interface)
            count = self.master.config_init(release_gil=True)
            self.forget_errors()
            if 0 < count <= MAX_STATIONS:
                break
        if count == _TOO_MANY or count > MAX_STATIONS:
            raise ProtocolError("ethercat.more-slaves-segment", max_stations=MAX_STATIONS)
        if count == _OTHER_FRAME:
            raise LinkLost("ethercat.answers-come-too-late", interface=self.interface)
        self._fresh = True
        self.slaves = tuple(self.master.slaves) if count > 0 else ()
        if self._library is not None:
            self._library.found(self.slaves, self._patience_us())
        return len(self.slaves)

    def discard_late_frames(self) -> None:
        """Discard frames that nothing waits for; to be called with no frame in transit."""
        if self._ear is None:
            return
        try:
            while self._ear.recv_into(self._scrap, 0, MSG_DONTWAIT):
                self.late_frames += 1
        except BlockingIOError:
            return
        except OSError:
            # The interface went down: the next send reports it.
            return

    def in_step(self) -> bool:
        """Return whether the next answer will match the next request.

        To be called with no frame in transit. Late frames are discarded, or, where they cannot be
        seen, probes are sent.
        """
        if self._library is not None:
            return self._library.in_step(self._patience_us())
        self.discard_late_frames()
        return True

    def wait_for_frames(self, waits: bool) -> None:
        """Set whether sending and receiving may wait; not while process data are exchanged."""
        self._waits = waits
        if self.socket_fd is not None:
            set_blocking(self.socket_fd, waits)

    def note_process_data(self, *, came_back: bool) -> None:
        """Count whether a frame of process data came back."""
        if self._library is not None:
            self._library.count(came_back=came_back)

    def exchange(self, requests: Sequence[frames.Request]) -> list[bytes | None]:
        """Access registers in one frame; see `frames.answers`; all None for a lost frame.

        The requests must fit one frame. A frame that comes back late is discarded.
        """
        if self._library is not None:
            replies = self._library.exchange(requests, self._patience_us())
            self.silent = self._library.silent
            return replies
        self.discard_late_frames()
        self._number = (self._number + 1) % frames.INDICES
        reported = self._transmit(
            requests, frames.build(requests, frames.FIRST_INDEX + self._number)
        )
        self.silent = reported is None
        return [None] * len(requests) if reported is None else reported

    def _transmit(
        self, requests: Sequence[frames.Request], sent: bytes
    ) -> list[bytes | None] | None:
        ear = self._ear
        if ear is None:
            return None
        deadline = time.monotonic() + self._patience_us() * 1e-6
        scrap = memoryview(self._scrap)
        try:
            ear.send(sent, MSG_DONTWAIT)
            # Frames already received are accepted however late they are: this process may have been
            # stalled itself.
            for _ in range(_MOST_STRAY):
                left_s = max(deadline - time.monotonic(), 0.0)
                if not select.select((ear,), (), (), left_s)[0]:
                    return None
                size = ear.recv_into(scrap, 0, MSG_DONTWAIT)
                reported = frames.answers(requests, sent, scrap[:size])
                if reported is not None:
                    return reported
                self.late_frames += 1
        except OSError:
            # Nothing to read, a full queue, or the interface went down.
            return None
        return None

    def _patience_us(self) -> int:
        if self._waits:
            return max(self.frame_timeout_us, _IDLE_FRAME_TIMEOUT_US)
        # Process data must not wait long for each of many frames that do not come back.
        return _FRAME_TIMEOUT_US if self.silent else self.frame_timeout_us

    def read(self, station: int, register: int, size: int) -> bytes | None:
        """Read a register of a slave; return None without an answer."""
        return self.exchange([(station, Read(register, size))])[0]

    def write(self, station: int, register: int, data: bytes) -> bool:
        """Write a register of a slave; return False without an answer."""
        return self.exchange([(station, Write(register, data))])[0] is not None

    def map(self, expected_bytes: int) -> None:
        """Build the IO map from the mappings in the drives. States remain unchanged.

        ``expected_bytes`` is the sum of all process data, checked before SOEM writes past the end
        of its buffer. SOEM reads the mapping entry by entry: slaves pack a whole object in several
        ways, and SOEM assumes one of them.

        Raises:
            NotAllowed: more process data than the IO map holds, or no search preceded.
            InvalidMap: a drive's mapping could not be read; search and map again.
        """
        if expected_bytes > IO_MAP_BYTES:
            raise NotAllowed(
                "ethercat.process-data-all-drives",
                limit=limits.size(IO_MAP_BYTES),
                expected_bytes=expected_bytes,
                io_map_bytes=IO_MAP_BYTES,
            )
        if not self._fresh:
            raise NotAllowed("ethercat.process-data-mapped-once")
        self._fresh = False
        self.forget_errors()
        self.master.manual_state_change = 1
        for slave in self.slaves:
            slave._disable_complete_access()  # noqa: SLF001 - its only name
        try:
            self.master.config_map()
        except pysoem.ConfigMapError as error:
            self.forget_errors()
            if self._library is not None:
                self._library.require_probes()
            reported = {str(why): why for why in map(_mapping_error, error.error_list)}
            raise InvalidMap(
                "ethercat.process-data-not-mapped",
                reported=joined(reported[each] for each in sorted(reported)),
            ) from error
        self.mapped = True

    def set_output(self, station: int, data: bytes) -> None:
        """Set the outputs of a slave, which must have the length of its process data."""
        self._check_mapped()
        slave = self.slaves[station - 1]
        size = len(slave.output)
        if len(data) != size:
            raise ProtocolError(
                "ethercat.bytes-outputs-station", bytes=len(data), size=size, station=station
            )
        slave.output = data

    def sizes(self, station: int) -> tuple[int, int]:
        """Return the bytes of outputs and inputs of a slave, once mapped."""
        self._check_mapped()
        slave = self.slaves[station - 1]
        return len(slave.output), len(slave.input)

    def recover(self, station: int) -> bool:
        """Set the address of a restarted slave again; return False if it is a different one."""
        if not self.in_step() and self.mixed_up:
            return False
        # SOEM sends some of these frames without waiting, which requires a blocking socket.
        if self.socket_fd is not None:
            set_blocking(self.socket_fd, True)
        began = time.perf_counter()
        try:
            back = bool(self.slaves[station - 1].recover(_RECOVER_US) > 0)
        finally:
            if self.socket_fd is not None:
                set_blocking(self.socket_fd, self._waits)
        if self._library is not None and (time.perf_counter() - began) * 1e6 >= _RECOVER_US:
            self._library.require_probes()
        self.forget_errors()
        return back

    def forget_errors(self) -> None:
        """Empty SOEM's error queue, so that later calls do not raise these errors."""
        self.master._collect_mailbox_errors()  # noqa: SLF001 - pysoem's only way to empty it

    def _check_mapped(self) -> None:
        if not self.mapped:
            raise NotAllowed("ethercat.no-process-data-before")

    def _check_interface(self) -> None:
        if not RAW_FRAMES:
            self._check_adapter()
            return
        if not 0 < len(self.interface.encode()) <= _NAME_LIMIT:
            raise LinkLost(
                "ethercat.cannot-interface-names-letters",
                interface=self.interface,
                name_limit=_NAME_LIMIT,
            )
        require_ethercat_adapter(self.interface)
        report = permissions.check(self.interface)
        if not report.exists or not report.up:
            names = ", ".join(name for _, name in socket.if_nameindex())
            others = text("ethercat.interfaces-there-are", names=names)
            raise LinkLost(report.text, remedy="; ".join(report.commands) or others)

    def _check_adapter(self) -> None:
        """Check the adapter: only those listed by the packet capture library are opened."""
        require_ethercat_adapter(self.interface)
        report = permissions.check(self.interface)
        if not report.ready:
            names = ", ".join(f"{one.name} ({one.title})" for one in packet_capture.adapters())
            others = text("ethercat.interfaces-there-are", names=names)
            raise LinkLost(report.text, remedy=report.capture_remedy or others)

    def _unlock(self) -> None:
        if self._lock is not None:
            self._lock.close()
            self._lock = None


def _device(interface: str) -> str:
    """Return what SOEM opens: the adapter's device in its own list, else the interface name."""
    if RAW_FRAMES:
        return interface
    listed = (one.device for one in packet_capture.adapters() if one.name == interface)
    return next(listed, interface)


def _lock(interface: str) -> socket.socket | BinaryIO:
    """Hold a system-wide name for this process alone; see `hold_name`."""
    try:
        return hold_name(f"servodeck-ethercat-{interface}")
    except OSError as error:
        raise Busy("ethercat.another-servodeck-already-uses", interface=interface) from error


def _mapping_error(item: Exception) -> Text:
    if isinstance(item, pysoem.SdoError):
        address = f"{item.index:04X}:{item.subindex:02X}"
        return text(
            "ethercat.map-aborted", station=item.slave_pos, object=address, cause=str(item.desc)
        )
    if isinstance(item, pysoem.MailboxError | pysoem.PacketError):
        return text("ethercat.map-failed", station=item.slave_pos, cause=str(item.desc))
    return text("ethercat.map-unexpected-mail")
