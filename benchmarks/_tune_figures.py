"""What the benchmarks of measuring and of tuning have in common."""

from __future__ import annotations

import numpy as np

from drivers.virtual.mechanics import MechanicsSpec
from drivers.virtual.mechanics.chain import continuous_chain


def true_modes(spec: MechanicsSpec) -> list[tuple[float, float]]:
    """Frequency (Hz) and damping of the resonances of the chain, from its matrices."""
    a, _b = continuous_chain(spec, 1e5)
    poles = np.linalg.eigvals(a)
    swinging = poles[poles.imag > 1.0]
    return sorted((float(abs(p)) / (2 * np.pi), float(-p.real / abs(p))) for p in swinging)


def marked(value: float, limit: float, form: str) -> str:
    """A figure, with an exclamation mark where it misses its limit."""
    return f"{value:{form}}" + (" " if value <= limit else "!")
