"""Slave controller data in a manufacturer's ESI file: mailboxes, sync managers and clock.

Without them no complete ENI can be written: the addresses are specific to the slave (ETG.2000).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Literal, TypeAlias
from xml.etree.ElementTree import Element

from profiles.importer.esi.bring_up import assign_activate, manager_kind, signed_number
from profiles.importer.esi.esi import EsiFile, esi_devices, open_esi
from profiles.importer.esi.xml_tree import attribute_of, child, children, flag_of, text_of
from profiles.importer.report import ImportFailed, ImportReport
from profiles.importer.values import whole_number

SyncKind = Literal["mailbox_out", "mailbox_in", "outputs", "inputs"]
_MEMORY, _MEMORY_END = 0x1000, 0x10000
#: Size of the smallest CoE mailbox (ETG.1000.6), and the largest length of a sync manager.
_SHORTEST_MAILBOX, _LONGEST = 16, 0x7FFF
#: Default for a drive with a clock whose file has no operation mode: SYNC0 without SYNC1.
_SYNC0 = 0x0300


@dataclass(frozen=True, slots=True)
class SyncManager:
    """One sync manager by its number; ``length`` is that of a mailbox, 0 for process data."""

    number: int
    kind: SyncKind
    start: int
    length: int
    control: int


@dataclass(frozen=True, slots=True)
class SlaveController:
    """Sync managers and clock of a slave; ``assign_activate`` 0 means no clock."""

    physics: str
    sync_managers: tuple[SyncManager, ...]
    assigns: bool
    """Whether PDOs can be assigned (1C12h, 1C13h)."""
    configures: bool
    """Whether the contents of PDOs can be written."""
    assign_activate: int
    shift_ns: int
    source: str

    def manager(self, kind: SyncKind) -> SyncManager | None:
        """Return the first one of a kind."""
        return next((each for each in self.sync_managers if each.kind == kind), None)


class NoController(ImportFailed):
    """A valid file without the requested controller."""


#: Vendor ID, product code and revision number of a drive; the revision may be unknown.
Wanted: TypeAlias = tuple[int, int, int | None]


def read_controllers(
    sources: Iterable[tuple[bytes, str]], wanted: Sequence[Wanted]
) -> tuple[SlaveController, ...]:
    """Return the controllers of these drives in their order, each from the first file that has it.

    ``sources`` are ESI files with their names; only one of them is in memory at a time. If a
    revision is unknown or not in the file, the newest is used.

    Raises:
        NoController: no file has such a device, or only one without CoE mailboxes.
        ImportFailed: a file is not an ESI file, or is damaged.
    """
    found: dict[int, SlaveController] = {}
    missing: dict[int, NoController] = {}
    for data, name in sources:
        left = [number for number in range(len(wanted)) if number not in found]
        if not left:
            break
        file = open_esi(data, name, ImportReport())
        for number in left:
            try:
                found[number] = _of_file(file, *wanted[number])
            except NoController as error:
                missing[number] = error
    for number in range(len(wanted)):
        if number not in found:
            raise missing[number]
    return tuple(found[number] for number in range(len(wanted)))


@dataclass(frozen=True, slots=True)
class ControllersTask:
    """`read_controllers` as a task of the import process; see `profiles.importer.process`."""

    sources: tuple[tuple[bytes, str], ...]
    wanted: tuple[Wanted, ...]

    def run(self) -> dict[str, object]:
        """Return ``controllers``, or ``refused`` with code and facts; ``sound``: NoController."""
        try:
            found = read_controllers(self.sources, self.wanted)
        except ImportFailed as error:
            refused = {"code": error.code, "params": dict(error.params)}
            return {"refused": refused, "sound": isinstance(error, NoController)}
        return {"controllers": [asdict(each) for each in found]}


def _of_file(file: EsiFile, vendor: int, product: int, revision: int | None) -> SlaveController:
    fitting = [
        device
        for device in esi_devices(file)
        if (device.vendor_id, device.product_code) == (vendor, product)
    ]
    if not fitting:
        raise NoController(
            "handover.no-device-vendor-0x", value=file.name, vendor=vendor, product=product
        )
    exact = [device for device in fitting if device.revision == revision]
    chosen = max(exact or fitting, key=lambda device: device.revision or 0)
    found = _controller(file.devices[chosen.number], file.name, file.report)
    if found.manager("mailbox_out") is None or found.manager("mailbox_in") is None:
        raise NoController("handover.no-mailboxes-no-start", value=file.name, chosen=chosen.name)
    return found


def _controller(element: Element, name: str, report: ImportReport) -> SlaveController:
    managers = []
    for number, each in enumerate(children(element, "Sm")):
        kind = manager_kind(each, number)
        start = _number(each, "StartAddress", name, report)
        control = _number(each, "ControlByte", name, report)
        length = _number(each, "DefaultSize", name, report)
        if kind is None or (not text_of(each) and not start):
            continue
        mailbox = kind.startswith("mailbox")
        if not _MEMORY <= start < _MEMORY_END or (
            mailbox and not _SHORTEST_MAILBOX <= length <= _LONGEST
        ):
            raise ImportFailed(
                "handover.sync-manager-0x-bytes",
                value=name,
                number=number,
                start=start,
                length_bytes=length,
            )
        managers.append(SyncManager(number, kind, start, length if mailbox else 0, control))
    coe = child(child(element, "Mailbox"), "CoE")
    modes = children(child(element, "Dc"), "OpMode")
    activate = shift = 0
    if modes:
        words = [assign_activate(mode, name, report) for mode in modes]
        at = next((n for n, word in enumerate(words) if word), 0)
        activate = words[at]
        shift = signed_number(text_of(child(modes[at], "ShiftTimeSync0")) or "0", name, report) or 0
    elif child(element, "Dc") is not None:
        activate = _SYNC0
    return SlaveController(
        physics=element.get("Physics", "YY")[:4],
        sync_managers=tuple(managers),
        assigns=flag_of(coe, "PdoAssign"),
        configures=flag_of(coe, "PdoConfig"),
        assign_activate=activate,
        shift_ns=shift,
        source=name,
    )


def _number(element: Element, attribute: str, name: str, report: ImportReport) -> int:
    text = attribute_of(element, attribute)
    return (whole_number(text, name, report) or 0) if text else 0
