"""Steps of a transaction with one station, without any I/O.

A transaction is a generator: it yields `Read`, `Write`, `Pause` and `Gap` and receives the bytes of
a read, ``b""`` for a write that arrived, or None without an answer. The owner of the wire runs the
steps, one frame each, so that process data never wait for a mailbox.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import NamedTuple, TypeVar

T = TypeVar("T")


class Read(NamedTuple):
    """Read ``size`` bytes from an ESC register (FPRD).

    ``may_be_empty``: a frame that came back without an answer of a slave (an empty mailbox, working
    counter 0) returns ``b""``; None then means a lost frame.
    """

    register: int
    size: int
    may_be_empty: bool = False


class Write(NamedTuple):
    """Write an ESC register (FPWR)."""

    register: int
    data: bytes


class Pause(NamedTuple):
    """Send nothing to the station for a while."""

    seconds: float


class Gap(NamedTuple):
    """No transaction is pending: more urgent ones of the station may be inserted here."""


Step = Read | Write | Pause | Gap
Steps = Generator[Step, bytes | None, T]
