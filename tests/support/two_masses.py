"""A bench with two masses that is written without the analysis: friction, backlash, ripple.

Torque to motor speed, integrated with semi-implicit Euler steps; its linear response is analytic.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numba
import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Bench:
    """``antiresonance_hz`` is of the load on the spring; ``friction`` is Coulomb's, in Nm.

    ``distortion`` is what the current measurement shows that is no torque, relative.
    """

    motor_kgm2: float = 1e-3
    load_kgm2: float = 2e-3
    antiresonance_hz: float = 53.0
    damping: float = 0.01
    viscous_nms: float = 5e-3
    friction_nm: float = 0.0
    stribeck: float = 1.2
    backlash_rad: float = 0.0
    ripple: float = 0.0
    filter_hz: float = 1e5
    distortion: float = 0.0
    noise: float = 0.0

    @property
    def stiffness(self) -> float:
        return self.load_kgm2 * (2 * np.pi * self.antiresonance_hz) ** 2

    @property
    def resonance_hz(self) -> float:
        return self.antiresonance_hz * float(np.sqrt(1 + self.load_kgm2 / self.motor_kgm2))

    @property
    def spring_damping(self) -> float:
        reduced = self.motor_kgm2 * self.load_kgm2 / (self.motor_kgm2 + self.load_kgm2)
        return 2 * self.damping * float(np.sqrt(self.stiffness * reduced))

    def response(self, f: Array) -> npt.NDArray[np.complex128]:
        """Linear torque to motor speed."""
        s = 2j * np.pi * f
        spring = self.stiffness + self.spring_damping * s
        load = self.load_kgm2 * s * s
        motor = self.motor_kgm2 * s * s + self.viscous_nms * s
        speed = s * (load + spring) / (motor * (load + spring) + load * spring)
        return np.asarray(speed / (1 + 1j * f / self.filter_hz))

    def linear(self) -> Bench:
        return replace(self, friction_nm=0.0, backlash_rad=0.0, ripple=0.0, distortion=0.0)

    def record(self, torque: Array, rate_hz: float, seed: int) -> tuple[Array, Array]:
        """Measured torque and measured motor speed."""
        speed = _integrated(
            torque, rate_hz, 8, self.motor_kgm2, self.load_kgm2, self.stiffness,
            self.spring_damping, self.viscous_nms, self.friction_nm, self.stribeck,
            self.backlash_rad, self.ripple, 2 * np.pi * self.filter_hz,
        )  # fmt: skip
        rng = np.random.default_rng(seed)
        size = float(np.std(torque))
        reported = torque + self.distortion * size * np.sin(6.0 * torque / size) / 2
        reported = reported + rng.normal(size=torque.size) * self.noise * size
        return reported, speed + rng.normal(size=torque.size) * self.noise * float(np.std(speed))


@numba.njit(cache=True)
def _integrated(torque, rate, steps, j1, j2, k, c, b, tc, ts, gap, ripple, corner):  # type: ignore[no-untyped-def]
    dt = 1.0 / rate / steps
    x1 = v1 = x2 = v2 = seen = 0.0
    out = np.empty(torque.size)
    share = 1.0 - np.exp(-corner * dt)
    for i in range(torque.size):
        out[i] = seen
        for _ in range(steps):
            d = x1 - x2
            spring = 0.0
            if abs(d) >= gap:
                spring = k * (d - np.sign(d) * gap) + c * (v1 - v2)
            rub = tc * (1.0 + (ts - 1.0) * np.exp(-((v1 / 0.3) ** 2))) * np.tanh(v1 / 0.02)
            drive = torque[i] * (1.0 + ripple * np.sin(4.0 * x1)) + 0.3 * ripple * np.sin(8.0 * x1)
            v1 += dt * (drive - spring - b * v1 - rub) / j1
            v2 += dt * (spring - 0.3 * tc * np.tanh(v2 / 0.02)) / j2
            x1 += dt * v1
            x2 += dt * v2
            seen += share * (v1 - seen)
    return out


def multisine(
    rate_hz: float, lines: npt.NDArray[np.int64], size: float, periods: int, seed: int
) -> Array:
    """Random phases on these lines, 1 Hz apart; ``size`` is the effective value."""
    n = round(rate_hz)
    spectrum = np.zeros(n // 2 + 1, dtype=np.complex128)
    phases = np.random.default_rng(seed).random(lines.size)
    spectrum[lines] = np.exp(2j * np.pi * phases)
    one = np.fft.irfft(spectrum, n)
    return np.tile(one * size / np.std(one), periods)
