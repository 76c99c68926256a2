"""Position of values among the registers of a serial link: the interface, and by table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from drivers.errors import NotAllowed
from drivers.link import Address, Found
from drivers.modbus.registers import Place, WordOrder, words_of
from drivers.texts.message import text
from profiles.schema import LinkKind, Profile


@dataclass(frozen=True, slots=True)
class BlockLimits:
    """Longest block one request may read, and the unused registers it may bridge."""

    max_registers: int = 125
    max_gap: int = 0


class Layout(Protocol):
    """Position of the objects of one kind of link among the registers."""

    kind: LinkKind

    def configure(self, station: int, profile: Profile) -> None:
        """Apply the profile's data on this link for one station."""

    def place(self, station: int, address: Address) -> Place:
        """Return the registers of a value.

        Raises:
            NotAllowed: this value cannot be reached over this link; the message states the reason.
        """

    def limits(self, station: int) -> BlockLimits:
        """Return how values may be read together."""

    def identity(self) -> tuple[Address, ...]:
        """Return what a scan reads: the first must exist in every drive."""

    def describe(self, station: int, values: Sequence[int | None]) -> Found:
        """Create the result of a scan from the values of `identity` (None: could not be read)."""


class TableLayout:
    """Registers by table: each parameter of the profile states its own (manual 003)."""

    kind: LinkKind = "modbus"

    def __init__(self, word_order: WordOrder = "high_first") -> None:
        self._default_order = word_order
        self._orders: dict[int, WordOrder] = {}
        self._limits: dict[int, BlockLimits] = {}

    def configure(self, station: int, profile: Profile) -> None:
        """See `Layout.configure`."""
        spec = profile.link("modbus")
        if spec is None:
            return
        self._orders[station] = spec.word_order or self._default_order
        self._limits[station] = BlockLimits(spec.max_registers or 1, spec.max_gap or 0)

    def place(self, station: int, address: Address) -> Place:
        """See `Layout.place`."""
        if address.register is None:
            raise NotAllowed(
                "modbus.no-modbus-register", parameter=str(address), address=str(address)
            )
        order = self._orders.get(station, self._default_order)
        return Place(address.register, words_of(address.type), address.type, order)

    def limits(self, station: int) -> BlockLimits:
        """See `Layout.limits`."""
        return self._limits.get(station, BlockLimits())

    def identity(self) -> tuple[Address, ...]:
        """Return register 0: any answer to reading it shows that a drive is present."""
        return (Address(None, 0, "UINT16", register=0),)

    def describe(self, station: int, values: Sequence[int | None]) -> Found:
        """See `Layout.describe`."""
        held = values[0]
        answer = (
            text("modbus.note-register-refused")
            if held is None
            else text("modbus.note-register-holds", value=held)
        )
        return Found(station, notes=(answer, text("modbus.note-no-identity")))
