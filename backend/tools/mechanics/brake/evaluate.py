"""Holding torque, windup and slip from recordings of a torque ramp. Pure: also from stored data."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Literal

import numpy as np
import numpy.typing as npt

from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.mechanics.brake.result import BrakeResult, BrakeWay, Means, Obstacle, Verdict
from backend.tools.mechanics.brake.settings import BrakeSettings
from backend.tools.thresholds import brake_evaluate as threshold
from backend.tools.tool import Arrays, Meta

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
_TURN = 2 * np.pi
PRELOAD = threshold.PRELOAD
_POINTS = 200


class Phase(IntEnum):
    """Phases of the sequence."""

    LEAD = 0
    PRELOADING = 1
    PRELOADED = 2
    RAMP = 3
    TOP = 4
    UNLOADING = 5
    UNLOADED = 6
    END = 7


@dataclass(frozen=True)
class Trial:
    """One direction, [n]: ``phase`` is the planned phase of each sample.

    ``halted``: a limit of travel or speed ended it; from then on ``sent_nm`` is zero.
    """

    direction: Literal[1, -1]
    position_rad: FloatArray
    torque_nm: FloatArray
    sent_nm: FloatArray
    phase: npt.NDArray[np.int64]
    valid: BoolArray
    halted: bool


@dataclass(frozen=True)
class Trials:
    """Raw data of both directions, and facts about them; ``test_percent`` of rated torque."""

    trials: tuple[Trial, ...]
    sample_rate_hz: float
    torque_step_nm: float
    test_percent: float
    means: Means
    measured_at: str

    def arrays(self) -> dict[str, npt.NDArray[np.generic]]:
        """The samples as arrays for storage."""
        names = ("position_rad", "torque_nm", "sent_nm", "phase", "valid")
        found: dict[str, npt.NDArray[np.generic]] = {
            name: np.concatenate([getattr(each, name) for each in self.trials]) for name in names
        }
        way = [np.full(each.phase.size, each.direction, np.int64) for each in self.trials]
        return {**found, "way": np.concatenate(way)}

    def facts(self) -> dict[str, object]:
        """The scalar facts for storage, with the arrays."""
        return {
            "sample_rate_hz": self.sample_rate_hz,
            "torque_step_nm": self.torque_step_nm,
            "test_percent": self.test_percent,
            "means": self.means,
            "measured_at": self.measured_at,
            "halted": [each.direction for each in self.trials if each.halted],
        }


def reevaluate(arrays: Arrays, meta: Meta) -> BrakeResult:
    """Evaluate stored raw data again.

    Raises:
        ValueError: not the raw data of a brake test.
    """
    given, facts, halted = meta.get("settings"), meta.get("facts"), meta.get("halted")
    if (
        not isinstance(given, dict)
        or not isinstance(facts, dict)
        or "way" not in arrays
        or not isinstance(halted, list)
    ):
        raise ValueError("not the raw data of a brake test")
    way = np.asarray(arrays["way"], np.int64)
    trials = []
    directions: tuple[Literal[1, -1], ...] = (1, -1)
    for direction in directions:
        at = way == direction
        if np.any(at):
            trials.append(
                Trial(
                    direction,
                    np.asarray(arrays["position_rad"], np.float64)[at],
                    np.asarray(arrays["torque_nm"], np.float64)[at],
                    np.asarray(arrays["sent_nm"], np.float64)[at],
                    np.asarray(arrays["phase"], np.int64)[at],
                    np.asarray(arrays["valid"], np.bool_)[at],
                    direction in halted,
                )
            )
    test = Trials(
        tuple(trials),
        float(str(meta["sample_rate_hz"])),
        float(str(meta["torque_step_nm"])),
        float(str(meta["test_percent"])),
        "supply" if meta["means"] == "supply" else "output",
        str(meta["measured_at"]),
    )
    return evaluate(test, BrakeSettings.model_validate(given), AxisFacts(**facts))


def evaluate(test: Trials, settings: BrakeSettings, facts: AxisFacts) -> BrakeResult:
    """Result of both directions."""
    limit = settings.envelope.travel_rev
    each = [_Way(trial, test, facts.rated_torque_nm, limit) for trial in test.trials]
    seen = [way for way in each if not way.lost()]
    lost = len(seen) < len(each)
    ways = tuple(way.judged()[0] for way in seen)
    unknown: list[Verdict] = ["cannot_be_tested"] if lost else []
    verdict = _worst([*(way.verdict for way in ways), *unknown])
    least: float | None = min((way.torque_percent for way in ways), default=None)
    if lost and verdict == "cannot_be_tested":
        # The direction that was not seen may have carried less.
        least = None
    rated = facts.rated_torque_nm if facts.torque_known else None
    of_brake = None
    if least is not None and rated is not None and settings.brake_rated_nm is not None:
        of_brake = least * rated / settings.brake_rated_nm
    obstacle: Obstacle | None = None
    if verdict == "cannot_be_tested" and lost:
        obstacle = "samples_lost"
    elif verdict == "cannot_be_tested" and any(trial.halted for trial in test.trials):
        obstacle = "windup_beyond_limit"
    return BrakeResult(
        verdict=verdict, obstacle=obstacle, means=test.means, measured_at=test.measured_at,
        rated_torque_nm=rated, brake_rated_nm=settings.brake_rated_nm,
        test_percent=test.test_percent, slip_limit_rev=limit, torque_percent=least,
        of_brake_percent=of_brake, ways=ways,
    )  # fmt: skip


def _worst(verdicts: Sequence[Verdict]) -> Verdict:
    order: tuple[Verdict, ...] = ("not_closed", "slipped", "cannot_be_tested", "held")
    return next(each for each in order if each in verdicts)


class _Way:
    """One direction, with signs such that its torque is positive."""

    def __init__(self, trial: Trial, test: Trials, rated_nm: float, limit_rev: float) -> None:
        self._trial, self._limit, self._rate = trial, limit_rev, test.sample_rate_hz
        self._asked = test.test_percent
        self._step = 100.0 * test.torque_step_nm / rated_nm
        start = self._still(trial.position_rad, Phase.LEAD)
        if not np.any(trial.valid & (trial.phase == Phase.LEAD)) and np.any(trial.valid):
            start = float(trial.position_rad[np.argmax(trial.valid)])
        self._travel = trial.direction * (trial.position_rad - start) / _TURN
        self._torque = 100.0 * trial.direction * trial.torque_nm / rated_nm
        lead = self._travel[(trial.phase == Phase.LEAD) & trial.valid]
        self._noise = float(np.std(lead)) if lead.size else 0.0
        self._end = self._halted_at()

    def _still(self, signal: FloatArray, phase: Phase) -> float:
        """Median over the second half of a phase; 0 without valid samples."""
        at = np.flatnonzero((self._trial.phase == phase) & self._trial.valid)
        return float(np.median(signal[at[at.size // 2 :]])) if at.size else 0.0

    def _halted_at(self) -> int:
        """Index of the first sample after the torque was removed; the sample count if none."""
        sent = np.abs(self._trial.sent_nm) > 0
        if not self._trial.halted or not np.any(sent):
            return sent.size
        return int(np.flatnonzero(sent)[-1]) + 1

    def lost(self) -> bool:
        """Whether what a verdict is read from was lost on the bus."""
        phase, valid = self._trial.phase, self._trial.valid
        reached = bool(np.any(phase >= Phase.RAMP))
        needed = [Phase.LEAD, Phase.PRELOADED] if reached else []
        if not self._trial.halted:
            needed = [Phase.LEAD, Phase.PRELOADED, Phase.TOP, Phase.UNLOADED]
        if any(not np.any(valid & (phase == each)) for each in needed):
            return True
        ramp, loaded = phase == Phase.RAMP, np.arange(phase.size) < self._end
        if np.count_nonzero(ramp & valid & loaded) >= 2 * threshold.PARTS:
            return False
        # Of a halted ramp it is known where the torque was gone, not where it was.
        gone = valid & (self._trial.sent_nm == 0.0)
        return not self._trial.halted or int(np.sum(ramp & ~gone)) >= 2 * threshold.PARTS

    def judged(self) -> tuple[BrakeWay, float]:
        """Result of the direction, and its compliance [revolutions per %]."""
        phase, valid = self._trial.phase, self._trial.valid
        before = np.arange(phase.size) < self._end
        loading = np.flatnonzero(((phase == Phase.RAMP) | (phase == Phase.TOP)) & valid & before)
        ramp = loading[phase[loading] == Phase.RAMP]
        if ramp.size < 2 * threshold.PARTS:
            return self._not_closed(), 0.0
        torque_0 = self._still(self._torque, Phase.PRELOADED)
        travel_0 = self._still(self._travel, Phase.PRELOADED)
        way, torque = self._travel - travel_0, self._torque - torque_0
        compliance = _compliance(way[ramp], torque[ramp])
        beyond = way[loading] - compliance * torque[loading]
        slips = max(threshold.DEVIATIONS * self._noise, threshold.OF_LIMIT * self._limit)
        over = np.flatnonzero(beyond > slips)
        top = loading[phase[loading] == Phase.TOP]
        slip = self._slip(travel_0, beyond)
        verdict: Verdict = "held"
        if self._trial.halted:
            verdict = "slipped" if over.size else "cannot_be_tested"
        elif slip >= self._limit:
            verdict = "slipped"
        if verdict == "slipped" or not top.size:
            onset = self._onset(loading, beyond, slips)
            last = loading[over[0]] if over.size else loading[-1]
            ends = (self._near(onset), self._near(last))
            carried = self._near(onset)
        else:
            carried = float(np.mean(self._torque[top]))
            ends = (carried, carried)
        if verdict == "held" and carried < threshold.SHORT * self._asked:
            # Of a brake that carries what the drive reached, nothing is known beyond that.
            verdict = "cannot_be_tested"
        return self._made(verdict, carried, ends, way, compliance, slip, loading), compliance

    def _slip(self, travel_0: float, beyond: FloatArray) -> float:
        """Travel left at the same torque; of a halted test, the largest travel seen [rev]."""
        if self._trial.halted:
            return max(float(np.max(beyond)), 0.0)
        return max(self._still(self._travel, Phase.UNLOADED) - travel_0, 0.0)

    def _onset(self, loading: npt.NDArray[np.int64], beyond: FloatArray, slips: float) -> int:
        """Index of the last sample on the elastic line before the travel left it."""
        over = np.flatnonzero(beyond > slips)
        first = int(over[0]) if over.size else loading.size - 1
        line = np.flatnonzero(beyond[: first + 1] <= 0.2 * slips)
        return int(loading[line[-1]]) if line.size else int(loading[first])

    def _near(self, place: int) -> float:
        """Mean torque over the last `threshold.ONSET_S` before this sample [% of rated]."""
        begin = max(0, place - round(threshold.ONSET_S * self._rate))
        part = slice(begin, place + 1)
        return float(np.mean(self._torque[part][self._trial.valid[part]]))

    def _made(
        self, verdict: Verdict, carried: float, ends: tuple[float, float], way: FloatArray,
        compliance: float, slip: float, loading: npt.NDArray[np.int64],
    ) -> BrakeWay:  # fmt: skip
        quiet = self._torque[(self._trial.phase == Phase.LEAD) & self._trial.valid]
        scatter = float(np.std(quiet)) if quiet.size else 0.0
        half = 0.5 * self._step + scatter + threshold.SHARE * abs(carried)
        low, high = min(ends) - half, max(ends) + half
        shown = loading[:: max(1, -(-loading.size // _POINTS))]
        most = float(np.max(self._torque[loading])) - self._still(self._torque, Phase.PRELOADED)
        after = np.flatnonzero(self._trial.valid & (self._trial.phase >= Phase.RAMP))
        return BrakeWay(
            direction=self._trial.direction,
            verdict=verdict,
            torque_percent=carried,
            torque_ci95_percent=(low, high),
            travel_rev=float(np.max(way[after])),
            windup_rev=compliance * most,
            slip_rev=slip,
            abort_ms=self._abort_ms(),
            curve_travel_rev=tuple(map(float, way[shown])),
            curve_torque_percent=tuple(map(float, self._torque[shown])),
        )

    def _abort_ms(self) -> float | None:
        """Time from the first sample beyond the travel limit until the torque was gone [ms]."""
        out = np.flatnonzero((self._travel >= self._limit) & self._trial.valid)
        if not self._trial.halted or not out.size:
            return None
        first = int(out[0])
        left = threshold.GONE * abs(self._torque[max(first - 1, 0)])
        gone = np.flatnonzero((np.abs(self._torque[first:]) <= left) & self._trial.valid[first:])
        return 1e3 * float(gone[0]) / self._rate if gone.size else None

    def _not_closed(self) -> BrakeWay:
        """Result for motion before the preload was reached: the brake is open, or hardly holds."""
        valid = self._trial.valid & (np.arange(self._trial.valid.size) < self._end)
        most = float(np.max(self._torque[valid], initial=0.0))
        travel = float(np.max(self._travel[self._trial.valid], initial=0.0))
        return BrakeWay(
            direction=self._trial.direction, verdict="not_closed", torque_percent=0.0,
            torque_ci95_percent=(0.0, most + 0.5 * self._step), travel_rev=travel, windup_rev=0.0,
            slip_rev=travel, abort_ms=self._abort_ms(), curve_travel_rev=(),
            curve_torque_percent=(),
        )  # fmt: skip


def _compliance(way: FloatArray, torque: FloatArray) -> float:
    """Slope of the stiffer parts of the ramp [revolutions per %]; elsewhere it may slip."""
    edges = np.linspace(float(torque[0]), float(np.max(torque)), threshold.PARTS + 1)
    slopes = []
    for low, high in itertools.pairwise(edges):
        at = (torque >= low) & (torque <= high)
        if np.count_nonzero(at) >= 4 and float(np.ptp(torque[at])) > 0.0:
            slopes.append(float(np.polyfit(torque[at], way[at], 1)[0]))
    return max(float(np.quantile(slopes, threshold.STIFF_QUANTILE)), 0.0) if slopes else 0.0
