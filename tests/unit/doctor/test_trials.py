"""What the doctor may try for each cause, and that every trial is undone."""

from __future__ import annotations

from typing import Any

import pytest

from backend.commands.buses.doctor import tried
from drivers.doctor.diagnosis import Cause, Fact
from drivers.doctor.examined import Examination
from drivers.doctor.trials import MOST, trials
from drivers.errors import DriveError, NotAllowed
from drivers.ethercat.exchange.bring_up import station_bring_up
from profiles.bring_up import BringUp, ClockMode, InitCommand, SyncSignal, WatchdogRegisters
from profiles.schema import PdoSet, PdoSpec, Profile
from tests.wire.ethercat_host.servo_device import servo_profile

MODES = (
    ClockMode(name="A", assign_activate=0x330),
    ClockMode(name="B", assign_activate=0x700, sync1=SyncSignal(shift_ns=1000)),
)


def profile(**rules: Any) -> Profile:
    return servo_profile().model_copy(update={"bring_up": BringUp(source="x", **rules)})


def of(code: str, known: Profile, *facts: Fact) -> list[tuple[str, str, str]]:
    return [(t.setting, t.before, t.after) for t in trials([Cause(code, 3, facts)], known)]


def test_the_operation_modes_of_the_file_come_before_those_of_others() -> None:
    found = of("clock_mode_wrong", profile(clock_modes=MODES))
    assert [after for _, _, after in found] == ["0700h", "0000h", "0300h"]
    first = trials([Cause("clock_mode_wrong", 3, ())], profile(clock_modes=MODES))[0]
    assert first.profile.bring_up is not None
    assert first.profile.bring_up.clock_mode == MODES[1]
    # Without a file the master's own 0300h is in use.
    assert of("clock_needed", servo_profile())[0][2] == "0700h"


def test_without_distributed_clocks() -> None:
    """A file that names modes, none with a clock, is brought up without SYNC0 (ETG.2000)."""
    off = ClockMode(name="FreeRun", assign_activate=0)
    assert station_bring_up(profile(clock_modes=(off,)), 1_000_000).activate == 0
    assert station_bring_up(profile(), 1_000_000).activate == 0x300
    clock = "bring_up.clock_modes"
    # No pulse of the clock comes: the drive may do without.
    assert of("sync0_missing", servo_profile())[0] == (clock, "0300h", "0000h")
    # The file's own mode is used, with the PDOs that it assigns.
    found = trials([Cause("clock_mode_wrong", 3, ())], profile(clock_modes=(MODES[0], off)))
    assert [t.profile.bring_up.clock_modes for t in found if t.after == "0000h"] == [(off,)]  # type: ignore[union-attr]
    # A drive that reports that it needs the clock is not tried without, and one without not again.
    assert "0000h" not in [after for _, _, after in of("clock_needed", servo_profile())]
    without = profile(clock_modes=(off,))
    assert (clock, "0000h", "0300h") in of("clock_mode_wrong", without)
    assert of("sync0_unsteady", without) == [("cycle", "1", "2"), ("cycle", "1", "4")]


def test_the_shift_of_sync0_is_tried() -> None:
    shift = "bring_up.clock_modes.sync0.shift_ns"
    shifted = ClockMode(name="A", assign_activate=0x330, sync0=SyncSignal(shift_ns=-200_000))
    (first, *_) = trials([Cause("sync0_unsteady", 3, ())], profile(clock_modes=(shifted,)))
    assert (first.setting, first.before, first.after) == (shift, "-200000", "0")
    rules = station_bring_up(first.profile, 1_000_000)
    assert (rules.activate, rules.sync0_shift_ns) == (0x330, 0)
    # Half of the 1 ms of a trial.
    assert of("sync0_unsteady", servo_profile())[0] == (shift, "0", "500000")


def test_a_setting_that_changes_nothing_is_not_tried() -> None:
    """Every trial of a clock must reach the registers as another value than before."""
    off = ClockMode(name="C", assign_activate=0)
    for known in (servo_profile(), profile(clock_modes=(*MODES, off)), profile(clock_modes=(off,))):
        before = station_bring_up(known, 1_000_000).activate
        found = trials([Cause("clock_mode_wrong", 3, ())], known)
        assert found
        for trial in found:
            after = station_bring_up(trial.profile, 1_000_000).activate
            assert after != before
            assert trial.after == f"{after:04X}h"


def test_the_refused_command_alone_is_left_out() -> None:
    commands = tuple(
        InitCommand(transition="PS", index=index, subindex=0, data="00")
        for index in (0x2010, 0x6060, 0x2010)
    )
    cause = Cause("init_command_refused", 5, (Fact("refused_object", "2010:00"),))
    (trial,) = trials([cause], profile(init_commands=commands))
    assert trial.profile.bring_up is not None
    assert [c.index for c in trial.profile.bring_up.init_commands] == [0x6060]
    assert of("init_command_refused", profile(), Fact("refused_object", "2010:00")) == []


def test_one_setting_differs_in_each_trial() -> None:
    known = profile(watchdog=WatchdogRegisters(divider=100, process_data=5))
    pdo = PdoSpec(
        sets=(PdoSet(index=0x1600, direction="rx", entries=("6040:00",), source="x"),),
        default_rx=0x1600,
        default_tx=0x1A00,
        max_entries=8,
        source="x",
    )
    known = known.model_copy(update={"pdo": pdo})
    assert of("watchdog_refused", known) == [("bring_up.watchdog", "20400 ns", "-")]
    assert of("assignment_locked", known) == [("bring_up.coe.pdo_assign", "-", "false")]
    assert of("mapping_locked", known) == [("pdo.remappable", "true", "false")]
    assert of("watchdog_expired", known) == of("watchdog_refused", known)
    fixed = ClockMode(name="A", assign_activate=0x300, sync0=SyncSignal(cycle_ns=40_000_000))
    assert of("cycle_refused", profile(clock_modes=(fixed,)))[0] == (
        "bring_up.clock_modes.sync0.cycle_ns",
        "40000000",
        "0",
    )


@pytest.mark.parametrize("code", ["supply_low", "cable", "drive_fault", "station_silent"])
def test_what_no_setting_changes_is_not_tried(code: str) -> None:
    assert of(code, profile(clock_modes=MODES)) == []


def test_a_code_of_the_maker_tells_nothing_so_clocks_and_contents_are_tried() -> None:
    settings = {setting for setting, _, _ in of("makers_code", servo_profile())}
    assert settings == {"bring_up.clock_modes", "pdo.remappable"}


def test_no_more_than_some_trials_and_none_twice() -> None:
    causes = [
        Cause("clock_mode_wrong", 3, ()),
        Cause("clock_needed", 2, ()),
        Cause("sync0_unsteady", 1, ()),
    ]
    found = trials(causes, profile(clock_modes=MODES))
    assert len({(t.setting, t.after) for t in found}) == len(found) == MOST


class _Bus:
    """A link whose station reaches Operational with 0700h alone."""

    kind, url = "ethercat", "x"

    def __init__(self) -> None:
        self.attached: list[Profile] = []
        self.running = False
        self.cycles: list[float] = []
        self.cyclic = self.doctor = self

    def attach(self, _station: int, known: Profile) -> None:
        assert not self.running
        self.attached.append(known)

    async def configure(self, _inputs: object, _outputs: object, cycle_s: float) -> None:
        self.cycles.append(cycle_s)

    async def start(self) -> None:
        rules = self.attached[-1].bring_up
        if rules is None or rules.clock_mode is None or rules.clock_mode.assign_activate != 0x700:
            raise NotAllowed("station.doctor-knows-not", value="x")
        self.running = True

    async def stop(self) -> None:
        self.running = False

    async def stations_known(self) -> list[int]:
        return [1]

    async def examination(self, station: int, refusal: DriveError | None = None) -> Examination:
        return Examination(station, refusal is None)


async def test_trials_end_with_the_one_that_works_and_leave_the_profile_as_it_was() -> None:
    bus = _Bus()
    known = profile(clock_modes=MODES[:1])
    bus.attach(1, known)
    found = await tried(bus, 1, known, [Cause("clock_mode_wrong", 3, ())])  # type: ignore[arg-type]
    assert [(each["after"], each["reached"]) for each in found] == [
        ("0000h", False),
        ("0300h", False),
        ("0700h", True),
    ]
    assert bus.attached[-1] is known
    assert not bus.running
