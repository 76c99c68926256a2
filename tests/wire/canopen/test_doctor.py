"""The doctor on a CAN bus: real frames, injected trouble, the cause that comes first.

The whole table is ``python -m benchmarks.doctor --bus canopen``.
"""

from __future__ import annotations

import pytest

from backend.station.doctor import examined
from benchmarks.doctor_canopen import CASES, NODE, CanCase, causes_of
from drivers.canopen.link import CanopenLink
from tests.wire.canopen.conftest import Bench
from tests.wire.canopen.small_device import small_profile

#: One of each kind of evidence; the others differ in a code only.
CHOSEN = (
    "alone on the bus, slcan adapter", "other bit rate", "bus-off, slcan adapter",
    "adapter pulled", "node-ID 9 in place of 5", "two nodes of one number", "four restarts",
    "heartbeat ends", "NMT start ignored", "objects not mappable", "COB-ID locked",
    "another node sends 185h", "SYNC does not reach it", "panel control",
    "PDO of one byte for two",
)  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("case", [pytest.param(c, id=c.name) for c in CASES if c.name in CHOSEN])
async def test_the_injected_cause_comes_first(case: CanCase) -> None:
    assert (await causes_of(case))[:1] == [case.cause]


def test_the_chosen_cases_are_in_the_table() -> None:
    assert set(CHOSEN) <= {case.name for case in CASES}


@pytest.mark.long
async def test_a_healthy_node_reaches_operational_and_is_put_back(
    bench: Bench, link: CanopenLink
) -> None:
    link.attach(NODE, small_profile())
    before = link.quality(NODE).details["boots"]
    result = await examined(link, NODE)
    assert result.reached, result
    assert result.causes == ()
    assert bench.node.state == 127, "pre-operational again (CiA 301 clause 7.3.2.2.4)"
    assert bench.device.value(0x6040) == 0, "nothing was enabled"
    assert link.quality(NODE).details["boots"] == before


@pytest.mark.long
async def test_the_examination_starts_no_life_guarding(bench: Bench, link: CanopenLink) -> None:
    """The first request of guarding would start it (CiA 301 clause 7.2.8.3.2.1)."""
    read = bench.device.read
    held = {(0x100C, 0): b"\x64\0", (0x100D, 0): b"\x03"}
    asked: list[int] = []
    guard = bench.node._guard

    def guarded(now: int) -> None:
        asked.append(now)
        guard(now)

    def with_life_guarding(index: int, subindex: int) -> bytes:
        return held.get((index, subindex)) or read(index, subindex)

    bench.node._guard = guarded  # type: ignore[method-assign]
    bench.device.read = with_life_guarding  # type: ignore[method-assign]
    await link.examination(NODE)
    assert asked == []
    held.clear()
    await link.examination(NODE)
    assert len(asked) == 1


@pytest.mark.long
async def test_the_bus_alone_is_examined_where_nobody_answers(bench: Bench) -> None:
    bench.node.mute = True
    link = CanopenLink(bench.url)
    await link.open()
    try:
        result = await examined(link, 0)
    finally:
        await link.close()
    assert [cause.code for cause in result.causes] == ["can_node_silent"]
    facts = {fact.name: fact.actual for fact in result.causes[0].facts}
    assert facts["other_nodes"] == 0
