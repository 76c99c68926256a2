"""The pysoem Master behind guards.

Every guard answers a crash or a leak that was reproduced with pysoem 1.1.13: interface names
longer than 15 characters overflow a buffer; ``close()`` on a master that never opened closes
descriptor 0 and a second one closes a stranger's; a failed open leaks its socket; outputs longer
than the slave's overwrite memory; the IO map of 4096 bytes is not checked; errors of earlier
calls stay in a global queue and are raised by later ones.

And SOEM distinguishes answers by an index of four bits alone: when 16 late frames lie in the
socket, each request is at once answered by one that is 16 frames old, for ever. So late frames
are thrown away before anything is sent, and registers are read and written by frames of our own.

SOEM assumes that slaves of the same vendor, product and revision have the same EEPROM, and reads
only the first one's. Drives that show nothing of themselves all have 0, whatever they are.
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
from drivers.computer import packet_capture, permissions
from drivers.computer.sockets import (
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
from drivers.texts.message import text

IO_MAP_BYTES = 4096
MAX_STATIONS = 199
_NAME_LIMIT = 15
_EMERGENCY = "an emergency or another unexpected mail came in between"
_FRAME_TIMEOUT_US, _IDLE_FRAME_TIMEOUT_US = 2000, 10_000
"""With and without process data. A mail is gone once it was read: a slave made of software, on a
busy computer, may send the frame with it late."""
_MARGIN_US = 1000
_RECOVER_US = 2000
_STALL_S = 0.1
_MOST_STRAY = 64
"""Frames of something else that may come before the answer."""
_OTHER_FRAME, _TOO_MANY = -2, -4
"""What SOEM's search returns besides a number of slaves."""

_FIND_TRIES = 3
"""A segment that stands still for a moment answers nothing, or too late and to another question."""


class InvalidMap(ProtocolError):
    """SOEM took something else for an answer while it asked for the mapping.

    Only a new search helps: SOEM gives every further mapping FMMUs of its own next to those of the
    one that failed, which then go on writing outputs and reading inputs at the wrong places, and
    the third mapping is beyond the end of its list.
    """


class Segment:
    """One interface with its slaves. Stations count from 1, in the order of the cable."""

    def __init__(self, interface: str, *, raw_frames: bool = True) -> None:
        """Without ``raw_frames`` all goes through SOEM's own calls, as on Windows and macOS."""
        self.interface = interface
        self._library = None if raw_frames else LibraryWire()
        self._master: pysoem.Master | None = None
        self._lock: socket.socket | BinaryIO | None = None
        self._index = 0
        self.socket_fd: int | None = None
        self.slaves: Sequence[pysoem.CdefSlave] = ()
        self.mapped = False
        self._fresh = False
        """Nothing was mapped since the search."""
        self._waits = True
        """Frames are waited for; not while process data are exchanged."""
        self.frame_timeout_us = _FRAME_TIMEOUT_US
        self.late_frames = 0
        """Frames that came back after they had been given up."""
        self._ear: socket.socket | None = None
        self._scrap = bytearray(2048)
        self._number = 0
        self.silent = False
        """The last frame of ours did not come back."""

    def open(self) -> None:
        """Open the interface for us alone.

        Raises:
            LinkLost: no such interface, switched off, or not permitted; the message says which.
            Busy: another programme of ours has it.
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
            # SOEM switches it for good; bound to the socket it ends with it, even on SIGKILL.
            promiscuous.bind_to(self._ear, self.interface, self._index)
        self._master = master

    def _open_by_library(self) -> None:
        # A frame is sent again after this time, and ours are given up before: each is sent once.
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
        """Close the interface once; calling again does nothing."""
        master, self._master = self._master, None
        self.slaves, self.socket_fd, self.mapped = (), None, False
        if self._ear is not None:
            self._ear.close()
            self._ear = None
        if master is not None:
            master.close()
        self._unlock()

    def replaced(self) -> bool:
        """Whether the interface has to be opened again: it vanished or came back as another, or
        old answers match new requests.
        """
        if self._library is not None:
            return self.mixed_up
        try:
            return socket.if_nametoindex(self.interface) != self._index
        except OSError:
            return True

    @property
    def mixed_up(self) -> bool:
        """Old answers match new requests; see `drivers.ethercat.process.library_wire`."""
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
        """Reset the segment, give every slave its address and ask it for PREOP.

        Returns the number of slaves; 0 when nobody answers.

        Raises:
            ProtocolError: more slaves than can be handled.
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
        """Throw away what nobody waits for any more; to be called with no frame under way."""
        if self._ear is None:
            return
        try:
            while self._ear.recv_into(self._scrap, 0, MSG_DONTWAIT):
                self.late_frames += 1
        except BlockingIOError:
            return
        except OSError:
            # The interface went down: whoever sends next is informed.
            return

    def in_step(self) -> bool:
        """Whether the next answer will be that of the next request; to be called with no frame
        under way. Late frames are discarded, or probes sent where they cannot be seen.
        """
        if self._library is not None:
            return self._library.in_step(self._patience_us())
        self.discard_late_frames()
        return True

    def wait_for_frames(self, waits: bool) -> None:
        """Whether sending and receiving may wait; not while process data are exchanged."""
        self._waits = waits
        if self.socket_fd is not None:
            set_blocking(self.socket_fd, waits)

    def note_process_data(self, *, came_back: bool) -> None:
        """Whether a frame of process data came back."""
        if self._library is not None:
            self._library.count(came_back=came_back)

    def exchange(self, requests: Sequence[frames.Request]) -> list[bytes | None]:
        """Accesses to registers in one frame; see `frames.answers`, all None for a lost frame.

        They must fit one frame. A frame that came back late is nobody's answer any more.
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
            # What has come is accepted however late it is: this process may have stood still
            # itself.
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
            # Nothing to read after all, a full queue, or the interface went down.
            return None
        return None

    def _patience_us(self) -> int:
        if self._waits:
            return max(self.frame_timeout_us, _IDLE_FRAME_TIMEOUT_US)
        # Process data must not wait long for each of many frames that do not come back.
        return _FRAME_TIMEOUT_US if self.silent else self.frame_timeout_us

    def read(self, station: int, register: int, size: int) -> bytes | None:
        """Read a register of a slave, or None when it does not answer."""
        return self.exchange([(station, Read(register, size))])[0]

    def write(self, station: int, register: int, data: bytes) -> bool:
        """Write a register of a slave; False when it does not answer."""
        return self.exchange([(station, Write(register, data))])[0] is not None

    def map(self, expected_bytes: int) -> None:
        """Build the IO map from what the drives have mapped. States stay as they are.

        ``expected_bytes`` is the sum of all process data, checked before SOEM writes past the
        end of its buffer. SOEM reads the mapping entry by entry: slaves pack a whole object in
        several ways, and SOEM takes one for granted.

        Raises:
            NotAllowed: more process data than the IO map holds, or no search came before.
            InvalidMap: a drive's mapping could not be read; to be searched for and mapped again.
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
                self._library.doubt()
            reported = sorted({_mapping_error(item) for item in error.error_list})
            raise InvalidMap(
                "ethercat.process-data-not-mapped", reported="; ".join(reported)
            ) from error
        self.mapped = True

    def set_output(self, station: int, data: bytes) -> None:
        """Set the outputs of a slave, with the length that it has."""
        self._check_mapped()
        slave = self.slaves[station - 1]
        size = len(slave.output)
        if len(data) != size:
            raise ProtocolError(
                "ethercat.bytes-outputs-station", bytes=len(data), size=size, station=station
            )
        slave.output = data

    def sizes(self, station: int) -> tuple[int, int]:
        """Bytes of outputs and inputs of a slave, once mapped."""
        self._check_mapped()
        slave = self.slaves[station - 1]
        return len(slave.output), len(slave.input)

    def recover(self, station: int) -> bool:
        """Give a slave that was switched off its address back; False when it is another one."""
        if not self.in_step() and self.mixed_up:
            return False
        # SOEM sends some of these frames without waiting, and needs the socket to block then.
        if self.socket_fd is not None:
            set_blocking(self.socket_fd, True)
        began = time.perf_counter()
        try:
            back = bool(self.slaves[station - 1].recover(_RECOVER_US) > 0)
        finally:
            if self.socket_fd is not None:
                set_blocking(self.socket_fd, self._waits)
        if self._library is not None and (time.perf_counter() - began) * 1e6 >= _RECOVER_US:
            self._library.doubt()
        self.forget_errors()
        return back

    def forget_errors(self) -> None:
        """Empty SOEM's queue of errors, so that nobody else is blamed for them."""
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
        """Only what is in the list of the packet capture library is opened."""
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
    """What SOEM opens: the device of the adapter in its own list, else the interface's name."""
    if RAW_FRAMES:
        return interface
    listed = (one.device for one in packet_capture.adapters() if one.name == interface)
    return next(listed, interface)


def _lock(interface: str) -> socket.socket | BinaryIO:
    """A name that one process alone holds; see `hold_name`."""
    try:
        return hold_name(f"servodeck-ethercat-{interface}")
    except OSError as error:
        raise Busy("ethercat.another-servodeck-already-uses", interface=interface) from error


def _mapping_error(item: Exception) -> str:
    if isinstance(item, pysoem.SdoError):
        return (
            f"station {item.slave_pos} aborted {item.index:04X}:{item.subindex:02X} ({item.desc})"
        )
    if isinstance(item, pysoem.MailboxError):
        return f"station {item.slave_pos}: {item.desc}"
    if isinstance(item, pysoem.PacketError):
        return f"station {item.slave_pos}: {item.desc}"
    return _EMERGENCY
