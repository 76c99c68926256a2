"""A virtual servo drive: the `Device` that every wire serves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from drivers.virtual.device import (
    ABORT_DEVICE_STATE,
    ABORT_NOT_MAPPABLE,
    ABORT_STORE,
    ABORT_UNSUPPORTED,
    ABORT_VALUE_RANGE,
    EntryInfo,
    ProcessImage,
    SdoAbort,
)
from drivers.virtual.firmware import kernel as k
from drivers.virtual.firmware.axis import VirtualAxis
from drivers.virtual.firmware.control import DeviceControl, Emergency
from drivers.virtual.firmware.core import Core
from drivers.virtual.firmware.dictionary import Entry, ObjectDictionary
from drivers.virtual.firmware.families.base import Family
from drivers.virtual.firmware.live import live_values
from drivers.virtual.firmware.nvm import Nvm
from drivers.virtual.firmware.panel import Panel
from drivers.virtual.firmware.process_data import InputImage, OutputImage, check_mapping
from drivers.virtual.firmware.registers import RegisterTable
from drivers.virtual.mechanics import MechanicsSpec
from profiles.schema import Profile, Raw

#: Set-points and commands, which no drive stores.
_VOLATILE: Final = frozenset(
    f"{index:04X}:00"
    for index in (0x6040, 0x6060, 0x607A, 0x60FF, 0x6071, 0x60B0, 0x60B1, 0x60B2, 0x60B8, 0x200D)
) | {"60FE:01", "60FE:02"}
_RESET_AFTER_STEPS: Final = 400
"""20 ms from the reset command to the reset."""
_BOOT_S: Final = 0.3
_FAULT_NAMES: Final = {
    "over_current": k.F_OVER_CURRENT, "under_voltage": k.F_UNDER_VOLTAGE,
    "locked_rotor": k.F_LOCKED, "power_stage": k.F_POWER_STAGE, "overload": k.F_OVERLOAD,
    "position_limit": k.F_POSITION_LIMIT, "sensor": k.F_SENSOR, "memory": k.F_MEMORY,
    "over_temperature": k.F_OVER_TEMPERATURE, "over_voltage": k.F_OVER_VOLTAGE,
    "over_speed": k.F_OVER_SPEED, "speed_error": k.F_SPEED_ERROR, "watchdog": k.F_WATCHDOG,
}  # fmt: skip


class VirtualServo:
    """Firmware, loops and mechanics of one drive; see `drivers.virtual.device.Device`.

    The clock starts with the first ``advance``. The same seed and the same accesses at the same
    times give the same run.
    """

    def __init__(
        self,
        profile: Profile,
        family: Family,
        mechanics: MechanicsSpec,
        *,
        nvm_path: Path | None = None,
        station: int = 1,
        seed: int = 1,
    ) -> None:
        self.profile = profile
        self.powered = True
        self.mechanics = mechanics
        self.axis = VirtualAxis(mechanics, seed)
        self.nvm = Nvm(nvm_path)
        self.od = ObjectDictionary(profile, station)
        self._family = family
        self._registers = RegisterTable(profile, self.od)
        self._zero_rad = 0.0
        self._start_ns: int | None = None
        self._off_until_ns: int | None = None
        self._reset_step: int | None = None
        self._power_on()

    # --- power -----------------------------------------------------------------------------
    def _power_on(self) -> None:
        od, axis = self.od, self.axis
        od.restore_defaults()
        self._load_factory()
        od.load(self.nvm.load())
        self.core = Core(self.profile, self._family, od, axis)
        self.core.zero_rad = self._zero_rad
        axis.power_off()
        axis.clear_faults()
        axis.set_alarm(None)
        self.control = DeviceControl(self.core)
        self.panel = Panel(self.core)
        self.core.apply_settings()
        self._connect()
        if self.nvm.damaged:
            self.control.raise_fault(k.F_MEMORY)

    def _load_factory(self) -> None:
        """Values the maker sets, and start values where the manual prints none."""
        fallback = self._family.fallback_values(self.axis.motor)
        printed = self.profile.by_key
        self.od.load(
            {
                key: value
                for key, value in fallback.items()
                if key not in printed or printed[key].default_raw is None
            }
        )
        self.od.load(self._family.factory_values(self.mechanics, self.axis.motor))

    def power_cycle(self, off_s: float = 0.0) -> None:
        """Off for a time and on again; the shaft coasts meanwhile, the absolute zero stays."""
        self.axis.power_off()
        self._zero_rad = self.core.zero_rad
        if off_s > 0 and self._start_ns is not None:
            self.powered = False
            self._off_until_ns = self._start_ns + round(
                self.axis.s[k.S_STEP] * k.STEP_NS + off_s * 1e9
            )
        else:
            self._power_on()

    # --- time ------------------------------------------------------------------------------
    def advance(self, t_ns: int) -> None:
        """Compute everything up to ``t_ns``; events are handled in the step they happen."""
        if self._start_ns is None:
            self._start_ns = t_ns - round(float(self.axis.s[k.S_STEP]) * k.STEP_NS)
        if self._off_until_ns is not None:
            self._run_to(min(t_ns, self._off_until_ns))
            if t_ns < self._off_until_ns:
                return
            self._off_until_ns = None
            self.powered = True
            self._power_on()
        if self._reset_step is not None:
            reset_ns = self._start_ns + self._reset_step * k.STEP_NS
            if t_ns >= reset_ns:
                self._run_to(reset_ns)
                self._reset_step = None
                self.power_cycle(_BOOT_S)
                self.advance(t_ns)
                return
        self._run_to(t_ns)

    def _run_to(self, t_ns: int) -> None:
        axis = self.axis
        left = (t_ns - (self._start_ns or 0)) // k.STEP_NS - int(axis.s[k.S_STEP])
        while left > 0:
            left -= axis.run(left)
            events = axis.events
            if events and self._off_until_ns is None:
                self.control.on_events(events)

    # --- dictionary ------------------------------------------------------------------------
    def read(self, index: int, subindex: int) -> bytes:
        """Value of an object. Raises SdoAbort."""
        return self.od.read(index, subindex)

    def write(self, index: int, subindex: int, data: bytes) -> None:
        """Write an object. Raises SdoAbort with nothing changed."""
        self._write_entry(self.od.find(index, subindex), data)

    def _write_entry(self, entry: Entry, data: bytes) -> None:
        if entry.parameter.settable == "stopped" and self.axis.powered:
            raise SdoAbort(ABORT_DEVICE_STATE)
        self.od.write_entry(entry, data)
        self._autosave(entry)
        if entry.parameter.pdo in ("rx", "rxtx") and entry.key not in ("6040:00", "6060:00"):
            self._arrived()

    def _autosave(self, entry: Entry) -> None:
        """Families that store what is written: only this value, as their EEPROM does."""
        index = entry.parameter.index
        if index is None or entry.key in _VOLATILE:
            return
        for rule in self._family.traits.autosave:
            inside = rule.first_index <= index <= rule.last_index
            if inside and int(self.od.number(rule.key)) & rule.mask:
                self._store(self.nvm.load() | {entry.key: entry.value})
                return

    def read_register(self, register: int, count: int) -> list[int]:
        """Registers of the profile's table, 32-bit values in its word order."""
        return self._registers.read(register, count)

    def write_registers(self, register: int, values: Sequence[int]) -> None:
        """Write registers of the profile's table; all of a value's words at once."""
        self._registers.write(register, values, self._write_entry)

    def indices(self) -> Sequence[int]:
        """All object indices, ascending."""
        return self.od.indices()

    def subindices(self, index: int) -> Sequence[int]:
        """All subindices of an object, ascending. Raises SdoAbort."""
        return self.od.subindices(index)

    def entry(self, index: int, subindex: int) -> EntryInfo:
        """Description of an entry. Raises SdoAbort."""
        return self.od.info(index, subindex)

    # --- process data ----------------------------------------------------------------------
    def map_process_data(self, entries: Sequence[int], direction: str) -> ProcessImage:
        """Bind mapping entries for "rx" or "tx". Raises SdoAbort for what cannot be mapped."""
        limit = self.profile.pdo.max_bytes if self.profile.pdo else None
        parts = check_mapping(self.od, entries, direction, limit)
        return InputImage(parts) if direction == "tx" else OutputImage(parts, self._arrived)

    def _arrived(self) -> None:
        self.control.modes.on_cyclic()

    def _check_mapping_count(self, entry: Entry) -> Callable[[Raw], None]:
        index = entry.parameter.index or 0
        direction = "rx" if index < 0x1A00 else "tx"

        def check(count: Raw) -> None:
            number = int(count)
            limit = self.profile.pdo.max_entries if self.profile.pdo else 8
            if number > limit:
                raise SdoAbort(ABORT_VALUE_RANGE)
            mapped = [
                int(self.od.entries[index << 8 | sub].value) for sub in range(1, number + 1)
                if index << 8 | sub in self.od.entries
            ]  # fmt: skip
            if len(mapped) != number:
                raise SdoAbort(ABORT_VALUE_RANGE)
            self.map_process_data(mapped, direction)

        return check

    def _check_mapping_entry(self, entry: Entry) -> Callable[[Raw], None]:
        index = entry.parameter.index or 0
        direction = "rx" if index < 0x1A00 else "tx"

        def check(item: Raw) -> None:
            # Entries may be written only while the count is 0 (004:2137-2142, ETG.1000.6).
            if int(self.od.entries[index << 8].value) != 0:
                raise SdoAbort(ABORT_UNSUPPORTED)
            if int(item):
                check_mapping(self.od, [int(item)], direction, None)

        return check

    def _check_assignment(self, entry: Entry) -> Callable[[Raw], None]:
        index = entry.parameter.index or 0
        first = 0x1600 if index == 0x1C12 else 0x1A00

        def check(value: Raw) -> None:
            number = int(value)
            if entry.parameter.subindex == 0:
                if number > max(self.od.subindices(index)):
                    raise SdoAbort(ABORT_VALUE_RANGE)
                return
            if int(self.od.entries[index << 8].value) != 0:
                raise SdoAbort(ABORT_UNSUPPORTED)
            if number and not (first <= number < first + 0x200 and number << 8 in self.od):
                raise SdoAbort(ABORT_NOT_MAPPABLE)

        return check

    # --- reactions to writes ---------------------------------------------------------------
    def _connect(self) -> None:
        for key, getter in live_values(self.core, self.control, self.panel).items():
            if key in self.od.numbered:
                self.od.numbered[key].getter = getter
        special: dict[str, Callable[[Raw], None]] = {
            "6040:00": lambda value: self.control.set_control_word(int(value)),
            "6060:00": self._set_mode,
            "60FF:00": lambda _: self.control.modes.refresh(),
            "6071:00": lambda _: self.control.modes.refresh(),
            "60B8:00": lambda value: self.panel.set_probe_function(int(value)),
        }
        for key, actions in self._family.traits.commands.items():
            special[key] = self._command_setter(key, actions)
        for entry in self.od:
            parameter = entry.parameter
            index = parameter.index or 0
            if parameter.access == "ro":
                continue
            if entry.key in special:
                entry.setter = special[entry.key]
            elif 0x1600 <= index < 0x1C00:
                first = parameter.subindex == 0
                entry.setter = (
                    self._check_mapping_count(entry) if first else self._check_mapping_entry(entry)
                )
            elif index in (0x1C12, 0x1C13):
                entry.setter = self._check_assignment(entry)
            elif parameter.effective == "now":
                entry.setter = self._motion_object_changed

    def _motion_object_changed(self, _: Raw) -> None:
        self.core.units = self._family.units(self.od, self.core.motor)
        if not self.control.modes.homing.active:
            self.core.apply_motion()
        if not self.control.state.value & 0x08:
            self.control.modes.refresh()
        self.panel.update_probes()

    def _set_mode(self, value: Raw) -> None:
        mode = int(value)
        if mode not in self.profile.supported_modes and mode != 0:
            raise SdoAbort(ABORT_VALUE_RANGE)
        self.control.set_mode(mode)

    def _commands(self) -> dict[str, Callable[[], None]]:
        return {
            "save": self.save,
            "restore": self.restore,
            "zero": self.zero_position,
            "clear_history": self.control.clear_history,
            "reset": self._schedule_reset,
            "write_settings": self.write_settings,
            "fault_reset": self._reset_fault,
        }

    def _reset_fault(self) -> None:
        self.control.reset_fault()

    def _command_setter(self, key: str, actions: dict[int, str]) -> Callable[[Raw], None]:
        """Writing one of the printed values to ``key`` carries out its command."""
        commands = self._commands()
        traits = self._family.traits

        last = 0

        def command(value: Raw) -> None:
            nonlocal last
            before, last = last, int(value)
            # A trigger that stays acts on its change only (003:411-414).
            if last == 0 or (not traits.self_clearing and last == before):
                return
            name = actions.get(int(value))
            if name is None:
                raise SdoAbort(ABORT_VALUE_RANGE)
            commands[name]()
            if traits.self_clearing:
                last = 0
                self.od.put(key, 0)

        return command

    def _schedule_reset(self) -> None:
        """Reboot (004:2400), late enough that the wire can still answer the command."""
        self._reset_step = int(self.axis.s[k.S_STEP]) + _RESET_AFTER_STEPS

    def write_settings(self) -> None:
        """Written parameters come into use."""
        self.od.activate("write_settings")
        self.core.apply_settings()
        self.panel.update_probes()

    def save(self) -> None:
        """All writable parameters to the NVM; set-points and commands are not parameters."""
        values = {
            entry.key: entry.value
            for entry in self.od
            if entry.parameter.access == "rw" and entry.key not in _VOLATILE
        }
        self._store(values)

    def _store(self, values: dict[str, Raw]) -> None:
        try:
            self.nvm.save(values)
        except OSError:
            self.control.raise_fault(k.F_MEMORY)
            raise SdoAbort(ABORT_STORE) from None

    def restore(self) -> None:
        """Factory values, in use and in the NVM."""
        if self.axis.powered:
            raise SdoAbort(ABORT_DEVICE_STATE)
        try:
            self.nvm.save({})
        except OSError:
            raise SdoAbort(ABORT_STORE) from None
        for entry in self.od:
            if entry.parameter.access != "ro" and entry.key not in _VOLATILE:
                entry.value = entry.active = entry.default()
        self._load_factory()
        self.core.apply_settings()

    def zero_position(self) -> None:
        """The present position becomes zero; not while the servo is on."""
        if self.axis.powered:
            raise SdoAbort(ABORT_DEVICE_STATE)
        self.core.zero_rad = self.axis.angle_rad

    # --- trouble ---------------------------------------------------------------------------
    def communication_lost(self, reason: str) -> None:  # noqa: ARG002 - the seam's signature
        """The wire's watchdog fired or the network state fell."""
        self.control.communication_lost()

    def take_emergencies(self) -> list[Emergency]:
        """Emergencies since the last call."""
        taken = list(self.control.emergencies)
        self.control.emergencies.clear()
        return taken

    def inject(self, what: str, value: float = 1.0) -> None:
        """Trouble by name.

        A fault's name (``over_current`` … ``watchdog``) or 603Fh code (``0x7121``) latches it;
        ``encoder_loss`` (1/0), ``supply_v``, ``ambient_c``, ``temperature_c``, ``load_nm`` (extra
        constant torque) and ``coulomb_nm`` change the machine; ``di1`` … ``di4`` set terminals;
        ``power_off`` switches off for ``value`` seconds.
        """
        physics = {
            "supply_v": k.P_SUPPLY_V, "ambient_c": k.P_AMBIENT, "load_nm": k.P_GRAVITY,
            "coulomb_nm": k.P_COULOMB, "encoder_loss": k.P_ENCODER_DEAD,
        }  # fmt: skip
        if what in physics:
            self.axis.p[physics[what]] = value
        elif what == "temperature_c":
            self.axis.s[k.S_TEMPERATURE] = value
        elif what in _FAULT_NAMES:
            self.control.raise_fault(_FAULT_NAMES[what])
        elif what == "power_off":
            self.power_cycle(value)
        elif what in ("di1", "di2", "di3", "di4"):
            self._set_terminal(int(what[2]) - 1, value > 0)
        else:
            self.control.raise_fault(self._fault_by_code(what))

    def _set_terminal(self, terminal: int, level: bool) -> None:
        before = self.panel.alarm_reset_input()
        self.panel.external[terminal] = level
        self.panel.update_probes()
        if self.panel.alarm_reset_input() and not before:
            self.control.reset_fault()

    def _fault_by_code(self, what: str) -> int:
        try:
            code = int(what, 0)
        except ValueError:
            raise ValueError(f"a virtual drive knows no trouble named {what!r}") from None
        for bit, info in self._family.traits.faults.items():
            if info.code == code:
                return bit
        raise ValueError(f"{self.profile.drive} has no fault with code {what}")
