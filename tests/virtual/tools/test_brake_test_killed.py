"""A brake test that is killed (SIGKILL) while its output is switched to the bus.

    python -m tests.virtual.tools.test_brake_test_killed

is the process that is killed; its state folder is that of the environment.
"""

from __future__ import annotations

import asyncio
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from backend.commands.base.restoring import recall
from backend.commands.base.state import STATE_FOLDER_VARIABLE
from backend.station.bench import Bench
from backend.tools.mechanics.brake.run import TOOL
from backend.tools.tool import Run
from backend.tools.tuning.sweep import profile_speed
from tests.support.servo import Servo
from tests.virtual.tools.direct import STATION, direct
from tests.virtual.tools.rig import At
from tests.virtual.tools.test_brake_test import ASKED, M6L, RATED_NM, braked

URL = "ethercat://eth0"
#: DO1's function: 18 is the brake, 28 lets the bus switch it (000:1360).
OUTPUT, BRAKE, BUS = "2003:10", 18, 28
KILLED_S = 60.0


async def killed() -> None:
    """Test, and die in the middle of the ramp of the first direction."""
    async with direct(braked(2.0 * RATED_NM), drive="m6l", settings=M6L) as bench:
        bench.link.url = URL
        recall(bench.axis.drive, URL, STATION)

        def die() -> None:
            print(bench.link.device.od.number(OUTPUT), flush=True)  # type: ignore[attr-defined]
            os.kill(os.getpid(), signal.SIGKILL)

        async with profile_speed.prepared(bench.axis, bench.session, ASKED.envelope, True):
            at = At("forwards", die, fraction=0.3)
            await TOOL.run(Run(bench.axis, bench.session, at.progress), ASKED)


@pytest.mark.long
async def test_the_output_of_a_killed_brake_test_is_on_the_list_and_offered(
    tmp_path: Path,
) -> None:
    process = await asyncio.to_thread(
        subprocess.run,
        [sys.executable, "-m", "tests.virtual.tools.test_brake_test_killed"],
        env=os.environ | {STATE_FOLDER_VARIABLE: str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=KILLED_S,
        check=False,
    )
    assert process.returncode == -signal.SIGKILL, process.stderr
    assert int(process.stdout) == BUS, "the drive is left with it"
    (file,) = (tmp_path / "restore").glob("*.json")
    noted = {each["key"]: each for each in json.loads(file.read_text())["values"]}
    assert noted[OUTPUT]["raw"] == BRAKE
    assert noted[OUTPUT]["left"] == [BUS]

    servo = Servo("m6l")
    place = (int(OUTPUT[:4], 16), int(OUTPUT[5:], 16))
    servo.set(place, BUS)
    servo.kind, servo.url = "ethercat", URL
    bench = Bench(tmp_path, {URL: lambda: servo})
    try:
        x = await bench.connect(URL, STATION, "m6l", "X")
        offered = {each.key: each.raw for each in x.drive.pending_restores.entries}
        assert offered[OUTPUT] == BRAKE, "the next server knows it from its first moment"
        job = bench.reconnection.start(x, asked=True)
        await job.wait()
        assert servo.number(place) == BRAKE
        assert OUTPUT not in {each.key for each in x.drive.pending_restores.entries}
    finally:
        await bench.close()


if __name__ == "__main__":
    asyncio.run(killed())
