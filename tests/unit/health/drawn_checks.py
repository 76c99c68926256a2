"""Health checks drawn with noise that the comparison does not assume."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from backend.tools.watching.health.result import HealthRound, HealthValue, Quantity
from backend.tools.watching.trend.compare import Finding

Noise = Callable[[np.random.Generator, int], np.ndarray]

#: Deviation of a repeat: of a frequency, of friction and of inertia.
SPREAD: dict[Quantity, float] = {"resonance": 0.004, "friction": 0.015, "inertia": 0.01}

TRUE: dict[tuple[Quantity, int], float] = {
    ("resonance", 1): 62.0,
    ("resonance", 2): 210.0,
    ("friction", 1): 8.0,
    ("inertia", 1): 1.5e-4,
}


def normal(rng: np.random.Generator, n: int) -> np.ndarray:
    return rng.standard_normal(n)


def heavy(rng: np.random.Generator, n: int) -> np.ndarray:
    return rng.standard_t(3, n) / math.sqrt(3.0)


def skewed(rng: np.random.Generator, n: int) -> np.ndarray:
    return rng.exponential(1.0, n) - 1.0


def linked(rng: np.random.Generator, n: int) -> np.ndarray:
    white, out = rng.standard_normal(n), np.zeros(n)
    out[0] = white[0]
    for i in range(1, n):
        out[i] = 0.6 * out[i - 1] + 0.8 * white[i]
    return out


def by_day(rng: np.random.Generator, n: int) -> np.ndarray:
    """The checks are made on another day than the baseline, which is as far away as repeats."""
    day = np.zeros(n)
    day[-2:] = rng.standard_normal()
    return rng.standard_normal(n) + day


def sometimes_wrong(rng: np.random.Generator, n: int) -> np.ndarray:
    return rng.standard_normal(n) * np.where(rng.random(n) < 0.03, 10.0, 1.0)


def drawn(
    rng: np.random.Generator, noise: Noise, repeats: int, factors: dict[tuple[Quantity, int], float]
) -> tuple[list[HealthRound], list[HealthRound]]:
    """A baseline and two checks whose true values are ``factors`` of the baseline's."""
    columns: list[list[HealthValue]] = [[] for _ in range(repeats + 2)]
    for (quantity, number), true in TRUE.items():
        errors = SPREAD[quantity] * noise(rng, repeats + 2)
        for index, error in enumerate(errors):
            factor = factors.get((quantity, number), 1.0) if index >= repeats else 1.0
            value = true * factor * math.exp(error)
            # Own intervals are too narrow by half, as those of results that repeat badly.
            wide = 0.5 * 1.96 * SPREAD[quantity] * value
            columns[index].append(
                HealthValue(
                    quantity=quantity,
                    number=number,
                    value=value,
                    low=value - wide,
                    high=value + wide,
                )
            )
    rounds = [HealthRound(values=tuple(column)) for column in columns]
    return rounds[:repeats], rounds[repeats:]


def alarms(found: list[Finding]) -> set[tuple[Quantity, int]]:
    return {(each.quantity, each.number) for each in found if each.code == "changed"}
