"""Drives that differ: fixed process data, no distributed clock, firmware."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from drivers.link import Address, CyclicSignal
from drivers.virtual.wires.netns import Namespace
from tests.wire.ethercat_host.conftest import Rig
from tests.wire.ethercat_host.servo_device import servo_profile
from tests.wire.ethercat_host.test_cyclic import enable, inputs, move, ramp

POSITION = Address(0x607A, 0, "INT32")


@pytest.fixture(scope="module")
def odd_rig(namespace: Namespace) -> Iterator[Rig]:
    rig = Rig(namespace, ("fixed", "without_dc"), lockstep=True)
    yield rig
    rig.segment.close()


@pytest.mark.long
async def test_fixed_process_data_and_no_clock(odd_rig: Rig) -> None:
    async with odd_rig.link() as bus:
        link = bus.link
        link.attach(1, servo_profile(remappable=False))
        link.attach(2, servo_profile(dc=False))
        mapped = await link.process_data.configure(
            [*inputs(1), *inputs(2)],
            [CyclicSignal(n, POSITION, f"{n}.target") for n in (1, 2)],
            0.002,
        )
        assert "1.torque" not in {s.channel for s in mapped}
        assert {s.channel for s, _ in link.process_data.left_over} == {"1.torque", "1.following"}
        assert link.process_data.dc is False, "one drive without a clock: all follow the frames"
        await link.process_data.start()
        for station in (1, 2):
            await enable(bus, station)
        await link.process_data.run([move(n, ramp(odd_rig, n - 1, count=50)) for n in (1, 2)])
        await link.process_data.stop()


@pytest.mark.long
async def test_firmware_goes_in_with_progress(odd_rig: Rig) -> None:
    async with odd_rig.link() as bus:
        steps: list[float] = []
        await bus.link.load_firmware(
            1, "servo.bin", bytes(5000), lambda share, _text: steps.append(share)
        )
        assert steps == sorted(steps)
        assert steps[-1] == 1.0
        assert len(steps) > 10


@pytest.mark.long
async def test_an_emergency_before_mapping_does_not_spoil_it(odd_rig: Rig) -> None:
    async with odd_rig.link() as bus:
        bus.link.attach(1, servo_profile(remappable=False))
        for code in (0x8611, 0x7305):
            odd_rig.do("inject", slave=0, what="emergency", value=code)
        await bus.link.process_data.configure(
            inputs(1), [CyclicSignal(1, POSITION, "target")], 0.002
        )
        await bus.link.process_data.start()
        await bus.link.process_data.stop()
