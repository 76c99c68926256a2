"""From a maker's file alone to Operational, on a slave that insists on every rule of the file."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from dataclasses import replace

import pytest

from drivers.cia402 import State
from drivers.ethercat.exchange.mapping import plan_station
from drivers.ethercat.link import EthercatLink
from drivers.link import Address, CyclicSignal, ScopeBlock
from drivers.texts.message import prose
from drivers.virtual.wires.ethercat.launch import VirtualSegment
from drivers.virtual.wires.netns import Namespace, unavailable
from profiles.importer import import_file
from profiles.schema import DataType, Profile
from tests.wire.makers_files.samples import ODD, SAMPLES

_FACTORY = "tests.wire.makers_files.strict_slave:make_device"
_SLAVE = "tests.wire.makers_files.strict_slave:StrictSlave"


@pytest.fixture(scope="module")
def namespace() -> Iterator[Namespace]:
    reason = unavailable()
    if reason is not None:
        pytest.skip(reason)
    with Namespace.create() as made:
        yield made


@asynccontextmanager
async def brought(
    namespace: Namespace, name: str, haste: float = 1.0
) -> AsyncIterator[tuple[EthercatLink, VirtualSegment]]:
    """``haste``: how many times as fast as real time the wire may run with process data."""
    # A slave that takes its time takes real time, while the time of a lockstep wire stands without
    # frames. With process data its time follows the frames as well: a cycle that this computer
    # sends late is not late for the drive.
    wire = "--steady" if "slow" in name else "--lockstep"
    arguments = ["--factory", _FACTORY, "--slave", _SLAVE, "--sdo-ms", "0.3", "--drive", name]
    arguments.append(wire)
    segment = VirtualSegment.start("ec0s", arguments, namespace)
    link = EthercatLink(
        "ec0m",
        url="ethercat://virtual0",
        launcher=namespace.command([]),
        lockstep=haste,
    )
    await link.open()
    try:
        # A search that lost frames on a busy computer is made again, as the page offers.
        for _ in range(5):
            found = await link.scan(lambda _share, _text: None)
            if [each.state for each in found] == [prose("PREOP")]:
                break
        assert [each.state for each in found] == [prose("PREOP")], found
        yield link, segment
    finally:
        await link.close()
        segment.close()


def profile_of(name: str) -> Profile:
    return import_file((SAMPLES | ODD)[name], f"{name}.xml").profile


def signal(index: int, kind: DataType) -> CyclicSignal:
    return CyclicSignal(1, Address(index, 0, kind), f"{index:04X}")


INPUTS = [signal(0x6041, "UINT16"), signal(0x6064, "INT32"), signal(0x606C, "INT32")]
OUTPUTS = [signal(0x6060, "INT8"), signal(0x607A, "INT32"), signal(0x60FF, "INT32")]


@pytest.mark.long
@pytest.mark.parametrize("name", SAMPLES)
async def test_from_the_file_to_process_data(namespace: Namespace, name: str) -> None:
    async with brought(namespace, name) as (link, segment):
        link.attach(1, profile_of(name))
        cyclic = link.process_data
        taken = await cyclic.configure(INPUTS, OUTPUTS, 0.001)
        assert {s.channel for s in taken} >= {"6041", "6064", "607A", "6060"}
        blocks: list[ScopeBlock] = []
        cyclic.blocks(blocks.append)
        await cyclic.start()
        state = segment.command("state")
        assert state["slaves"][0]["state"] == "OP", state
        await cyclic.drive_to(1, State.OPERATION_ENABLED, mode=9)
        segment.command("inject", slave=0, what="shift", value=4321)
        await link.write(1, Address(0x6060, 0, "INT8"), b"\x09")
        for _ in range(400):
            await asyncio.sleep(0.01)
            last = blocks[-1] if blocks else None
            if last is not None:
                row = dict(zip(last.channels, last.samples[-1], strict=True))
                # Both take some cycles, and either may come first.
                if row["6064"] >= 5321 and int(row["6041"]) & 0x6F == 0x27:
                    break
        assert last is not None
        truth = bytes.fromhex(segment.command("read", slave=0, index=0x6064))
        assert row["6064"] == int.from_bytes(truth, "little", signed=True) == 5321
        assert int(row["6041"]) & 0x6F == 0x27, "operation enabled, by the status word (CiA 402)"
        mode = bytes.fromhex(segment.command("read", slave=0, index=0x6060))
        assert mode == b"\x09", "the output that was written has arrived"
        await cyclic.stop()


FIXED = {"fixed_with_padding", "two_each_way", "exclusive_sets", "pdos_of_the_mode"}
"""Samples with fixed contents, none of which carries torque and velocity offset as well."""
ALL_OUTPUTS = (
    (0x6060, "INT8"),
    (0x6071, "INT16"),
    (0x607A, "INT32"),
    (0x60B1, "INT32"),
    (0x60FF, "INT32"),
)


@pytest.mark.parametrize("name", SAMPLES)
def test_outputs_that_the_process_data_lack_are_left_out(name: str) -> None:
    """The page asks for every output that the file says can be mapped; fixed PDOs have fewer."""
    profile = profile_of(name)
    wanted = [signal(0x6040, "UINT16")]
    wanted += [replace(signal(i, kind), optional=True) for i, kind in ALL_OUTPUTS]
    plan = plan_station(1, INPUTS, wanted, profile)
    carried = {s.channel for s in plan.mapped}
    assert carried >= {"6040", "6060", "607A", "6041", "6064"}
    left = {s.channel for s, _why in plan.left_over}
    assert left == ({"6071", "60B1"} if name in FIXED else set())
