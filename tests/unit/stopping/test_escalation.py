"""What STOP does where the quick stop is not enough, against a drive in simulated time.

Drives are the virtual families; each test breaks one thing and looks at the shaft and the steps.
"""

from __future__ import annotations

import asyncio

import pytest

from benchmarks.stopping.clock import run_simulated
from benchmarks.stopping.motions import SPEED_RPM, own_jog_by_input, profile_velocity
from benchmarks.stopping.rig import Rig, rig
from drivers.errors import Rejected
from drivers.link import Address


async def stop(bench: Rig) -> dict[str, object]:
    answer = await bench.http.post("/stop", json={})
    found: dict[str, object] = answer.json()["axes"][0] | {"answer": answer.json()}
    return found


def codes(axis: dict[str, object]) -> list[str]:
    steps = axis["steps"]
    assert isinstance(steps, list)
    return [step["code"] for step in steps]


def test_a_drive_that_ignores_its_quick_stop_loses_its_power() -> None:
    """It answers every write and goes on: 606Ch and 6064h show it, and the power goes."""

    async def main() -> None:
        async with rig("mms7") as bench:
            await profile_velocity(bench)
            control = bench.device.control
            obey = control.set_control_word

            def deaf(word: int) -> None:
                if word != 2:
                    obey(word)

            bench.device.od.numbered["6040:00"].setter = lambda value: deaf(int(value))
            axis = await stop(bench)
            assert "voltage_disabled" in codes(axis)
            assert axis["verdict"] != "stopped"
            assert bench.shaft_rpm > 3.0
            assert not bench.device.axis.powered

    run_simulated(main)


def test_a_jog_that_cannot_be_taken_back_is_still_moving() -> None:
    """STOP must not say stopped when the shaft turns: the M6-L refuses what would end its jog."""

    async def main() -> None:
        async with rig("m6l") as bench:
            await own_jog_by_input(bench)
            write = bench.link.write

            async def refuse(station: int, address: Address, data: bytes) -> None:
                if address.index in (0x2003, 0x200C):
                    raise Rejected("write-protected", abort_code=0x06010002)
                await write(station, address, data)

            bench.link.write = refuse  # type: ignore[method-assign]
            axis = await stop(bench)
            assert axis["verdict"] == "still_moving"
            assert axis["speed"] == pytest.approx(SPEED_RPM, rel=0.05)
            answer = axis["answer"]
            assert isinstance(answer, dict)
            assert answer["stopped"] == []
            assert "emergency stop" in answer["failed"][axis["drive"]]
            assert bench.shaft_rpm == pytest.approx(SPEED_RPM, rel=0.05)

    run_simulated(main)


def test_a_long_ramp_is_waited_for_with_its_power_on() -> None:
    """300 rpm at 100 rpm/s take 3 s; to coast on this motor takes longer."""

    async def main() -> None:
        async with rig("mms7") as bench:
            await profile_velocity(bench)
            units = await bench.connected.axis.units()
            bench.poke("6085:00", units.acceleration_raw(100.0))
            axis = await stop(bench)
            assert axis["verdict"] == "stopped"
            assert codes(axis) == ["quick_stop"]
            took = axis["took_s"]
            assert isinstance(took, float)
            assert 2.8 < took < 3.6

    run_simulated(main)


def test_the_option_is_put_back_when_it_stands() -> None:
    async def main() -> None:
        async with rig("r6l") as bench:
            await profile_velocity(bench)
            bench.poke("605A:00", 0)
            await asyncio.sleep(1.3)
            axis = await stop(bench)
            assert axis["verdict"] == "stopped"
            assert bench.device.core.number("605A:00") == 0

    run_simulated(main)


def test_a_new_motion_ends_the_watch_of_the_old_stop() -> None:
    """Nothing is done to an axis that somebody has allowed to move again."""

    async def main() -> None:
        async with rig("mms7") as bench:
            await profile_velocity(bench)
            units = await bench.connected.axis.units()
            bench.poke("6085:00", units.acceleration_raw(100.0))
            asked = asyncio.create_task(stop(bench))
            await asyncio.sleep(0.5)
            bench.bench.motion.permit(bench.connected.drive.id)
            axis = await asked
            assert axis["superseded"]
            assert codes(axis) == ["quick_stop"]

    run_simulated(main)


def test_a_drive_that_leaves_the_bench_is_stopped_first_and_has_its_verdict() -> None:
    """Chaos found it: STOP was answered by an internal error when its axis was removed."""

    async def main() -> None:
        async with rig("mms7") as bench:
            await profile_velocity(bench)
            asked = asyncio.create_task(stop(bench))
            await asyncio.sleep(0.02)
            removed = await bench.http.delete(f"/drives/{bench.connected.drive.id}")
            assert removed.is_success, removed.text
            assert (await asked)["verdict"] == "stopped"
            assert bench.shaft_rpm < 3.0

    run_simulated(main)


def test_a_watch_that_is_ended_says_that_nobody_saw_the_axis_stand() -> None:
    async def main() -> None:
        async with rig("mms7") as bench:
            await profile_velocity(bench)
            asked = asyncio.create_task(stop(bench))
            await asyncio.sleep(0.02)
            await bench.bench.motion.end_watches()
            axis = await asked
            assert axis["verdict"] == "unreachable"
            assert "removed from the axis list" in str(axis["problem"])

    run_simulated(main)


def test_a_standing_axis_is_reported_at_once() -> None:
    async def main() -> None:
        async with rig("mms7") as bench:
            await asyncio.sleep(0.3)
            axis = await stop(bench)
            assert axis["verdict"] == "stopped"
            took = axis["took_s"]
            assert isinstance(took, float)
            assert took < 0.1

    run_simulated(main)
