"""Delayed actions of a drive: one list for the single alarm clock of the 50 µs loop."""

from __future__ import annotations

from collections.abc import Callable

from drivers.virtual.firmware.axis import VirtualAxis
from drivers.virtual.firmware.kernel import layout as k


class Timer:
    """One delayed action. ``cancel`` may be called at any time, also afterwards."""

    __slots__ = ("_schedule", "action", "step")

    def __init__(self, schedule: Schedule, step: float, action: Callable[[], None]) -> None:
        self._schedule = schedule
        self.step = step
        self.action = action

    def cancel(self) -> None:
        """Cancel the action."""
        self._schedule.forget(self)


class Schedule:
    """Runs actions in the step in which they are due, in the order of their times."""

    def __init__(self, axis: VirtualAxis) -> None:
        self._axis = axis
        self._timers: list[Timer] = []
        axis.set_alarm(None)

    def after(self, seconds: float, action: Callable[[], None]) -> Timer:
        """Call ``action`` after this time of the drive's clock, at least one step."""
        steps = max(1, round(seconds / k.STEP_S))
        timer = Timer(self, float(self._axis.s[k.S_STEP]) + steps, action)
        self._timers.append(timer)
        self._wind()
        return timer

    def forget(self, timer: Timer) -> None:
        """Remove a timer from the list."""
        if timer in self._timers:
            self._timers.remove(timer)
            self._wind()

    def run(self) -> None:
        """Run all due actions; called on the alarm clock event."""
        now = float(self._axis.s[k.S_STEP])
        due = sorted((t for t in self._timers if t.step <= now), key=lambda t: t.step)
        for timer in due:
            if timer in self._timers:  # an action may have cancelled a later one
                self._timers.remove(timer)
                timer.action()
        self._wind()

    def _wind(self) -> None:
        self._axis.set_alarm(min((t.step for t in self._timers), default=None))
