"""Monitor parameters and fault records of the makers' own, with manual lines.

Values are given in engineering units of the parameter and brought to raw by its scale.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from drivers.virtual.firmware.alarms import Record
from drivers.virtual.firmware.control import DeviceControl
from drivers.virtual.firmware.core import Core
from drivers.virtual.firmware.dictionary import Number
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.states import State
from drivers.virtual.firmware.terminals import Terminals

_RPM = 30 / math.pi
Value = Callable[[], float]
Getter = Callable[[], Number]


@dataclass(frozen=True, slots=True)
class Sources:
    """What monitors are made of."""

    core: Core
    control: DeviceControl
    terminals: Terminals | None

    def item(self, state: int) -> float:
        """A state of the 50 µs loop."""
        return float(self.core.axis.s.item(state))

    def rpm(self, state: int) -> Value:
        """A speed in rpm."""
        return lambda: self.item(state) * _RPM

    def percent(self, state: int) -> Value:
        """A torque in % of the rated torque."""
        return lambda: 100 * self.item(state) / self.core.motor.rated_torque_nm

    def counts(self, state: int) -> Value:
        """An angle in encoder increments."""
        per_rad = float(self.core.axis.p[k.P_COUNTS_PER_RAD])
        return lambda: self.item(state) * per_rad

    def position(self, state: int) -> Value:
        """An angle in command units."""
        return lambda: self.core.position_of(self.item(state))

    def deviation(self) -> float:
        """Position deviation in command units."""
        away = self.item(k.S_P_DEMAND) - self.item(k.S_THETA)
        return away * self.core.units.position_per_rad

    def turn_share(self) -> float:
        """Place within the revolution, 0 to 1."""
        return self.item(k.S_THETA) / (2 * math.pi) % 1.0


def _m6l(f: Sources) -> dict[str, Value]:
    """P11 (000:3558-3615) and the three records of P10.18 to P10.59 (000:3497-3556)."""
    axis, control = f.core.axis, f.control
    values: dict[str, Value] = {
        "200B:01": f.rpm(k.S_SPEED_REFERENCE),
        "200B:02": f.rpm(k.S_OMEGA),
        "200B:03": lambda: abs(f.item(k.S_UQ)) * math.sqrt(3),
        "200B:04": lambda: abs(f.item(k.S_CURRENT)),
        "200B:05": f.percent(k.S_TORQUE),
        "200B:07": lambda: f.item(k.S_TORQUE),
        "200B:09": lambda: 100 * f.item(k.S_LOAD_RATIO),
        "200B:0A": lambda: f.item(k.S_VOLTAGE),
        "200B:0C": partial(_m6l_state, f),
        "200B:13": lambda: f.counts(k.S_THETA)() % axis.spec.encoder.counts_per_rev,
        "200B:18": f.counts(k.S_THETA),
        "200B:17": f.counts(k.S_P_DEMAND),
        "200B:19": lambda: f.counts(k.S_P_DEMAND)() - f.counts(k.S_THETA)(),
        "200B:1B": f.position(k.S_P_DEMAND),
        "200B:1C": f.position(k.S_THETA),
        "200B:1D": f.deviation,
        "200B:20": lambda: f.item(k.S_TEMPERATURE),
        "200B:21": lambda: f.turn_share() * 2**23,
        "200B:22": lambda: f.item(k.S_THETA) // (2 * math.pi) % 65536,
        "200B:23": lambda: f.core.number("2009:27", 100) * 0.01,
        "200B:24": f.position(k.S_THETA),
        "200B:2D": lambda: f.turn_share() * axis.motor.pole_pairs % 1.0 * 360,
        "200B:30": lambda: f.item(k.S_TEMPERATURE),
        "2011:04": lambda: control.modes.mode,
        "2011:05": lambda: control.control_word,
        "2011:12": control.status_word,
    }
    for age, first in ((0, 0x16), (1, 0x23), (2, 0x30)):
        values |= _m6l_record(f, age, 0x13 + age, first)
    return values


def _m6l_state(f: Sources) -> int:
    """P11.11: run, direction, zero speed (000:3569)."""
    speed = f.item(k.S_OMEGA)
    running = f.control.state is State.OPERATION_ENABLED
    return running | (speed >= 0) << 1 | (f.item(k.S_ZERO_T) > 0) << 2


def _m6l_record(f: Sources, age: int, code: int, first: int) -> dict[str, Value]:
    def record() -> Record:
        return f.control.alarms.log.at(age)

    fields: tuple[Callable[[Record], float], ...] = (
        lambda r: r.snapshot.bus_v,
        lambda r: r.snapshot.current_v_a,
        lambda r: r.snapshot.current_w_a,
        lambda _: 0.0,  # the d-axis current is kept at zero
        lambda r: r.snapshot.demand_q_a,
        lambda _: 0.0,
        lambda r: r.snapshot.current_q_a,
        lambda r: r.snapshot.speed_rpm,
        lambda r: r.snapshot.position,
        lambda r: r.snapshot.inputs,
        lambda r: r.snapshot.outputs,
        lambda r: r.snapshot.state_bits,
        lambda r: r.snapshot.temperature_c,
    )
    values: dict[str, Value] = {f"200A:{code:02X}": lambda: record().number}
    for place, read in enumerate(fields):
        values[f"200A:{first + place:02X}"] = lambda read=read: read(record())  # type: ignore[misc]
    return values


def _r6l(f: Sources) -> dict[str, Value]:
    """Group P13 (002:12090-12685); 200Dh:24 chooses one of the ten records."""

    def record() -> Record:
        return f.control.alarms.log.at(int(f.core.number("200D:24")))

    return {
        "200D:01": lambda: {State.FAULT: 0, State.OPERATION_ENABLED: 2}.get(f.control.state, 1),
        "200D:02": f.rpm(k.S_OMEGA),
        "200D:03": f.rpm(k.S_SPEED_REFERENCE),
        "200D:04": f.percent(k.S_TORQUE),
        "200D:05": f.percent(k.S_TORQUE_COMMAND),
        "200D:06": lambda: 100 * f.item(k.S_LOAD_RATIO),
        "200D:08": f.position(k.S_P_DEMAND),
        "200D:0A": f.position(k.S_THETA),
        "200D:0C": f.counts(k.S_THETA),
        "200D:0E": f.deviation,
        "200D:17": lambda: f.turn_share() * f.core.motor.pole_pairs % 1.0 * 360,
        "200D:18": lambda: f.item(k.S_VOLTAGE),
        "200D:21": lambda: f.item(k.S_STEP) * k.STEP_S,
        "200D:25": lambda: record().number,
        "200D:26": lambda: record().snapshot.current_u_a,
        "200D:27": lambda: record().snapshot.current_v_a,
        "200D:28": lambda: record().snapshot.inputs,
        "200D:29": lambda: record().snapshot.outputs,
        "200D:2A": lambda: record().snapshot.bus_v,
        "200D:2B": lambda: record().snapshot.speed_rpm,
        "200D:2C": lambda: record().snapshot.running_s,
        "200D:36": lambda: newest_number(f.control),
        "200D:3C": lambda: record().number,
        "200D:3D": f.counts(k.S_THETA),
        "200D:4D": f.rpm(k.S_OMEGA),
    }


def newest_number(control: DeviceControl) -> int:
    """Number of the newest active fault, 0 without one."""
    return control.alarms.log.at(0).number if control.alarms.active else 0


def _ep3e(f: Sources) -> dict[str, Value]:
    """2600h to 26A2h (001:77-130)."""
    motor = f.core.motor
    return {
        "2600:00": lambda: (
            0 if f.control.faults.error_code == 0xFF3C else f.control.faults.error_code & 0xFF
        ),
        "2601:00": lambda: f.turn_share() * 2**32,
        "2602:00": lambda: f.item(k.S_THETA) // (2 * math.pi) % 65536,
        "2603:00": lambda: 1,
        "2605:00": lambda: f.item(k.S_VOLTAGE),
        "2606:00": lambda: f.item(k.S_TEMPERATURE),
        "2670:00": lambda: 100 * f.item(k.S_LOAD_RATIO),
        "2671:00": lambda: 100 * f.item(k.S_BRAKE_DUTY),
        "2680:01": f.position(k.S_P_DEMAND),
        "2680:02": f.position(k.S_THETA),
        "2680:03": f.deviation,
        "2681:01": f.rpm(k.S_OMEGA),
        "2682:01": f.percent(k.S_TORQUE),
        "2682:03": lambda: f.item(k.S_CURRENT),
        "26A0:00": lambda: motor.rated_current_a,
        "26A1:00": lambda: motor.rated_torque_nm,
        "26A2:00": lambda: motor.rated_speed_rad_s * _RPM,
    }


_MONITORS: dict[str, Callable[[Sources], dict[str, Value]]] = {
    "m6l": _m6l,
    "r6l": _r6l,
    "ep3e": _ep3e,
}


def monitors(core: Core, control: DeviceControl, terminals: Terminals | None) -> dict[str, Getter]:
    """Raw getters of the parameters that this drive's dictionary has."""
    make = _MONITORS.get(core.profile.drive)
    sources = Sources(core, control, terminals)
    values = {} if make is None else make(sources)
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
