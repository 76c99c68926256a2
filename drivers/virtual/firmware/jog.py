"""The jog that a drive does by itself, by two of its inputs and without the bus.

M6-L: inputs with functions 17 and 18 at the speed of P06.05 (000:1191-1193); the ramps P06.07 and
P06.08 are taken to 1000 rpm, which is not printed. R6L: inputs with functions 39 and 40 at P04.04,
with the servo off, and P04.05 and P04.06 as the times to and from 1000 rpm (002:9774-9807). Both
inputs at once, or none, stand still. Whoever enables the axis over the bus ends it.
"""

from __future__ import annotations

from collections.abc import Callable

from drivers.virtual.firmware.brake import HoldingBrake
from drivers.virtual.firmware.core import Core
from drivers.virtual.firmware.families.base import RPM

_REFERENCE_RPM = 1000.0


class TerminalJog:
    """Turns the axis while one of its two inputs is on; ``free`` says that the bus does not."""

    def __init__(self, core: Core, brake: HoldingBrake, free: Callable[[], bool]) -> None:
        self._core = core
        self._axis = core.axis
        self._brake = brake
        self._free = free
        self._wanted = 0
        self._stopping = False

    @property
    def active(self) -> bool:
        """Turning, or still coming to rest."""
        return self._wanted != 0 or self._stopping

    def update(self, *, forward: bool, backward: bool) -> None:
        """Levels of the two inputs, whenever they may have changed."""
        wanted = int(forward) - int(backward)
        if wanted == self._wanted or self._core.family.traits.jog is None:
            return
        if wanted and not self._free():
            return
        before, self._wanted = self._wanted, wanted
        if not wanted:
            self._stop()
        elif before or self._stopping or not self._brake.open(self._turn):
            self._turn()

    def cancel(self) -> None:
        """Something else takes the axis."""
        self._wanted, self._stopping = 0, False

    def stopped(self) -> None:
        """The axis has come to rest."""
        if not self._stopping:
            return
        self._stopping = False
        if not self._brake.close(lambda: self.active or not self._free()):
            self._axis.power_off()

    def _turn(self) -> None:
        if not self._wanted:
            return
        self._stopping = False
        speed, rise, fall = self._settings()
        self._axis.run_velocity(self._wanted * speed, rise, fall)

    def _stop(self) -> None:
        self._brake.cancel()
        self._stopping = True
        self._axis.stop_ramp(self._settings()[2])

    def _settings(self) -> tuple[float, float, float]:
        """Speed [rad/s] and both ramps [rad/s²]."""
        keys = self._core.family.traits.jog
        if keys is None:
            return (0.0, 1.0, 1.0)
        speed, rise_ms, fall_ms = (self._value(key) for key in (keys.speed, keys.rise, keys.fall))
        reference = _REFERENCE_RPM * RPM * 1e3
        return (speed * RPM, reference / max(rise_ms, 1.0), reference / max(fall_ms, 1.0))

    def _value(self, key: str) -> float:
        return float(self._core.profile.by_key[key].to_value(self._core.number(key)))
