"""The drive's own parameter identification (200Ch, control word bit 11, 004:2650-2819).

The inertia is measured, not taken from the model: the axis is accelerated and braked by two
constant torques, and the regression of torque on acceleration and speed gives inertia and friction,
so that a load that cannot be moved fails as it would in a drive. Electrical values are those of the
simulated windings, to the resolution of their objects.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator

import numpy as np

from drivers.virtual.firmware.core import Core
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.schedule import Timer

(
    IDLE, PREPARATION, RESISTANCE, READY_INDUCTANCE, INDUCTANCE_D, INDUCTANCE_Q, THETA_BIAS,
    TORQUE_CONSTANT, INERTIA, INERTIA_AGAIN, TORQUE_CONSTANT_LIMITED, INERTIA_LIMITED, COMPLETE,
) = range(13)  # fmt: skip
ERROR = 16

_Wait = Generator[float, None, None]


class Identification:
    """Steps through the states of 200Ch:05 and sets 200Ch:06 to :0C."""

    def __init__(self, core: Core) -> None:
        self._core = core
        self._axis = core.axis
        self._script: _Wait | None = None
        self._timer: Timer | None = None
        self._ended: Callable[[], None] = lambda: None
        self.started = False

    @property
    def active(self) -> bool:
        """True while identifying (status word bit 14)."""
        return self._script is not None

    def start(self, ended: Callable[[], None]) -> None:
        """Start; it ends by itself in the state "complete" or "error"."""
        self.started = True
        self._ended = ended
        self._script = self._run()
        self._resume()

    def stop(self) -> None:
        """Stop, as control word bit 11 fell or the axis got another command."""
        if self._script is not None:
            self._script.close()
            self._script = None
            self._status(IDLE)
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        self.started = False

    def _resume(self) -> None:
        if self._script is None:
            return
        try:
            wait_s = next(self._script)
        except StopIteration:
            self._script = None
            self._timer = None
            self._ended()
        else:
            self._timer = self._core.schedule.after(wait_s, self._resume)

    def _status(self, value: int) -> None:
        self._core.od.put("200C:05", value)

    def _put(self, key: str, value: float) -> None:
        self._core.od.put(key, max(0, round(value)))

    def _run(self) -> _Wait:
        core, axis, motor = self._core, self._axis, self._core.motor
        limited = core.number("200C:01") == 1
        self._status(PREPARATION)
        axis.hold()
        yield 0.1
        for state, key, value in (
            (RESISTANCE, "200C:06", motor.resistance_ohm * 1e3),
            (READY_INDUCTANCE, None, 0.0),
            (INDUCTANCE_D, "200C:07", motor.inductance_h * 1e6),
            (INDUCTANCE_Q, "200C:08", motor.inductance_h * 1e6),
            (THETA_BIAS, None, 0.0),
            (
                TORQUE_CONSTANT_LIMITED if limited else TORQUE_CONSTANT,
                "200C:09",
                motor.torque_constant * 1e3,
            ),
        ):
            self._status(state)
            yield 0.1
            if key is not None:
                self._put(key, value)
        self._status(INERTIA_LIMITED if limited else INERTIA)
        samples: list[tuple[float, float, float]] = []
        rounds = core.number("200C:04", 10)
        for torque_share in (0.5, 0.9):
            for direction in (1.0, -1.0):
                yield from self._swing(direction * torque_share, rounds, samples)
            if not limited:
                self._status(INERTIA_AGAIN)
        self._conclude(samples)

    def _swing(
        self, share: float, rounds: float, samples: list[tuple[float, float, float]]
    ) -> _Wait:
        """Accelerate until speed or travel is used up, then brake; collect (T, a, ω)."""
        axis, motor = self._axis, self._core.motor
        start = axis.angle_rad
        travel = rounds * math.pi  # half of the permitted turns to accelerate, half to brake
        for torque in (share, -share):
            axis.run_torque(torque * motor.rated_torque_nm, math.inf)
            yield 0.005  # the torque has settled
            for _ in range(2000):
                before, then = axis.speed_rad_s, float(axis.s[k.S_STEP])
                yield 0.002
                span_s = (float(axis.s[k.S_STEP]) - then) * k.STEP_S
                speed = axis.speed_rad_s
                if abs(speed) > 5.0 and before * speed > 0:
                    samples.append(
                        (axis.torque_nm, (speed - before) / span_s, (speed + before) / 2)
                    )
                far = abs(axis.angle_rad - start) > travel
                fast = abs(speed) > 0.5 * motor.rated_speed_rad_s
                if torque == share and (far or fast):
                    break
                if torque != share and speed * share <= 0:
                    break
        axis.run_velocity(0.0, 1e4, 1e4)
        yield 0.1

    def _conclude(self, samples: list[tuple[float, float, float]]) -> None:
        core = self._core
        fit = regress(samples)
        if fit is None:
            self._status(ERROR)
            return
        inertia, viscous, coulomb = fit
        self._put("200C:0A", inertia * 1e7)
        self._put("200C:0B", viscous * 1e3)
        self._put("200C:0C", coulomb * 1e3)
        for target, source in (
            ("2001:01", "200C:06"),
            ("2001:02", "200C:07"),
            ("2001:03", "200C:08"),
            ("2001:05", "200C:09"),
            ("2001:06", "200C:0A"),
            ("2001:0B", "200C:0C"),
        ):
            core.od.put(target, core.number(source))
        core.od.put("2001:0A", min(65535, max(0, round(viscous * 1e6))))
        self._status(COMPLETE)


def regress(samples: list[tuple[float, float, float]]) -> tuple[float, float, float] | None:
    """Fit T = J·a + b·ω + Tc·sign(ω) + Tg by least squares; None for insufficient data."""
    if len(samples) < 20:
        return None
    data = np.array(samples)
    torque, acceleration, speed = data.T
    design = np.stack([acceleration, speed, np.sign(speed), np.ones_like(speed)], axis=1)
    solution, _, rank, _ = np.linalg.lstsq(design / np.abs(design).max(axis=0), torque, rcond=None)
    if rank < 4:
        return None
    inertia, viscous, coulomb, _gravity = solution / np.abs(design).max(axis=0)
    return (float(inertia), float(viscous), float(coulomb)) if inertia > 0 else None
