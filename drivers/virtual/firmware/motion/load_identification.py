"""Identification of the load inertia by the drive: with its own motion, or during operation.

Offline: P09.00 to P09.04 of the M6-L (000:3417-3421), P07.05 to P07.09 with 200Ch:0Ch of the R6L
(002:11121-11161, 002:11919). Online: P09.05 of the M6-L (000:3422). The inertia is measured, not
taken from the model: by regression of torque on acceleration, speed and the direction of motion.
The start value is not printed in either manual; any value but 0 starts it here, and 0 stops it.
"""

from __future__ import annotations

from collections.abc import Callable, Generator

from drivers.virtual.firmware.cia402.base import RPM
from drivers.virtual.firmware.cia402.keys import LoadKeys
from drivers.virtual.firmware.core import Core
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.motion.identification import regress
from drivers.virtual.firmware.schedule import Timer

_SAMPLE_S = 0.002
_SWINGS = 3
Sample = tuple[float, float, float]


class LoadIdentification:
    """Runs one identification at a time; ``active`` while the axis moves for it."""

    def __init__(self, core: Core, keys: LoadKeys, failed: Callable[[], None]) -> None:
        self._core = core
        self._axis = core.axis
        self._keys = keys
        self._failed = failed
        self._script: Generator[float, None, None] | None = None
        self._timer: Timer | None = None
        self._samples: list[Sample] = []
        self._before: tuple[float, float] | None = None
        if keys.online:
            core.schedule.after(_SAMPLE_S, self._watch)
        self._show_revolutions()

    @property
    def active(self) -> bool:
        """True while moving."""
        return self._script is not None

    def start(self) -> None:
        """Start the motion; the axis must be free to turn by the displayed revolutions."""
        if self.active:
            return
        self._samples = []
        self._script = self._run()
        self._resume()

    def stop(self) -> None:
        """End without a result."""
        if self._script is not None:
            self._script.close()
            self._script = None
            self._axis.power_off()
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _resume(self) -> None:
        if self._script is None:
            return
        try:
            wait_s = next(self._script)
        except StopIteration:
            self._script = None
            self._timer = None
        else:
            self._timer = self._core.schedule.after(wait_s, self._resume)

    def _value(self, key: str) -> float:
        return float(self._core.profile.by_key[key].to_value(self._core.number(key)))

    def _show_revolutions(self) -> None:
        """Set the travel of each move, up and down the ramp: P09.03, P07.09."""
        key = self._keys.revolutions
        if key is None or key not in self._core.profile.by_key:
            return
        turns = self._value(self._keys.speed) / 60 * self._value(self._keys.ramp) * 1e-3
        self._core.od.put(key, self._core.profile.by_key[key].to_raw(turns))

    def _run(self) -> Generator[float, None, None]:
        axis, keys = self._axis, self._keys
        self._show_revolutions()
        speed = self._value(keys.speed) * RPM
        ramp = speed / (self._value(keys.ramp) * 1e-3)
        axis.hold()
        yield 0.05
        for _ in range(_SWINGS):
            for direction in (1.0, -1.0):
                axis.run_velocity(direction * speed, ramp, ramp)
                yield from self._collect(speed / ramp)
                axis.run_velocity(0.0, ramp, ramp)
                yield from self._collect(speed / ramp)
                yield self._value(keys.pause) * 1e-3
        axis.power_off()
        self._conclude()

    def _collect(self, seconds: float) -> Generator[float, None, None]:
        self._before = None
        for _ in range(max(2, round(seconds / _SAMPLE_S))):
            self._sample()
            yield _SAMPLE_S

    def _sample(self) -> None:
        speed, now = self._axis.speed_rad_s, float(self._axis.s[k.S_STEP]) * k.STEP_S
        if self._before is not None and now > self._before[1]:
            rate = (speed - self._before[0]) / (now - self._before[1])
            mean = (speed + self._before[0]) / 2
            if abs(mean) > 2.0 and speed * self._before[0] > 0:
                self._samples.append((self._axis.torque_nm, rate, mean))
        self._before = (speed, now)

    def _conclude(self) -> None:
        inertia = self._inertia()
        if inertia is None:
            self._failed()
        else:
            self._take(inertia, 1.0)

    def _inertia(self) -> float | None:
        if len(self._samples) < 20:
            return None
        fit = regress(self._samples)
        return None if fit is None else fit[0]

    def _take(self, inertia: float, share: float) -> None:
        """Change the ratio by this share of the difference."""
        parameter = self._core.profile.by_key[self._keys.ratio]
        rotor = self._core.motor.rotor_inertia_kgm2
        measured = max(0.0, inertia / rotor - 1.0) * self._keys.ratio_per_one
        before = self._value(self._keys.ratio)
        raw = parameter.to_raw(before + share * (measured - before))
        low, high = parameter.raw_limits
        self._core.od.put(self._keys.ratio, min(max(raw, low or 0), high or raw))
        self._core.apply_settings()

    def _watch(self) -> None:
        """Online: evaluate motion commanded by others, and adapt after every half second of it."""
        mode = int(self._core.number(self._keys.online or ""))
        share = {1: 0.05, 2: 0.2, 3: 0.5}.get(mode, 0.0)
        if share and self._axis.powered and not self.active:
            self._sample()
            if len(self._samples) >= 250:
                rates = [abs(sample[1]) for sample in self._samples]
                inertia = self._inertia() if max(rates) > 200.0 else None
                if inertia is not None:
                    self._take(inertia, share)
                self._samples = []
        self._core.schedule.after(_SAMPLE_S if share else 0.1, self._watch)
