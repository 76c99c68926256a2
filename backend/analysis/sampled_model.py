"""A continuous-time model of the mechanics, fitted through hold, loop and sampling.

What the bus samples is the true response plus its images folded back at multiples of the sample
rate. The model is continuous; before it is compared with a measurement it is sent through the
same hold, current loop, delay, speed or position loop and sampling (sum of images), so that the
images explain themselves instead of bending the answer.

The mechanics are a chain driven and measured at the motor: a rigid part and modes with positive
residues, G(s) = g/(s + p) + Σ α_i·(s + β_i)/(s² + 2·ζ_i·ω_i·s + ω_i²). Such a sum cannot
imitate a delay, which is why the delay can be found together with it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from backend.analysis.arrays import BoolArray, ComplexArray, FloatArray
from backend.analysis.frf import Frf, valid_band_hz
from backend.analysis.sampling import (
    DIRECT_SHARE,
    SignalPath,
    delay_response,
    hold_response,
    lag_response,
    reported_response,
)

TURN = 2.0 * np.pi


@dataclass(frozen=True)
class Mode:
    """One resonance: α·(s + β)/(s² + 2ζωs + ω²)."""

    frequency_hz: float
    damping: float
    residue: float
    zero_rad_s: float


@dataclass(frozen=True)
class MechanicalModel:
    """Torque to velocity, continuous; ``gain`` is 1/J of the rigid part, ``pole_rad_s`` b/J."""

    gain: float
    pole_rad_s: float
    modes: tuple[Mode, ...] = ()

    def response(self, frequency_hz: FloatArray) -> ComplexArray:
        """Complex response without any delay."""
        s = 1j * TURN * np.asarray(frequency_hz, dtype=np.float64)
        out = self.gain / (s + self.pole_rad_s)
        for mode in self.modes:
            w = TURN * mode.frequency_hz
            out = out + mode.residue * (s + mode.zero_rad_s) / (
                s * s + 2 * mode.damping * w * s + w * w
            )
        return np.asarray(out, dtype=np.complex128)

    def numerator(self) -> FloatArray:
        """Numerator polynomial in s, highest power first."""
        denominators = [
            np.array([1.0, 2 * m.damping * TURN * m.frequency_hz, (TURN * m.frequency_hz) ** 2])
            for m in self.modes
        ]
        rigid = np.array([1.0, self.pole_rad_s])
        total = self.gain * _product(denominators)
        for i, mode in enumerate(self.modes):
            others = _product([rigid, *denominators[:i], *denominators[i + 1 :]])
            total = np.polyadd(total, mode.residue * np.polymul([1.0, mode.zero_rad_s], others))
        return np.asarray(total, dtype=np.float64)

    def antiresonances(self) -> tuple[tuple[float, float], ...]:
        """(frequency in Hz, damping) of the complex zeros, ascending."""
        zeros = np.roots(self.numerator())
        pairs = [(abs(z) / TURN, -z.real / abs(z)) for z in zeros if z.imag > 1e-6 * abs(z)]
        return tuple(sorted((float(f), float(d)) for f, d in pairs))

    def perturbed(self, frequency_factor: float, damping_factor: float) -> MechanicalModel:
        """All modes moved in frequency (stiffness) and damping; the inertias stay."""
        return replace(
            self,
            modes=tuple(
                replace(
                    m,
                    frequency_hz=m.frequency_hz * frequency_factor,
                    damping=min(m.damping * damping_factor, 0.99),
                )
                for m in self.modes
            ),
        )


def _product(polynomials: list[FloatArray]) -> FloatArray:
    out = np.array([1.0])
    for p in polynomials:
        out = np.polymul(out, p)
    return out


@dataclass(frozen=True)
class LoopModel:
    """Torque that the drive's own loop makes from the reported velocity: c0 + c1/s + c2/s²."""

    c0: float = 0.0
    c1: float = 0.0
    c2: float = 0.0

    def response(self, frequency_hz: FloatArray) -> ComplexArray:
        """Controller response from velocity to torque reference (without the current loop)."""
        s = 1j * TURN * np.asarray(frequency_hz, dtype=np.float64)
        return np.asarray(self.c0 + self.c1 / s + self.c2 / s**2, dtype=np.complex128)


@dataclass(frozen=True)
class SampledFit:
    """Result of :func:`fit_sampled_model`.

    ``delay_s`` [s] was found beyond the delays that the estimate already had. ``error`` is the
    median relative misfit of the fitted lines. ``delay_std_s`` is the delay's standard deviation.
    """

    model: MechanicalModel
    loop: LoopModel
    path: SignalPath
    delay_s: float
    delay_std_s: float
    error: float
    valid_band_hz: tuple[float, float]

    def image_factor(self, frequency_hz: FloatArray) -> ComplexArray:
        """What an estimate that ignores images returns, relative to the true response."""
        seen = seen_response(frequency_hz, self.model, self.delay_s, self.path, self.loop)
        true = self.model.response(frequency_hz) * delay_response(frequency_hz, self.delay_s)
        return np.asarray(seen / true, dtype=np.complex128)


def seen_response(
    frequency_hz: FloatArray,
    model: MechanicalModel,
    delay_s: float,
    path: SignalPath,
    loop: LoopModel,
    images: int | None = None,
) -> ComplexArray:
    """What the direct estimate (torque_mode, or torque_injection with a loop) would return.

    ``delay_s`` is the delay from torque to reported velocity beyond the one in ``path``.
    """
    f = np.asarray(frequency_hz, dtype=np.float64)
    if images is None:  # enough to reach past 6 kHz, where nothing comes back any more
        images = int(np.clip(np.ceil(6000.0 / path.sample_rate_hz), 2, 6))
    m = np.arange(-images, images + 1)[:, None]
    all_f = f[None, :] + m * path.sample_rate_hz
    base = hold_response(f, path.sample_rate_hz, path.hold) * lag_response(
        f, path.current_bandwidth_hz
    )
    hold = hold_response(all_f, path.sample_rate_hz, path.hold)
    lag = lag_response(all_f, path.current_bandwidth_hz)
    command = delay_response(all_f, path.command_delay_s)
    plant = model.response(all_f) * delay_response(all_f, delay_s) * reported_response(all_f, path)
    controller = lag * loop.response(all_f) * delay_response(all_f, path.loop_delay_s)
    torque = hold * lag * command / (1.0 + controller * plant)
    measured = np.sum(plant * torque, axis=0)
    own = -np.sum(controller * plant * torque, axis=0)
    u = base * delay_response(f, path.command_delay_s) + own
    return np.asarray(measured / (u * reported_response(f, path)))


def _unpack(x: FloatArray, scale: float) -> tuple[MechanicalModel, float]:
    """Parameters (logs, so that they stay positive) to model and delay."""
    modes = tuple(
        Mode(
            float(np.exp(q[0])),
            float(np.exp(q[1])),
            float(np.exp(q[2])),
            float(q[3] * TURN * np.exp(q[0])),
        )
        for q in x[3:].reshape(-1, 4)
    )
    return MechanicalModel(float(np.exp(x[0])), float(np.exp(x[1])), modes), float(x[2]) * scale


def _weights(frf: Frf, floor: float) -> FloatArray:
    """Weight of each line's relative error: its accuracy, but nothing is better than the floor."""
    relative = np.nan_to_num(frf.std_db, nan=0.0) * np.log(10) / 20
    return np.asarray(1.0 / np.hypot(relative, floor))


def _next_mode(
    f: FloatArray, residual: ComplexArray, scale: FloatArray, modes: FloatArray
) -> FloatArray:
    """Parameters of the mode that explains most of ``residual``.

    Every candidate is one column of a linear problem, made orthogonal to the rigid body and to
    the modes [n, 4] already there. Only positive residues are mechanics.
    """
    s = 1j * TURN * f
    grid_f = np.geomspace(f[0] * 1.5, f[-1], 120)
    ff, dd = (a.ravel() for a in np.meshgrid(grid_f, [0.01, 0.03, 0.1]))

    def columns(frequency: FloatArray, damping: FloatArray) -> FloatArray:
        w = TURN * frequency
        z = s[:, None] * scale[:, None] / (s[:, None] ** 2 + 2 * damping * w * s[:, None] + w**2)
        return np.concatenate([z.real, z.imag])

    rigid = scale / s
    known = np.column_stack([np.concatenate([rigid.real, rigid.imag])])
    if modes.size:
        known = np.hstack([known, columns(np.exp(modes[:, 0]), np.exp(modes[:, 1]))])
    b = residual * scale
    target = np.concatenate([b.real, b.imag])
    q, _ = np.linalg.qr(known)
    rest = columns(ff, dd)
    rest -= q @ (q.T @ rest)
    norm = np.maximum(np.linalg.norm(rest, axis=0), 1e-9)
    explained = rest.T @ (target - q @ (q.T @ target)) / norm
    best = int(np.argmax(explained))
    residue = max(float(explained[best] / norm[best]), 1e-9)
    return np.array([np.log(ff[best]), np.log(dd[best]), np.log(residue), 0.0])


def _rigid_gain(f: FloatArray, g: ComplexArray) -> float:
    """First guess of 1/J: the low lines, where every chain moves as one."""
    low = slice(0, max(3, f.size // 6))
    return float(np.median(np.abs(g[low]) * TURN * f[low]))


def _greedy(f: FloatArray, g: ComplexArray, count: int) -> tuple[FloatArray, float]:
    """Rigid body and ``count`` modes by projection alone; parameters and relative error."""
    x = np.array([np.log(_rigid_gain(f, g)), np.log(0.02 * TURN * f[0]), 0.0])
    scale = 1.0 / np.abs(g)
    residual = g
    for i in range(count + 1):
        model, _ = _unpack(x, 1.0)
        residual = g - model.response(f)
        if i < count:
            x = np.concatenate([x, _next_mode(f, residual, scale, x[3:].reshape(-1, 4))])
    return x, float(np.sum(np.minimum(np.abs(residual * scale), 1.0) ** 2))


def _coarse_delay(frf: Frf, use: BoolArray, longest_s: float, count: int) -> float:
    """Delay, on a grid, with which a few modes explain the response best."""
    top = float(frf.frequency_hz[use][-1])
    grid = np.arange(0.0, longest_s + 1e-9, 0.05 / top)
    # A coarse answer needs no more than about 80 lines.
    thin = slice(None, None, max(1, np.count_nonzero(use) // 80))
    f, g = frf.frequency_hz[use][thin], frf.response[use][thin]
    errors = [_greedy(f, g * np.conj(delay_response(f, d)), count)[1] for d in grid]
    return float(grid[np.argmin(errors)])


@dataclass(frozen=True)
class _Problem:
    """One nonlinear least-squares problem: lines, weights, what lies around the mechanics."""

    f: FloatArray
    g: ComplexArray
    weight: FloatArray
    path: SignalPath
    loop: LoopModel
    period_s: float
    coarse_delay: float

    def misfit(self, x: FloatArray) -> FloatArray:
        """Weighted logarithmic error: peaks and valleys alike, sane far from the solution."""
        model, delay = _unpack(x, self.period_s)
        ratio = seen_response(self.f, model, delay, self.path, self.loop) / self.g
        error = np.log(ratio) * self.weight
        return np.concatenate([error.real, error.imag])

    def error(self, x: FloatArray) -> float:
        """Median relative misfit."""
        model, delay = _unpack(x, self.period_s)
        seen = seen_response(self.f, model, delay, self.path, self.loop)
        return float(np.median(np.abs(seen / self.g - 1.0)))

    def solve(self, start: FloatArray) -> tuple[FloatArray, FloatArray, float]:
        """Best parameters near ``start``, Jacobian and Bayesian information criterion."""
        low, high = self._bounds(start)
        fit = least_squares(
            self.misfit, np.clip(start, low + 1e-9, high - 1e-9), bounds=(low, high),
            x_scale=_steps(start.size), loss="soft_l1", f_scale=3.0, max_nfev=25,
            ftol=1e-4, xtol=1e-5,
        )  # fmt: skip
        points = 2 * self.f.size
        score = points * np.log(2 * fit.cost / points) + start.size * np.log(points)
        return fit.x, np.asarray(fit.jac), float(score)

    def _bounds(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Where a physical answer must lie; keeps a poor start from running away."""
        f0, top = float(self.f[0]), float(self.f[-1])
        count = (x.size - 3) // 4
        gain = float(x[0])
        low = [gain - 2.0, np.log(1e-3 * TURN * f0), max(self.coarse_delay - 1.0, -0.2)]
        high = [gain + 2.0, np.log(0.5 * TURN * np.sqrt(f0 * top)), self.coarse_delay + 1.0]
        low += [np.log(1.2 * f0), np.log(5e-4), gain - 9.0, -0.5] * count
        high += [np.log(1.2 * top), np.log(0.6), gain + 5.0, 0.5] * count
        return np.array(low), np.array(high)

    def worth_keeping(self, x: FloatArray) -> FloatArray:
        """Parameters without modes that rise less than 3 % above the rest of the response."""
        model, _ = _unpack(x, 1.0)
        keep = [x[:3]]
        for mode, q in zip(model.modes, x[3:].reshape(-1, 4), strict=True):
            at = np.array([mode.frequency_hz])
            rest = replace(model, modes=tuple(m for m in model.modes if m is not mode))
            height = mode.residue / (2 * mode.damping * TURN * mode.frequency_hz)
            above = int(np.clip(np.searchsorted(self.f, mode.frequency_hz), 1, self.f.size - 1))
            gap = float(self.f[above] - self.f[above - 1])
            resolved = mode.damping * mode.frequency_hz > 0.1 * gap
            # A heavily damped mode at the end of the band only imitates a piece of delay.
            invented = mode.damping > 0.3 and mode.frequency_hz > 0.8 * float(self.f[-1])
            prominent = height > 0.03 * float(np.abs(rest.response(at))[0])
            if prominent and resolved and not invented:
                keep.append(q)
        return np.concatenate(keep)


def loop_image_factor(frequency_hz: FloatArray, fit: SampledFit) -> ComplexArray:
    """Ratio of the loop's own torque to the velocity as sampled, relative to the true ratio."""
    f = np.asarray(frequency_hz, dtype=np.float64)
    path = fit.path
    images = int(np.clip(np.ceil(6000.0 / path.sample_rate_hz), 2, 6))
    all_f = f[None, :] + np.arange(-images, images + 1)[:, None] * path.sample_rate_hz
    lag = lag_response(all_f, path.current_bandwidth_hz)
    reported = delay_response(all_f, fit.delay_s) * reported_response(all_f, path)
    plant = fit.model.response(all_f) * reported
    controller = lag * fit.loop.response(all_f) * delay_response(all_f, path.loop_delay_s)
    hold = hold_response(all_f, path.sample_rate_hz, path.hold)
    torque = hold * lag * delay_response(all_f, path.command_delay_s) / (1.0 + controller * plant)
    seen = np.sum(controller * plant * torque, axis=0) / np.sum(plant * torque, axis=0)
    return np.asarray(seen / controller[images], dtype=np.complex128)


def _steps(size: int) -> FloatArray:
    """Typical sizes of parameter changes, see :func:`_unpack`."""
    return np.array([0.3, 1.0, 0.05, *[0.03, 0.5, 0.5, 0.05] * ((size - 3) // 4)])


def _grow(problem: _Problem, max_modes: int) -> tuple[FloatArray, FloatArray]:
    """Add modes one by one as long as the information criterion gains; best parameters."""
    f, g = problem.f, problem.g
    x = np.array([np.log(_rigid_gain(f, g)), np.log(0.02 * TURN * f[0]), problem.coarse_delay])
    best: tuple[float, FloatArray, FloatArray] | None = None
    misses = 0
    for count in range(max_modes + 1):
        if count > 0:
            model, delay = _unpack(x, problem.period_s)
            seen = seen_response(f, model, delay, problem.path, problem.loop)
            residual = (g - seen) * np.conj(delay_response(f, delay))
            mode = _next_mode(f, residual, 1.0 / np.abs(g), x[3:].reshape(-1, 4))
            x = np.concatenate([x, mode])
        x, jacobian, score = problem.solve(x)
        if best is None or score < best[0] - 10.0:
            best, misses = (score, x, jacobian), 0
        else:
            misses += 1
        if misses == 2:
            break
    assert best is not None
    kept = problem.worth_keeping(best[1])
    if kept.size == best[1].size:
        return best[1], best[2]
    x, jacobian, _ = problem.solve(kept)
    return x, jacobian


def fit_sampled_model(
    frf: Frf,
    path: SignalPath,
    *,
    loop: LoopModel | None = None,
    max_modes: int = 4,
    longest_delay_s: float | None = None,
    floor: float = 0.01,
    minimum_coherence: float = 0.6,
) -> SampledFit:
    """Fit mechanics and delay to a direct estimate, images included.

    ``frf`` is a direct estimate made with ``path``; lines up to 0.4 of the sample rate with
    enough coherence take part. Modes are added one by one as long as the Bayesian information
    criterion gains. ``longest_delay_s`` defaults to three bus cycles in torque
    mode and a quarter of one in a closed loop.
    """
    band = valid_band_hz(float(frf.frequency_hz[0]), path.sample_rate_hz, model=True)
    use = (frf.frequency_hz <= band[1]) & (frf.coherence >= minimum_coherence)
    if np.count_nonzero(use) < 12:
        raise ValueError("fewer than 12 coherent lines: too little excitation for a model")
    loop = LoopModel() if loop is None else loop
    f, g = frf.frequency_hz[use], frf.response[use]
    weight = _weights(frf, floor)[use]
    period_s = 1.0 / path.sample_rate_hz
    if longest_delay_s is None:
        # Torque and velocity are reported together: only injection itself can be cycles late.
        longest_delay_s = 3 * period_s if loop == LoopModel() else 0.25 * period_s
    coarse = _coarse_delay(frf, use, longest_delay_s, min(3, max_modes))

    problem = _Problem(f, g, weight, path, loop, period_s, coarse / period_s)
    x, jacobian = _grow(problem, max_modes)
    model, delay = _unpack(x, period_s)
    residuals = problem.misfit(x)
    freedom = max(residuals.size - x.size, 1)
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * float(residuals @ residuals) / freedom
    return SampledFit(
        model=model,
        loop=loop,
        path=path,
        delay_s=delay,
        delay_std_s=float(np.sqrt(max(covariance[2, 2], 0.0))) * period_s,
        error=problem.error(x),
        valid_band_hz=band,
    )


def fit_loop(
    frequency_hz: FloatArray, own_torque: ComplexArray, velocity: ComplexArray, path: SignalPath
) -> LoopModel:
    """Controller of the closed loop from its own torque and the velocity, line by line.

    ``own_torque`` and ``velocity`` are cross spectra with the injection. Only lines well below
    half the sample rate are used, since both are sampled signals.
    """
    use = frequency_hz <= 0.6 * DIRECT_SHARE * path.sample_rate_hz
    if np.count_nonzero(use) < 6:
        raise ValueError("fewer than 6 lines below 0.15 of the sample rate")
    f = frequency_hz[use]
    s = 1j * TURN * f
    known = lag_response(f, path.current_bandwidth_hz) * delay_response(f, path.loop_delay_s)
    reference = -own_torque[use] / velocity[use] / known
    a = np.column_stack([np.ones(f.size), 1.0 / s, 1.0 / s**2]) / np.abs(reference)[:, None]
    b = reference / np.abs(reference)
    matrix, target = np.vstack([a.real, a.imag]), np.concatenate([b.real, b.imag])
    # A robust pass: single lines spoilt by friction must not bend the gains.
    row: FloatArray = np.ones(target.size)
    c: FloatArray = np.zeros(3)
    for _ in range(4):
        c = np.linalg.lstsq(matrix * row[:, None], target * row, rcond=None)[0]
        error = np.abs(target - matrix @ c)
        row = 1.0 / np.sqrt(1.0 + (error / max(float(np.median(error)), 1e-9) / 2.0) ** 2)
    return LoopModel(float(c[0]), float(c[1]), float(c[2]))
