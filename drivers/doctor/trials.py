"""Settings of this program to try when a drive does not reach Operational. Pure.

A trial is a profile (or a cycle) that differs in one setting. It is not stored: the caller attaches
the previous profile again afterwards, and a person enters the setting in the profile.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from drivers.doctor.diagnosis import Cause
from profiles.bring_up import BringUp, ClockMode
from profiles.schema import PdoSet, Profile

MOST = 4
"""Maximum number of trials for one station: each takes the drive to Operational again."""

_ACTIVATES = (0x0300, 0x0700, 0x0330)
"""Values of 0980h used by known drives: SYNC0, SYNC0 and SYNC1, SYNC0 on its pin."""

_HALF_CYCLE_NS = 500_000
"""Half of the 1 ms cycle of a trial: as far as possible from the arrival of the process data."""

_LONGER = (2, 4)


@dataclass(frozen=True, slots=True)
class Trial:
    """One changed setting: its path in the profile, its present value and the one to try."""

    setting: str
    before: str
    after: str
    profile: Profile
    cycle_factor: int = 1

    @property
    def of_profile(self) -> bool:
        """Whether it is a setting of the profile, and not the cycle of the exchange."""
        return self.cycle_factor == 1


def trials(causes: Sequence[Cause], profile: Profile) -> tuple[Trial, ...]:
    """Return what to try, for the most likely cause first; empty if no setting is concerned."""
    found: dict[tuple[str, str], Trial] = {}
    for cause in causes:
        for trial in _BY_CAUSE.get(cause.code, _none)(cause, profile):
            found.setdefault((trial.setting, trial.after), trial)
    return tuple(found.values())[:MOST]


def _none(_cause: Cause, _profile: Profile) -> Iterator[Trial]:
    return iter(())


def _rules(profile: Profile) -> BringUp:
    return profile.bring_up or BringUp(source="doctor")


def _with_rules(profile: Profile, **changes: object) -> Profile:
    rules = _rules(profile).model_copy(update=changes)
    return profile.model_copy(update={"bring_up": rules})


def _own_assignment(_cause: Cause, profile: Profile) -> Iterator[Trial]:
    coe = _rules(profile).coe
    if coe.pdo_assign is not False:
        kept = coe.model_copy(update={"pdo_assign": False})
        yield Trial(
            "bring_up.coe.pdo_assign",
            _said(coe.pdo_assign),
            "false",
            _with_rules(profile, coe=kept),
        )


def _own_contents(_cause: Cause, profile: Profile) -> Iterator[Trial]:
    """Use the PDOs as the profile describes them, without writing any of them."""
    pdo = profile.pdo
    if pdo is None or not pdo.remappable:
        return
    sets = tuple(_fixed(each) for each in pdo.sets)
    kept = pdo.model_copy(update={"remappable": False, "sets": sets})
    yield Trial("pdo.remappable", "true", "false", profile.model_copy(update={"pdo": kept}))


def _fixed(each: PdoSet) -> PdoSet:
    return each.model_copy(update={"fixed": True})


def _without_command(cause: Cause, profile: Profile) -> Iterator[Trial]:
    refused = {str(fact.actual) for fact in cause.facts if fact.name == "refused_object"}
    rules = _rules(profile)
    left = tuple(
        each
        for each in rules.init_commands
        if f"{each.index:04X}:{each.subindex:02X}" not in refused
    )
    if len(left) < len(rules.init_commands):
        yield Trial(
            "bring_up.init_commands",
            ", ".join(sorted(refused)),
            "-",
            _with_rules(profile, init_commands=left),
        )


def _other_clock(_cause: Cause, profile: Profile) -> Iterator[Trial]:
    """Modes of the file with a clock, then none, then values that other drives need."""
    used = _rules(profile).clock_mode
    others = [m for m in _rules(profile).clock_modes if m is not used and m.assign_activate]
    for mode in others:
        yield _mode_tried(profile, mode)
    if _rules(profile).assign_activate:
        yield _mode_tried(profile, _mode_without_clock(profile))
    known = {_rules(profile).assign_activate, *(mode.assign_activate for mode in others)}
    shape = used or ClockMode(name="doctor")
    for value in _ACTIVATES:
        if value not in known:
            mode = shape.model_copy(update={"assign_activate": value, "name": "doctor"})
            yield _mode_tried(profile, mode)


def _with_clock(cause: Cause, profile: Profile) -> Iterator[Trial]:
    """Modes with a clock, for a drive that reports that it needs one."""
    return (each for each in _other_clock(cause, profile) if _rules(each.profile).assign_activate)


def _without_clock(_cause: Cause, profile: Profile) -> Iterator[Trial]:
    if _rules(profile).assign_activate:
        yield _mode_tried(profile, _mode_without_clock(profile))


def _mode_without_clock(profile: Profile) -> ClockMode:
    """Return the file's own mode without clock if it has one: it may assign other PDOs."""
    modes = (mode for mode in _rules(profile).clock_modes if not mode.assign_activate)
    return next(modes, ClockMode(name="doctor"))


def _mode_tried(profile: Profile, mode: ClockMode) -> Trial:
    return Trial(
        "bring_up.clock_modes",
        f"{_rules(profile).assign_activate:04X}h",
        f"{mode.assign_activate:04X}h",
        _with_rules(profile, clock_modes=(mode,)),
    )


def _other_shift(_cause: Cause, profile: Profile) -> Iterator[Trial]:
    """Shift SYNC0 relative to the process data: without the file's shift, or by half a cycle."""
    activate = _rules(profile).assign_activate
    if not activate:
        return
    mode = _rules(profile).clock_mode or ClockMode(name="doctor", assign_activate=activate)
    before = mode.sync0.shift_ns
    after = 0 if before else _HALF_CYCLE_NS
    shifted = mode.model_copy(update={"sync0": mode.sync0.model_copy(update={"shift_ns": after})})
    yield Trial(
        "bring_up.clock_modes.sync0.shift_ns",
        f"{before}",
        f"{after}",
        _with_rules(profile, clock_modes=(shifted,)),
    )


def _steadier_clock(cause: Cause, profile: Profile) -> Iterator[Trial]:
    yield from _other_shift(cause, profile)
    yield from _longer_cycle(cause, profile)
    yield from _without_clock(cause, profile)


def _usual_watchdog(_cause: Cause, profile: Profile) -> Iterator[Trial]:
    watchdog = _rules(profile).watchdog
    if watchdog.process_data is None and watchdog.divider is None:
        return
    usual = watchdog.model_copy(update={"process_data": None, "divider": None})
    yield Trial(
        "bring_up.watchdog",
        f"{watchdog.process_data_ns or 0} ns",
        "-",
        _with_rules(profile, watchdog=usual),
    )


def _longer_cycle(_cause: Cause, profile: Profile) -> Iterator[Trial]:
    for factor in _LONGER:
        yield Trial("cycle", "1", f"{factor}", profile, cycle_factor=factor)


def _clock_then_cycle(cause: Cause, profile: Profile) -> Iterator[Trial]:
    """Free the SYNC0 cycle if the file's mode fixes it; then try longer cycles."""
    mode = _rules(profile).clock_mode
    if mode is not None and mode.sync0.cycle_ns:
        free = mode.model_copy(update={"sync0": mode.sync0.model_copy(update={"cycle_ns": 0})})
        yield Trial(
            "bring_up.clock_modes.sync0.cycle_ns",
            f"{mode.sync0.cycle_ns}",
            "0",
            _with_rules(profile, clock_modes=(free,)),
        )
    yield from _longer_cycle(cause, profile)


def _clock_then_contents(cause: Cause, profile: Profile) -> Iterator[Trial]:
    """Yield the most frequent errors of files, for a drive that does not report the reason."""
    yield from _other_clock(cause, profile)
    yield from _own_contents(cause, profile)


_Rule = Callable[[Cause, Profile], Iterator[Trial]]
_BY_CAUSE: dict[str, _Rule] = {
    "assignment_locked": _own_assignment,
    "mapping_locked": _own_contents,
    "process_data_setup": _own_contents,
    "outputs_size": _own_contents,
    "inputs_size": _own_contents,
    "init_command_refused": _without_command,
    "clock_mode_wrong": _other_clock,
    "clock_needed": _with_clock,
    "sync0_missing": _other_clock,
    "sync0_unsteady": _steadier_clock,
    "cycle_refused": _clock_then_cycle,
    "watchdog_refused": _usual_watchdog,
    "watchdog_expired": _usual_watchdog,
    "makers_code": _clock_then_contents,
    "unknown": _clock_then_contents,
    "can_mapping_refused": _own_contents,
    "can_bus_full": _longer_cycle,
    "can_outputs_late": _longer_cycle,
    "can_overrun": _longer_cycle,
    "can_cycle_short": _longer_cycle,
}


def _said(flag: bool | None) -> str:
    return "-" if flag is None else str(flag).lower()
