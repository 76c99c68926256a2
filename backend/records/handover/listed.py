"""Rows of a controller's list and their fields, for all formats. Without I/O."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

from drivers.texts.message import Text, Unsuitable, text

_T = TypeVar("_T")


@dataclass(frozen=True, slots=True)
class Listed:
    """One write of a controller's list. ``transition`` is empty where the format states none."""

    index: int
    subindex: int
    data: bytes
    transition: str
    place: Text

    @property
    def key(self) -> str:
        """The object as a profile's key, such as 6081:00."""
        return f"{self.index:04X}:{self.subindex:02X}"


@dataclass(frozen=True, slots=True)
class ControllerList:
    """A list: its format and its writes in order; ``ordered``: whether the order is significant."""

    format: str
    writes: tuple[Listed, ...]
    ordered: bool = True


class BadRow(Unsuitable):
    """A row cannot be read; the message contains its place."""


def line_of(line: int) -> Text:
    """The place of a row in a file of lines, counted from 1."""
    return text("handover.place-line", line=line)


class SeveralSlaves(ValueError):
    """A file writes to several slaves, and none was chosen."""

    def __init__(self, slaves: int) -> None:
        super().__init__(f"{slaves} slaves")
        self.slaves = slaves


def chosen(each: Sequence[_T], slave: int | None) -> _T:
    """The only slave, or the chosen one, counted from 1.

    Raises:
        SeveralSlaves: none was chosen among several, or there is no such slave.
    """
    if slave is None and len(each) == 1:
        return each[0]
    if slave is not None and 1 <= slave <= len(each):
        return each[slave - 1]
    raise SeveralSlaves(len(each))


def number(written: str | None, place: Text, *, base: int = 0) -> int:
    """A number; with base 0 also #x, 16# and 0x."""
    word = (written or "").strip()
    for prefix in ("#x", "16#", "0x"):
        if word.lower().startswith(prefix):
            word, base = word[len(prefix) :], 16
    try:
        # Python does not accept decimals with leading zeros at base 0; other programs write them.
        return int(word, base or 10)
    except ValueError as error:
        raise BadRow(text("handover.row-no-number", place=place, word=word[:40])) from error


def listed(index: int, subindex: int, data: bytes, transition: str, place: Text) -> Listed:
    """A write, after a check that its object can exist and that it has data."""
    if not 0 <= index <= 0xFFFF or not 0 <= subindex <= 0xFF:
        key = f"{index:X}h:{subindex}"[:40]
        raise BadRow(text("handover.row-no-object", place=place, key=key))
    if not data:
        raise BadRow(text("handover.row-no-data", place=place, index=index, subindex=subindex))
    return Listed(index, subindex, data, transition, place)


def row_of_bytes(written: str | None, place: Text) -> bytes:
    """Bytes from hexadecimal digits."""
    try:
        return bytes.fromhex((written or "").strip())
    except ValueError as error:
        word = (written or "")[:40]
        raise BadRow(text("handover.row-no-bytes", place=place, word=word)) from error


def sized(value: int, size: int, place: Text) -> bytes:
    """An integer, signed or unsigned, as ``size`` bytes, little endian."""
    if not -(1 << (8 * size - 1)) <= value < 1 << (8 * size):
        # As text, since a number in a damaged file may have any length.
        raise BadRow(
            text("handover.row-too-large", place=place, number=str(value)[:40], bytes=size)
        )
    return (value % (1 << (8 * size))).to_bytes(size, "little")
