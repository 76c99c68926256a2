"""Separates components that repeat per revolution (orders) from those that repeat in time.

At one constant speed both look the same. Over several speeds an order keeps its number of periods
per revolution, and a frequency its value in Hz; a component above half the sample rate is folded
and keeps neither.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy

from backend.analysis.signals.arrays import BoolArray, FloatArray, IntArray
from backend.analysis.thresholds import orders as threshold
from backend.analysis.vibration.sinusoids import Segment, Sinusoid, fitted

Kind = Literal["order", "frequency"]


@dataclass(frozen=True)
class Seen:
    """One sinusoid of one segment; ``speed`` is the index of the speed in the series of speeds."""

    segment: int
    speed: int
    speed_rps: float
    turns: float
    sinusoid: Sinusoid


@dataclass(frozen=True)
class Component:
    """A component common to several speeds: an order per revolution, or a frequency in Hz."""

    kind: Kind
    value: float
    ci95: tuple[float, float]
    speeds: int
    fastest_rps: float
    slowest_rps: float


def components(seen: Sequence[Seen]) -> tuple[list[Component], list[Seen]]:
    """Return the components, those seen at most speeds first, and the sinusoids of none."""
    left, found = list(seen), list[Component]()
    while True:
        best: tuple[tuple[int, float], Kind, list[Seen]] | None = None
        for kind in ("order", "frequency"):
            group = _largest(left, kind)
            if group is None:
                continue
            score = len({one.speed for one in group}), sum(_strength(one) for one in group)
            if best is None or score > best[0]:
                best = score, kind, group
        if best is None:
            return found, left
        _, kind, group = best
        found.append(_component(kind, group))
        taken = {id(one) for one in group}
        left = [one for one in left if id(one) not in taken]


def levels(
    segments: Sequence[Segment], found: Sequence[Component], band_hz: tuple[float, float]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return amplitudes of speed [segments, components], their deviations, and those of torque.

    NaN where a component is outside the band, has too few periods, or cannot be separated from
    another one. Where an order meets a frequency, the level is assigned to the order.
    """
    shape = len(segments), len(found)
    speed, deviation, torque = (np.full(shape, np.nan) for _ in range(3))
    for row, segment in enumerate(segments):
        hertz = np.array([_hz(each, segment.speed_rps) for each in found])
        shown = (hertz >= max(band_hz[0], threshold.PERIODS / segment.duration_s)) & (
            hertz <= band_hz[1]
        )
        shown &= _distinguished(hertz, shown, found, 1.0 / segment.duration_s)
        at = np.flatnonzero(shown).tolist()
        if not at:
            continue
        basis = [(float(hertz[i]), found[i].kind == "order") for i in at]
        amplitudes, deviations = fitted(segment, segment.speed, basis)
        speed[row, at], deviation[row, at] = np.abs(amplitudes), deviations
        torque[row, at] = np.abs(fitted(segment, segment.torque, basis)[0])
    return speed, deviation, torque


def _hz(component: Component, speed_rps: float) -> float:
    return component.value * speed_rps if component.kind == "order" else component.value


def _distinguished(
    hertz: FloatArray,
    shown: BoolArray,
    found: Sequence[Component],
    line_hz: float,
) -> BoolArray:
    clear = np.ones(hertz.size, np.bool_)
    for i in np.flatnonzero(shown).tolist():
        for j in np.flatnonzero(shown).tolist():
            close = i != j and abs(hertz[i] - hertz[j]) < threshold.APART * line_hz
            if close and (found[i].kind == "frequency" or found[j].kind == "order"):
                clear[i] = False
    return clear


def _strength(one: Seen) -> float:
    return one.sinusoid.amplitude / max(one.sinusoid.amplitude_deviation, 1e-300)


def _value(one: Seen, kind: Kind) -> float:
    f = one.sinusoid.frequency_hz
    return f / one.speed_rps if kind == "order" else f


def _deviation(one: Seen, kind: Kind) -> float:
    d = one.sinusoid.deviation_hz
    return d / one.speed_rps if kind == "order" else d


def _tolerance(one: Seen, kind: Kind) -> float:
    """Permitted distance from the others: multiple of its deviation, and a share of a line."""
    line = 1.0 / one.turns if kind == "order" else one.speed_rps / one.turns
    return threshold.DEVIATIONS * _deviation(one, kind) + threshold.OF_LINE * line


def _largest(left: Sequence[Seen], kind: Kind) -> list[Seen] | None:
    """The group about one value with most speeds; None where no group has enough."""
    if not left:
        return None
    value = np.array([_value(one, kind) for one in left])
    reach = np.array([_tolerance(one, kind) for one in left])
    strength = np.array([_strength(one) for one in left])
    speed = np.array([one.speed for one in left], np.int64)
    segment = np.array([one.segment for one in left], np.int64)
    best: tuple[tuple[int, float], IntArray] | None = None
    for centre in range(len(left)):
        near = np.flatnonzero(np.abs(value - value[centre]) <= np.hypot(reach, reach[centre]))
        # Keep the strongest sinusoid of each segment.
        near = near[np.argsort(-strength[near])]
        near = near[np.unique(segment[near], return_index=True)[1]]
        score = int(np.unique(speed[near]).size), float(np.sum(strength[near]))
        if best is None or score > best[0]:
            best = score, near
    assert best is not None
    group = [left[i] for i in best[1]]
    rps = [one.speed_rps for one in group]
    if best[0][0] < threshold.SPEEDS or max(rps) < threshold.SPAN * min(rps):
        return None
    return group


def _component(kind: Kind, group: Sequence[Seen]) -> Component:
    """Mean with its interval, which includes scatter of the values beyond their deviations."""
    value = np.array([_value(one, kind) for one in group])
    variance = np.array([_deviation(one, kind) ** 2 for one in group])
    weight = 1.0 / np.maximum(variance, 1e-24)
    mean = float(np.sum(weight * value) / np.sum(weight))
    # R. DerSimonian and N. Laird, Meta-analysis in clinical trials, 1986.
    excess = float(np.sum(weight * (value - mean) ** 2)) - (value.size - 1)
    scale = float(np.sum(weight) - np.sum(weight**2) / np.sum(weight))
    between = max(excess / scale, 0.0)
    weight = 1.0 / (np.maximum(variance, 1e-24) + between)
    mean = float(np.sum(weight * value) / np.sum(weight))
    # J. Hartung and G. Knapp, 2001: the scatter itself, with Student's t.
    spread = float(np.sum(weight * (value - mean) ** 2)) / (value.size - 1)
    error = np.sqrt(max(spread, 1.0) / float(np.sum(weight)))
    half = float(scipy.special.stdtrit(value.size - 1, 0.975) * error)
    rps = [one.speed_rps for one in group]
    return Component(
        kind,
        mean,
        (mean - half, mean + half),
        len({one.speed for one in group}),
        max(rps),
        min(rps),
    )
