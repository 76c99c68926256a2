"""What a transaction with one station does, step by step, without any I/O.

A transaction is a generator: it yields `Read`, `Write`, `Pause` and `Gap` and is sent back the
bytes of a read, ``b""`` for a write that arrived, or None where nobody answered. Whoever owns the
wire runs the steps, one frame each, so that process data never wait for a mailbox.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import NamedTuple, TypeVar

T = TypeVar("T")


class Read(NamedTuple):
    """Read ``size`` bytes from an ESC register (FPRD).

    ``may_be_empty``: a frame that came back although nobody answered (an empty mailbox, working
    counter 0) gives ``b""`` and not None, which is then a lost frame.
    """

    register: int
    size: int
    may_be_empty: bool = False


class Write(NamedTuple):
    """Write an ESC register (FPWR)."""

    register: int
    data: bytes


class Pause(NamedTuple):
    """Leave the station alone for a while."""

    seconds: float


class Gap(NamedTuple):
    """Nothing is under way: here more urgent transactions of the station may come in between."""


Step = Read | Write | Pause | Gap
Steps = Generator[Step, bytes | None, T]
