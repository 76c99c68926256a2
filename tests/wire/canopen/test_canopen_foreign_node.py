"""Our link and a node that is not ours: python-canopen's `LocalNode`, which sends no PDO."""

from __future__ import annotations

from collections.abc import Iterator

import canopen
import pytest

from backend.station.doctor import examined
from drivers.canopen.link import CanopenLink
from drivers.errors import Rejected
from drivers.link import Address
from profiles import STANDARD, load_profile

U8, I16, U16, I32, U32, TEXT = 5, 3, 6, 4, 7, 9
_RAMP = Address(0x6083, 0, "UINT32")


def _dictionary() -> canopen.ObjectDictionary:
    module, dictionary = canopen.objectdictionary, canopen.ObjectDictionary()
    values: tuple[tuple[int, int, int | str], ...] = (
        (0x1000, U32, 0x00020192), (0x1001, U8, 0), (0x1008, TEXT, "Node of another stack"),
        (0x1017, U16, 0), (0x603F, U16, 0), (0x6040, U16, 0), (0x6041, U16, 0x0240),
        (0x6060, U8, 0), (0x6061, U8, 0), (0x6064, I32, 100), (0x606C, I32, 0), (0x6071, I16, 0),
        (0x6077, I16, 0), (0x607A, I32, 0), (0x6083, U32, 1000), (0x60FF, I32, 0),
    )  # fmt: skip
    for index, kind, value in values:
        variable = module.ODVariable(f"object {index:x}", index)
        variable.data_type, variable.default, variable.access_type = kind, value, "rw"
        dictionary.add_object(variable)
    records: dict[int, tuple[tuple[int, int], ...]] = {
        0x1018: ((U8, 4), (U32, 0x99), (U32, 0x1234), (U32, 1), (U32, 77))
    }
    for n in range(4):
        for communication, mapping, cob_id, target in (
            (0x1400, 0x1600, 0x205, 0x60400010),
            (0x1800, 0x1A00, 0x185, 0x60410010),
        ):
            entries = ((U8, 5), (U32, cob_id + 0x100 * n), (U8, 1), (U16, 0), (U8, 0), (U16, 0))
            records[communication + n] = entries
            records[mapping + n] = ((U8, 1), (U32, target), (U32, 0), (U32, 0), (U32, 0))
    for index, members in records.items():
        record = module.ODRecord(f"record {index:x}", index)
        for subindex, (kind, number) in enumerate(members):
            member = module.ODVariable(f"entry {subindex}", index, subindex)
            member.data_type, member.default = kind, number
            record.add_member(member)
        dictionary.add_object(record)
    return dictionary


@pytest.fixture
def bus() -> Iterator[str]:
    network = canopen.Network()
    network.NOTIFIER_CYCLE = 0.02  # how long disconnecting takes
    network.connect(interface="virtual", channel="another-stack")
    network.add_node(canopen.LocalNode(5, _dictionary()))
    yield "canopen://virtual/another-stack?timeout_ms=1000"
    network.disconnect()


async def test_it_is_found_read_and_written(bus: str) -> None:
    link = CanopenLink(bus)
    await link.open()
    try:
        (found,) = await link.scan(lambda *_: None, range(4, 7))
        assert (found.station, found.vendor_id, found.product_code) == (5, 0x99, 0x1234)
        assert (found.name, found.serial) == ("Node of another stack", 77)
        assert (found.device_profile, found.notes) == (402, ())
        await link.write(5, _RAMP, b"\x01\x02\x00\x00")
        assert await link.read(5, _RAMP) == b"\x01\x02\x00\x00"
        missing = [Address(0x2000, 0, "UINT16"), Address(0x1018, 9, "UINT32")]
        refused = await link.read_many(5, missing)
        codes = [each.abort_code for each in refused if isinstance(each, Rejected)]
        assert codes == [0x06020000, 0x06090011]
    finally:
        await link.close()


@pytest.mark.long
async def test_a_node_that_sends_no_pdo_is_diagnosed_as_one(bus: str) -> None:
    """Its dictionary takes the mapping, and nothing acts on it."""
    link = CanopenLink(bus)
    await link.open()
    try:
        link.attach(5, load_profile(STANDARD))
        seen = await examined(link, 5)
        assert seen.reached is False
        facts = {fact.name: fact.actual for cause in seen.causes for fact in cause.facts}
        assert facts["pdo_silent"] == "185h"
    finally:
        await link.close()
