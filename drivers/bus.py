"""Description of each kind of bus: the form of its URLs, its traits, and its link.

The folder of a bus has a module ``bus`` with a `BusKind` named ``BUS``; no other code in the
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
        """True for a wire created by the demo, such as ``virtual0``."""
        return re.fullmatch(r"virtual\d+", self.place) is not None

    def with_options(self, **options: str | int) -> BusUrl:
        """Return the same bus with some options replaced."""
        merged = dict(self.options) | {name: str(value) for name, value in options.items()}
        return replace(self, options=tuple(merged.items()))

    def __str__(self) -> str:
        query = "&".join(f"{name}={value}" for name, value in self.options)
        return f"{self.scheme}://{self.place}" + (f"?{query}" if query else "")


@dataclass(frozen=True, slots=True)
class SerialLine:
    """Usual settings of the serial lines of a kind of bus, the most likely first."""

    baudrates: tuple[int, ...]
    parities: tuple[str, ...]
    standard_silence: bool = False
    """Use the pause of the Modbus standard above 19200 baud, 1.75 ms, instead of 3.5 characters."""


@dataclass(frozen=True, slots=True)
class BusKind:
    """One kind of bus. ``link`` creates the link of a URL without opening it.

    ``require_place`` raises OutOfRange if the form of the adapter name is not allowed.
    ``serial_port`` returns the serial port that an adapter name stands for; empty for none.
    """

    example: str
    traits: LinkTraits
    require_place: Callable[[str], None]
    link: Callable[[BusUrl], Link]
    serial: SerialLine | None = None
    serial_port: Callable[[str], str] = lambda _place: ""

    @property
    def like(self) -> Text:
        """Message with an example URL of this kind."""
        return text("link.write-it-like", example=self.example)
