"""Modular devices: the modules in their slots by default (ETG.2000, ETG.5001)."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from xml.etree.ElementTree import Element

from profiles.bring_up import InitCommand
from profiles.importer.esi.xml_tree import attribute_of, child, children, flag_of, text_of
from profiles.importer.report import ImportReport
from profiles.importer.values import whole_number

_MOST_SLOTS = 64
_MODULE_LIST = 0xF030


@dataclass(frozen=True, slots=True)
class Part:
    """The device itself, or a module; the offsets of its objects and PDOs from those of slot 0."""

    element: Element
    index_shift: int = 0
    pdo_shift: int = 0


def parts_of(root: Element, device: Element) -> list[Part]:
    """Return the device and the default modules of its slots.

    For a device without slots and without objects, the first module that has some.
    """
    parts = [Part(device)]
    modules = children(child(child(root, "Descriptions"), "Modules"), "Module")
    slots = child(device, "Slots")
    by_ident = {_number(attribute_of(child(m, "Type"), "ModuleIdent")): m for m in modules}
    for number, slot in enumerate(_slots(slots)):
        module = by_ident.get(_delivered(slot, number))
        if module is not None:
            parts.append(
                Part(
                    module,
                    number * _increment(slot, slots, "SlotIndexIncrement"),
                    number * _increment(slot, slots, "SlotPdoIncrement"),
                )
            )
    if len(parts) == 1 and not dictionaries_of(device):
        parts += [Part(m) for m in modules if dictionaries_of(m)][:1]
    return parts


def _slots(slots: Element | None) -> list[Element]:
    """Return one element per slot: ``MinInstances`` repeats a ``Slot`` (ETG.2000)."""
    found: list[Element] = []
    for slot in children(slots, "Slot"):
        count = _number(attribute_of(slot, "MinInstances")) or 1
        found += [slot] * min(count, _MOST_SLOTS - len(found))
    return found


def overwritten(pdo: Element, device: Part, modules: list[Part]) -> bool:
    """Return whether a module provides the PDO that the device has under the same index."""
    if not flag_of(pdo, "OverwrittenByModule"):
        return False
    index = pdo_index(pdo, device)
    others = (
        pdo_index(other, part) for part in modules for other in children(part.element, pdo.tag)
    )
    return index is not None and index in others


def pdo_index(pdo: Element, part: Part) -> int | None:
    """Return the index in this slot; None if the file states no number."""
    index = _number(text_of(child(pdo, "Index")))
    shifts = flag_of(child(pdo, "Index"), "DependOnSlot")
    return index + part.pdo_shift if index is not None and shifts else index


def module_list(root: Element, device: Element) -> InitCommand | None:
    """Return the write of F030h that lists the device's modules; None if not required."""
    slots = child(device, "Slots")
    if slots is None or not flag_of(slots, "DownloadModuleIdentList"):
        return None
    # Subindex n is slot n, and an empty slot has 0 (ETG.5001).
    idents = [_delivered(slot, number) or 0 for number, slot in enumerate(_slots(slots))]
    if not any(idents):
        idents = [
            _number(attribute_of(child(part.element, "Type"), "ModuleIdent")) or 0
            for part in parts_of(root, device)[1:]
        ]
    while idents and not idents[-1]:
        idents.pop()
    if not idents:
        return None
    data = struct.pack(f"<H{len(idents)}I", len(idents), *idents)
    return InitCommand(
        transition="PS",
        index=_MODULE_LIST,
        subindex=0,
        data=data.hex().upper(),
        complete_access=True,
        comment="modules in the slots as delivered",
    )


def dictionaries_of(element: Element) -> list[Element]:
    """Return the dictionaries with objects of a device or module."""
    found = []
    for profile in children(element, "Profile"):
        dictionary = child(profile, "Dictionary")
        if dictionary is not None and child(dictionary, "Objects") is not None:
            found.append(dictionary)
    return found


def _delivered(slot: Element, number: int) -> int | None:
    """Return the default module of a slot; in the first slot the first one allowed."""
    idents = children(slot, "ModuleIdent")
    marked = [each for each in idents if flag_of(each, "Default")]
    needed = number == 0 or bool(_number(attribute_of(slot, "MinInstances")))
    chosen = marked or (idents if needed else [])
    return _number(text_of(chosen[0])) if chosen else None


def _increment(slot: Element, slots: Element | None, name: str) -> int:
    return _number(attribute_of(slot, name)) or _number(attribute_of(slots, name)) or 0


def _number(text: str) -> int | None:
    return whole_number(text, "module", ImportReport()) if text.strip() else None
