"""Automatic settings of a drive: gains from a rigidity level, notches from a detected resonance,
the command notch from a detected load oscillation.

M6-L: P09.06, P09.07 (000:3423), P09.08 and P09.22 (000:3427, 000:3444). R6L: P07.00, P07.01
(002:11088-11109), P07.11 (002:11168). Neither manual prints its table of levels: the bandwidths are
those that the MMS7's manual prints for its 32 levels (table 38, 004:3003). How a resonance is found
is not printed either: here it is the strongest line of the torque command above 80 Hz.

P09.25 (000:3447-3450): after a move the position deviation is monitored; if it oscillates by more
than P09.28, its frequency becomes P09.26. The method and the time are not printed.
"""

from __future__ import annotations

import math

import numpy as np

from drivers.virtual.firmware.cia402.keys import FoundNotchKeys, SwingKeys
from drivers.virtual.firmware.core import Core
from drivers.virtual.firmware.kernel import layout as k
from profiles.loader import load_profile

_LOWEST_HZ = 80.0
_PERIOD_S = 0.25
_SWING_SAMPLE_S = 0.002
_SWING_SAMPLES = 400
"""0.8 s: two periods of an oscillation at 2.5 Hz."""


class Automatic:
    """Runs the two functions; called after settings have changed and by its own timer."""

    def __init__(self, core: Core) -> None:
        self._core = core
        self._axis = core.axis
        self._rigidity = core.family.traits.rigidity
        self._notches = core.family.traits.found_notches
        self._level: tuple[int, int] | None = None
        known = core.profile.by_key
        if self._rigidity is not None and self._rigidity.level not in known:
            self._rigidity = None
        if self._notches is not None and self._notches.mode in known:
            core.schedule.after(_PERIOD_S, self._listen)
        swing = core.family.traits.swing
        self._swing = swing if swing is not None and swing.mode in known else None
        self._deviations: list[float] = []
        if self._swing is not None:
            core.schedule.after(_PERIOD_S, self._watch_swing)

    def settings_changed(self) -> None:
        """Apply a new rigidity level."""
        keys = self._rigidity
        if keys is None:
            return
        mode, level = int(self._core.number(keys.mode)), int(self._core.number(keys.level))
        if (mode, level) == self._level:
            return
        self._level = (mode, level)
        if mode not in keys.on:
            return
        position_hz, speed_hz, integral_hz = load_profile(keys.levels_of).stiffness[0].rows[level]
        for gains, factor in ((keys.first, 1.0), (keys.second, 1.2 if mode == 2 else 1.0)):
            self._put(gains[0], position_hz * factor)
            self._put(gains[1], speed_hz)
            self._put_raw(gains[2], 1000 / (2 * math.pi * integral_hz))

    def _put(self, key: str, hertz: float) -> None:
        unit = self._core.profile.by_key[key].unit
        self._put_raw(key, hertz if "Hz" in unit else 2 * math.pi * hertz)

    def _put_raw(self, key: str, value: float) -> None:
        parameter = self._core.profile.by_key[key]
        low, high = parameter.raw_limits
        raw = parameter.to_raw(value)
        self._core.od.put(key, min(max(raw, low or 0), raw if high is None else high))

    # --- resonances ------------------------------------------------------------------------
    def _listen(self) -> None:
        keys = self._notches
        if keys is None:
            return
        mode = int(self._core.number(keys.mode))
        if mode == keys.restore:
            for frequency, width in keys.notches:
                self._restore(frequency)
                self._restore(width)
            self._core.od.put(keys.mode, 0)
            self._core.apply_settings()
        elif mode in keys.count and self._axis.powered:
            found = self._resonance_hz()
            if found is not None:
                self._hear(keys, found, keys.count[mode])
        self._core.schedule.after(_PERIOD_S, self._listen)

    def _restore(self, key: str) -> None:
        default = self._core.profile.by_key[key].default_raw
        if isinstance(default, int):
            self._core.od.put(key, default)

    def _hear(self, keys: FoundNotchKeys, hertz: float, places: int) -> None:
        if keys.result is not None:
            self._core.od.put(keys.result, round(hertz))
        free = [
            pair
            for pair in keys.notches[:places]
            if abs(self._core.number(pair[0]) - keys.off_raw) < 1
        ]
        if free:
            frequency, width = free[0]
            self._core.od.put(frequency, round(hertz))
            self._core.od.put(width, keys.width_raw)
            self._core.apply_settings()

    def _resonance_hz(self) -> float | None:
        """Return the strongest line of the torque command if it is far above the rest."""
        trace = self._axis.trace()
        window = np.hanning(trace.size)
        spectrum = np.abs(np.fft.rfft((trace - trace.mean()) * window))
        hertz = np.fft.rfftfreq(trace.size, k.STEP_S)
        band = (hertz > _LOWEST_HZ) & (hertz < 4000)
        place = int(np.argmax(np.where(band, spectrum, 0.0)))
        amplitude = 2 * spectrum[place] / window.sum()
        strong = amplitude > 0.05 * self._core.motor.rated_torque_nm
        alone = spectrum[place] > 10 * np.median(spectrum[band])
        return float(hertz[place]) if strong and alone else None

    # --- swings ----------------------------------------------------------------------------
    def _watch_swing(self) -> None:
        keys, s = self._swing, self._axis.s
        if keys is None:
            return
        wanted = int(self._core.number(keys.mode)) == keys.automatic_raw and self._axis.powered
        if wanted and s[k.S_V_DEMAND] == 0.0:
            self._deviations.append(float(s[k.S_P_DEMAND] - s[k.S_THETA]))
        else:
            self._deviations.clear()
        if len(self._deviations) >= _SWING_SAMPLES:
            self._take_swing(keys)
            self._deviations.clear()
        pause_s = _SWING_SAMPLE_S if wanted else _PERIOD_S
        self._core.schedule.after(pause_s, self._watch_swing)

    def _take_swing(self, keys: SwingKeys) -> None:
        """Set the frequency of the zero crossings, if the oscillation was large enough."""
        seen = np.array(self._deviations)
        seen -= seen[seen.size // 2 :].mean()
        threshold = self._core.number(keys.threshold) / abs(self._core.units.position_per_rad)
        crossings = np.flatnonzero(np.diff(np.signbit(seen)))
        if np.abs(seen).max() < threshold or crossings.size < 3:
            return
        turns_s = (crossings[-1] - crossings[0]) * _SWING_SAMPLE_S / (crossings.size - 1) * 2
        hertz = 1.0 / turns_s
        parameter = self._core.profile.by_key[keys.frequency]
        if 1.0 <= hertz <= float(parameter.to_value(parameter.max_raw or 0)):
            self._core.od.put(keys.frequency, parameter.to_raw(hertz))
            self._core.apply_settings()
