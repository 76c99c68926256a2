"""Quantities of a health check from measured results, and their arrays for storage. Pure."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt

from backend.analysis.mechanics.resonance import Resonance
from backend.tools.mechanics.friction.result import FrictionPoint
from backend.tools.thresholds import health_evaluate as threshold
from backend.tools.tool import Arrays, Meta
from backend.tools.watching.health.result import (
    QUANTITIES,
    HealthResult,
    HealthRound,
    HealthValue,
    Quantity,
)


def resonances(found: Iterable[Resonance]) -> list[HealthValue]:
    """The lowest resonances and antiresonances, each kind by rising frequency."""
    values: list[HealthValue] = []
    kinds: tuple[Quantity, ...] = ("resonance", "antiresonance")
    rows = sorted(found, key=lambda row: row.frequency_hz)
    for kind in kinds:
        own = [row for row in rows if row.kind == kind][: threshold.FOLLOWED]
        for number, row in enumerate(own, 1):
            low, high = row.frequency_ci95_hz or (None, None)
            values.append(
                HealthValue(
                    quantity=kind, number=number, value=row.frequency_hz, low=low, high=high
                )
            )
    return values


def friction(points: Sequence[FrictionPoint]) -> HealthValue | None:
    """Mean friction over the speeds measured in both directions, in % of rated torque.

    Half the difference of both directions is free of the load's static torque. None where no speed
    was measured in both directions.
    """
    halves, variances = [], []
    for ahead in (each for each in points if each.speed_rpm > 0):
        back = min(
            (each for each in points if each.speed_rpm < 0),
            key=lambda each: abs(each.speed_rpm + ahead.speed_rpm),
            default=None,
        )
        if back is None or abs(back.speed_rpm / ahead.speed_rpm + 1.0) > threshold.SAME_SPEED:
            continue
        halves.append(0.5 * (ahead.torque_percent - back.torque_percent))
        deviations = [
            (each.torque_ci95_percent[1] - each.torque_ci95_percent[0]) / (2 * 1.96)
            for each in (ahead, back)
        ]
        variances.append(0.25 * sum(d**2 for d in deviations))
    if not halves:
        return None
    mean = sum(halves) / len(halves)
    half_width = 1.96 * math.sqrt(sum(variances)) / len(halves)
    return HealthValue(
        quantity="friction", value=mean, low=mean - half_width, high=mean + half_width
    )


def arrays_of(rounds: Sequence[HealthRound]) -> dict[str, npt.NDArray[np.generic]]:
    """Arrays for storage: one row per value; a missing quantity is a row without a value."""
    rows = [
        (index, QUANTITIES.index(each.quantity), each.number, each.value, each.low, each.high)
        for index, one in enumerate(rounds)
        for each in one.values
    ] + [
        (index, QUANTITIES.index(name), 0, math.nan, None, None)
        for index, one in enumerate(rounds)
        for name in one.missing
    ]
    table = np.array(
        [[math.nan if cell is None else cell for cell in row] for row in rows], np.float64
    ).reshape(-1, 6)
    return {"rows": table, "rounds": np.array([len(rounds)], np.int64)}


def reevaluate(arrays: Arrays, meta: Meta) -> HealthResult:
    """Restore the result from stored arrays.

    Raises:
        ValueError: the arrays are not those of a health check.
    """
    if meta.get("tool") != "health" or "rows" not in arrays:
        raise ValueError("no health check")
    values: list[list[HealthValue]] = [[] for _ in range(int(arrays["rounds"][0]))]
    missing: list[list[Quantity]] = [[] for _ in values]
    for row in np.asarray(arrays["rows"], np.float64):
        index, quantity, number = int(row[0]), QUANTITIES[int(row[1])], int(row[2])
        if number == 0:
            missing[index].append(quantity)
            continue
        value, low, high = (None if math.isnan(cell) else float(cell) for cell in row[3:])
        if value is None:
            raise ValueError("a quantity without a value")
        values[index].append(
            HealthValue(quantity=quantity, number=number, value=value, low=low, high=high)
        )
    return HealthResult(
        rounds=tuple(
            HealthRound(values=tuple(own), missing=tuple(gone))
            for own, gone in zip(values, missing, strict=True)
        )
    )
