"""What went over the wire of a segment, as the recorder kept it."""

from __future__ import annotations

import asyncio
import shutil
import subprocess
from pathlib import Path

import pytest

from drivers.cia402 import State
from tests.wire.ethercat_host.conftest import Rig
from tests.wire.ethercat_host.test_cyclic import running

LOCKSTEP = True


@pytest.mark.long
async def test_mailbox_process_data_and_our_own_remarks(rig: Rig, tmp_path: Path) -> None:
    if shutil.which("tshark") is None:
        pytest.skip("tshark is not installed: .ci/run installs it")
    async with running(rig) as bus:
        await bus.link.process_data.drive_to(1, State.OPERATION_ENABLED, mode=8)
        await asyncio.sleep(0.5)
        path = tmp_path / "segment.pcapng"
        path.write_bytes(await bus.link.flight())
        one = tmp_path / "station.pcapng"
        one.write_bytes(await bus.link.flight(station=2))

    def shown(file: Path, chosen: str) -> list[list[str]]:
        fields = ["frame.packet_flags_direction", "frame.comment", "ecat.adp", "frame.time_epoch"]
        command = ["tshark", "-r", str(file), "-Y", chosen, "-T", "fields", "-E", "separator=|"]
        command += [part for field in fields for part in ("-e", field)]
        done = subprocess.run(
            command,
            capture_output=True,
            check=True,
            text=True,
            env={"PATH": "/usr/bin:/bin", "HOME": str(tmp_path)},
        )
        return [line.split("|") for line in done.stdout.splitlines()]

    mails = await asyncio.to_thread(shown, path, "ecat_mailbox.coe")
    assert mails, "CoE in mailboxes is decoded"
    cyclic = await asyncio.to_thread(shown, path, "ecat.cmd == 12 || ecat.cmd == 10")
    directions = {int(row[0], 0) for row in cyclic}
    assert directions == {1, 2}, "process data both ways"
    times = [float(row[3]) for row in cyclic]
    assert times == sorted(times)
    remarks = await asyncio.to_thread(shown, path, "frame.comment")
    assert any("OPERATION_ENABLED is commanded" in row[1] for row in remarks), remarks
    others = await asyncio.to_thread(shown, one, "ecat.adp == 0x1001 && !ecat.lad")
    assert [row for row in others if row[2] == "0x1001"] == [], "only what concerns station 2"
