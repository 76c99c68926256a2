"""A gantry as equations of motion: two motors, a beam with a carriage off its centre.

Nothing of it comes from the product. All quantities are at the motor shafts. Coordinates: motor 1,
motor 2, mean of the beam's ends, their difference.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Gantry:
    motors: tuple[float, float] = (5e-5, 5e-5)
    viscous: tuple[float, float] = (2e-4, 2e-4)
    joints: tuple[float, float] = (25.0, 25.0)
    joint_damping: float = 3e-3
    beam: float = 2e-4
    yaw: float = 4e-5
    off_centre: float = 0.15
    yaw_stiffness: float = 4.0
    yaw_damping: float = 2e-3

    def matrices(self):
        mass = np.zeros((4, 4))
        mass[0, 0], mass[1, 1] = self.motors
        mass[2, 2], mass[2, 3] = self.beam, self.beam * self.off_centre
        mass[3, 2] = mass[2, 3]
        mass[3, 3] = self.yaw + self.beam * self.off_centre**2
        twist = np.array([[1.0, 0.0, -1.0, -0.5], [0.0, 1.0, -1.0, 0.5]])
        stiffness = twist.T @ np.diag(self.joints) @ twist
        damping = self.joint_damping * twist.T @ twist
        stiffness[3, 3] += self.yaw_stiffness
        damping[3, 3] += self.yaw_damping
        damping[0, 0] += self.viscous[0]
        damping[1, 1] += self.viscous[1]
        return mass, damping, stiffness

    def response(self, f_hz):
        """Torque to speed of the motors [n, 2, 2]."""
        mass, damping, stiffness = self.matrices()
        s = 2j * np.pi * np.asarray(f_hz, dtype=float)[:, None, None]
        whole = s * mass + damping + stiffness / s
        return np.linalg.inv(whole)[:, :2, :2]

    def state(self):
        """State matrix of positions and speeds."""
        mass, damping, stiffness = self.matrices()
        inverse = np.linalg.inv(mass)
        top = np.hstack([np.zeros((4, 4)), np.eye(4)])
        return np.vstack([top, np.hstack([-inverse @ stiffness, -inverse @ damping])])

    def modes(self):
        """(frequency in Hz, damping, share of differential motion at the motors), ascending."""
        values, vectors = np.linalg.eig(self.state())
        found = []
        for value, vector in zip(values, vectors.T, strict=True):
            if value.imag > 1.0:
                v = vector[:2]
                share = abs(v[0] - v[1]) ** 2 / 2.0 / (abs(v[0]) ** 2 + abs(v[1]) ** 2)
                found.append((abs(value) / 2 / np.pi, -value.real / abs(value), share))
        return sorted(found)

    def poles_of_loop(self, gain, integral_hz, factor=1.0):
        """Poles with a PI speed loop of each motor."""
        a = self.state()
        mass, _, _ = self.matrices()
        b = np.zeros((8, 2))
        b[4:] = np.linalg.inv(mass)[:, :2]
        speeds = np.zeros((2, 8))
        speeds[0, 4] = speeds[1, 5] = 1.0
        k = factor * np.asarray(gain)
        ki = k * 2 * np.pi * np.asarray(integral_hz)
        whole = np.zeros((10, 10))
        whole[:8, :8] = a - b @ np.diag(k) @ speeds
        whole[:8, 8:] = b @ np.diag(ki)
        whole[8:, :8] = -speeds
        return np.linalg.eigvals(whole)
