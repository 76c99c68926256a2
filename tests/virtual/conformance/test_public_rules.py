"""Our virtual drives keep the rules of the public standards, over their real wires."""

from __future__ import annotations

import struct

import pytest

from drivers.conformance.check import check
from drivers.conformance.rule import Verdict
from drivers.conformance.subject import AlAnswer, Subject
from drivers.link import Address
from drivers.objects.sdo_abort import rejected
from profiles.schema import LinkKind

from .on_wire import EVERY, Aborted, CanWire, EthercatWire, OnWire

#: Where a drive leaves a standard by its own manual, or its manual does not print what it needs.
DEVIATIONS: dict[str, set[str]] = {
    # 004, 000, 001 and 003 print no vendor ID; our drives do not invent one.
    "mms7": {"object-identity"},
    "m6l": {"object-identity"},
    "ep3e": {"object-identity"},
    # The profile of a drive that is not listed has no values of the objects of an identity.
    "generic402": {"object-identity", "drive-device-type"},
    "ds_c": {"object-identity"},
    "r6l": set(),
}


class OnLink:
    """The wire of a virtual drive as a link."""

    def __init__(self, drive: OnWire) -> None:
        self.drive = drive
        self.kind: LinkKind = "canopen" if isinstance(drive.wire, CanWire) else "ethercat"
        if isinstance(drive.wire, EthercatWire):
            self.al_states = self

    async def read(self, _station: int, address: Address) -> bytes:
        assert address.index is not None
        try:
            return self.drive.wire.upload(address.index, address.subindex)
        except Aborted as refusal:
            raise rejected(refusal.code) from refusal

    async def write(self, _station: int, address: Address, data: bytes) -> None:
        assert address.index is not None
        wire = self.drive.wire
        try:
            if len(data) <= 4:
                wire.download(address.index, address.subindex, data)
                return
            assert isinstance(wire, EthercatWire)
            head = struct.pack("<BHBI", 0x21, address.index, address.subindex, len(data))
            answer = wire._sdo(head + data)
        except Aborted as refusal:
            raise rejected(refusal.code) from refusal
        if answer[0] == 0x80:
            raise rejected(struct.unpack_from("<I", answer, 4)[0])

    async def request(self, _station: int, control: int) -> AlAnswer:
        assert isinstance(self.drive.wire, EthercatWire)
        return AlAnswer(*self.drive.wire.wire.request(control))


@pytest.mark.parametrize("name", EVERY)
async def test_rules_of_the_standards(name: str) -> None:
    drive = OnWire(name, None)
    link = OnLink(drive)
    before = drive.status
    result = await check(Subject(link, 1))  # type: ignore[arg-type]
    shown = {each.rule.code.removeprefix("conformance."): each.outcome for each in result}
    failed = {code for code, each in shown.items() if each.verdict is Verdict.FAILED}
    assert failed == DEVIATIONS[name], {code: shown[code].facts for code in failed}
    assert not drive.device.axis.powered
    assert drive.status == before
