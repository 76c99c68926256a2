"""The interface is as it was once EtherCAT has let go of it, in whatever way."""

from __future__ import annotations

import asyncio
import subprocess
import sys
from collections.abc import Iterator

import pytest

from drivers.virtual.wires.netns import Namespace, unavailable
from tests.wire.ethercat_host.conftest import Rig

#: In the namespace: the flag that somebody set for good, and who wants the mode at all.
_LOOK = """
import sys
from drivers.ethercat.process import promiscuous
print(int(promiscuous.is_set(sys.argv[1])))
"""
_SWITCH = """
import fcntl, socket, struct, sys
line = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
request = struct.pack("16sH14x", sys.argv[1].encode(), 0)
flags = struct.unpack("16sH14x", fcntl.ioctl(line, 0x8913, request))[1]
flags = flags | 0x100 if sys.argv[2] == "on" else flags & ~0x100
fcntl.ioctl(line, 0x8914, struct.pack("16sH14x", sys.argv[1].encode(), flags))
"""


@pytest.fixture(scope="module")
def namespace() -> Iterator[Namespace]:
    """A network of its own: SOEM alone, as in `test_library_frames`, leaves the flag set."""
    if reason := unavailable():
        pytest.skip(reason)
    with Namespace.create() as made:
        yield made


def inside(rig: Rig, *argv: str) -> str:
    with rig.namespace.popen([sys.executable, "-c", *argv], stdout=subprocess.PIPE) as process:
        reported, _ = process.communicate(timeout=60)
    assert process.returncode == 0
    return reported.strip()


def set_for_good(rig: Rig) -> bool:
    return inside(rig, _LOOK, "ec0m") == "1"


@pytest.mark.long
async def test_closing_leaves_the_interface_as_it_was(rig: Rig) -> None:
    assert not set_for_good(rig)
    async with rig.link() as bus:
        assert await bus.link.scan(lambda _fraction, _step: None)
        assert not set_for_good(rig), "only for as long as the socket lives"
    assert not set_for_good(rig)


@pytest.mark.long
async def test_so_does_a_kill(rig: Rig) -> None:
    async with rig.link() as bus:
        host = bus.link._host
        process = host._process
        assert process is not None
        process.kill()
        await asyncio.wait_for(process.wait(), 30)
        assert not set_for_good(rig)
    assert not set_for_good(rig)


@pytest.mark.long
async def test_what_somebody_else_switched_on_stays(rig: Rig) -> None:
    inside(rig, _SWITCH, "ec0m", "on")
    try:
        async with rig.link():
            assert set_for_good(rig)
        assert set_for_good(rig)
    finally:
        inside(rig, _SWITCH, "ec0m", "off")
