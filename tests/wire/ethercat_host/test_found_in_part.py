"""A search that misses where a drive's process data are: it is repeated before anything moves."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from drivers.ethercat.link import EthercatLink
from drivers.link import Address, CyclicSignal
from drivers.virtual.wires.netns import Namespace
from tests.wire.ethercat_host.test_strangers import odd_profile

SLAVES = Path(__file__).parent / "plain_slaves.py"


@pytest.fixture
def wire(namespace: Namespace) -> Iterator[Namespace]:
    with subprocess.Popen(
        namespace.command([sys.executable, str(SLAVES), "ec0s", "hasty"]), stdout=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline().strip() == b"ready"
        yield namespace
        process.kill()


@pytest.mark.long
async def test_the_search_is_repeated(wire: Namespace) -> None:
    link = EthercatLink("ec0m", launcher=wire.command([]), lockstep=1.0)
    await link.open()
    try:
        link.attach(1, odd_profile())
        process_data = link.process_data
        await process_data.configure(
            [CyclicSignal(1, Address(0x6064, 0, "INT32"), "position")],
            [CyclicSignal(1, Address(0x607A, 0, "INT32"), "target")],
            0.004,
        )
        await process_data.start()
        assert process_data.running
        await process_data.stop()
    finally:
        await link.close()
