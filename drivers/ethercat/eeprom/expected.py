"""Comparison of the EEPROM contents with the manufacturer's file. Pure.

Source: ETG.2000 clause 6.10 (Eeprom), ETG.2010 (words).
"""

from __future__ import annotations

from drivers.ethercat.eeprom.image import CATEGORIES, UNIT_BYTES, Difference, Image
from drivers.ethercat.wire.sii import ALIAS_WORD, CONFIG_WORDS
from profiles.bring_up import BringUp, SyncManagerRule
from profiles.schema import Profile

#: Bits of word 1Ch (ETG.1000.6 table 18).
_PROTOCOL_BITS = {"aoe": 0x01, "eoe": 0x02, "coe": 0x04, "foe": 0x08, "soe": 0x10, "voe": 0x20}
_SYNC_MANAGERS = next(kind for kind, name in CATEGORIES.items() if name == "sync_managers")


def against_profile(image: Image, profile: Profile) -> tuple[Difference, ...]:
    """Return the fields in which the contents differ from the file: the file's value is ``second``.

    Fields that the file does not state are not compared, nor is the alias, which belongs to the
    machine.
    """
    wanted: list[tuple[str, int, bytes]] = []
    for name, word, value in (
        ("vendor_id", 0x08, profile.identity.vendor_id),
        ("product_code", 0x0A, profile.identity.product_code),
        ("revision", 0x0C, profile.identity.revision),
    ):
        if value is not None:
            wanted.append((name, word, value.to_bytes(4, "little")))
    if profile.bring_up is not None:
        wanted += _of_rules(profile.bring_up)
    found = [
        Difference(name, word, held.hex(), value.hex())
        for name, word, value in wanted
        if (held := image.data[2 * word : 2 * word + len(value)]) != value
    ]
    if profile.bring_up is not None:
        found += _of_managers(image, profile.bring_up)
    return tuple(found)


def _of_rules(rules: BringUp) -> list[tuple[str, int, bytes]]:
    config = bytes.fromhex(rules.eeprom_config)[: 2 * CONFIG_WORDS]
    wanted = [("configuration", 0, config[: 2 * ALIAS_WORD])] if config else []
    for kind, word in (("mailbox_out", 0x18), ("mailbox_in", 0x1A)):
        manager = rules.sync_manager(kind)  # type: ignore[arg-type]
        if manager is not None and manager.start is not None and manager.default_size:
            place = manager.start.to_bytes(2, "little") + manager.default_size.to_bytes(2, "little")
            wanted.append((kind, word, place))
    bits = sum(_PROTOCOL_BITS[each] for each in rules.protocols)
    if bits:
        wanted.append(("protocols", 0x1C, bits.to_bytes(2, "little")))
    if rules.eeprom_bytes and 0 <= (units := rules.eeprom_bytes // UNIT_BYTES - 1) <= 0xFFFF:
        wanted.append(("size", 0x3E, units.to_bytes(2, "little")))
    return wanted


def _of_managers(image: Image, rules: BringUp) -> list[Difference]:
    """Compare start and control byte of each sync manager in the file."""
    try:
        held = next((c for c in image.categories() if c.kind == _SYNC_MANAGERS), None)
    except ValueError:
        return []
    found = []
    for manager in rules.sync_managers:
        at = 8 * manager.number
        entry = b"" if held is None else held.data[at : at + 8]
        word = 0 if held is None else held.word + 2 + 4 * manager.number
        first = entry[:2] + entry[4:5]
        second = _place(manager)
        if second is not None and first != second:
            found.append(
                Difference(
                    f"sync_manager_{manager.number}", word, first.hex() or None, second.hex()
                )
            )
    return found


def _place(manager: SyncManagerRule) -> bytes | None:
    if manager.start is None or manager.control is None:
        return None
    return manager.start.to_bytes(2, "little") + bytes([manager.control])
