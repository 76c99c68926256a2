"""The manufacturers' own monitor parameters and fault records, with manual lines.

Values are in engineering units of the parameter and converted to raw by its scale.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from drivers.virtual.firmware.control import DeviceControl
from drivers.virtual.firmware.core import Core
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.objects.dictionary import Number
from drivers.virtual.firmware.terminals import Terminals

_RPM = 30 / math.pi
Value = Callable[[], float]
Getter = Callable[[], Number]


@dataclass(frozen=True, slots=True)
class Sources:
    """Sources of monitor values."""

    core: Core
    control: DeviceControl
    terminals: Terminals | None

    def item(self, state: int) -> float:
        """Return a state of the 50 µs loop."""
        return float(self.core.axis.s.item(state))

    def rpm(self, state: int) -> Value:
        """Return a speed in rpm."""
        return lambda: self.item(state) * _RPM

    def percent(self, state: int) -> Value:
        """Return a torque in % of the rated torque."""
        return lambda: 100 * self.item(state) / self.core.motor.rated_torque_nm

    def counts(self, state: int) -> Value:
        """Return an angle in encoder increments."""
        per_rad = float(self.core.axis.p[k.P_COUNTS_PER_RAD])
        return lambda: self.item(state) * per_rad

    def position(self, state: int) -> Value:
        """Return an angle in command units."""
        return lambda: self.core.position_of(self.item(state))

    def deviation(self) -> float:
        """Return the position deviation in command units."""
        away = self.item(k.S_P_DEMAND) - self.item(k.S_THETA)
        return away * self.core.units.position_per_rad

    def turn_share(self) -> float:
        """Return the position within the revolution, 0 to 1."""
        return self.item(k.S_THETA) / (2 * math.pi) % 1.0


def monitors(core: Core, control: DeviceControl, terminals: Terminals | None) -> dict[str, Getter]:
    """Return raw getters of the parameters in this drive's dictionary."""
    values = core.family.monitors(Sources(core, control, terminals))
    if terminals is not None:
        table = core.family.terminals
        if table is not None and table.inputs_key is not None:
            values[table.inputs_key] = terminals.input_bits
        if table is not None and table.outputs_key is not None:
            values[table.outputs_key] = terminals.output_bits
        for place, key in enumerate(("60D5:00", "60D6:00", "60D7:00", "60D8:00")):
            values[key] = lambda place=place: terminals.latch_count(place)  # type: ignore[misc]
    known = core.profile.by_key
    return {key: _raw(known[key].scale, value) for key, value in values.items() if key in known}


def _raw(scale: float, value: Value) -> Getter:
    return lambda: round(value() / scale)
