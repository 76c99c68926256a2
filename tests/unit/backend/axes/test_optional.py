"""Drives that lack what CiA 402-2 leaves to the maker: moved by what they have, or refused."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

import pytest

from backend.axes.axis.axis import Envelope
from backend.foundation.work.jobs import Progress
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from backend.tools.measuring.axis_facts import read_facts
from backend.tools.moving.jog.release import END_OF_JOG
from backend.tools.moving.jog.run import Hold, JogSettings, jog
from backend.tools.moving.moves.move import MoveSettings, move
from backend.tools.tuning.sweep.plan import drive_limit_percent
from drivers.cia402 import Mode
from drivers.errors import LinkTimeout, NotAllowed, OutOfRange, Rejected
from tests.support.servo import Servo

URL = "canopen://virtual0"
MAX_TORQUE, POSITIVE, NEGATIVE = (0x6072, 0), (0x60E0, 0), (0x60E1, 0)
ACCELERATION, DECELERATION, QUICK_STOP = (0x6083, 0), (0x6084, 0), (0x6085, 0)
RATED_TORQUE = (0x6076, 0)
HALF = Envelope(1.0, 100.0, 50.0, 5.0)


class Plain(Servo):
    """A CiA 402 drive of which nothing else is known: 10000 increments to the revolution."""

    def __init__(self) -> None:
        super().__init__("generic402")
        self.kind = "canopen"
        self.url = URL
        reported = {
            (0x6091, 1): 1, (0x6091, 2): 1, (0x6092, 1): 10000, (0x6092, 2): 1, RATED_TORQUE: 1270,
            MAX_TORQUE: 3000, POSITIVE: 2000, NEGATIVE: 2000, (0x6081, 0): 10000,
            ACCELERATION: 50000, DECELERATION: 50000, QUICK_STOP: 50000,
            # Increments, increments per second and per square second (CiA 303-2).
            (0x60A8, 0): 0x00B50000, (0x60A9, 0): 0x00B50300, (0x60AA, 0): 0x00B55700,
        }  # fmt: skip
        for place, value in reported.items():
            self.set(place, value)

    def without(self, *places: tuple[int, int]) -> None:
        for place in places:
            del self.objects[place]


@pytest.fixture
def plain() -> Plain:
    return Plain()


@pytest.fixture
async def connected(plain: Plain, tmp_path: Path) -> AsyncIterator[ConnectedDrive]:
    bench = Bench(tmp_path, {URL: lambda: plain})
    connected = await bench.connect(URL, 1, "generic402", "X")
    await connected.monitor.close()
    yield connected
    await bench.close()


@pytest.mark.parametrize(
    ("missing", "held"),
    [
        ((POSITIVE, NEGATIVE), [MAX_TORQUE]),
        ((NEGATIVE,), [POSITIVE, MAX_TORQUE]),
        ((MAX_TORQUE,), [POSITIVE, NEGATIVE]),
    ],
)
async def test_the_limits_that_are_there_hold_the_torque(
    plain: Plain,
    connected: ConnectedDrive,
    missing: tuple[tuple[int, int], ...],
    held: list[tuple[int, int]],
) -> None:
    plain.without(*missing)
    before = {place: plain.number(place) for place in held}
    async with connected.axis.enabled(Mode.PP, HALF):
        assert [plain.number(place) for place in held] == [500] * len(held)  # ‰ of rated
    assert {place: plain.number(place) for place in held} == before


@pytest.mark.parametrize("missing", [(MAX_TORQUE, NEGATIVE), (MAX_TORQUE, POSITIVE, NEGATIVE)])
async def test_a_torque_that_is_free_in_one_direction_is_not_enabled(
    plain: Plain, connected: ConnectedDrive, missing: tuple[tuple[int, int], ...]
) -> None:
    plain.without(*missing)
    with pytest.raises(NotAllowed, match="60E1:00 Negative torque limit") as refused:
        async with connected.axis.enabled(Mode.PP, HALF):
            pass
    assert "cyclic exchange" in (refused.value.remedy or "")
    assert plain.words() == []


async def test_a_limit_that_cannot_be_read_for_another_reason_is_not_taken_for_none(
    plain: Plain, connected: ConnectedDrive
) -> None:
    plain.read_errors[POSITIVE] = Rejected("a general error", abort_code=0x08000000)
    with pytest.raises(Rejected):
        async with connected.axis.enabled(Mode.PP, HALF):
            pass
    assert plain.words() == []


async def test_a_drive_without_a_deceleration_is_jogged_by_its_acceleration(
    plain: Plain, connected: ConnectedDrive
) -> None:
    """CiA 402-2 object 6084h: without it the drive brakes by 6083h."""
    plain.without(DECELERATION, QUICK_STOP)
    hold = Hold()
    asyncio.get_running_loop().call_later(0.1, hold.release, END_OF_JOG["released"])
    reported = await jog(
        connected.axis, JogSettings(1, 60.0, 600.0, 1.0, 50.0), hold, Progress(lambda: None)
    )
    assert reported["reason_message"] == END_OF_JOG["released"].to_wire()
    # 600 rpm/s are 10 rev/s², 100000 inc/s².
    assert (ACCELERATION, (100000).to_bytes(4, "little")) in plain.written
    assert plain.number(ACCELERATION) == 50000, "put back"


async def test_without_an_acceleration_the_way_to_rest_is_not_known(
    plain: Plain, connected: ConnectedDrive
) -> None:
    plain.without(ACCELERATION)
    with pytest.raises(NotAllowed, match="6083:00 Profile acceleration"):
        await jog(
            connected.axis, JogSettings(1, 60.0, 600.0, 1.0, 50.0), Hold(), Progress(lambda: None)
        )
    assert plain.words() == []


async def test_two_ramps_are_not_given_to_a_drive_that_has_one(
    plain: Plain, connected: ConnectedDrive
) -> None:
    plain.without(DECELERATION)
    settings = MoveSettings("PP", 0.1, HALF, acceleration_rpm_s=600.0, deceleration_rpm_s=300.0)
    with pytest.raises(OutOfRange, match="no deceleration of its own"):
        await move(connected.axis, settings, Progress(lambda: None))
    assert plain.written == []


async def test_what_is_known_without_a_rated_torque_is_reported(
    plain: Plain, connected: ConnectedDrive
) -> None:
    plain.without(RATED_TORQUE, POSITIVE)
    facts = await read_facts(connected.axis)
    assert not facts.torque_known
    assert await drive_limit_percent(connected.axis) == 200.0


async def test_faults_of_a_drive_that_does_not_answer_are_not_reported_as_none(
    plain: Plain, connected: ConnectedDrive
) -> None:
    plain.without((0x603F, 0))
    assert await connected.axis.active_faults() == [], "603Fh is optional in CiA 402-2"
    plain.mute = True
    with pytest.raises(LinkTimeout):
        await connected.axis.active_faults()
