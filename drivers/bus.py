"""What each kind of bus brings: how its URLs are written, its traits, and its link.

The folder of a bus has a module ``bus`` with a `BusKind` called ``BUS``; nothing else in the
product names a kind of bus. See ``CONTRIBUTING.md``, "Add a bus".
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace

from drivers.link import Link, LinkTraits
from drivers.texts.message import Text, text
from profiles.schema import LinkKind


@dataclass(frozen=True, slots=True)
class BusUrl:
    """A bus URL split into its parts. ``place``: device path, interface or CAN channel."""

    scheme: LinkKind
    place: str
    options: tuple[tuple[str, str], ...] = ()

    @property
    def is_virtual(self) -> bool:
        """True for a wire that the demo makes, such as ``virtual0``."""
        return re.fullmatch(r"virtual\d+", self.place) is not None

    def with_options(self, **options: str | int) -> BusUrl:
        """The same bus with some options replaced."""
        merged = dict(self.options) | {name: str(value) for name, value in options.items()}
        return replace(self, options=tuple(merged.items()))

    def __str__(self) -> str:
        query = "&".join(f"{name}={value}" for name, value in self.options)
        return f"{self.scheme}://{self.place}" + (f"?{query}" if query else "")


@dataclass(frozen=True, slots=True)
class SerialLine:
    """How the serial lines of a kind are usually set, the likeliest first."""

    baudrates: tuple[int, ...]
    parities: tuple[str, ...]
    standard_silence: bool = False
    """The pause of the Modbus standard above 19200 baud, 1.75 ms; else 3.5 characters."""


@dataclass(frozen=True, slots=True)
class BusKind:
    """One kind of bus. ``link`` makes the link of a URL, not yet opened.

    ``require_place`` raises OutOfRange where an adapter is named in a form that is not allowed.
    """

    example: str
    traits: LinkTraits
    require_place: Callable[[str], None]
    link: Callable[[BusUrl], Link]
    serial: SerialLine | None = None

    @property
    def like(self) -> Text:
        """How URLs of this kind are written."""
        return text("link.write-it-like", example=self.example)
