"""Other people's clients against the virtual node, and its two other wires."""

from __future__ import annotations

import errno
import os
import shutil
import subprocess
import sys
import termios
import textwrap
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import can
import canopen
import pytest

from drivers.canopen.adapters.slcan import AdapterLost, SlcanBus
from drivers.canopen.frames import Frame, exact_bits, worst_case_bits
from drivers.canopen.link import CanopenLink
from drivers.link import Address
from drivers.virtual.wires.can_wire import CanWire
from drivers.virtual.wires.canopen import CanopenNode
from drivers.virtual.wires.slcan import SlcanSide
from tests.wire.canopen.conftest import Bench, until
from tests.wire.canopen.small_device import SmallDevice

ROOT = Path(__file__).parents[3]


def _dictionary() -> canopen.ObjectDictionary:
    """Enough of a dictionary for canopen to know TPDO 1."""
    module = canopen.objectdictionary
    dictionary = canopen.ObjectDictionary()
    for index, kind in ((0x6040, 0x06), (0x6041, 0x06), (0x6064, 0x04)):
        variable = module.ODVariable(f"object {index:x}", index)
        variable.data_type = kind
        dictionary.add_object(variable)
    for index, kinds in ((0x1800, (5, 7, 5)), (0x1A00, (5, 7, 7))):
        record = module.ODRecord(f"pdo {index:x}", index)
        for subindex, kind in enumerate(kinds):
            member = module.ODVariable(f"entry {subindex}", index, subindex)
            member.data_type = kind
            record.add_member(member)
        dictionary.add_object(record)
    return dictionary


@pytest.fixture(params=["virtual", "slcan"])
def remote(request: pytest.FixtureRequest) -> Iterator[tuple[Bench, canopen.RemoteNode]]:
    bench: Bench = request.getfixturevalue("bench" if request.param == "virtual" else "slcan_bench")
    channel = bench.url.split("/", 3)[3].partition("?")[0]
    network = canopen.Network()
    network.NOTIFIER_CYCLE = 0.02  # how long disconnecting takes
    extra = {"sleep_after_open": 0} if request.param == "slcan" else {}
    network.connect(interface=request.param, channel=channel, bitrate=1_000_000, **extra)
    node = canopen.RemoteNode(5, _dictionary())
    network.add_node(node)
    yield bench, node
    network.disconnect()


def test_canopen_reads_and_writes_every_way(remote: tuple[Bench, canopen.RemoteNode]) -> None:
    bench, node = remote
    assert node.sdo.upload(0x6041, 0) == b"\x50\x02"
    assert node.sdo.upload(0x1008, 0) == b"Small drive of many letters"
    node.sdo.download(0x2001, 0, b"\x0a\x00")
    assert bench.device.value(0x2001) == 10
    with pytest.raises(canopen.SdoAbortedError) as aborted:
        node.sdo.download(0x2001, 0, b"\xff\x7f")
    assert aborted.value.code == 0x06090030
    contents = b"The quick brown fox jumps over the lazy dog. " * 30
    with node.sdo.open(0x1021, 0, "wb", size=len(contents), block_transfer=True) as stream:
        stream.write(contents)
    assert bench.device.big == contents
    with node.sdo.open(0x1021, 0, "rb", block_transfer=True) as stream:
        assert stream.read() == contents
    assert node.sdo.upload(0x1021, 0) == contents


def test_canopen_follows_the_network_state(remote: tuple[Bench, canopen.RemoteNode]) -> None:
    bench, node = remote
    node.nmt.send_command(0x01)
    node.sdo.download(0x1017, 0, b"\x0a\x00")
    node.nmt.wait_for_heartbeat(timeout=2)
    assert node.nmt.state == "OPERATIONAL"
    # canopen's own wait misses a boot-up that comes before it begins.
    booted = threading.Event()
    node.network.subscribe(0x705, lambda _id, data, _at: booted.set() if data == b"\0" else None)
    node.nmt.send_command(0x81)
    assert booted.wait(timeout=2)
    assert bench.node.state == 127
    bench.wire.do(lambda: bench.device.inject("2310"))
    assert node.emcy.wait(0x2310, timeout=2).code == 0x2310


def test_canopen_reads_and_writes_its_process_data(
    remote: tuple[Bench, canopen.RemoteNode],
) -> None:
    bench, node = remote
    node.tpdo.read()
    assert node.tpdo[1][0].name == "object 6041"
    node.tpdo[1].clear()
    node.tpdo[1].add_variable(0x6064)
    node.tpdo[1].trans_type = 1
    node.tpdo[1].enabled = True
    node.tpdo.save()
    node.nmt.send_command(0x01)
    node.sdo.download(0x607A, 0, (1234).to_bytes(4, "little"))
    received = threading.Event()
    node.tpdo[1].add_callback(lambda _pdo: received.set())
    node.network.sync.transmit()
    assert received.wait(timeout=2)
    assert node.tpdo[1][0].raw == 1234
    node.network.send_message(0x205, b"\x0f\x00")  # RPDO 1 is event-driven by default
    deadline = time.monotonic() + 2
    while bench.device.value(0x6040) != 15:
        assert time.monotonic() < deadline
        time.sleep(0.002)


async def test_our_link_works_over_slcan(slcan_bench: Bench) -> None:
    link = CanopenLink(slcan_bench.url)
    await link.open()
    try:
        found = await link.scan(lambda *_: None, range(1, 9))
        assert [f.station for f in found] == [5]
        assert await link.read(5, Address(0x1021, 0, "STRING")) == bytes(range(256)) * 8
    finally:
        await link.close()


def test_python_cans_own_slcan_client_sees_a_refused_frame_as_nothing(tmp_path: Path) -> None:
    """Why `drivers.canopen.adapters.slcan` exists: bus-off must not look like silence."""
    side = SlcanSide(tmp_path / "tty")
    node = CanopenNode(SmallDevice(), 5, time.monotonic_ns)
    with (
        CanWire(side, [node]) as wire,
        can.Bus(
            interface="slcan", channel=str(tmp_path / "tty"), bitrate=1_000_000, sleep_after_open=0
        ) as bus,
    ):
        request = can.Message(arbitration_id=0x605, is_extended_id=False, data=bytes(8))
        bus.send(request)
        assert bus.recv(2) is not None  # the commands that open the channel have been obeyed
        wire.do(side.bus_off)
        bus.send(request)
        assert bus.recv(0.1) is None
        assert side.refused == 1


class _Refusing:
    """A serial port whose adapter answers BEL to everything, F included."""

    timeout: float | None = None

    def __init__(self) -> None:
        self.sent: list[bytes] = []
        self.waiting = 0

    @property
    def in_waiting(self) -> int:
        return 0

    def write(self, data: bytes) -> None:
        self.sent.append(data)
        self.waiting += 1

    def flush(self) -> None:
        return

    def read(self, count: int) -> bytes:
        if self.waiting == 0:
            return b""
        self.waiting -= 1
        return b"\a"


def test_an_adapter_that_does_not_know_flags_is_asked_twice_a_second_at_most() -> None:
    bus = SlcanBus.__new__(SlcanBus)
    port = _Refusing()
    bus.serialPortOrig = port
    bus._buffer = bytearray()
    port.write(b"t605000\r")
    for _ in range(50):
        bus._read(0)
    assert port.sent.count(b"F\r") == 1


class _Interrupted(_Refusing):
    """Its flush is broken off, once by a signal and then for good where `code` says so."""

    def __init__(self, *codes: int) -> None:
        super().__init__()
        self._codes = list(codes)

    def flush(self) -> None:
        if self._codes:
            raise termios.error(self._codes.pop(0), "broken off")


def test_a_signal_while_a_frame_drains_loses_no_adapter() -> None:
    bus = SlcanBus.__new__(SlcanBus)
    bus.serialPortOrig = port = _Interrupted(errno.EINTR, errno.EINTR)
    bus._write("t6050")
    assert port.sent == [b"t6050\r"]
    bus.serialPortOrig = _Interrupted(errno.EIO)
    with pytest.raises(AdapterLost, match="broken off"):
        bus._write("t6050")


async def test_wire_time_is_emulated_on_request(tmp_path: Path) -> None:
    node = CanopenNode(SmallDevice(), 5, time.monotonic_ns)
    side = SlcanSide(tmp_path / "tty")
    with CanWire(side, [node], bitrate=10_000):
        link = CanopenLink(f"canopen://slcan/{tmp_path / 'tty'}?timeout_ms=2000")
        await link.open()
        try:
            started = time.monotonic()
            await link.read(5, Address(0x6041, 0, "UINT16"))
            taken = time.monotonic() - started
        finally:
            await link.close()
    # Request and answer of 8 bytes: at least 2·(98 + 13) bits at 10 kbit/s.
    assert taken >= 2 * 111 / 10_000


def test_exact_bits_of_a_frame_without_and_with_stuffing() -> None:
    # 01010101… needs no stuff bit in the data; all zeros need one after every run of five,
    # and are still below the worst case.
    assert 98 + 13 <= exact_bits(Frame(0x555, b"\x55" * 8)) <= worst_case_bits(8)
    assert exact_bits(Frame(0, bytes(8))) > exact_bits(Frame(0x555, b"\x55" * 8))
    # SYNC 080h, no data: SOF + id 0000 1000 0000 + control 000 0000: bits 0 0001 0000 0000 0000000
    # The frame has 34 stuffable bits and 13 others; stuffing can only add.
    assert 47 < exact_bits(Frame(0x080)) <= worst_case_bits(0)


NAMESPACE_TEST = """
    import asyncio, sys, time
    sys.path[:0] = [{root!r}, {here!r}]
    import can
    from small_device import SmallDevice
    from drivers.canopen.link import CanopenLink
    from drivers.link import Address
    from drivers.virtual.wires.can_wire import CanWire, PythonCanSide
    from drivers.virtual.wires.canopen import CanopenNode

    async def main():
        bus = can.Bus(interface="udp_multicast", channel="239.74.163.2", fd=False)
        node = CanopenNode(SmallDevice(), 5, time.monotonic_ns)
        with CanWire(PythonCanSide(bus), [node]):
            link = CanopenLink("canopen://udp_multicast/239.74.163.2")
            await link.open()
            print(await link.read(5, Address(0x1008, 0, "STRING")))
            await link.close()

    asyncio.run(main())
"""


def _namespaces_work() -> bool:
    if shutil.which("unshare") is None:
        return False
    probe = subprocess.run(["unshare", "-Urn", "true"], capture_output=True, check=False)
    return probe.returncode == 0


@pytest.mark.skipif(not _namespaces_work(), reason="needs unprivileged network namespaces")
def test_udp_multicast_inside_a_namespace_of_its_own() -> None:
    script = textwrap.dedent(NAMESPACE_TEST).format(root=str(ROOT), here=str(Path(__file__).parent))
    network = "ip link set lo up multicast on && ip route add 239.0.0.0/8 dev lo && exec "
    done = subprocess.run(
        ["unshare", "-Urn", "sh", "-c", network + '"$0" -c "$1"', sys.executable, script],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        env=os.environ | {"PYTHONWARNINGS": "default"},
    )
    assert done.stdout.strip() == "b'Small drive of many letters'", done.stderr


async def test_two_links_share_one_wire(bench: Bench) -> None:
    """A second master is distinguished from a second node of the same number."""
    first, second = CanopenLink(bench.url), CanopenLink(bench.url)
    events: list[str] = []
    first.listen(lambda e: events.append(e.text.words()))
    await first.open()
    await second.open()
    try:
        await first.read(5, Address(0x6041, 0, "UINT16"))
        for _ in range(4):
            await second.read(5, Address(0x6041, 0, "UINT16"))
            await first.read(5, Address(0x6041, 0, "UINT16"))
        await until(lambda: any("another master" in text for text in events))
    finally:
        await first.close()
        await second.close()
