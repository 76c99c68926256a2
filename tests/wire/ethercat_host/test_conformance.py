"""Conformance through the host process: of an ideal servo, and of a slave that breaks a rule."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager

import pytest

from drivers.conformance.check import check
from drivers.conformance.rule import Verdict
from drivers.conformance.subject import Subject
from drivers.errors import Busy, NotAllowed
from drivers.ethercat.link import EthercatLink
from drivers.ethercat.wire.al_status import AlState
from drivers.link import Address, CyclicSignal
from drivers.virtual.wires.ethercat.launch import VirtualSegment
from drivers.virtual.wires.ethercat.slave import Slave
from drivers.virtual.wires.netns import Namespace, unavailable
from tests.wire.ethercat_host.conftest import FACTORY

_HERE = "tests.wire.ethercat_host.test_conformance"


class SloppySlave(Slave):
    """Takes a request of a state that does not exist for one of Pre-Op."""

    def state_requested(self, control: int, now_ns: int) -> None:
        if control & 0x0F not in (1, 2, 3, 4, 8):
            control = 2
        super().state_requested(control, now_ns)


@pytest.fixture(scope="module")
def namespace() -> Iterator[Namespace]:
    reason = unavailable()
    if reason is not None:
        pytest.skip(reason)
    with Namespace.create() as made:
        yield made


@asynccontextmanager
async def opened(
    namespace: Namespace, *more: str
) -> AsyncIterator[tuple[EthercatLink, VirtualSegment]]:
    arguments = ["--factory", FACTORY, "--lockstep", "--sdo-ms", "0.3", "--drive", "X", *more]
    segment = VirtualSegment.start("ec0s", arguments, namespace)
    link = EthercatLink(
        "ec0m", url="ethercat://virtual0", launcher=namespace.command([]), lockstep=1.0
    )
    await link.open()
    try:
        yield link, segment
    finally:
        await link.close()
        segment.close()


async def in_safe_op(link: EthercatLink) -> None:
    signal = CyclicSignal(1, Address(0x6041, 0, "UINT16"), "6041")
    control = CyclicSignal(1, Address(0x6040, 0, "UINT16"), "6040")
    await link.process_data.configure([signal], [control], 0.001)
    await link.process_data.start()
    with pytest.raises(Busy):
        await link.al_states.request(1, 1)
    await link.process_data.stop()
    await link.set_state(1, AlState.SAFEOP)
    await link.al_states.request(1, 8)


@pytest.mark.long
async def test_a_drive_and_a_sloppy_slave(namespace: Namespace) -> None:
    """Through the host process: the drive is left in Pre-Op, without an error, and disabled."""
    async with opened(namespace) as (link, segment):
        found = await check(Subject(link, 1, (await link.scan(lambda _share, _text: None))[0]))
        assert {e.rule.code for e in found if e.outcome.verdict is Verdict.FAILED} == set()
        # It has neither 6502h nor a plain writable object.
        assert {e.rule.code for e in found if e.outcome.verdict is Verdict.NOT_TESTABLE} == {
            "conformance.drive-mode-objects",
            "conformance.sdo-too-long",
            "conformance.sdo-too-short",
        }
        state = segment.command("state")["slaves"][0]
        assert (state["state"], state["error"]) == ("PREOP", False)
        assert bytes.fromhex(segment.command("read", slave=0, index=0x6040)) == b"\0\0"
        # In Safe-Op a conforming slave would enter Op: that is never requested.
        with pytest.raises(NotAllowed):
            await in_safe_op(link)
    async with opened(namespace, "--slave", f"{_HERE}:SloppySlave") as (link, segment):
        found = await check(Subject(link, 1, (await link.scan(lambda _share, _text: None))[0]))
        failed = {e.rule.code for e in found if e.outcome.verdict is Verdict.FAILED}
        assert failed == {"conformance.states-unknown"}
        state = segment.command("state")["slaves"][0]
        assert (state["state"], state["error"]) == ("PREOP", False)
