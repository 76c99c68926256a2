"""Layer setting services: a node without number is found, named and stored (CiA 305)."""

from __future__ import annotations

import itertools
import json
import threading
import time
from collections.abc import AsyncIterator, Iterator

import can
import canopen
import pytest
from typer.testing import CliRunner

from backend import cli
from drivers.canopen.link import CanopenLink
from drivers.canopen.lss.codes import LssIdentity
from drivers.canopen.lss.master import LssMaster
from drivers.errors import LinkTimeout, NotAllowed, OutOfRange
from drivers.link import Address
from drivers.virtual.wires.can_wire import CanWire, PythonCanSide
from drivers.virtual.wires.canopen import CanopenNode
from drivers.virtual.wires.lss import LssSlave
from tests.wire.canopen.conftest import Bench, until
from tests.wire.canopen.small_device import SmallDevice

_numbers = itertools.count()
STATUS = Address(0x6041, 0, "UINT16")
#: Few bits that are one: each of them takes a scan as long as a missing answer.
SERIAL = 0x10000001


def quiet(_share: float, _step: object) -> None:
    pass


def made(node: int, serial: int) -> CanopenNode:
    return CanopenNode(SmallDevice(serial=serial), node, time.monotonic_ns)


@pytest.fixture
def bench() -> Iterator[Bench]:
    """A node without number, and node 5."""
    channel = f"lss-{next(_numbers)}"
    nodes = [made(255, SERIAL), made(5, 42)]
    with CanWire(PythonCanSide(can.Bus(interface="virtual", channel=channel)), nodes) as wire:
        yield Bench(wire, f"canopen://virtual/{channel}?timeout_ms=100")


@pytest.fixture
async def link(bench: Bench) -> AsyncIterator[CanopenLink]:
    opened = CanopenLink(bench.url)
    await opened.open()
    yield opened
    await opened.close()


def truth(node: CanopenNode) -> LssIdentity:
    """Vendor, product and revision of the small drive, and its serial number."""
    assert isinstance(node.device, SmallDevice)
    return LssIdentity(0x1234, 0x56, 3, node.device.serial)


async def test_a_node_without_number_says_nothing_else(bench: Bench, link: CanopenLink) -> None:
    found = await link.scan(quiet, [5, 127])
    assert [each.station for each in found] == [5]


@pytest.mark.long
async def test_it_is_found_bit_by_bit_and_given_a_number(bench: Bench, link: CanopenLink) -> None:
    found = await link.lss.search(quiet)
    assert found is not None
    assert found.node is None
    assert found.identity == truth(bench.node)
    await link.lss.set_node(found.identity, 9, store=True)
    await until(lambda: bench.node.node_id == 9)
    assert await link.read(9, STATUS) == b"\x50\x02"
    bench.wire.do(bench.node.reboot)
    assert bench.node.node_id == 9, "stored"


async def test_what_is_not_stored_is_gone_after_a_power_cut(
    bench: Bench, link: CanopenLink
) -> None:
    await link.lss.set_node(truth(bench.node), 9, store=False)
    await until(lambda: bench.node.node_id == 9)
    bench.wire.do(bench.node.reboot)
    assert bench.node.node_id == 255


async def test_a_node_with_a_number_takes_another_at_its_next_reset(
    bench: Bench, link: CanopenLink
) -> None:
    other = bench.wire.nodes[1]
    await link.lss.set_node(truth(other), 6, store=True)
    assert other.node_id == 5
    bench.wire.do(other.reboot)
    assert other.node_id == 6


async def test_the_only_node_is_found_with_its_number(bench: Bench, link: CanopenLink) -> None:
    bench.wire.do(lambda: bench.wire.nodes.pop(0))
    found = await link.lss.search(quiet)
    assert found is not None
    assert (found.identity, found.node) == (truth(bench.node), 5)


async def test_several_nodes_with_numbers_are_not_distinguished_by_a_guess(
    bench: Bench, link: CanopenLink
) -> None:
    bench.wire.do(lambda: bench.wire.nodes.__setitem__(0, made(7, 43)))
    with pytest.raises(NotAllowed, match="2 nodes"):
        await link.lss.search(quiet)


async def test_a_number_that_somebody_has_is_refused(bench: Bench, link: CanopenLink) -> None:
    with pytest.raises(NotAllowed, match="number 5 already answers"):
        await link.lss.set_node(truth(bench.node), 5, store=False)
    assert bench.node.node_id == 255


@pytest.mark.parametrize("number", [0, 128])
async def test_no_number_beyond_the_range(bench: Bench, link: CanopenLink, number: int) -> None:
    with pytest.raises(OutOfRange):
        await link.lss.set_node(truth(bench.node), number, store=False)


async def test_nobody_has_this_identity(bench: Bench, link: CanopenLink) -> None:
    with pytest.raises(LinkTimeout, match="no node"):
        await link.lss.set_node(truth(bench.node)._replace(serial=1), 9, store=True)


async def test_a_node_that_cannot_store_says_so(bench: Bench, link: CanopenLink) -> None:
    bench.node.lss.can_store = False
    with pytest.raises(NotAllowed, match="cannot store"):
        await link.lss.set_node(truth(bench.node), 9, store=True)


async def test_a_bit_rate_counts_after_a_power_cycle(bench: Bench, link: CanopenLink) -> None:
    await link.lss.set_bit_rate(truth(bench.node), 250, store=True)
    assert bench.node.lss.active_rate is None
    bench.wire.do(bench.node.reboot)
    assert bench.node.lss.active_rate == 3, "250 kbit/s is index 3 of table 0 (CiA 305)"
    with pytest.raises(OutOfRange, match="kbit/s"):
        await link.lss.set_bit_rate(truth(bench.node), 300, store=True)


@pytest.mark.long
async def test_of_several_without_number_each_is_found_in_turn(
    bench: Bench, link: CanopenLink
) -> None:
    bench.wire.do(lambda: bench.wire.nodes.append(made(255, SERIAL + 1)))
    serials = []
    for number in (10, 11):
        found = await link.lss.search(quiet)
        assert found is not None
        serials.append(found.identity.serial)
        await link.lss.set_node(found.identity, number, store=True)
    assert serials == [SERIAL, SERIAL + 1]
    await until(lambda: {node.node_id for node in bench.wire.nodes} == {10, 5, 11})


@pytest.mark.long
def test_an_answer_that_comes_late_does_not_lose_the_node() -> None:
    """The bit that it belongs to is read as one, and the node confirms no such number."""
    slave = LssSlave(LssIdentity(0x1234, 0x56, 3, SERIAL), 255)
    late_s, requests = 0.03, itertools.count()
    timers: list[threading.Timer] = []

    def send(data: bytes) -> None:
        answer = slave.take(data)
        if answer is None:
            return
        if next(requests) == 5:
            timers.append(threading.Timer(late_s, master.deliver, [answer]))
            timers[-1].start()
        else:
            master.deliver(answer)

    master = LssMaster(send, answer_s=0.001, late_answer_s=0.1)
    found = master.find(lambda _share: None)
    timers[0].join()
    assert found == slave.identity


@pytest.mark.long
def test_an_independent_master_finds_and_names_the_virtual_node(bench: Bench) -> None:
    """python-canopen's own LSS master."""
    network = canopen.Network()
    network.connect(interface="virtual", channel=bench.url.split("/")[-1].split("?")[0])
    try:
        found, numbers = network.lss.fast_scan()
        assert found
        assert tuple(numbers) == truth(bench.node)
        assert network.lss.inquire_node_id() == 255
        network.lss.configure_node_id(12)
        network.lss.store_configuration()
        network.lss.send_switch_state_global(network.lss.WAITING_STATE)
        deadline = time.monotonic() + 3
        while bench.node.node_id != 12:
            assert time.monotonic() < deadline
            time.sleep(0.01)
    finally:
        network.disconnect()


@pytest.mark.long
def test_the_command_line_finds_names_and_sets(bench: Bench) -> None:
    run = CliRunner().invoke
    found = run(cli.app, ["lss", "search", bench.url, "--json"])
    assert json.loads(found.output) == {**truth(bench.node)._asdict(), "node": None}
    kept = run(cli.app, ["lss", "node", bench.url, "9"], input="n\n")
    assert (kept.exit_code, bench.node.node_id) == (1, 255)
    given = run(cli.app, ["lss", "node", bench.url, "9", "--yes"])
    assert given.exit_code == 0, given.output
    assert bench.node.node_id == 9
    wrong = run(cli.app, ["lss", "bit-rate", bench.url, "250", "--identity", "1:2", "--yes"])
    assert wrong.exit_code == 1
    by_identity = ":".join(str(number) for number in truth(bench.node))
    rate = run(cli.app, ["lss", "bit-rate", bench.url, "250", "--identity", by_identity, "--yes"])
    assert rate.exit_code == 0, rate.output
    assert bench.node.lss.stored_rate == 3
