"""A virtual servo drive: the `Device` that every wire serves."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final, Protocol

from drivers.virtual.device import (
    ABORT_DEVICE_STATE,
    ABORT_READ_ONLY,
    ABORT_STORE,
    ABORT_VALUE_RANGE,
    EntryInfo,
    ProcessImage,
    SdoAbort,
)
from drivers.virtual.firmware.axis import VirtualAxis
from drivers.virtual.firmware.cia402.base import Family
from drivers.virtual.firmware.control import DeviceControl
from drivers.virtual.firmware.core import Core
from drivers.virtual.firmware.failures.alarms import FaultLog
from drivers.virtual.firmware.failures.faults import Emergency
from drivers.virtual.firmware.failures.trouble import make_trouble
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.live import live_values
from drivers.virtual.firmware.motion.automatic import Automatic
from drivers.virtual.firmware.motion.commands import Commands
from drivers.virtual.firmware.objects.dictionary import Entry, ObjectDictionary
from drivers.virtual.firmware.objects.mapping import MappingRules
from drivers.virtual.firmware.objects.panel import Panel
from drivers.virtual.firmware.objects.process_data import InputImage, OutputImage, check_mapping
from drivers.virtual.firmware.objects.registers import RegisterTable
from drivers.virtual.firmware.objects.storage import Storage
from drivers.virtual.firmware.terminals import Terminals
from drivers.virtual.mechanics import MechanicsSpec
from profiles.schema import Profile, Raw

_RESET_AFTER_STEPS: Final = 400
"""20 ms from the reset command to the reset, so that the wire can still answer it."""
_BOOT_S: Final = 0.3
_OUTPUTS: Final = 0x60FE01
#: Setpoints that the cyclic modes and bit 4 of the control word read by themselves.
_FETCHED: Final = frozenset({"607A:00", "60B0:00", "60B1:00", "60B2:00", "60FE:01", "60FE:02"})
_OPTION_CODES: Final = frozenset({"605A:00", "605B:00", "605C:00", "605D:00", "605E:00"})
#: Standard objects that change the loop settings, not only windows and limits.
_UNIT_OBJECTS: Final = frozenset({0x6065, 0x6066, 0x607E, 0x608F, 0x6091, 0x6092})


class SteppedTogether(Protocol):
    """Several axes on one machine, which are stepped together."""

    def begin(self, start_ns: int) -> None:
        """Start the clock of all of them."""

    def run(self, steps: int) -> int:
        """Advance all by up to ``steps`` of 50 µs and let each drive react; return those done."""


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
        self.od = ObjectDictionary(profile, station)
        self._storage = Storage(profile, family, self.od, mechanics, self.axis.motor, nvm_path)
        self._family = family
        self._registers = RegisterTable(profile, self.od)
        self._watches_terminals = family.traits.assigns_terminals or family.terminals is not None
        self._zero_rad = 0.0
        self._log = FaultLog(family.traits.history_size)
        self._start_ns: int | None = None
        self._off_until_ns: int | None = None
        self._reset_step: int | None = None
        self._maps_outputs = False
        #: Steps this axis together with another one on the same beam; None for an axis of its own.
        self.stepped: SteppedTogether | None = None
        self._power_on()

    # --- power -----------------------------------------------------------------------------
    def _power_on(self) -> None:
        self._storage.power_on()
        self.axis.power_off()
        self.axis.clear_faults()
        self.axis.set_alarm(None)
        self.core = Core(self.profile, self._family, self.od, self.axis)
        self.core.zero_rad = self._zero_rad
        self.control = DeviceControl(self.core, self._log)
        self.control.modes.mode = int(self.core.number("6060:00", 0))
        table = self._family.terminals
        self.panel: Panel | Terminals = (
            Panel(self.core) if table is None else Terminals(self.core, self.control, table)
        )
        self.core.apply_settings()
        self._connect()
        if self._storage.nvm.damaged:
            self.control.faults.raise_bits(k.F_MEMORY)

    def power_cycle(self, off_s: float = 0.0) -> None:
        """Switch off for a time and on again; the shaft coasts, the absolute zero is kept."""
        self.axis.power_off()
        self._zero_rad = self.core.zero_rad
        if off_s > 0 and self._start_ns is not None:
            self.powered = False
            now_ns = self._start_ns + int(self.axis.s[k.S_STEP]) * k.STEP_NS
            self._off_until_ns = now_ns + round(off_s * 1e9)
        else:
            self._power_on()

    def _schedule_reset(self) -> None:
        self._reset_step = int(self.axis.s[k.S_STEP]) + _RESET_AFTER_STEPS

    # --- time ------------------------------------------------------------------------------
    def advance(self, t_ns: int) -> None:
        """Compute everything up to ``t_ns``; events are handled in the step in which they occur."""
        if self._start_ns is None:
            self._start_ns = t_ns - int(self.axis.s[k.S_STEP]) * k.STEP_NS
            if self.stepped is not None:
                self.stepped.begin(self._start_ns)
        if self._reset_step is not None:
            reset_ns = self._start_ns + self._reset_step * k.STEP_NS
            if t_ns < reset_ns:
                self._run_to(t_ns)
                return
            self._run_to(reset_ns)
            self._reset_step = None
            self.power_cycle(_BOOT_S)
        if self._off_until_ns is not None:
            self._run_to(min(t_ns, self._off_until_ns))
            if t_ns < self._off_until_ns:
                return
            self._off_until_ns = None
            self.powered = True
            self._power_on()
        self._run_to(t_ns)

    def _run_to(self, t_ns: int) -> None:
        axis = self.axis
        left = (t_ns - (self._start_ns or 0)) // k.STEP_NS - int(axis.s.item(k.S_STEP))
        while left > 0:
            left -= axis.run(left) if self.stepped is None else self.stepped.run(left)
            if self.stepped is None:
                self.take_events()

    def take_events(self) -> None:
        """React to the events that ended the last run of the loop."""
        events = self.axis.events
        if events and self._off_until_ns is None:
            self.control.on_events(events)

    def begin(self, start_ns: int) -> None:
        """Start the clock with that of an axis stepped together with this one."""
        self._start_ns = start_ns

    # --- dictionary ------------------------------------------------------------------------
    def read(self, index: int, subindex: int) -> bytes:
        """Return the value of an object. Raises SdoAbort."""
        if self._commands.store is not None:
            self._commands.store.guard()
        return self.od.read(index, subindex)

    def write(self, index: int, subindex: int, data: bytes) -> None:
        """Write an object. Raises SdoAbort with nothing changed."""
        if self._commands.store is not None:
            self._commands.store.guard()
        self._write_entry(self.od.find(index, subindex), data)

    def _write_entry(self, entry: Entry, data: bytes) -> None:
        if entry.parameter.settable == "stopped" and self.axis.powered:
            raise SdoAbort(ABORT_DEVICE_STATE)
        self._check_protection(entry)
        try:
            self.od.write_entry(entry, data)
            self._storage.autosave(entry)
        except SdoAbort as refused:
            if refused.code == ABORT_STORE:
                self.control.faults.raise_bits(k.F_MEMORY)
            raise
        if self._commands.load is not None and entry.key == "6040:00":
            self._commands.load.stop()  # a command ends the drive's own identification motion
        if entry.parameter.effective == "stopped" and not self.axis.powered:
            entry.active = entry.value
            self.core.apply_settings()
        if entry.parameter.pdo in ("rx", "rxtx"):
            self.control.modes.on_cyclic()
        self._terminals_changed()

    def _check_protection(self, entry: Entry) -> None:
        """Check the parameter that protects others from being written (P02.21, 000:3248)."""
        protect = self._family.traits.write_protect
        if protect is None or not 0x2000 <= (entry.parameter.index or 0) < 0x6000:
            return
        open_keys = protect[1].get(int(self.od.number(protect[0])))
        if open_keys is not None and entry.key not in open_keys:
            raise SdoAbort(ABORT_READ_ONLY)

    def read_register(self, register: int, count: int) -> list[int]:
        """Return registers of the profile's table, 32-bit values in its word order."""
        return self._registers.read(register, count)

    def write_registers(self, register: int, values: Sequence[int]) -> None:
        """Write registers of the profile's table; all of a value's words at once."""
        self._registers.write(register, values, self._write_entry)

    def indices(self) -> Sequence[int]:
        """Return all object indices, ascending."""
        return self.od.indices()

    def subindices(self, index: int) -> Sequence[int]:
        """Return all subindices of an object, ascending. Raises SdoAbort."""
        return self.od.subindices(index)

    def entry(self, index: int, subindex: int) -> EntryInfo:
        """Return the description of an entry. Raises SdoAbort."""
        return self.od.info(index, subindex)

    # --- process data ----------------------------------------------------------------------
    def map_process_data(self, entries: Sequence[int], direction: str) -> ProcessImage:
        """Bind mapping entries for "rx" or "tx". Raises SdoAbort for what cannot be mapped."""
        limit = self.profile.pdo.max_bytes if self.profile.pdo else None
        parts = check_mapping(self.od, entries, direction, limit)
        if direction == "tx":
            return InputImage(parts)
        self._maps_outputs = any(item >> 8 == _OUTPUTS for item in entries)
        return OutputImage(parts, self.od, self._outputs_arrived)

    def _outputs_arrived(self) -> None:
        if isinstance(self.panel, Terminals):
            self.panel.cycle(carries_outputs=self._maps_outputs)
        self.control.modes.on_cycle()

    # --- reactions to writes ---------------------------------------------------------------
    def _connect(self) -> None:
        for key, getter in live_values(self.core, self.control, self.panel).items():
            if key in self.od.numbered:
                self.od.numbered[key].getter = getter
        commands = Commands(self.core, self.control, self._storage, self._schedule_reset)
        self._commands = commands
        self._automatic = Automatic(self.core)
        special: dict[str, Callable[[Raw], None]] = {
            "6040:00": lambda value: self.control.set_control_word(int(value)),
            "6060:00": self._set_mode,
            "60FF:00": lambda _: self.control.modes.refresh(),
            "6071:00": lambda _: self.control.modes.refresh(),
            "60B8:00": lambda value: self.panel.set_probe_function(int(value)),
            **commands.setters(),
        }
        rules = MappingRules(self.od, self.profile)
        for entry in self.od:
            if entry.parameter.access == "ro":
                continue
            entry.setter = special.get(entry.key) or rules.check_for(entry)
            if entry.setter is None and entry.parameter.effective == "now":
                entry.setter = self._reaction(entry)

    def _reaction(self, entry: Entry) -> Callable[[Raw], None] | None:
        """Return the reaction to an ordinary parameter that acts at once."""
        if entry.key in _FETCHED:
            return None
        listed = self._family.traits.listed_options_only and bool(entry.parameter.enum)
        if listed and entry.key in _OPTION_CODES:
            return self._listed_option(entry)
        index = entry.parameter.index or 0
        if index < 0x6000 or index in _UNIT_OBJECTS:
            return self._setting_changed
        return self._motion_object_changed

    def _listed_option(self, entry: Entry) -> Callable[[Raw], None]:
        """Return a check for values listed in the manual (M6-L 000:3017, EP3E 001:885)."""

        def check(value: Raw) -> None:
            if int(value) not in entry.parameter.enum:
                raise SdoAbort(ABORT_VALUE_RANGE)

        return check

    def _setting_changed(self, _: Raw) -> None:
        self._automatic.settings_changed()
        self.core.apply_settings()
        self.control.modes.refresh()

    def _motion_object_changed(self, _: Raw) -> None:
        self.core.apply_motion()
        self.control.modes.refresh()

    def _set_mode(self, value: Raw) -> None:
        mode = int(value)
        if mode not in self.profile.supported_modes and mode != 0:
            raise SdoAbort(ABORT_VALUE_RANGE)
        self.control.set_mode(mode)

    def _terminals_changed(self) -> None:
        if self._watches_terminals and self.panel.update():
            self.control.faults.reset()

    # --- failures --------------------------------------------------------------------------
    def communication_lost(self, reason: str) -> None:  # noqa: ARG002 - the seam's signature
        """React when the wire's watchdog expired or the network state fell."""
        if isinstance(self.panel, Terminals):
            self.panel.bus_lost()
        self.control.communication_lost()

    def network_started(self) -> None:
        """Apply pending gear settings.

        Only in families where they become active with the network (001:1002, 001:1036).
        """
        if not self._family.traits.acts_with_network or self.axis.powered:
            return
        self.od.activate("power_cycle")
        self.core.apply_settings()
        fault = self.control.alarms.find(self._family.gear_fault(self.od) or "")
        if fault is not None:
            self.control.faults.raise_entry(fault)

    def take_emergencies(self) -> list[Emergency]:
        """Return emergencies since the last call."""
        waiting = self.control.faults.emergencies
        if not waiting:
            return []
        taken = list(waiting)
        waiting.clear()
        return taken

    @property
    def shaft_rev(self) -> float:
        """See `drivers.virtual.device.HasShaft`."""
        return self.axis.angle_rad / (2.0 * math.pi)

    def inject(self, what: str, value: float = 1.0) -> None:
        """Cause a failure by name.

        A fault's name (``over_current`` … ``watchdog``), its code in the profile's table
        (``Er.013``, ``AL.247`` …) or in 603Fh (``0x7121``) latches it; a warning's code shows it;
        ``encoder_loss`` (1/0), ``supply_v``, ``ambient_c``, ``temperature_c``, ``load_nm`` (the
        constant torque of gravity) and ``coulomb_nm`` change the machine; ``turn_to_rev`` turns the
        shaft by hand; ``di1`` … set terminals without a switch; ``power_off`` switches off for
        ``value`` seconds.

        Raises:
            ValueError: this drive does not support this failure.
        """
        if what == "power_off":
            self.power_cycle(value)
            return
        make_trouble(self.core, self.control, self.panel, what, value)
        self._terminals_changed()
