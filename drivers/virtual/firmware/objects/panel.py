"""Digital terminals, outputs and the touch probe of one drive (004:1966-2033, 004:4626-4695)."""

from __future__ import annotations

from drivers.virtual.firmware.core import Core
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.objects.dictionary import Number

_INPUTS, _OUTPUTS = 4, 2
_PROBE_FUNCTION = 4  # of DI1 (probe 1) and DI2 (probe 2), 004:6480, 004:6492
_ALARM_RESET = 4  # of DI3, 004:6500
_SIGNALS: dict[Number, int] = {1: k.SIG_NEGATIVE, 2: k.SIG_POSITIVE, 3: k.SIG_HOME}


class Panel:
    """Levels of the terminals. ``external`` contains levels set from outside the mechanics."""

    def __init__(self, core: Core) -> None:
        self._core = core
        cell = core.od.cell
        self._functions = [cell(f"2030:{n:02X}") for n in range(1, _INPUTS + _OUTPUTS + 1)]
        self._polarity = cell("2031:01")
        self._simulated, self._simulation = cell("2031:02"), cell("2031:03")
        self._forced, self._mask = cell("60FE:01"), cell("60FE:02")
        self.external = [False] * _INPUTS
        self.target_reached = False
        self.alarm = False
        self._resetting = False
        self._probe_levels = [False, False]
        self._probe_status = 0
        self._probe_function = 0
        self._latched = {"60BA:00": 0, "60BB:00": 0, "60BC:00": 0, "60BD:00": 0}

    def _function(self, terminal: int) -> int:
        return int(self._functions[terminal].active)

    def terminal_valid(self, terminal: int, *, simulated: bool) -> bool:
        """Return the logic level of an input: after polarity and optionally simulation (2031h)."""
        if simulated and int(self._simulated.active) >> terminal & 1:
            return bool(int(self._simulation.active) >> terminal & 1)
        return self._levels()[terminal]

    def _levels(self) -> list[bool]:
        """Return the logic levels of all inputs after polarity."""
        physical, polarity = self._physical(), int(self._polarity.active)
        levels = list(self.external)
        for terminal in range(_INPUTS):
            signal = _SIGNALS.get(self._functions[terminal].active)
            if signal is not None:
                levels[terminal] = bool(physical & signal) is not bool(polarity >> terminal & 1)
        return levels

    def _physical(self) -> int:
        """Return the switches activated by the mechanics."""
        axis = self._core.axis
        angle, limit = axis.s.item(k.S_THETA), axis.p.item
        pressed = k.SIG_NEGATIVE if angle <= limit(k.P_LIMIT_NEGATIVE) else 0
        pressed |= k.SIG_POSITIVE if angle >= limit(k.P_LIMIT_POSITIVE) else 0
        inside = limit(k.P_HOME_FROM) <= angle <= limit(k.P_HOME_TO)
        return pressed | (k.SIG_HOME if inside else 0)

    def digital_inputs(self) -> int:
        """Return 60FDh: functions in bits 0–2, inputs 16–19, outputs 24/25 (004:7700-7728).

        Simulation is not shown here (004:2014-2015).
        """
        word = 0
        for terminal, level in enumerate(self._levels()):
            if level:
                word |= 1 << (16 + terminal)
                function = self._function(terminal)
                if 1 <= function <= 3:
                    word |= 1 << (function - 1)
        return word | self.outputs() << 24

    def outputs(self) -> int:
        """Return DO1 and DO2: forced (60FEh), simulated (2031h) or by function (2030h)."""
        forced, mask = int(self._forced.active), int(self._mask.active)
        simulated, values = int(self._simulated.active), int(self._simulation.active)
        word = 0
        for output in range(_OUTPUTS):
            if mask >> (16 + output) & 1:
                on = bool(forced >> (16 + output) & 1)
            elif simulated >> (8 + output) & 1:
                on = bool(values >> (8 + output) & 1)
            else:
                on = self.alarm if self._function(_INPUTS + output) == 1 else self.target_reached
            word |= on << output
        return word

    def update(self) -> bool:
        """Update after a possible change at the terminals; True requests a fault reset (DI3)."""
        self._update_probes()
        before, self._resetting = self._resetting, self._alarm_reset_input()
        return self._resetting and not before

    def _alarm_reset_input(self) -> bool:
        return self._function(2) == _ALARM_RESET and self.terminal_valid(2, simulated=True)

    # --- touch probe -----------------------------------------------------------------------
    def set_probe_function(self, word: int) -> None:
        """Apply 60B8h: enabling again clears the latched state."""
        rising = word & ~self._probe_function
        for probe, shift in ((0, 0), (1, 8)):
            if rising >> shift & 1 or not word >> shift & 1:
                self._probe_status &= ~(0x7 << shift)
            self._probe_levels[probe] = self._probe_level(probe)
        self._probe_function = word

    def _probe_level(self, probe: int) -> bool:
        if self._function(probe) != _PROBE_FUNCTION:
            return False
        return self.terminal_valid(probe, simulated=True)

    def _update_probes(self) -> None:
        position = round(self._core.position_of(self._core.axis.angle_rad))
        for probe, shift, keys in ((0, 0, ("60BA:00", "60BB:00")), (1, 8, ("60BC:00", "60BD:00"))):
            level = self._probe_level(probe)
            if level == self._probe_levels[probe]:
                continue
            self._probe_levels[probe] = level
            function = self._probe_function >> shift
            edge = 0 if level else 1
            done = 2 << edge << shift
            continuous = bool(function & 2)
            wanted = function & 1 and function & (0x10 << edge)
            if wanted and (continuous or not self._probe_status & done):
                self._latched[keys[edge]] = position
                self._probe_status |= done

    def probe_status(self) -> int:
        """Return 60B9h."""
        return self._probe_status | (self._probe_function & 0x0101)

    def latched(self, key: str) -> int:
        """Return one of 60BAh to 60BDh."""
        return self._latched[key]
