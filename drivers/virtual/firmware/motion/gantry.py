"""Two virtual drives on one gantry beam: their motors and the beam are stepped together.

The drive that is advanced first takes both to that time, so that neither reads the other's motor at
a different time than its own.
"""

from __future__ import annotations

import numpy as np

from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.kernel.pair import run_pair
from drivers.virtual.firmware.servo import VirtualServo
from drivers.virtual.mechanics.gantry import (
    MEAN,
    SECOND,
    STATES,
    GantrySpec,
    discretise_gantry,
)


class VirtualGantry:
    """The common mechanics of two drives that have not run yet."""

    def __init__(self, spec: GantrySpec, first: VirtualServo, second: VirtualServo) -> None:
        self.spec = spec
        self._servos = (first, second)
        self.x = np.zeros(STATES)
        self._scratch = np.zeros(STATES)
        self._corners = (0.0, 0.0)
        self._a = self._b = np.zeros((0, 0))
        self._randoms = (
            first.axis.share_state(self.x[:SECOND]),
            second.axis.share_state(self.x[SECOND:MEAN]),
        )
        self._follow()
        for servo in self._servos:
            servo.axis.placed = self._follow
            servo.stepped = self

    def begin(self, start_ns: int) -> None:
        """See `drivers.virtual.firmware.servo.SteppedTogether`."""
        for servo in self._servos:
            servo.begin(start_ns)

    def run(self, steps: int) -> int:
        """See `drivers.virtual.firmware.servo.SteppedTogether`."""
        first, second = (servo.axis for servo in self._servos)
        first.s[k.S_EVENTS] = second.s[k.S_EVENTS] = 0.0
        corners = (first.current_loop_rad_s, second.current_loop_rad_s)
        if corners != self._corners:
            # Not in every run: the look-up by mechanics takes 9 µs, all steps of a cycle 39 µs.
            self._corners = corners
            specs = (first.spec, second.spec)
            self._a, self._b = discretise_gantry(self.spec, specs, corners, k.STEP_S)
        done: int = run_pair(
            steps, first.p, first.s, self._randoms[0], second.p, second.s, self._randoms[1],
            self.x, self._a, self._b, self._scratch,
        )  # fmt: skip
        for servo in self._servos:
            servo.take_events()
        return done

    def _follow(self) -> None:
        """Place the beam at rest between the present motor positions; joints may be strained."""
        spec = self.spec
        first, second = self.x[0], self.x[SECOND]
        joints, guides = 0.5 * spec.joint_stiffness_nm_per_rad, spec.yaw_stiffness_nm_per_rad
        pulled = joints * (first - second) + guides * spec.square_error_rad
        self.x[MEAN:] = 0.5 * (first + second), 0.0, pulled / (joints + guides), 0.0
