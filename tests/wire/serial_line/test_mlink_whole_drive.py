"""All parameters of the MMS7 over the line, alone and in blocks, against the drive itself."""

from __future__ import annotations

from pathlib import Path
from typing import cast

import pytest

from drivers.errors import DriveError, NotAllowed
from drivers.link import Address
from drivers.modbus.link import RegisterLink
from drivers.virtual.firmware.factory import make_device
from drivers.virtual.wires.modbus import ModbusSlave, ObjectRegisters
from drivers.virtual.wires.pty import PtyWire
from profiles.loader import load_profile

from .conftest import OpenLink


@pytest.mark.parametrize("max_registers", [None, 125])
async def test_every_setting_reads_as_the_drive_holds_it(
    port: Path, opened: OpenLink, max_registers: int | None
) -> None:
    profile = load_profile("mms7")
    links = tuple(
        spec.model_copy(update={"max_registers": max_registers}) if spec.kind == "mlink" else spec
        for spec in profile.links
    )
    device = make_device("mms7")
    for t_ns in (0, 1_000_000):
        device.advance(t_ns)
    slave = ModbusSlave(
        PtyWire(port), {1: (device, ObjectRegisters(device))}, now_ns=lambda: 2_000_000
    )
    slave.start()
    try:
        link = cast("RegisterLink", await opened(f"mlink://{port}?timeout_ms=1000"))
        link.attach(1, profile.model_copy(update={"links": links}))
        addresses = [
            Address(p.index, p.subindex or 0, p.type)
            for p in profile.parameters
            if p.index is not None and p.access != "wo"
        ]
        results = await link.read_many(1, addresses)
    finally:
        slave.stop()
    unreachable = 0
    for address, result in zip(addresses, results, strict=True):
        if isinstance(result, NotAllowed):
            unreachable += 1
            continue
        assert not isinstance(result, DriveError), f"{address}: {result}"
        assert address.index is not None
        assert result == device.read(address.index, address.subindex), str(address)
    # Subindex 0 of the records, 1A02h against 6502h, and text: everything else is there.
    assert unreachable < len(addresses) / 8
    assert (slave.requests < len(addresses) - unreachable) == (max_registers is not None)
