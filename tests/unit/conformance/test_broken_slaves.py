"""A slave that keeps every rule, and for each rule one that breaks it: no rule passes by itself.

The slave is written from CiA 301, CiA 402-2 and ETG.1000.6, and shares no code with our drives.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from drivers.conformance.check import RULES, check
from drivers.conformance.rule import Verdict
from drivers.conformance.subject import AlAnswer, Subject
from drivers.errors import Busy, LinkTimeout, NotAllowed
from drivers.link import Address, Found
from drivers.objects.sdo_abort import rejected
from drivers.texts.message import language, speaking

NO_OBJECT, NO_SUBINDEX, READ_ONLY, TOO_LONG, TOO_SHORT = (
    0x06020000,
    0x06090011,
    0x06010002,
    0x06070012,
    0x06070013,
)
VENDOR, PRODUCT = 0xA2B, 0x190


def objects() -> dict[tuple[int, int], bytes]:
    values = {
        (0x1000, 0): (0x00020192, 4), (0x1001, 0): (0, 1), (0x1017, 0): (100, 2),
        (0x1018, 0): (2, 1), (0x1018, 1): (VENDOR, 4), (0x1018, 2): (PRODUCT, 4),
        (0x1600, 0): (3, 1), (0x1600, 1): (0x60400010, 4), (0x1600, 2): (0x00000008, 4),
        (0x1600, 3): (0x607A0020, 4), (0x1A00, 0): (1, 1), (0x1A00, 1): (0x60410010, 4),
        (0x1C00, 0): (4, 1), (0x1C00, 1): (1, 1), (0x1C00, 2): (2, 1), (0x1C00, 3): (3, 1),
        (0x1C00, 4): (4, 1), (0x1C12, 0): (1, 1), (0x1C12, 1): (0x1600, 2),
        (0x1C13, 0): (1, 1), (0x1C13, 1): (0x1A00, 2), (0x6040, 0): (0, 2),
        (0x6041, 0): (0x0250, 2), (0x6061, 0): (8, 1), (0x6064, 0): (0, 4), (0x607A, 0): (0, 4),
        (0x6502, 0): (0x80, 4),
    }  # fmt: skip
    return {key: number.to_bytes(size, "little") for key, (number, size) in values.items()}


class Slave:
    """The link with one slave at it, and its AL state machine."""

    def __init__(self, kind: str = "ethercat") -> None:
        self.kind = kind
        self.values = objects()
        self.codes = {c: c for c in (NO_OBJECT, NO_SUBINDEX, READ_ONLY, TOO_LONG, TOO_SHORT)}
        self.writable = {0x1017, 0x6040, 0x607A}
        self.written: list[tuple[int, int, bytes]] = []
        self.state, self.code = 2, 0
        self.refusals = {8: 0x11, 5: 0x12}
        self.sticky = False
        self.deaf: set[int] = set()
        if kind == "ethercat":
            self.al_states = self

    def _abort(self, code: int) -> None:
        if self.codes[code]:
            raise rejected(self.codes[code])

    async def read(self, _station: int, address: Address) -> bytes:
        assert address.index is not None
        if address.index in self.deaf:
            raise LinkTimeout("link.drive-cannot-list-objects", drive="X", kind=self.kind)
        held = self.values.get((address.index, address.subindex))
        if held is None:
            known = any(index == address.index for index, _ in self.values)
            self._abort(NO_SUBINDEX if known else NO_OBJECT)
            return bytes(4)
        return held

    async def write(self, _station: int, address: Address, data: bytes) -> None:
        assert address.index is not None
        self.written.append((address.index, address.subindex, data))
        held = self.values[address.index, address.subindex]
        if address.index not in self.writable:
            self._abort(READ_ONLY)
            return
        if len(data) != len(held):
            self._abort(TOO_LONG if len(data) > len(held) else TOO_SHORT)
        self.values[address.index, address.subindex] = data[: len(held)].ljust(len(held), b"\xff")

    async def request(self, _station: int, control: int) -> AlAnswer:
        wanted, error = control & 0x0F, self.state & 0x10
        if error and not control & 0x10 and wanted >= self.state & 0x0F:
            return AlAnswer(self.state, self.code)
        if self.refusals.get(wanted):
            self.state, self.code = self.state & 0x0F | 0x10, self.refusals[wanted]
        elif not (self.sticky and self.state & 0x10):
            self.state, self.code = wanted, 0
        return AlAnswer(self.state, self.code)


async def verdicts(slave: Slave) -> dict[str, Verdict]:
    subject = Subject(slave, 1, Found(1, VENDOR, PRODUCT))  # type: ignore[arg-type]
    return {
        each.rule.code.removeprefix("conformance."): each.outcome.verdict
        for each in await check(subject)
    }


def of(verdict: Verdict, found: dict[str, Verdict]) -> set[str]:
    return {code for code, each in found.items() if each is verdict}


@pytest.mark.parametrize("kind", ["ethercat", "canopen"])
async def test_a_slave_that_keeps_every_rule(kind: str) -> None:
    slave = Slave(kind)
    before = dict(slave.values)
    found = await verdicts(slave)
    other = {"canopen": "ethercat", "ethercat": "canopen"}[kind]
    foreign = {r.code.removeprefix("conformance.") for r in RULES if r.buses == (other,)}
    assert of(Verdict.NOT_APPLICABLE, found) == foreign
    assert of(Verdict.PASSED, found) == set(found) - foreign
    assert slave.values == before
    assert slave.state == 2
    assert not {index for index, _, _ in slave.written} & {0x6040, 0x6060, 0x607A, 0x60FF, 0x6071}


def put(index: int, subindex: int, data: bytes) -> Callable[[Slave], None]:
    def change(slave: Slave) -> None:
        slave.values[index, subindex] = data

    return change


def gone(*keys: int) -> Callable[[Slave], None]:
    def change(slave: Slave) -> None:
        slave.values = {k: v for k, v in slave.values.items() if k[0] not in keys}

    return change


def aborts(instead_of: int, code: int) -> Callable[[Slave], None]:
    return lambda slave: slave.codes.update({instead_of: code})


def refuses(state: int, code: int) -> Callable[[Slave], None]:
    return lambda slave: slave.refusals.update({state: code})


def sticks(slave: Slave) -> None:
    slave.sticky = True


BROKEN: list[tuple[str, str, str, Callable[[Slave], None]]] = [
    ("states-up-and-down", "ethercat", "Init is refused", refuses(1, 0x01)),
    ("states-op-from-preop", "ethercat", "Op is entered", refuses(8, 0)),
    ("states-op-from-preop", "ethercat", "another code", refuses(8, 0x16)),
    ("states-unknown", "ethercat", "state 5 is entered", refuses(5, 0)),
    ("states-acknowledged", "ethercat", "the error bit stays", sticks),
    ("sdo-no-object", "canopen", "it is answered", aborts(NO_OBJECT, 0)),
    ("sdo-no-object", "ethercat", "general error", aborts(NO_OBJECT, 0x08000000)),
    ("sdo-no-object", "canopen", "no answer", lambda slave: slave.deaf.add(0x0FFF)),
    ("sdo-no-subindex", "canopen", "it is answered", aborts(NO_SUBINDEX, 0)),
    ("sdo-no-subindex", "ethercat", "no object", aborts(NO_SUBINDEX, NO_OBJECT)),
    ("sdo-read-only", "canopen", "it is taken", aborts(READ_ONLY, 0)),
    ("sdo-too-long", "ethercat", "it is cut", aborts(TOO_LONG, 0)),
    ("sdo-too-short", "canopen", "it is filled with ones", aborts(TOO_SHORT, 0)),
    ("object-device-type", "canopen", "two bytes", put(0x1000, 0, b"\x92\x01")),
    ("object-error-register", "canopen", "missing", gone(0x1001)),
    ("object-identity", "canopen", "no vendor", put(0x1018, 1, bytes(4))),
    ("object-identity", "ethercat", "entry missing", put(0x1018, 0, b"\x03")),
    ("object-identity", "ethercat", "missing", gone(0x1018)),
    ("error-control", "canopen", "neither", gone(0x1017)),
    ("stored-identity", "ethercat", "other product", put(0x1018, 2, b"\x91\x01\0\0")),
    ("sync-manager-kinds", "ethercat", "swapped", put(0x1C00, 3, b"\x04")),
    ("sync-manager-kinds", "ethercat", "missing", gone(0x1C00)),
    ("assignment", "ethercat", "no such PDO", put(0x1C13, 1, b"\x0a\x1a")),
    ("assignment", "ethercat", "no such object", put(0x1600, 1, b"\x10\0\x99\x60")),
    ("drive-device-type", "canopen", "401", put(0x1000, 0, b"\x91\x01\x02\0")),
    ("drive-words", "canopen", "four bytes", put(0x6041, 0, b"\x50\x02\0\0")),
    ("drive-words", "canopen", "no control word", gone(0x6040)),
    ("drive-state", "canopen", "bits of no state", put(0x6041, 0, b"\x01\x00")),
    ("drive-mode-shown", "canopen", "mode 3 is not in 6502h", put(0x6061, 0, b"\x03")),
    ("drive-mode-shown", "canopen", "missing", gone(0x6061)),
    ("drive-mode-objects", "canopen", "no position", gone(0x6064)),
    ("drive-mode-objects", "ethercat", "no mode at all", put(0x6502, 0, bytes(4))),
]


@pytest.mark.parametrize(
    ("rule", "kind", "breaks"),
    [pytest.param(r, k, b, id=f"{r}: {name}") for r, k, name, b in BROKEN],
)
async def test_a_broken_rule_fails(rule: str, kind: str, breaks: Callable[[Slave], None]) -> None:
    slave = Slave(kind)
    breaks(slave)
    found = await verdicts(slave)
    assert rule in of(Verdict.FAILED, found), found[rule]


def test_every_rule_is_seen_to_fail() -> None:
    codes = {rule.code.removeprefix("conformance.") for rule in RULES}
    assert codes == {rule for rule, *_ in BROKEN}


@pytest.mark.parametrize("status", [0x0237, 0x0217, 0x021F])
async def test_a_powered_drive_is_only_read(status: int) -> None:
    slave = Slave()
    slave.values[0x6041, 0] = status.to_bytes(2, "little")
    asked: list[Any] = []

    async def request(_station: int, control: int) -> AlAnswer:
        asked.append(control)
        return AlAnswer(2, 0)

    slave.request = request  # type: ignore[method-assign]
    found = await verdicts(slave)
    changing = {r.code.removeprefix("conformance.") for r in RULES if r.changes}
    assert of(Verdict.NOT_TESTABLE, found) == changing
    assert slave.written == []
    assert asked == []


@pytest.mark.parametrize(
    "refusal",
    [Busy("ethercat.cyclic-exchange-owns-states"), NotAllowed("ethercat.op-needs-cyclic-data")],
)
async def test_what_we_do_not_send_is_no_failure_of_the_slave(refusal: Exception) -> None:
    slave = Slave()

    async def request(_station: int, _control: int) -> AlAnswer:
        raise refusal

    slave.request = request  # type: ignore[method-assign]
    found = await verdicts(slave)
    states = {code for code in found if code.startswith("states-")}
    assert of(Verdict.NOT_TESTABLE, found) == states


async def test_a_value_that_a_broken_slave_has_taken_is_restored() -> None:
    slave = Slave("canopen")
    slave.codes[TOO_SHORT] = 0
    await verdicts(slave)
    assert slave.values[0x1017, 0] == (100).to_bytes(2, "little")


async def test_what_cannot_be_known_is_not_called_passed() -> None:
    slave = Slave("canopen")
    gone(0x6502, 0x1017)(slave)
    slave.values |= {(0x100C, 0): b"\0\0", (0x100D, 0): b"\0"}
    found = await verdicts(slave)
    assert found["error-control"] is Verdict.PASSED
    assert of(Verdict.NOT_TESTABLE, found) == {
        "drive-mode-objects",
        "sdo-too-long",
        "sdo-too-short",
    }


def test_titles_and_verdicts_have_words_in_both_languages() -> None:
    english = [rule.title.words("en") for rule in RULES]
    assert len(set(english)) == len(RULES)
    with speaking("zh"):
        assert all(rule.title.words(language()) not in english for rule in RULES)
    assert {each.text.words("en") for each in Verdict} == {
        "passed",
        "failed",
        "not applicable",
        "could not be tested",
    }
