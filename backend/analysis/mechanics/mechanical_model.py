"""Continuous model of mechanics driven and measured at the motor.

A rigid part and modes with positive residues, G(s) = g/(s + p) + Σ α_i·(s + β_i)/(s² + 2·ζ_i·ω_i·s
+ ω_i²). Such a sum cannot imitate a delay, so a delay can be identified together with it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from backend.analysis.signals.arrays import ComplexArray, FloatArray

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
        """Return the complex response without any delay."""
        s = 1j * TURN * np.asarray(frequency_hz, dtype=np.float64)
        out = self.gain / (s + self.pole_rad_s)
        for mode in self.modes:
            w = TURN * mode.frequency_hz
            out = out + mode.residue * (s + mode.zero_rad_s) / (
                s * s + 2 * mode.damping * w * s + w * w
            )
        return np.asarray(out, dtype=np.complex128)

    def without(self, mode: Mode) -> MechanicalModel:
        """Return the model without this mode."""
        return replace(self, modes=tuple(m for m in self.modes if m is not mode))

    def height_db(self, mode: Mode) -> float:
        """Return the height of a mode above the rest of the model at its own frequency, dB."""
        at = np.array([mode.frequency_hz])
        ratio = np.abs(self.response(at)[0]) / np.abs(self.without(mode).response(at)[0])
        return float(20 * np.log10(max(float(ratio), 1e-6)))

    def prominence(self, mode: Mode) -> float:
        """Return a mode's own part of the response at its frequency, relative to the rest."""
        at = np.array([mode.frequency_hz])
        rest = self.without(mode).response(at)[0]
        return float(np.abs(self.response(at)[0] - rest) / np.abs(rest))

    def numerator(self) -> FloatArray:
        """Return the numerator polynomial in s, highest power first."""
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
        """Return (frequency in Hz, damping) of the complex zeros, ascending."""
        zeros = np.roots(self.numerator())
        pairs = [(abs(z) / TURN, -z.real / abs(z)) for z in zeros if z.imag > 1e-6 * abs(z)]
        return tuple(sorted((float(f), float(d)) for f, d in pairs))

    def perturbed(self, frequency_factor: float, damping_factor: float) -> MechanicalModel:
        """Return the model with all modes scaled in frequency (stiffness) and damping only."""
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


# --- parameters of a fit ----------------------------------------------------------------

#: Parameters before those of the modes: gain, pole, two delays and the speed filter's log corner.
RIGID_PARAMETERS = 5
MODE_PARAMETERS = 4


def model_of(x: FloatArray) -> MechanicalModel:
    """Return the model of the parameters: log gain, log pole, (path), and per mode log frequency,
    log damping, log residue and β/ω; the logarithms keep the values positive.
    """
    modes = tuple(
        Mode(
            float(np.exp(q[0])),
            float(np.exp(q[1])),
            float(np.exp(q[2])),
            float(q[3] * TURN * np.exp(q[0])),
        )
        for q in x[RIGID_PARAMETERS:].reshape(-1, MODE_PARAMETERS)
    )
    return MechanicalModel(float(np.exp(x[0])), float(np.exp(x[1])), modes)


def response_and_slopes(
    x: FloatArray, frequency_hz: FloatArray
) -> tuple[ComplexArray, Callable[[], ComplexArray]]:
    """Return the response [...] of `model_of` (x), and a function for its slopes [n, ...], 0 for
    the path.
    """
    s = 1j * TURN * np.asarray(frequency_hz, dtype=np.float64)
    gain, pole = np.exp(x[0]), np.exp(x[1])
    rigid = gain / (s + pole)
    total = rigid.copy()
    modes: list[tuple[ComplexArray, ComplexArray]] = []
    for i in range(RIGID_PARAMETERS, x.size, MODE_PARAMETERS):
        w, zeta, residue, part = TURN * np.exp(x[i]), np.exp(x[i + 1]), np.exp(x[i + 2]), x[i + 3]
        below = s * s + 2 * zeta * w * s + w * w
        mode = residue * (s + part * w) / below
        total += mode
        modes.append((mode, below))

    def slopes() -> ComplexArray:
        out = np.zeros((x.size, *s.shape), dtype=np.complex128)
        out[0] = rigid
        out[1] = -rigid * pole / (s + pole)
        for i, (mode, below) in zip(
            range(RIGID_PARAMETERS, x.size, MODE_PARAMETERS), modes, strict=True
        ):
            w, zeta = TURN * np.exp(x[i]), np.exp(x[i + 1])
            residue, part = np.exp(x[i + 2]), x[i + 3]
            out[i] = residue * part * w / below - mode * (2 * zeta * w * s + 2 * w * w) / below
            out[i + 1] = -mode * 2 * zeta * w * s / below
            out[i + 2] = mode
            out[i + 3] = residue * w / below
        return out

    return total, slopes
