"""Digital terminals, outputs and the touch probe of one drive (004:1966-2033, 004:4626-4695)."""

from __future__ import annotations

from drivers.virtual.firmware import kernel as k
from drivers.virtual.firmware.core import Core

_INPUTS = 4
_PROBE_FUNCTION = 4  # of DI1 (probe 1) and DI2 (probe 2), 004:6480, 004:6492
_ALARM_RESET = 4  # of DI3, 004:6500


class Panel:
    """Levels of the terminals. ``external`` holds levels set from outside the mechanics."""

    def __init__(self, core: Core) -> None:
        self._core = core
        self.external = [False] * _INPUTS
        self.target_reached = False
        self.alarm = False
        self._resetting = False
        self._probe_levels = [False, False]
        self._probe_status = 0
        self._probe_function = 0
        self._latched = {"60BA:00": 0, "60BB:00": 0, "60BC:00": 0, "60BD:00": 0}

    def _number(self, key: str) -> int:
        return int(self._core.number(key))

    def _function(self, terminal: int) -> int:
        return self._number(f"2030:{terminal + 1:02X}")

    def terminal_valid(self, terminal: int, *, simulated: bool) -> bool:
        """Logic of an input: after polarity and, if asked, after simulation (2031h)."""
        if simulated and self._number("2031:02") >> terminal & 1:
            return bool(self._number("2031:03") >> terminal & 1)
        signal = {1: k.SIG_NEGATIVE, 2: k.SIG_POSITIVE, 3: k.SIG_HOME}.get(self._function(terminal))
        if signal is None:
            return self.external[terminal]
        physical = self._physical() & signal != 0
        return physical != bool(self._number("2031:01") >> terminal & 1)

    def _physical(self) -> int:
        """Switches as the mechanics presses them."""
        axis = self._core.axis
        angle = float(axis.s[k.S_THETA])
        pressed = k.SIG_NEGATIVE if angle <= axis.p[k.P_LIMIT_NEGATIVE] else 0
        pressed |= k.SIG_POSITIVE if angle >= axis.p[k.P_LIMIT_POSITIVE] else 0
        inside = axis.p[k.P_HOME_FROM] <= angle <= axis.p[k.P_HOME_TO]
        return pressed | (k.SIG_HOME if inside else 0)

    def digital_inputs(self) -> int:
        """60FDh: functions in bits 0–2, inputs in 16–19, outputs in 24/25 (004:7700-7728).

        Simulation does not show here (004:2014-2015).
        """
        word = 0
        for terminal in range(_INPUTS):
            if self.terminal_valid(terminal, simulated=False):
                word |= 1 << (16 + terminal)
                function = self._function(terminal)
                if 1 <= function <= 3:
                    word |= 1 << (function - 1)
        return word | self.outputs() << 24

    def outputs(self) -> int:
        """Logic of DO1 and DO2: forced (60FEh), simulated (2031h) or by function (2030h)."""
        forced, mask = self._number("60FE:01"), self._number("60FE:02")
        simulated, values = self._number("2031:02"), self._number("2031:03")
        word = 0
        for output in range(2):
            if mask >> (16 + output) & 1:
                on = bool(forced >> (16 + output) & 1)
            elif simulated >> (8 + output) & 1:
                on = bool(values >> (8 + output) & 1)
            else:
                on = self.alarm if self._number(f"2030:{5 + output:02X}") == 1 else (
                    self.target_reached
                )  # fmt: skip
            word |= on << output
        return word

    def update(self) -> bool:
        """Something at the terminals may have changed; True asks for a fault reset (DI3)."""
        self._update_probes()
        before, self._resetting = self._resetting, self._alarm_reset_input()
        return self._resetting and not before

    def _alarm_reset_input(self) -> bool:
        return self._function(2) == _ALARM_RESET and self.terminal_valid(2, simulated=True)

    # --- touch probe -----------------------------------------------------------------------
    def set_probe_function(self, word: int) -> None:
        """60B8h: enabling anew forgets what was latched."""
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
        """60B9h."""
        return self._probe_status | (self._probe_function & 0x0101)

    def latched(self, key: str) -> int:
        """60BAh to 60BDh."""
        return self._latched[key]
