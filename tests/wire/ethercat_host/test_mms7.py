"""Our own MMS7 firmware behind the host: everything read, and moved by cyclic position."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from drivers.cia402 import Mode, State
from drivers.errors import DriveError, NotInUse
from drivers.ethercat.link import EthercatLink
from drivers.link import Address, CyclicSignal, Envelope, Trajectory
from drivers.virtual.wires.ethercat.launch import VirtualSegment
from drivers.virtual.wires.netns import Namespace
from profiles.loader import load_profile
from tests.wire.ethercat_host.conftest import Bus, until

POSITION = Address(0x607A, 0, "INT32")
ACTUAL = Address(0x6064, 0, "INT32")


@pytest.fixture(scope="module")
def mms7(namespace: Namespace) -> Iterator[VirtualSegment]:
    """Its time follows the frames, so that a busy machine is no trouble.

    Behind it an M6-L, without complete access. Neither shows vendor or product, so that SOEM
    takes them for the same make.
    """
    arguments = ["--drive", "mms7", "--drive", "m6l", "--sdo-ms", "0.3", "--lockstep"]
    with VirtualSegment.start("ec0s", arguments, namespace) as made:
        yield made


async def position(link: EthercatLink) -> int:
    return int.from_bytes(await link.read(1, ACTUAL), "little", signed=True)


@pytest.mark.long
async def test_mms7_is_read_whole_and_moves(namespace: Namespace, mms7: VirtualSegment) -> None:
    profile = load_profile("mms7")
    addresses = [
        Address(p.index, p.subindex or 0, p.type)
        for p in profile.parameters
        if p.index is not None and p.access != "wo"
    ]
    link = EthercatLink("ec0m", launcher=namespace.command([]), lockstep=1.0)
    bus = Bus(link)
    await link.open()
    try:
        found = await link.scan(lambda _share, _text: None)
        assert (
            found[0].vendor_id == profile.identity.vendor_id or profile.identity.vendor_id is None
        )
        link.attach(1, profile)
        once = await link.read_many(1, addresses)
        again = await link.read_many(1, addresses)
        singles = [await link.read(1, address) for address in addresses[::7]]
        unused = {
            str(a)
            for a, reported in zip(addresses, once, strict=True)
            if isinstance(reported, NotInUse)
        }
        assert "1600:06" in unused, "five objects are mapped at first (004:5111)"
        assert all(key[:2] in ("16", "1A") for key in unused)
        others = [a for a in (*once, *again) if isinstance(a, DriveError)]
        assert all(isinstance(a, NotInUse) for a in others)
        steady = [
            (a, b, c) for a, b, c in zip(once[::7], again[::7], singles, strict=True) if a == b
        ]
        assert len(steady) > 0.8 * len(singles)
        assert all(b == c for _, b, c in steady), "whole objects and single reads agree"
        cyclic = link.process_data
        await cyclic.configure(
            [
                CyclicSignal(1, Address(0x6041, 0, "UINT16"), "status"),
                CyclicSignal(1, ACTUAL, "position"),
            ],
            [
                CyclicSignal(1, POSITION, "target"),
                CyclicSignal(1, Address(0x6060, 0, "INT8"), "mode"),
            ],
            0.002,
        )
        await cyclic.start()
        assert not [t for t in bus.texts if "refuses" in t], "the M6-L stays as it was"
        other = await link.survey()
        assert other.stations[1].state == "PREOP"
        await cyclic.drive_to(1, State.OPERATION_ENABLED, Mode.CSP)
        await until(lambda: cyclic.axis_state(1)[0] == "Operation enabled", 30.0)
        here = int.from_bytes(
            await link.read(1, Address(0x6064, 0, "INT32")), "little", signed=True
        )
        there = (here + 20000 * (1 - np.cos(np.linspace(0, np.pi, 500))) / 2).astype(np.int64)
        there[0] = here
        await cyclic.run([Trajectory(1, POSITION, there, Envelope(position_max=here + 40000.0))])
        assert await position(link) == pytest.approx(here + 20000, abs=2000)
        assert not [t for t in bus.texts if "beyond" in t]
        await cyclic.stop()
    finally:
        await link.close()
