"""MLink: EZmotion's object access over RS485, as Modbus RTU frames by an object-to-register rule.

Manual 004:1445-1470 describes MLink, its line settings and addresses, but prints no frame. The
rule, the word order and the function codes here come from EZmotion's public Python package for the
RS485 models of the same family (``EZMotionMMS2`` 1.0.2). They are not confirmed on an MMS7xxxxBE.
"""

from __future__ import annotations

from collections.abc import Sequence

from drivers.errors import NotAllowed
from drivers.link import Address, Found
from drivers.modbus.layout import BlockLimits
from drivers.modbus.link import RegisterLink
from drivers.modbus.port import LineSettings
from drivers.modbus.registers import Place, words_of
from drivers.objects.codec import serial_or_none
from drivers.texts.message import Text, text
from profiles.schema import DataType, LinkKind, Profile

#: Longest value that the package transfers: two registers.
_MAX_WORDS = 2


def register_of(index: int, subindex: int) -> int:
    """Return the first register of an object: 6040h -> 6400h, 6099h:02 -> 6991h, 2105h -> 3050h.

    Subindex 0 and 1 share a register, and so do a few unrelated objects; `MlinkLayout`
    distinguishes them by the profile.

    Raises:
        NotAllowed: the rule exceeds the 16-bit register numbers.
    """
    register = (index & 0xF000) + ((index & 0x0FFF) << 4) + max(subindex - 1, 0)
    if register > 0xFFFF:
        raise NotAllowed(
            "mlink.no-register-number-mlink",
            parameter=f"{index:04X}:{subindex:02X}",
            index=index,
            subindex=subindex,
        )
    return register


class MlinkLayout:
    """Registers by rule. Without a profile every object is assumed to be accessible.

    Two neighbours are read in one request only if the profile allows blocks (``max_registers``),
    and only subindices of one object that fill one register each: the numbers of 32-bit subindices
    overlap, so there is no row of registers behind them.
    """

    kind: LinkKind = "mlink"

    def __init__(self) -> None:
        self._limits: dict[int, BlockLimits] = {}
        self._rivals: dict[int, dict[tuple[int, int], str]] = {}

    def configure(self, station: int, profile: Profile) -> None:
        """See `drivers.modbus.layout.Layout.configure`."""
        spec = profile.link("mlink")
        longest = spec.max_registers if spec and spec.max_registers else _MAX_WORDS
        self._limits[station] = BlockLimits(max(longest, _MAX_WORDS), 0)
        self._rivals[station] = ambiguous_objects(profile)

    def place(self, station: int, address: Address) -> Place:
        """See `drivers.modbus.layout.Layout.place`."""
        if address.index is None:
            raise NotAllowed("mlink.no-object-mlink-reaches", address=str(address))
        rival = self._rivals.get(station, {}).get((address.index, address.subindex))
        if rival:
            raise NotAllowed(
                "mlink.mlink-cannot-tell-both",
                parameter=str(address),
                address=str(address),
                rival=rival,
            )
        count = words_of(address.type)
        if count > _MAX_WORDS:
            raise NotAllowed(
                "mlink.mlink-moves-most-32",
                parameter=str(address),
                address=str(address),
                type=address.type,
            )
        blocks = self.limits(station).max_registers > _MAX_WORDS
        group = address.index if blocks and count == 1 else None
        start = register_of(address.index, address.subindex)
        return Place(start, count, address.type, "low_first", group)

    def limits(self, station: int) -> BlockLimits:
        """See `drivers.modbus.layout.Layout.limits`."""
        return self._limits.get(station, BlockLimits(_MAX_WORDS, 0))

    def identity(self) -> tuple[Address, ...]:
        """Status word, mode, and the identity object (CiA 301 clause 7.5.2.21)."""
        return (
            Address(0x6041, 0, "UINT16"),
            Address(0x6061, 0, "INT8"),
            *(Address(0x1018, sub, "UINT32") for sub in (1, 2, 3, 4)),
            Address(0x2105, 0, "UINT8"),
        )

    def describe(self, station: int, values: Sequence[int | None]) -> Found:
        """See `drivers.modbus.layout.Layout.describe`."""
        status, mode, vendor, product, revision, serial, slave_address = values
        notes: list[Text] = []
        if vendor is None:
            notes.append(text("mlink.note-no-identity"))
        if mode is not None:
            signed = int.from_bytes(bytes((mode,)), "little", signed=True)
            notes.append(text("mlink.note-mode", mode=signed))
        if slave_address not in (None, station):
            notes.append(text("mlink.note-next-address", address=slave_address))
        return Found(
            station,
            vendor_id=vendor,
            product_code=product,
            revision=revision,
            serial=serial_or_none(serial),
            state=None if status is None else text("mlink.state", status=f"{status:#06x}"),
            notes=tuple(notes),
        )


def ambiguous_objects(profile: Profile) -> dict[tuple[int, int], str]:
    """Return the objects that share a register with another one, and with which.

    Subindex 0 of a record is replaced by subindex 1, which the package reads there. If two
    different objects share a register, neither can be trusted.
    """
    owners: dict[int, list[tuple[int, int, DataType]]] = {}
    for parameter in profile.parameters:
        index, subindex = parameter.index, parameter.subindex
        if index is not None and subindex is not None:
            raw = (index & 0xF000) + ((index & 0x0FFF) << 4) + max(subindex - 1, 0)
            owners.setdefault(raw, []).append((index, subindex, parameter.type))
    rivals: dict[tuple[int, int], str] = {}
    for sharing in owners.values():
        for index, subindex, _ in sharing:
            others = [
                (i, s)
                for i, s, _ in sharing
                if (i, s) != (index, subindex) and not (i == index and s == 0)
            ]
            if others:
                rivals[index, subindex] = " and ".join(f"{i:04X}:{s:02X}" for i, s in others)
    return rivals


def mlink_link(url: str, settings: LineSettings) -> RegisterLink:
    """Create the link of an MLink bus without opening it."""
    return RegisterLink(url, settings, MlinkLayout())
