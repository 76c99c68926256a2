"""Prescriptions of an ESI device on the way to Operational (ETG.2000 v1.0.10)."""

from __future__ import annotations

import re
from xml.etree.ElementTree import Element

from profiles.bring_up import (
    BringUp,
    ClockMode,
    CoeRules,
    InitCommand,
    ModePdos,
    Protocol,
    StateTimeouts,
    SyncManagerKind,
    SyncManagerRule,
    SyncSignal,
    WatchdogRegisters,
)
from profiles.importer.esi.xml_tree import attribute_of, child, children, flag_of, name_of, text_of
from profiles.importer.report import ImportReport
from profiles.importer.values import tidy, whole_number

_PROTOCOLS: tuple[Protocol, ...] = ("aoe", "eoe", "coe", "foe", "soe", "voe")
_KINDS: dict[str, SyncManagerKind] = {
    "mboxout": "mailbox_out",
    "mbxout": "mailbox_out",
    "mboxin": "mailbox_in",
    "mbxin": "mailbox_in",
    "outputs": "outputs",
    "inputs": "inputs",
}
_BY_NUMBER: tuple[SyncManagerKind, ...] = ("mailbox_out", "mailbox_in", "outputs", "inputs")
_TRANSITION = re.compile(r"[IPSOB]{2}")
_MOST_COMMANDS, _MOST_MODES, _MOST_MANAGERS, _MOST_BYTES = 1000, 64, 16, 4096


def manager_kind(item: Element, number: int) -> SyncManagerKind | None:
    """Return the kind of a sync manager by its name, else by its number; None if unknown."""
    name = text_of(item).lower().replace(" ", "")
    return _KINDS.get(name) or (_BY_NUMBER[number] if number < len(_BY_NUMBER) else None)


def assign_activate(mode: Element, place: str, report: ImportReport) -> int:
    """Return the clock's register word of an operation mode; 0 if it cannot be interpreted."""
    word = text_of(child(mode, "AssignActivate")) or "0"
    if re.fullmatch(r"0\d{3}", word):
        # Register bits: a leading zero means hexadecimal, as decimal numbers are written without.
        report.repaired(place, "description.hexadecimal", value=word)
        word = f"#x{word}"
    activate = whole_number(word, place, report)
    if activate is None or not 0 <= activate <= 0xFFFF:
        report.left_out(place, "description.assign-activate")
        return 0
    return activate


def signed_number(text: str, place: str, report: ImportReport) -> int | None:
    """Read a number that may be negative, as factors and shifts are (ETG.2000 table 38)."""
    bare = text.strip()
    number = whole_number(bare.removeprefix("-"), place, report)
    return -number if number is not None and bare.startswith("-") else number


def read_bring_up(element: Element, file: str, report: ImportReport) -> BringUp:
    """Read the prescriptions of one ``Device`` element; missing parts stay empty."""
    return _Reader(element, file, report).read()


class _Reader:
    def __init__(self, element: Element, file: str, report: ImportReport) -> None:
        self._device = element
        self._mailbox = child(element, "Mailbox")
        self._file = file
        self._report = report

    def read(self) -> BringUp:
        controller = child(self._device, "ESC")
        eeprom = child(self._device, "Eeprom")
        return BringUp(
            protocols=tuple(p for p in _PROTOCOLS if child(self._mailbox, p) is not None),
            data_link_layer=flag_of(self._mailbox, "DataLinkLayer"),
            coe=self._coe(),
            init_commands=self._commands(),
            sync_managers=self._managers(),
            watchdog=WatchdogRegisters(
                divider=self._register(controller, "Reg0400"),
                pdi=self._register(controller, "Reg0410"),
                process_data=self._register(controller, "Reg0420"),
            ),
            clock_modes=tuple(
                self._mode(mode)
                for mode in children(child(self._device, "Dc"), "OpMode")[:_MOST_MODES]
            ),
            timeouts=self._timeouts(),
            eeprom_bytes=self._positive(child(eeprom, "ByteSize"), "Eeprom"),
            eeprom_config=self._hex(text_of(child(eeprom, "ConfigData")), "Eeprom") or "",
            source=self._file,
        )

    def _coe(self) -> CoeRules:
        coe = child(self._mailbox, "CoE")

        def said(name: str) -> bool | None:
            return flag_of(coe, name) if attribute_of(coe, name).strip() else None

        return CoeRules(
            sdo_info=said("SdoInfo"),
            pdo_assign=said("PdoAssign"),
            pdo_config=said("PdoConfig"),
            pdo_upload=said("PdoUpload"),
            complete_access=said("CompleteAccess"),
        )

    def _commands(self) -> tuple[InitCommand, ...]:
        found: list[InitCommand] = []
        coe = child(self._mailbox, "CoE")
        # Some files contain the list of an ENI, one level deeper.
        for item in (*children(coe, "InitCmd"), *children(child(coe, "InitCmds"), "InitCmd")):
            place = f"{self._file}: InitCmd"
            index = whole_number(text_of(child(item, "Index")), place, self._report)
            subindex = whole_number(text_of(child(item, "SubIndex")) or "0", place, self._report)
            data = self._hex(text_of(child(item, "Data")), place)
            if index is None or subindex is None or data is None or not 0x1000 <= index <= 0xFFFF:
                self._report.left_out(
                    place, "description.command-invalid", index=text_of(child(item, "Index"))[:12]
                )
                continue
            for transition in children(item, "Transition"):
                # TwinCAT shows commands of the file as <PS>, and some tools write them in this
                # form.
                letters = text_of(transition).upper().strip("<>")
                if _TRANSITION.fullmatch(letters) is None or not 0 <= subindex <= 255:
                    self._report.left_out(
                        place,
                        "description.transition-unknown",
                        index=index,
                        subindex=subindex,
                        transition=letters[:12],
                    )
                    continue
                found.append(
                    InitCommand(
                        transition=letters,
                        index=index,
                        subindex=subindex,
                        data=data,
                        complete_access=flag_of(item, "CompleteAccess"),
                        fixed=flag_of(item, "Fixed"),
                        comment=tidy(name_of_comment(item), 200),
                    )
                )
        if len(found) > _MOST_COMMANDS:
            self._report.left_out(
                self._file, "description.too-many-commands", commands=_MOST_COMMANDS
            )
        return tuple(found[:_MOST_COMMANDS])

    def _managers(self) -> tuple[SyncManagerRule, ...]:
        found = []
        for number, item in enumerate(children(self._device, "Sm")[:_MOST_MANAGERS]):
            kind = manager_kind(item, number)
            if kind is None:
                self._report.left_out(
                    self._file,
                    "description.sync-manager-unknown",
                    number=number,
                    name=text_of(item).lower().replace(" ", "")[:20],
                )
                continue
            place = f"{self._file}: Sm {number}"
            found.append(
                SyncManagerRule(
                    number=number,
                    kind=kind,
                    start=self._attribute(item, "StartAddress", place),
                    default_size=self._attribute(item, "DefaultSize", place),
                    min_size=self._attribute(item, "MinSize", place),
                    max_size=self._attribute(item, "MaxSize", place),
                    control=self._byte(item, "ControlByte", place),
                    enable=self._byte(item, "Enable", place),
                )
            )
        return tuple(found)

    def _mode(self, mode: Element) -> ClockMode:
        name = tidy(text_of(child(mode, "Name"))) or "unnamed"
        place = f"{self._file}: OpMode {name[:20]}"
        activate = assign_activate(mode, place, self._report)
        pdos = []
        for manager in children(mode, "Sm"):
            number = whole_number(attribute_of(manager, "No"), place, self._report)
            listed = tuple(
                index
                for item in children(manager, "Pdo")
                if (index := whole_number(text_of(item), place, self._report)) is not None
            )
            if number is not None and listed:
                pdos.append(ModePdos(sync_manager=number, pdos=listed))
        return ClockMode(
            name=name,
            description=tidy(text_of(child(mode, "Desc")), 200),
            assign_activate=activate,
            sync0=self._signal(mode, "0", place) or SyncSignal(),
            sync1=self._signal(mode, "1", place),
            pdos=tuple(pdos),
        )

    def _signal(self, mode: Element, number: str, place: str) -> SyncSignal | None:
        cycle = child(mode, f"CycleTimeSync{number}")
        shift = child(mode, f"ShiftTimeSync{number}")
        if cycle is None and shift is None:
            return None
        length = whole_number(text_of(cycle) or "0", place, self._report) or 0
        factor = signed_number(attribute_of(cycle, "Factor") or "1", place, self._report)
        shift_ns = signed_number(text_of(shift) or "0", place, self._report) or 0
        return SyncSignal(cycle_ns=max(length, 0), factor=factor or 1, shift_ns=shift_ns)

    def _timeouts(self) -> StateTimeouts:
        info = child(self._device, "Info")
        states = child(child(info, "StateMachine"), "Timeout")
        mailbox = child(child(info, "Mailbox"), "Timeout")
        return StateTimeouts(
            preop_ms=self._positive(child(states, "PreopTimeout"), "PreopTimeout"),
            safeop_op_ms=self._positive(child(states, "SafeopOpTimeout"), "SafeopOpTimeout"),
            back_to_init_ms=self._positive(child(states, "BackToInitTimeout"), "BackToInit"),
            back_to_safeop_ms=self._positive(child(states, "BackToSafeopTimeout"), "BackToSafeop"),
            mailbox_request_ms=self._positive(child(mailbox, "RequestTimeout"), "RequestTimeout"),
            mailbox_response_ms=self._positive(child(mailbox, "ResponseTimeout"), "Response"),
        )

    def _positive(self, element: Element | None, what: str) -> int | None:
        text = text_of(element)
        number = whole_number(text, f"{self._file}: {what}", self._report) if text else None
        return number if number is not None and number >= 0 else None

    def _register(self, controller: Element | None, name: str) -> int | None:
        number = self._positive(child(controller, name), name)
        return number if number is not None and number <= 0xFFFF else None

    def _attribute(self, element: Element, name: str, place: str) -> int | None:
        text = attribute_of(element, name).strip()
        number = whole_number(text, f"{place} {name}", self._report) if text else None
        return number if number is not None and 0 <= number <= 0xFFFF else None

    def _byte(self, element: Element, name: str, place: str) -> int | None:
        number = self._attribute(element, name, place)
        return number if number is not None and number <= 0xFF else None

    def _hex(self, text: str, place: str) -> str | None:
        """Return bytes in upper-case hex; files may have a prefix #x or spaces between them."""
        bare = "".join(text.split())
        bare = bare[2:] if bare.lower().startswith(("#x", "0x")) else bare
        try:
            data = bytes.fromhex(bare)
        except ValueError:
            self._report.left_out(place, "description.not-hexadecimal", value=bare[:20])
            return None
        return data[:_MOST_BYTES].hex().upper()


def name_of_comment(item: Element) -> str:
    """Return the English comment of a command if there are several, else the first."""
    comments = children(item, "Comment")
    for comment in comments:
        if (comment.get("LcId") or "1033").strip() in ("1033", "9"):
            return text_of(comment)
    return text_of(comments[0]) if comments else name_of(item)
