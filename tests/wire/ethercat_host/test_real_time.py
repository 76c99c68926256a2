"""How soon an axis stands in real time, whoever dies (200 ms are allowed)."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
import textwrap
import time

import numpy as np
import pytest

from drivers.errors import LinkLost, NotAllowed
from drivers.virtual.wires.netns import child_environment
from tests.wire.ethercat_host.conftest import Rig, repeated, until
from tests.wire.ethercat_host.test_cyclic import Track, enable, in_state, move, ramp, running


@repeated
async def test_setpoints_that_are_not_renewed_end_the_motion(rig: Rig) -> None:
    async with running(rig) as bus:
        await enable(bus, 1)
        await bus.link.process_data.play([move(1, ramp(rig, 0), renew_s=0.2)])
        started = time.monotonic()
        await bus.reported("not renewed in time")
        assert 0.15 < time.monotonic() - started < 0.4
        await until(lambda: in_state(bus, 1) == "Ready to switch on", 1.0)
        assert rig.truth(0, 0x606C) == 0


@repeated
async def test_halt_stops_every_axis(rig: Rig) -> None:
    async with running(rig) as bus:
        for station in (1, 2):
            await enable(bus, station)
        await bus.link.process_data.play(
            [move(1, ramp(rig, 0), renew_s=5), move(2, ramp(rig, 1), renew_s=5)]
        )
        await asyncio.sleep(0.1)
        await bus.link.process_data.halt()
        took = await until(lambda: all(rig.truth(n, 0x606C) == 0 for n in (0, 1)), 1.0)
        assert took < 0.3
        for station in (1, 2):
            await until(lambda n=station: in_state(bus, n) == "Ready to switch on", 1.0)  # type: ignore[misc]


@pytest.mark.long
@repeated
async def test_a_cable_cut_in_motion_stops_the_axis_and_heals(rig: Rig) -> None:
    async with running(rig) as bus:
        await enable(bus, 2)
        await bus.link.process_data.play([move(2, ramp(rig, 1), renew_s=5)])
        rig.do("cut", cable=1)
        took = await until(lambda: rig.truth(1, 0x606C) == 0, 1.0, "the watchdog stops it")
        assert took < 0.2
        await bus.reported("station 2", "no longer answers")
        with pytest.raises((NotAllowed, LinkLost), match="does not answer"):
            await bus.link.process_data.play([move(2, [0])])
        await enable(bus, 1)
        track = Track(bus)
        await bus.link.process_data.run([move(1, ramp(rig, 0, count=30))])
        assert np.isnan(track["2.position"]).all(), "what is old is not shown as present"
        assert not np.isnan(track["1.position"]).any()
        newest = bus.link.process_data.newest(["1.position", "2.position"], 1.0)
        assert list(newest) == ["1.position"]
        rig.do("heal")
        await bus.reported("station 2 is in OP again")
        newest = bus.link.process_data.newest(["1.position", "2.position"], 1.0)
        assert newest["2.position"] == rig.truth(1, 0x6064)
        await bus.link.process_data.reset_fault(2)
        await until(lambda: in_state(bus, 2) == "Switch on disabled", 2.0)
        await enable(bus, 2)
        await bus.link.process_data.run([move(2, ramp(rig, 1, count=30))])


@pytest.mark.long
@repeated
async def test_killing_the_host_in_motion_stops_the_axis_and_recovers_disabled(rig: Rig) -> None:
    async with running(rig) as bus:
        await enable(bus, 1)
        await bus.link.process_data.play([move(1, ramp(rig, 0), renew_s=5)])
        await asyncio.sleep(0.1)
        assert rig.truth(0, 0x606C) > 0
        host = bus.link._host.pid
        assert host is not None
        os.kill(host, signal.SIGKILL)
        took = await until(lambda: rig.truth(0, 0x606C) == 0, 1.0)
        assert took < 0.2
        await bus.reported("ended unexpectedly", "started again")
        await bus.reported("the cyclic exchange was interrupted")
        await bus.reported("the cyclic exchange runs again; every axis is disabled", within_s=15)
        assert bus.link.process_data.running
        assert not bus.link.process_data.trouble
        with pytest.raises(LinkLost, match="was interrupted, the motion has ended"):
            await bus.link.process_data.renew(1)
        here = rig.truth(0, 0x6064)
        await asyncio.sleep(0.3)
        assert rig.truth(0, 0x6064) == here, "nothing moves by itself"
        assert in_state(bus, 1) != "Operation enabled"
        # The bus was lost while it was enabled, which this drive keeps as a fault.
        await bus.link.process_data.reset_fault(1)
        await until(lambda: in_state(bus, 1) == "Switch on disabled", 3.0)
        await enable(bus, 1)
        await bus.link.process_data.run([move(1, ramp(rig, 0, count=50))])


@pytest.mark.long
@repeated
async def test_killing_the_server_in_motion_stops_the_axis(rig: Rig) -> None:
    """The host notices the end of the pipe, brakes, disables and leaves OP."""
    script = textwrap.dedent(
        f"""
        import asyncio, sys
        from tests.wire.ethercat_host.test_cyclic import *
        from drivers.ethercat.link import EthercatLink

        async def main():
            link = EthercatLink("ec0m", launcher={rig.namespace.command([])!r})
            bus = Bus(link)
            await link.open()
            link.attach(1, servo_profile())
            cyclic = link.process_data
            await cyclic.configure(inputs(1), outputs(1), 0.002)
            await cyclic.start()
            await enable(bus, 1)
            here = int({rig.truth(0, 0x6064)})
            await cyclic.play([move(1, here + 5 * np.arange(9000), renew_s=60)])
            print("moving", link._host.pid, flush=True)
            await asyncio.sleep(60)

        asyncio.run(main())
        """
    )
    server = subprocess.Popen(  # noqa: ASYNC220 - it is killed below
        [sys.executable, "-c", script], stdout=subprocess.PIPE, text=True, env=child_environment()
    )
    assert server.stdout is not None
    line = await asyncio.to_thread(server.stdout.readline)
    host = int(line.split()[1])
    await until(lambda: rig.truth(0, 0x606C) > 0, 2.0)
    server.kill()
    took = await until(lambda: rig.truth(0, 0x606C) == 0, 1.0)
    assert took < 0.2
    server.wait()
    server.stdout.close()
    await until(lambda: not os.path.exists(f"/proc/{host}"), 6.0, "the host outlived its server")  # noqa: PTH110
    async with rig.link() as bus:
        assert len(await bus.link.scan(lambda _s, _t: None)) == 2


@pytest.mark.long
@repeated
async def test_killing_the_segment_in_motion_ends_it_and_a_new_one_is_taken_up(rig: Rig) -> None:
    async with running(rig) as bus:
        await enable(bus, 1)
        await bus.link.process_data.play([move(1, ramp(rig, 0), renew_s=5)])
        rig.segment.kill()
        await bus.reported("no valid process data for")
        await bus.reported("station 1", "no longer answers")
        rig.segment.close()
        rig.start()
        await bus.reported("station 1 is in OP again", within_s=10)
        await bus.reported("station 2 is in OP again", within_s=10)
        assert in_state(bus, 1) != "Operation enabled"
        await enable(bus, 1)
