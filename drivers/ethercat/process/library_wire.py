"""Register accesses by SOEM itself, for systems without raw sockets (Npcap, bpf).

SOEM distinguishes answers by an index of four bits alone. Answers come in the order of their
requests, and SOEM drops every answer before the expected one unless it has the same index. That is
possible only if the 15 requests in between were lost as well. So after fewer losses in a row, no
answer is used until probes have shown that answers match requests: each probe reads one of two
registers with known values, chosen at random. If a probe returns the other value, old answers are
in the queue, and only opening the adapter again helps.

pysoem does not report the working counter of a register access that failed. SOEM gives a frame up
only after the whole time-out, so in an access that failed earlier, the frame came back without an
answer.
"""

from __future__ import annotations

import secrets
import time
from collections.abc import Callable, Sequence
from typing import Protocol

import pysoem

from drivers.ethercat.wire.frames import Request
from drivers.ethercat.wire.steps import Read

_SUSPICIOUS_LOSSES = 8
"""Of the 15 consecutive losses needed: SOEM's own calls send some frames that are not counted."""
_PROBES = 20
"""A wrong match passes with a probability of 2^-20."""
_IDENTITY, _ADDRESS = 0x0000, 0x0010
"""Type and revision of the ESC; configured station address (ETG.1000.4 clause 6.1)."""
_STATION_BASE = 0x1000


class Slave(Protocol):
    """The part of `pysoem.CdefSlave` that is used."""

    def _fprd(self, address: int, size: int, timeout_us: int) -> bytes: ...

    def _fpwr(self, address: int, data: bytes, timeout_us: int) -> None: ...


class LibraryWire:
    """Makes one access after the other; see the module docstring for when answers are used."""

    def __init__(
        self,
        coin: Callable[[], bool] = lambda: bool(secrets.randbits(1)),
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self._coin = coin
        self._clock = clock
        self._slaves: Sequence[Slave] = ()
        self._identities: list[bytes | None] = []
        self._patience_us = 0
        self._losses = 0
        self._probes_due = False
        self.mixed_up = False
        """Old answers match new requests: the adapter has to be opened again."""
        self.silent = False
        """The last frame sent here did not come back."""

    def found(self, slaves: Sequence[Slave], patience_us: int) -> None:
        """Set the slaves right after a search, when answers are known to match."""
        self._slaves, self._patience_us = slaves, patience_us
        self._losses, self._probes_due, self.mixed_up = 0, False, False
        self._identities = [self._read(slave, _IDENTITY, 2)[0] for slave in slaves]

    def require_probes(self) -> None:
        """Note that a call of SOEM failed, with an unknown number of lost frames."""
        self._probes_due = True

    def count(self, *, came_back: bool) -> None:
        """Count whether a frame came back, of SOEM's process data or of ours."""
        self._losses = 0 if came_back else self._losses + 1
        self._probes_due = self._probes_due or self._losses >= _SUSPICIOUS_LOSSES

    def in_step(self, patience_us: int) -> bool:
        """Return whether answers match requests; send probes if that is uncertain."""
        self._patience_us = patience_us
        if self._probes_due and not self.mixed_up:
            self._probes_due = not self._probed()
        return not self._probes_due

    def exchange(self, requests: Sequence[Request], patience_us: int) -> list[bytes | None]:
        """As `drivers.ethercat.process.segment.Segment.exchange`, with one frame for each access.

        ``patience_us`` is below SOEM's own time-out, so that each frame is sent once: a write, or a
        read from a mailbox, must not be repeated.
        """
        replies: list[bytes | None] = []
        self.silent = not self.in_step(patience_us)
        for station, access in requests:
            if self.silent or station > len(self._slaves):
                replies.append(None)
                continue
            slave = self._slaves[station - 1]
            if isinstance(access, Read):
                reply, back = self._read(slave, access.register, access.size)
                if reply is None and back and access.may_be_empty:
                    reply = b""
            else:
                reply, back = self._write(slave, access.register, access.data)
            self.count(came_back=back)
            self.silent = not back
            replies.append(reply)
        return replies

    def _read(self, slave: Slave, register: int, size: int) -> tuple[bytes | None, bool]:
        """Return the data, None without an answer; and whether the frame came back."""
        began = self._clock()
        try:
            return bytes(slave._fprd(register, size, self._patience_us)), True  # noqa: SLF001 - its only name
        except pysoem.WkcError:
            return None, self._in_time(began)

    def _write(self, slave: Slave, register: int, data: bytes) -> tuple[bytes | None, bool]:
        began = self._clock()
        try:
            slave._fpwr(register, bytes(data), self._patience_us)  # noqa: SLF001 - its only name
        except pysoem.WkcError:
            return None, self._in_time(began)
        return b"", True

    def _in_time(self, began: float) -> bool:
        return (self._clock() - began) * 1e6 < self._patience_us

    def _probed(self) -> bool:
        """Return whether `_PROBES` probes in a row were answered correctly; sets `mixed_up`."""
        for place, identity in enumerate(self._identities):
            address = (_STATION_BASE + place + 1).to_bytes(2, "little")
            if identity is None or identity == address:
                continue
            slave = self._slaves[place]
            reply, back = self._read(slave, _ADDRESS, 2)
            if reply is not None:
                return self._all_match(slave, {_ADDRESS: address, _IDENTITY: identity})
            if not back:
                # Every frame passes all slaves: that of another one would be lost as well.
                return False
        return False

    def _all_match(self, slave: Slave, known: dict[int, bytes]) -> bool:
        for _ in range(_PROBES):
            register = _ADDRESS if self._coin() else _IDENTITY
            reply, _ = self._read(slave, register, 2)
            if reply is None:
                return False
            if reply != known[register]:
                self.mixed_up = True
                return False
        self._losses = 0
        return True
