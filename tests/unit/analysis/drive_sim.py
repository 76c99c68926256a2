"""A small simulation of a servo axis with known truth, for the estimators' accuracy.

Independent of the product's virtual drive: an inertia chain and a first-order current loop by
matrix exponential at 20 kHz, speed PI and position P at 20 kHz, Coulomb friction that cannot
overshoot standstill, encoder quantisation and noise, torque and velocity quantised as on the
bus, a bus that samples every few loop periods.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from scipy.linalg import expm

LOOP_HZ = 20_000.0
TURN = 2 * np.pi


@dataclass(frozen=True)
class Mechanics:
    """Motor and chain of (inertia, stiffness, damping) loads, SI units."""

    motor_kgm2: float = 5e-5
    loads: tuple[tuple[float, float, float], ...] = ()
    viscous_nms: float = 2e-4
    coulomb_nm: float = 0.03
    gravity_nm: float = 0.0

    def matrices(self):
        n = 1 + len(self.loads)
        mass = np.array([self.motor_kgm2] + [load[0] for load in self.loads])
        k = np.zeros((n, n))
        d = np.zeros((n, n))
        d[0, 0] = self.viscous_nms
        for i, (_, stiffness, damping) in enumerate(self.loads):
            pair = np.zeros(n)
            pair[i], pair[i + 1] = 1.0, -1.0
            k += stiffness * np.outer(pair, pair)
            d += damping * np.outer(pair, pair)
        return mass, d, k

    @property
    def total_kgm2(self):
        return float(np.sum(self.matrices()[0]))

    def response(self, frequency_hz):
        """Exact torque to motor velocity response."""
        mass, d, k = self.matrices()
        out = np.empty(len(frequency_hz), dtype=complex)
        for i, f in enumerate(frequency_hz):
            s = 2j * np.pi * f
            dynamic = np.diag(mass) * s + d + k / s
            out[i] = np.linalg.solve(dynamic, np.eye(len(mass))[:, 0])[0]
        return out

    def modes(self):
        """Resonances (frequency, damping) and antiresonances of the chain."""
        mass, d, k = self.matrices()

        def pairs(mass, d, k):
            n = len(mass)
            a = np.block([[np.zeros((n, n)), np.eye(n)], [-k / mass[:, None], -d / mass[:, None]]])
            roots = np.linalg.eigvals(a)
            roots = roots[roots.imag > 1.0]
            found = sorted((abs(p) / TURN, -p.real / abs(p)) for p in roots)
            return [(float(f), float(z)) for f, z in found]

        anti = pairs(mass[1:], d[1:, 1:], k[1:, 1:]) if len(mass) > 1 else []
        return pairs(mass, d, k), anti


@dataclass(frozen=True)
class Drive:
    """Loops and sensors of the simulated drive.

    ``command_late_steps`` and ``told_late_steps`` are delays in steps of 50 µs: of a torque until
    it acts, and of all signals until the bus samples them. ``interpolates``: torques are reached
    linearly from cycle to cycle (60C2h). References of motion are, unless ``holds_motion``.
    """

    rated_nm: float = 1.27
    limit_nm: float = 3.8
    current_hz: float = 1000.0
    kp_nms: float = 0.0
    ki_nm: float = 0.0
    position_gain: float = 0.0
    speed_filter_hz: float = 0.0
    command_late_steps: int = 0
    reported_late_steps: int = 0
    interpolates: bool = False
    holds_motion: bool = False
    counts_per_rev: int = 2**23
    noise_counts: float = 0.5
    torque_step: float = 1e-3
    velocity_step: float = TURN / 65536
    seed: int = 1


@dataclass(frozen=True)
class Run:
    """What the bus saw: torque Nm, velocity rad/s, position rad."""

    torque: np.ndarray
    velocity: np.ndarray
    position: np.ndarray


@numba.njit(cache=True)
def _simulate(
    steps, m, a, b_ref, b_dist, coulomb, gravity, limit, mode, kp, ki, kv, alpha,
    torque_in, velocity_in, position_in, counts, noise, reported_late, holds, out,
):  # fmt: skip
    n = a.shape[0]
    x = np.zeros(n)
    integral = gravity
    previous = 0.0
    filtered = 0.0
    dt = 1.0 / 20000.0
    x[n - 1] = gravity
    for i in range(steps):
        k = i // m
        count = np.floor(x[0] * counts / (2 * np.pi) + noise[i] + 0.5)
        theta = count * 2 * np.pi / counts
        raw = (theta - previous) / dt if i > 0 else 0.0
        previous = theta
        filtered += alpha * (raw - filtered)
        reported = (i + reported_late) // m
        if (i + reported_late) % m == 0 and reported < out.shape[0]:
            out[reported, 0] = x[n - 1]
            out[reported, 1] = filtered
            out[reported, 2] = theta
        ref = torque_in[i]
        if mode == 0:
            ref += gravity
        else:
            # References of motion are interpolated from cycle to cycle, as 60C2h says.
            part = 1.0 if holds else (i % m + 1) / m
            before = max(k - 1, 0)
            wanted = velocity_in[before] + part * (velocity_in[k] - velocity_in[before])
            if mode == 2:
                goal = position_in[before] + part * (position_in[k] - position_in[before])
                wanted += kv * (goal - theta)
            error = wanted - filtered
            ref += kp * error + integral
            if abs(ref) < limit:
                integral += ki * error * dt
        if ref > limit:
            ref = limit
        elif ref < -limit:
            ref = -limit
        new = a @ x + b_ref * ref - b_dist * gravity
        if coulomb > 0.0:
            hold = new[1] / b_dist[1]
            friction = min(max(hold, -coulomb), coulomb)
            new = new - b_dist * friction
        x = new
    return x


def _per_step(torque, m, drive):
    """The torque command at every step of the loop: held or interpolated, and late."""
    if drive.interpolates:
        before = np.concatenate([[0.0], torque[:-1]])
        part = (np.arange(m) + 1) / m
        steps = (before[:, None] + part * (torque - before)[:, None]).ravel()
    else:
        steps = np.repeat(torque, m)
    return np.concatenate([np.zeros(drive.command_late_steps), steps])[: steps.size]


def simulate(mechanics, drive, sample_rate_hz, *, torque=None, velocity=None, position=None):
    """Play the injections (one value per bus cycle) and return what the bus sampled.

    Only torque: torque mode (gravity is compensated). With velocity: speed loop closed. With
    position: position loop closed.
    """
    given = next(x for x in (torque, velocity, position) if x is not None)
    mode = 2 if position is not None else 1 if velocity is not None else 0
    zero = np.zeros(len(given))
    mass, d, k = mechanics.matrices()
    n = len(mass)
    system = np.zeros((2 * n + 3, 2 * n + 3))  # angle 0, speed 0, ...; current loop; two inputs
    for i in range(n):
        system[2 * i, 2 * i + 1] = 1.0
        for j in range(n):
            system[2 * i + 1, 2 * j] = -k[i, j] / mass[i]
            system[2 * i + 1, 2 * j + 1] = -d[i, j] / mass[i]
    wc = TURN * drive.current_hz
    tau = 2 * n
    system[1, tau] = 1 / mass[0]
    system[tau, tau], system[tau, tau + 1] = -wc, wc
    system[1, tau + 2] = 1 / mass[0]
    step = expm(system / LOOP_HZ)
    m = round(LOOP_HZ / sample_rate_hz)
    rng = np.random.default_rng(drive.seed)
    steps = len(given) * m
    out = np.zeros((len(given), 3))
    alpha = 1.0
    if drive.speed_filter_hz:
        alpha = 1 - np.exp(-TURN * drive.speed_filter_hz / LOOP_HZ)
    size = 2 * n + 1
    _simulate(
        steps, m, np.ascontiguousarray(step[:size, :size]), step[:size, tau + 1].copy(),
        step[:size, tau + 2].copy(), mechanics.coulomb_nm, mechanics.gravity_nm, drive.limit_nm,
        mode, drive.kp_nms, drive.ki_nm, drive.position_gain, alpha,
        _per_step(zero if torque is None else np.asarray(torque, float), m, drive),
        zero if velocity is None else np.asarray(velocity, float),
        zero if position is None else np.asarray(position, float),
        float(drive.counts_per_rev), rng.normal(0, max(drive.noise_counts, 1e-12), steps),
        drive.reported_late_steps, drive.holds_motion, out,
    )  # fmt: skip
    lsb = drive.torque_step * drive.rated_nm
    return Run(
        torque=np.round(out[:, 0] / lsb) * lsb,
        velocity=np.round(out[:, 1] / drive.velocity_step) * drive.velocity_step,
        position=out[:, 2],
    )
