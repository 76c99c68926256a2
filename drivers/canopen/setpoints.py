"""Playing precomputed setpoints, and stopping by itself when nobody renews them. Pure.

One `Player` serves one trajectory of one station. `Player.step` is called once per cycle; time
is counted in cycles, so tests need no clock.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

from drivers.link import Trajectory

POSITION_TARGETS = (0x607A,)
VELOCITY_TARGETS = (0x60FF,)

_LONGEST_RAMP_S = 0.5


@dataclass(slots=True)
class Player:
    """State of one playing trajectory.

    After the last value it holds. With no renewal for ``renew_s`` it brakes: a position target no
    harder than the trajectory itself accelerated, other targets no faster than they changed, but
    within half a second in any case.
    """

    trajectory: Trajectory
    cycle_s: float
    position: int = 0
    """Index of the next value."""
    expires: int = 0
    cycle: int = 0
    braking: bool = False
    finished: bool = False
    disable_at_end: bool = True
    value: float = 0.0
    offset: float = 0.0
    _slope: float = 0.0
    _step: float = 0.0

    def __post_init__(self) -> None:
        values = self.trajectory.values
        self.expires = len(values) + self._life()
        if len(values):
            self.value = float(values[0])

    def _life(self) -> int:
        return max(1, math.ceil(self.trajectory.renew_s / self.cycle_s))

    @property
    def is_position(self) -> bool:
        """The target is a position: stopping means to end at standstill, not at zero."""
        return self.trajectory.target.index in POSITION_TARGETS

    def renew(self) -> None:
        """Extend the life by the renewal time from now, unless it is already braking."""
        if not self.braking:
            self.expires = max(self.expires, self.cycle + self._life())

    def brake(self, *, disable_at_end: bool) -> None:
        """Begin to stop now. ``disable_at_end`` leaves Operation enabled afterwards."""
        self.disable_at_end = self.disable_at_end if self.braking else disable_at_end
        if self.braking:
            self.disable_at_end = self.disable_at_end or disable_at_end
            return
        self.braking = True
        values = self.trajectory.values.astype(float)
        shortest = max(1.0, _LONGEST_RAMP_S / self.cycle_s)
        if self.is_position:
            steepest = max(map(abs, _differences(_differences(values.tolist()))), default=0.0)
            self._slope = max(steepest, abs(self._step) / shortest, 1e-9)
        else:
            steepest = max(map(abs, _differences(values.tolist())), default=0.0)
            self._slope = max(steepest, abs(self.value) / shortest, 1e-9)

    def step(self) -> tuple[int, int | None]:
        """Setpoint and offset of this cycle; advances by one cycle."""
        trajectory = self.trajectory
        if not self.braking and self.cycle >= self.expires:
            self.brake(disable_at_end=True)
        if self.braking:
            self._brake_step()
        elif self.position < len(trajectory.values):
            new = float(trajectory.values[self.position])
            self._step = new - self.value
            self.value = new
            offsets = trajectory.offset_values
            if offsets is not None and self.position < len(offsets):
                self.offset = float(offsets[self.position])
            self.position += 1
        else:
            self._step = 0.0
        self.cycle += 1
        offset = None if trajectory.offset_target is None else round(self.offset)
        return round(self.value), offset

    def _brake_step(self) -> None:
        self.offset = 0.0
        if self.is_position:
            self._step = _towards_zero(self._step, self._slope)
            self.value += self._step
            self.finished = self._step == 0.0
        else:
            self.value = _towards_zero(self.value, self._slope)
            self.finished = self.value == 0.0


def _differences(values: list[float]) -> list[float]:
    return [b - a for a, b in itertools.pairwise(values)]


def _towards_zero(value: float, step: float) -> float:
    return math.copysign(max(abs(value) - step, 0.0), value) if abs(value) > step else 0.0
