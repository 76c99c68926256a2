"""What a search left out or left wrong is corrected without anybody asking, but under no motion."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from drivers.errors import LinkLost
from drivers.ethercat.process.stations import roster as watched
from drivers.ethercat.process.stations.roster import Roster
from drivers.ethercat.wire.al_status import ERROR_BIT, AlState
from drivers.ethercat.wire.steps import Pause, Read, Steps, Write

#: Sync managers 0 and 1 with mailboxes of 128 bytes at 1000h and 1080h (ETG.1000.4 table 58).
MANAGERS = bytes.fromhex("0010 8000 26 00 01 00 8010 8000 22 00 01 00")


class Wire:
    """A segment on which some slaves answer; ``there`` is how many."""

    interface = "eth9"

    def __init__(self, there: int) -> None:
        self.there, self.searches, self.late_frames = there, 0, 0
        self.slaves: tuple[object, ...] = ()

    def find(self) -> int:
        self.searches += 1
        one = SimpleNamespace(man=1, id=2, rev=3, name="servo")
        self.slaves = (one,) * self.there
        return self.there

    def read(self, _station: int, _register: int, _size: int) -> bytes:
        return MANAGERS

    def replaced(self) -> bool:
        return False


class Lanes:
    """Carries out what must be, and keeps the rest."""

    def __init__(self) -> None:
        self.mailbox: list[int] = []
        self.held, self.frames = False, 0

    def submit(self, number: int, lane: str, _steps: object, _done: object) -> None:
        if lane == "mailbox":
            self.mailbox.append(number)

    def busy(self, _number: int, lane: str) -> bool:
        return lane == "register" or self.held

    def drop(self, _why: str) -> None: ...

    def wake_s(self) -> None:
        return None


class Clock:
    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    fake = SimpleNamespace(monotonic=clock, monotonic_ns=lambda: 0, sleep=lambda _s: None)
    monkeypatch.setattr(watched, "time", fake)
    return clock


def roster(there: int) -> tuple[Any, Wire, Lanes, list[str]]:
    wire, lanes, events = Wire(there), Lanes(), list[str]()
    ring = SimpleNamespace(host_lives_until=lambda *_what: None)
    tell: Callable[[Any], None] = lambda m: events.append(str(m.get("kind", "")))  # noqa: E731
    made = Roster(wire, lanes, ring, tell)  # type: ignore[arg-type]
    made.is_open = True
    return made, wire, lanes, events


def ask(made: Roster, number: int) -> bool:
    try:
        made.station({"station": number})
    except LinkLost:
        return False
    return True


def test_a_drive_that_is_switched_on_after_the_search_is_found(clock: Clock) -> None:
    """It was asked for ever where it was, and answered with "there is no station 2"."""
    made, wire, _, _ = roster(1)
    assert ask(made, 1)
    assert not ask(made, 2)
    wire.there = 2
    for _ in range(20):
        clock.now += 0.25
        made.housekeeping(clock.now)
        if ask(made, 2):
            break
    assert ask(made, 2)
    assert clock.now < 105.0


def test_one_that_stays_away_costs_the_others_little(clock: Clock) -> None:
    made, wire, _, _ = roster(1)
    for _ in range(4 * 60):
        ask(made, 2)
        clock.now += 0.25
        made.housekeeping(clock.now)
    assert wire.searches <= 9, "one a second at first, then one in ten seconds"


def test_no_search_resets_an_axis_that_is_enabled(clock: Clock) -> None:
    made, wire, _, _ = roster(1)
    ask(made, 1)
    made.commanded(1, 0x0F)
    for _ in range(40):
        ask(made, 2)
        clock.now += 0.25
        made.housekeeping(clock.now)
    assert wire.searches == 1
    made.commanded(1, 0x00)
    ask(made, 2)
    clock.now += 0.25
    made.housekeeping(clock.now)
    assert wire.searches == 2


def watch(made: Any, number: int, al_state: int) -> None:
    """One look at a station that answers with this state."""
    steps: Steps[None] = made._watch(made.stations[number - 1])
    answer: bytes | None = None
    try:
        step = next(steps)
        while True:
            assert isinstance(step, Read | Write | Pause)
            answer = bytes([al_state, 0, 0, 0, 0x16, 0]) if isinstance(step, Read) else b""
            step = steps.send(answer)
    except StopIteration:
        return


def test_a_drive_that_fell_to_init_is_brought_back(clock: Clock) -> None:
    """INIT with error 0016h, invalid mailbox configuration: it answered no parameter for ever."""
    made, wire, lanes, events = roster(2)
    assert ask(made, 2)
    lanes.mailbox.clear()
    fallen = AlState.INIT | ERROR_BIT
    watch(made, 2, fallen)
    assert lanes.mailbox == [2]
    assert "state" in events
    watch(made, 2, fallen)
    assert lanes.mailbox == [2], "not at once again"
    clock.now += 1.1
    watch(made, 2, fallen)
    assert lanes.mailbox == [2, 2]
    clock.now += 3.1
    watch(made, 2, fallen)
    made.housekeeping(clock.now)
    assert wire.searches == 2, "what the first search wrote down may be what is wrong"
    watch(made, 2, AlState.PREOP)
    lanes.mailbox.clear()
    watch(made, 2, AlState.PREOP)
    assert lanes.mailbox == []


def test_a_drive_that_is_being_set_up_is_left_to_that(clock: Clock) -> None:
    made, _, lanes, _ = roster(1)
    ask(made, 1)
    lanes.mailbox.clear()
    lanes.held = True
    watch(made, 1, AlState.INIT | ERROR_BIT)
    clock.now += 20.0
    watch(made, 1, AlState.INIT | ERROR_BIT)
    assert lanes.mailbox == []


def test_a_drive_that_did_not_leave_init_is_asked_again(clock: Clock) -> None:
    """Switched on again it took longer to start than a state may take, and stayed there, mute."""
    made, wire, lanes, _ = roster(2)
    assert ask(made, 2)
    lanes.mailbox.clear()
    watch(made, 2, AlState.INIT)
    assert lanes.mailbox == [2]
    clock.now += 1.1
    watch(made, 2, AlState.INIT)
    assert lanes.mailbox == [2, 2]
    watch(made, 2, AlState.PREOP)
    clock.now += 20.0
    watch(made, 2, AlState.PREOP)
    assert lanes.mailbox == [2, 2]
    # A terminal without mailbox may stay there: nobody asks it for a parameter.
    made.stations[0].mailbox = None
    for _ in range(10):
        watch(made, 1, AlState.INIT)
        clock.now += 5.0
        made.housekeeping(clock.now)
    assert 1 not in lanes.mailbox
    assert wire.searches == 1
