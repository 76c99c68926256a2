"""Search for the notches and filters that permit the highest gain of a speed loop.

Greedy in the number of notches: the best of a family of shapes is added, then all are varied
together (a pattern search, Hooke & Jeeves 1961, and random steps, Rechenberg 1973) as long as the
design improves. A further notch need not be an improvement at its start: the notches before it were
shaped for a loop without it, and a threshold there would let noise decide between one notch and
two. A shape is rated by the highest gain that meets the goals for every plant that the axis may be;
most shapes are rejected by the peak sensitivity alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from backend.analysis.loop.loop_goals import (
    Goals,
    Worst,
    keeps,
    stable_with_less_gain,
    worst_of,
)
from backend.analysis.loop.loop_structure import TURN, DriveLoops, NotchResponse
from backend.analysis.loop.measured_plant import BEYOND, MeasuredPlant
from backend.analysis.loop.notch import Notch
from backend.analysis.mechanics.mechanical_model import MechanicalModel
from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.analysis.thresholds import loop_search as threshold

INTEGRAL_RATIO = threshold.INTEGRAL_RATIO
BEGUN = threshold.BEGUN
TRIED_AT_LAST = threshold.TRIED_AT_LAST
#: Where the gain below a bandwidth is evaluated, as logarithms of shares of it.
_DECADE = np.linspace(-np.log(10.0), 0.0, 24)


@dataclass(frozen=True)
class Shape:
    """The loop apart from its gain; ``choice`` is the index of the drive's filter setting."""

    notches: tuple[Notch, ...] = ()
    choice: int = 0

    @property
    def price(self) -> float:
        """Share of a bandwidth left after the cost of the notches and the filter choice."""
        return 1.0 - threshold.PRICE * (len(self.notches) + self.choice)


@dataclass(frozen=True)
class Found:
    """A shape with its highest permitted gain, as a bandwidth; 0 where no gain meets the goals.

    ``merit`` is that bandwidth times the gain that the notches leave in the decade below it, less
    the cost of the parts. A notch there that takes as much gain as it permits to add has no value.
    """

    shape: Shape
    bandwidth_hz: float
    merit: float


@dataclass
class LoopSearch:
    """Search for one axis: possible plants, the drive's loop, and the response of a realised notch.

    ``notch_response`` raises ValueError for a notch that the drive cannot realise.
    """

    plant: MeasuredPlant
    inertia_kgm2: float
    loops: DriveLoops
    notch_response: NotchResponse
    _made: dict[Notch, ComplexArray | None] = field(default_factory=dict)
    _levels: dict[Notch, FloatArray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.frequency_hz: FloatArray = self.plant.frequency_hz
        self._s = 1j * TURN * self.frequency_hz
        self._log_f = np.log(self.frequency_hz)
        self._shifts = self.plant.shifted()
        self._some = np.ascontiguousarray(self._shifts[:, :: threshold.SOME])
        self.filters = (self.loops.filters, *self.loops.choices)
        self._fixed = [self.loops.with_filters(f).response(self.frequency_hz) for f in self.filters]
        self._highest = (
            self.loops.highest_speed_bandwidth_hz or 0.5 * self.loops.current_bandwidth_hz
        )

    def fixed(self, shape: Shape) -> ComplexArray | None:
        """Return filters, notches, current loop and delay; None if the drive cannot
        realise them.
        """
        total = self._fixed[shape.choice]
        for notch in shape.notches:
            made = self._notch(notch)
            if made is None:
                return None
            total = np.asarray(total * made)
        return total

    def _notch(self, notch: Notch) -> ComplexArray | None:
        if notch not in self._made:
            try:
                self._made[notch] = self.notch_response(notch, self.frequency_hz)
            except ValueError:
                self._made[notch] = None
        return self._made[notch]

    def loops_at(self, fixed: ComplexArray, bandwidth_hz: float) -> ComplexArray:
        """Return the open speed loops [shifts, lines] at this bandwidth."""
        corner = TURN * bandwidth_hz / INTEGRAL_RATIO
        pi = TURN * bandwidth_hz * self.inertia_kgm2 * (1.0 + corner / self._s)
        return np.asarray(self._shifts * (fixed * pi))

    def worst(self, shape: Shape, bandwidth_hz: float) -> Worst:
        """Return the worst margins of a shape that the drive can realise."""
        fixed = self.fixed(shape)
        assert fixed is not None
        return worst_of(self.loops_at(fixed, bandwidth_hz))

    def _peaks_on_some(self, fixed: ComplexArray, bandwidth_hz: FloatArray) -> FloatArray:
        """Ms on some of the lines, for each bandwidth [n].

        A shape that fails on some of the lines need not be evaluated on all of them.
        """
        by_gain = fixed[:: threshold.SOME] * (TURN * self.inertia_kgm2)
        by_integral = by_gain * (TURN / INTEGRAL_RATIO / self._s[:: threshold.SOME])
        b = bandwidth_hz[:, None]
        loops = self._some * (b * (by_gain + b * by_integral))[:, None, :]
        distance = np.min((1.0 + loops.real) ** 2 + loops.imag**2, axis=(1, 2))
        return np.asarray(1.0 / np.sqrt(distance))

    def _keeps(self, fixed: ComplexArray, bandwidth_hz: float, goals: Goals) -> bool:
        if self._peaks_on_some(fixed, np.array([bandwidth_hz]))[0] > goals.ms:
            return False
        return keeps(self.loops_at(fixed, bandwidth_hz), goals)

    def _safe(self, fixed: ComplexArray, bandwidth_hz: float, goals: Goals) -> bool:
        loops = self.loops_at(fixed, bandwidth_hz)
        return keeps(loops, goals) and stable_with_less_gain(loops)

    def highest(self, shape: Shape, goals: Goals, above_hz: float = 0.0) -> float:
        """Return the highest bandwidth that meets the goals; 0 if it is not above ``above_hz``."""
        fixed = self.fixed(shape)
        lowest = max(above_hz * (1.0 + threshold.RESOLUTION), threshold.LOWEST_HZ)
        if fixed is None or lowest > self._highest:
            return 0.0
        # Search from the top: above a gain at which a resonance fails, a higher one may meet the
        # goals.
        count = 2 + int(np.log(self._highest / lowest) / np.log(threshold.COARSE))
        levels = np.exp(np.linspace(np.log(lowest), np.log(self._highest), count))
        possible = np.flatnonzero(self._peaks_on_some(fixed, levels) <= goals.ms)
        good = next((i for i in possible[::-1] if self._safe(fixed, levels[i], goals)), -1)
        if good < 0:
            return 0.0
        low, high = float(levels[good]), float(levels[min(good + 1, count - 1)])
        while high > low * (1.0 + threshold.RESOLUTION):
            middle = float(np.sqrt(low * high))
            low, high = (middle, high) if self._keeps(fixed, middle, goals) else (low, middle)
        return low if self._safe(fixed, low, goals) else float(levels[good])

    def best(self, goals: Goals, slots: int) -> list[Found]:
        """Return the best loops with no notch, one, two, … as long as each is an improvement."""
        best = self._wider(Found(Shape(), 0.0, 0.0), goals)
        kept = [best] if best.bandwidth_hz else []
        for count in range(1, slots + 1):
            found = begun = replace(best, merit=BEGUN * best.merit)
            for shape in self._seeds(best.shape, count):
                found = self.better(found, shape, goals)
            if found is begun:
                break
            found = self.shaken(self._refined(found, goals), goals, threshold.TRIED)
            if found.merit <= best.merit:
                break
            best = found
            kept.append(best)
        return kept

    def shaken(self, found: Found, goals: Goals, tries: int) -> Found:
        """Return the best result of ``tries`` random steps, which are the same on each call.

        The gain is limited by the worst of many loops, so a change of two coordinates may improve
        it where no single one does.
        """
        random, spread = np.random.default_rng(1), 1.0
        at = np.array([_coordinates(notch) for notch in found.shape.notches])
        low = np.array(
            [np.log(threshold.LOWEST_PLACE_HZ), np.log(threshold.NARROWEST), threshold.DEEPEST_DB]
        )
        high = np.array(
            [np.log(threshold.FARTHEST * self.plant.measured_hz), np.log(threshold.WIDEST), -1.0]
        )
        for _ in range(tries if at.size else 0):
            chosen = random.random(at.shape) < max(threshold.AT_ONCE, 1.0 / len(at))
            moved = at + spread * np.array(threshold.SPREAD) * random.normal(size=at.shape) * chosen
            moved = np.clip(moved, low, high)
            shape = replace(found.shape, notches=tuple(_of(*each) for each in moved))
            tried = self.better(found, shape, goals)
            if tried is not found:
                found, at, spread = tried, moved, min(threshold.WIDER * spread, 1.0)
            else:
                spread = threshold.NARROWER * spread if spread > threshold.FINEST else 1.0
        return found

    def better(self, incumbent: Found, shape: Shape, goals: Goals) -> Found:
        """Return the shape with its highest gain if its merit is higher, else the incumbent."""
        worth = shape.price * self._left(shape, incumbent.bandwidth_hz or threshold.LOWEST_HZ)
        if not worth:
            return incumbent
        reached = self.highest(shape, goals, incumbent.merit / worth)
        merit = reached * shape.price * self._left(shape, reached) if reached else 0.0
        return Found(shape, reached, merit) if merit > incumbent.merit else incumbent

    def _left(self, shape: Shape, bandwidth_hz: float) -> float:
        """Gain that the notches leave in the decade below a bandwidth; 0: not realisable."""
        total = 0.0
        grid = np.log(bandwidth_hz) + _DECADE
        for notch in shape.notches:
            made = self._notch(notch)
            if made is None:
                return 0.0
            if notch not in self._levels:
                self._levels[notch] = np.log(np.maximum(np.abs(made), 1e-6))
            total += float(np.mean(np.interp(grid, self._log_f, self._levels[notch])))
        return float(np.exp(total))

    def _wider(self, found: Found, goals: Goals) -> Found:
        for choice in range(len(self.filters)):
            found = self.better(found, replace(found.shape, choice=choice), goals)
        return found

    def _seeds(self, given: Shape, count: int) -> Iterator[Shape]:
        """Shapes with one more notch, and the same notch on all of the highest resonances."""
        ranked = _ranked(self.plant.model, BEYOND * self.plant.measured_hz)
        for place in self._places():
            for width in threshold.WIDTHS:
                for depth in threshold.DEPTHS:
                    one = Notch(place, width * place, depth)
                    if len(given.notches) < count:
                        yield replace(given, notches=(*given.notches, one))
                    if 1 < count <= len(ranked) and place == ranked[0]:
                        same = tuple(Notch(hz, width * hz, depth) for hz in ranked[:count])
                        yield replace(given, notches=same)

    def _places(self) -> list[float]:
        """Candidate notch centres: near the resonances, or near the end of the loop's band."""
        ranked = _ranked(self.plant.model, BEYOND * self.plant.measured_hz)
        places = [factor * hz for hz in ranked[:4] for factor in threshold.PLACES]
        top = threshold.FARTHEST * self.plant.measured_hz
        places += [x for x in (240.0, 480.0, 960.0) if x < top]
        return [hz for hz in places if threshold.LOWEST_PLACE_HZ < hz < top]

    def _refined(self, found: Found, goals: Goals) -> Found:
        """Vary all notches together as long as the gain rises."""
        for halving in range(threshold.HALVINGS):
            for _ in range(threshold.SWEEPS):
                before = found
                for number in range(len(found.shape.notches)):
                    for notch in _moved(found.shape.notches[number], 0.5**halving):
                        if notch.center_hz < threshold.FARTHEST * self.plant.measured_hz:
                            notches = list(found.shape.notches)
                            notches[number] = notch
                            shape = replace(found.shape, notches=tuple(notches))
                            found = self.better(found, shape, goals)
                found = self._wider(found, goals)
                if found is before:
                    break
        return found


def _coordinates(notch: Notch) -> tuple[float, float, float]:
    """Log centre, log of width over centre, and depth."""
    return np.log(notch.center_hz), np.log(notch.width_hz / notch.center_hz), notch.depth_db


def _of(centre: float, ratio: float, depth_db: float) -> Notch:
    return Notch(float(np.exp(centre)), float(np.exp(centre + ratio)), float(depth_db))


def _moved(notch: Notch, scale: float) -> Iterator[Notch]:
    """Neighbours of a notch in centre, width and depth."""
    centre, width, depth = (scale * x for x in threshold.STEP)
    for sign in (1.0, -1.0):
        factor = (1.0 + centre) ** sign
        yield Notch(notch.center_hz * factor, notch.width_hz * factor, notch.depth_db)
        ratio = notch.width_hz / notch.center_hz * (1.0 + width) ** sign
        if threshold.NARROWEST <= ratio <= threshold.WIDEST:
            yield Notch(notch.center_hz, ratio * notch.center_hz, notch.depth_db)
        deep = notch.depth_db + sign * depth
        if threshold.DEEPEST_DB <= deep <= -1.0:
            yield Notch(notch.center_hz, notch.width_hz, deep)


def _ranked(model: MechanicalModel, highest_hz: float) -> list[float]:
    """Resonances that rise above the rest, highest first.

    A mode above ``highest_hz`` stands for everything stiffer than what was measured: its exact
    frequency is not known, so it gets no notch.
    """
    heights = [
        (model.height_db(mode), mode.frequency_hz)
        for mode in model.modes
        if mode.frequency_hz <= highest_hz
    ]
    return [hz for height, hz in sorted(heights, reverse=True) if height > 2.0]
