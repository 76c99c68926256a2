"""Terminals and touch probes of families whose terminals are tables of functions."""

from __future__ import annotations

from collections.abc import Callable

from drivers.virtual.firmware.cia402.states import State
from drivers.virtual.firmware.cia402.terminals import (
    InputPin,
    InputUse,
    Output,
    OutputUse,
    TerminalTable,
)
from drivers.virtual.firmware.control import DeviceControl
from drivers.virtual.firmware.core import Core
from drivers.virtual.firmware.kernel import layout as k

_LATCHES = ("60BA:00", "60BB:00", "60BC:00", "60BD:00")


class Terminals:
    """Levels of the terminals. ``external`` contains levels set from outside the mechanics."""

    def __init__(self, core: Core, control: DeviceControl, table: TerminalTable) -> None:
        self._core = core
        self._control = control
        self._table = table
        self._pins = tuple(InputPin(each, table, core.od) for each in table.inputs)
        self.external = [False] * len(table.inputs)
        self._before: dict[InputUse, bool] = {}
        self._probe_function = 0
        self._probe_status = 0
        self._probe_levels = [False, False]
        self._index_count = float(core.axis.s[k.S_INDEX_COUNT])
        self._latched = dict.fromkeys(_LATCHES, 0)
        self._counts = [0, 0, 0, 0]
        self._cyclic = False
        self._kept = 0
        control.faults.levels = lambda: (self.input_bits(), self.output_bits())

    # --- inputs ----------------------------------------------------------------------------
    def level(self, place: int) -> bool:
        """Return the logic level of an input: after polarity and forcing."""
        return self._pins[place].level(self.external[place], self._pressed())

    def _pressed(self) -> int:
        """Return the switches activated by the mechanics."""
        axis = self._core.axis
        angle, limit = axis.s.item(k.S_THETA), axis.p.item
        pressed = k.SIG_NEGATIVE if angle <= limit(k.P_LIMIT_NEGATIVE) else 0
        pressed |= k.SIG_POSITIVE if angle >= limit(k.P_LIMIT_POSITIVE) else 0
        inside = limit(k.P_HOME_FROM) <= angle <= limit(k.P_HOME_TO)
        return pressed | (k.SIG_HOME if inside else 0)

    def active(self, use: InputUse) -> bool:
        """Return whether any input with this function is on."""
        return any(pin.use == use and self.level(place) for place, pin in enumerate(self._pins))

    def input_bits(self) -> int:
        """Return the inputs as bits, starting with the first."""
        return sum(self.level(place) << place for place in range(len(self._table.inputs)))

    def digital_inputs(self) -> int:
        """Return 60FDh."""
        signals = int(self._core.axis.s[k.S_SIGNALS]) & 7
        if self._core.family.traits.limit_bits_swapped:
            signals = signals & 4 | (signals & 1) << 1 | signals >> 1 & 1
        word = signals
        pressed = self._pressed()
        for pin, external in zip(self._pins, self.external, strict=True):
            if pin.bit is not None:
                word |= pin.level(external, pressed) << pin.bit
        if self._table.probe_bits is not None:
            word |= self.active("probe1") << self._table.probe_bits[0]
            word |= self.active("probe2") << self._table.probe_bits[1]
        return word

    # --- outputs ---------------------------------------------------------------------------
    def _shows(self, use: OutputUse | None) -> bool:
        control, s = self._control, self._core.axis.s
        faulty = control.state in (State.FAULT, State.FAULT_REACTION)
        known: dict[OutputUse, Callable[[], bool]] = {
            "ready": lambda: not faulty,
            "running": lambda: control.state is State.OPERATION_ENABLED,
            "fault": lambda: faulty,
            "no_fault": lambda: not faulty,
            "warning": lambda: control.faults.warning,
            "zero_speed": lambda: bool(s[k.S_ZERO_T] > 0),
            "in_position": lambda: bool(s[k.S_POSITION_T] > 0),
            "homed": lambda: control.homed,
            "brake": lambda: control.brake.released,
            "target": lambda: bool(control.status_word() & 1 << 10),
            "on": lambda: True,
        }
        shown = known.get(use) if use is not None else None
        return shown is not None and shown()

    def cycle(self, *, carries_outputs: bool) -> None:
        """Handle the arrival of process data, with or without 60FEh.

        Outputs may then follow the bus; the brake of an EP3E only if 60FEh was included.
        """
        self._cyclic = True
        if carries_outputs and self._core.family.traits.brake_by_bus:
            value, mask = self._bus_outputs()
            faulty = self._control.state in (State.FAULT, State.FAULT_REACTION)
            self._control.brake.follow_bus(bool(value & 1) or faulty if mask & 1 else None)

    def bus_lost(self) -> None:
        """Keep or switch off outputs when process data end, by P20.27 (000:3124-3132)."""
        if not self._cyclic:
            return
        value, mask = self._bus_outputs()
        off = 0 if self._table.keep_key is None else int(self._core.number(self._table.keep_key))
        self._kept = value & mask & ~(off << 16)
        self._cyclic = False

    def _bus_outputs(self) -> tuple[int, int]:
        """Return 60FEh:01 and its mask."""
        return int(self._core.number("60FE:01")), int(self._core.number("60FE:02"))

    def _forced(self, terminal: Output, use: OutputUse | None) -> bool | None:
        """Return the level that the bus sets for an output, None if the drive controls it."""
        table, (value, mask) = self._table, self._bus_outputs()
        if terminal.bit is None or (table.bus_outputs_need_function and use != "bus"):
            return None
        if table.masks_outputs and not mask >> terminal.bit & 1:
            return None
        if table.bus_outputs_need_cycles and not self._cyclic:
            value = self._kept
        return bool(value >> terminal.bit & 1)

    def output_bits(self) -> int:
        """Return the outputs as bits, starting with the first, forced by 60FEh if masked."""
        core = self._core
        bits = 0
        for place, terminal in enumerate(self._table.outputs):
            use = self._table.output_use(terminal, core.od)
            forced = self._forced(terminal, use)
            if forced is not None:
                on = forced
            else:
                on = self._shows(use)
                if terminal.logic is not None and terminal.logic.inverted(core.od):
                    on = not on
            bits |= on << place
        return bits

    # --- reactions -------------------------------------------------------------------------
    def update(self) -> bool:
        """Update after a possible change; True requests a fault reset."""
        self._update_probes()
        uses: tuple[InputUse, ...] = ("reset", "emergency", "gain", "fault")
        now: dict[InputUse, bool] = {use: self.active(use) for use in uses}
        before, self._before = self._before, now
        self._core.axis.p[k.P_SWITCH_INPUT] = float(now["gain"])
        if now["emergency"] != before.get("emergency", False):
            warning = self._core.family.traits.emergency_warning
            self._control.alarms.warn(warning, now["emergency"])
            self._control.emergency_stop(now["emergency"])
        if now["fault"] and not before.get("fault", False):
            fault = self._control.alarms.find("Er.043")
            if fault is not None:
                self._control.faults.raise_entry(fault)
        self._control.jog.update(
            forward=self.active("jog_forward"), backward=self.active("jog_backward")
        )
        return now["reset"] and not before.get("reset", False)

    # --- touch probes ----------------------------------------------------------------------
    def set_probe_function(self, word: int) -> None:
        """Apply 60B8h: enabling again clears the latched state."""
        rising = word & ~self._probe_function
        for probe, shift in ((0, 0), (1, 8)):
            if rising >> shift & 1 or not word >> shift & 1:
                self._probe_status &= ~(0x7 << shift)
            self._probe_levels[probe] = self.active("probe2" if probe else "probe1")
        self._index_count = float(self._core.axis.s[k.S_INDEX_COUNT])
        self._probe_function = word

    def _update_probes(self) -> None:
        core = self._core
        here = round(core.position_of(core.axis.angle_rad))
        count = float(core.axis.s[k.S_INDEX_COUNT])
        passed, self._index_count = count != self._index_count, count
        index = round(core.position_of(float(core.axis.s[k.S_INDEX_ANGLE])))
        for probe, shift in ((0, 0), (1, 8)):
            function = self._probe_function >> shift
            level = self.active("probe2" if probe else "probe1")
            changed = level != self._probe_levels[probe]
            self._probe_levels[probe] = level
            if function & 4:  # the encoder's index instead of an input
                if passed:
                    self._latch(probe, 0, shift, index)
            elif changed:
                self._latch(probe, 0 if level else 1, shift, here)

    def _latch(self, probe: int, edge: int, shift: int, position: int) -> None:
        function = self._probe_function >> shift
        done = 2 << edge << shift
        if not (function & 1 and function & 0x10 << edge):
            return
        if not function & 2 and self._probe_status & done:
            return
        place = 2 * probe + edge
        self._latched[_LATCHES[place]] = position
        self._counts[place] = self._counts[place] + 1 & 0xFFFF
        self._probe_status |= done

    def probe_status(self) -> int:
        """Return 60B9h."""
        return self._probe_status | (self._probe_function & 0x0101)

    def latched(self, key: str) -> int:
        """Return one of 60BAh to 60BDh."""
        return self._latched[key]

    def latch_count(self, place: int) -> int:
        """Return one of 60D5h to 60D8h of the R6L."""
        return self._counts[place]
