"""Trials of an identification: estimates and fits with one path each, refined in turn."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from backend.analysis.loop.loop_fit import fit_loop
from backend.analysis.mechanics.identification.fit_problem import KnownInertia
from backend.analysis.mechanics.identification.mode_uncertainty import (
    ModeUncertainty,
    mode_uncertainties,
)
from backend.analysis.mechanics.identification.model_fit import (
    Solution,
    fit_sampled_model,
    views_of,
)
from backend.analysis.mechanics.reversals import with_balanced_reversals
from backend.analysis.response.frf import Frf, estimate_periodic
from backend.analysis.response.reported_signals.reported_speed import (
    with_position_speed,
    without_weight,
)
from backend.analysis.response.signal_path.path_fit import (
    at_whole_cycles,
    moved_path,
    path_between,
    path_covariance,
)
from backend.analysis.response.signal_path.sampled_model import LoopModel, SampledFit
from backend.analysis.response.signal_path.sampling import (
    Hold,
    SignalPath,
    command_delay_s,
    cycles_of,
)
from backend.analysis.response.uncertainty import Shifted, Uncertainty
from backend.analysis.response.uncertainty import uncertainty as joint_uncertainty
from backend.analysis.signals.line_spectra import Quantity, Record, loop_spectra, speed_lag_s
from backend.analysis.thresholds import identify as threshold

TRUSTED_ERROR = threshold.TRUSTED_ERROR


@dataclass(frozen=True)
class Views:
    """Estimates of the same mechanics from the reported velocity and from the reported position."""

    velocity: Frf
    position: Frf | None
    speed_used: bool = True
    """Whether the reported speed counts; without it ``velocity`` is derived, without weight."""


@dataclass(frozen=True)
class Trial:
    """A fit, with the estimates and the path that it was made with."""

    views: Views
    path: SignalPath
    solution: Solution

    @property
    def fit(self) -> SampledFit:
        """The fitted mechanics."""
        return self.solution.fit


@dataclass(frozen=True)
class Task:
    """Data and settings common to all trials."""

    records: tuple[Record, ...]
    quantity: Quantity
    max_modes: int = 4
    jitter_s: float = 0.0
    inertia: KnownInertia | None = None
    loop: LoopModel | None = None
    speed_used: bool = True
    """Whether the reported speed counts; without it only the position shows the motion."""

    def without_speed(self) -> Task:
        """Return the task with the position alone as the motion."""
        records = tuple(with_position_speed(record) for record in self.records)
        return replace(self, records=records, speed_used=False)

    def trial(
        self,
        path: SignalPath,
        coulomb_nm: float | None = None,
        motion: SampledFit | None = None,
        start: Solution | None = None,
        longest_delay_s: float | None = None,
        *,
        to_whole_cycles: bool = False,
    ) -> Trial:
        """Return estimates and fit with one path; ``motion``: an earlier fit, to correct images.

        ``longest_delay_s`` and ``to_whole_cycles`` as in `fit_sampled_model`.
        """
        if self.quantity == "closed_loop":
            raise ValueError("mechanics are identified from torque, not from a loop's reference")
        views = self.views(path, coulomb_nm)
        solution = fit_sampled_model(
            views.velocity,
            path,
            from_position=views.position,
            loop=self._loop(path, motion),
            max_modes=self.max_modes,
            longest_delay_s=longest_delay_s,
            to_whole_cycles=to_whole_cycles,
            start=start,
            inertia=self.inertia,
        )
        return Trial(views, path, solution)

    def trials(self, paths: tuple[SignalPath, ...]) -> list[Trial]:
        """Return all relevant trials, best first; fractions of a cycle only where whole ones fail.

        Torque and motion are reported together, so a path that leaves a large delay is wrong.
        """
        first = [p for p in paths if at_whole_cycles(p)] or list(paths)
        tried = sorted((self.trial(p) for p in first), key=rank)
        if abs(tried[0].fit.delay_s) * paths[0].sample_rate_hz > threshold.LEFT_LATE:
            tried += [self.trial(p) for p in paths if p not in first]
        return sorted(tried, key=rank)

    def of_both_holds(self, path: SignalPath) -> list[Trial]:
        """Return the fits with this path's corner and each hold at its best cycles, best first.

        What one hold leaves of the delay is where the search with the other one begins.
        """
        held = self.at_cycles(path, "zero")
        rate = path.sample_rate_hz
        # Half a cycle more passes until a line than until a step.
        known_s = held.path.command_delay_s + held.fit.delay_s - 0.5 / rate
        late_s = max(known_s, command_delay_s(0, "linear", rate))
        line = self.at_cycles(replace(path, command_delay_s=late_s), "linear", 1.0 / rate)
        return sorted([held, line], key=rank)

    def at_cycles(
        self, path: SignalPath, hold: Hold, longest_delay_s: float | None = None
    ) -> Trial:
        """Return the fit with this hold and the whole cycles that leave the least delay.

        ``longest_delay_s`` is the longest delay searched for beyond the path's.
        """
        rate = path.sample_rate_hz
        # A path that is too early shows as a remaining delay; one that is too late may not.
        cycles = max(math.floor(path.command_delay_s * rate - 0.25), 0)
        late_s = command_delay_s(cycles, hold, rate)
        begun = replace(path, hold=hold, command_delay_s=late_s)
        trial = self.trial(begun, longest_delay_s=longest_delay_s, to_whole_cycles=True)
        more = round(trial.fit.delay_s * rate)
        if more == 0 or cycles + more < 0:
            return trial
        late_s = command_delay_s(cycles + more, hold, rate)
        # The delay was searched for: what is left of it is a part of a cycle.
        other = self.trial(replace(begun, command_delay_s=late_s), longest_delay_s=0.5 / rate)
        return min(trial, other, key=rank)

    def by_motion(self, trial: Trial) -> Trial:
        """Return the trial refined with a path that only the motion adjusts, from the usual one."""
        for _ in range(threshold.MOTION_PASSES):
            uncertainty = self.uncertainty(trial, corner_known=False)
            finite = np.all(np.isfinite(uncertainty.path_step))
            if not finite or np.all(
                np.abs(uncertainty.path_step) < threshold.SETTLED * uncertainty.path_std
            ):
                break
            moved = self.moved(trial, uncertainty)
            if moved.fit.score >= trial.fit.score:
                break
            trial = moved
        return trial

    def views(self, path: SignalPath, coulomb_nm: float | None) -> Views:
        """Return the estimates from the recordings."""
        velocity = estimate_periodic(
            self.records, path, self.quantity, coulomb_nm=coulomb_nm, jitter_s=self.jitter_s
        )
        if any(record.position is None for record in self.records):
            return Views(velocity, None)
        position = estimate_periodic(
            self.records,
            path,
            self.quantity,
            coulomb_nm=velocity.coulomb_nm,
            jitter_s=self.jitter_s,
            position=True,
        )
        if not self.speed_used:
            return Views(without_weight(velocity), position, speed_used=False)
        return Views(velocity, position)

    def refined(self, first: Trial, path_of: Callable[[SampledFit], SignalPath]) -> Trial:
        """Refine loop, path and mechanics alternately: each corrects the images in the others."""
        last = first
        for _ in range(threshold.PASSES if self.quantity == "torque_injection" else 0):
            path = path_of(last.fit)
            change = abs(self._loop(path, last.fit).c0 / last.fit.loop.c0 - 1.0)
            if _alike(path, last.path) and change < 0.003:
                break
            last = self.trial(path, last.views.velocity.coulomb_nm, last.fit)
        return last

    def balanced(self, trial: Trial) -> tuple[Task, Trial]:
        """Return the trial refined with friction at reversals taken from the balance of torques.

        The round is kept whose friction makes the realisations most alike: an error of the balance
        distorts friction and damping against each other.
        """
        task, last = self, trial
        best = task, last
        lag_s = speed_lag_s(self.records, trial.path)
        motion = trial.fit if self.quantity == "torque_injection" else None
        for n in range(threshold.BALANCES):
            if last.fit.error > max(TRUSTED_ERROR, 1.5 * last.fit.noise):
                break
            friction_nm = last.views.velocity.coulomb_nm
            reported = with_balanced_reversals(
                self.records, self.quantity, last.fit, friction_nm, lag_s
            )
            task = replace(self, records=reported)
            fresh = n == 0 and _hidden_by_friction(trial)
            last = task.trial(trial.path, None, motion, None if fresh else last.solution)
            least = best[1].views.velocity.scatter_left
            if last.views.velocity.scatter_left < threshold.AS_ALIKE * least:
                best = task, last
        return best

    def with_sure_modes(
        self, trial: Trial, uncertainty: Uncertainty, corner_known: bool
    ) -> tuple[Trial, Uncertainty]:
        """Return the trial with fewer modes as long as one of them may not exist.

        Two modes that share the response of one are individually uncertain as well.
        """
        motion = trial.fit if self.quantity == "torque_injection" else None
        while trial.fit.error <= TRUSTED_ERROR and _unsure(trial, uncertainty):
            task = replace(self, max_modes=len(trial.fit.model.modes) - 1)
            fewer = task.trial(trial.path, trial.views.velocity.coulomb_nm, motion)
            if fewer.fit.score > trial.fit.score + threshold.WORTH_A_MODE:
                break
            trial, uncertainty = fewer, task.uncertainty(fewer, corner_known)
        return trial, uncertainty

    def moved(self, trial: Trial, uncertainty: Uncertainty) -> Trial:
        """Return the trial refined on the path that torque and motion together determine."""
        most = np.maximum(2.0 * uncertainty.path_std, threshold.LONGEST_STEP)
        step = np.clip(uncertainty.path_step, -most, most)
        path = moved_path(trial.path, float(step[0]), float(step[1]) if step.size > 1 else 0.0)
        motion = trial.fit if self.quantity == "torque_injection" else None
        return self.trial(path, trial.views.velocity.coulomb_nm, motion, trial.solution)

    def uncertainty(
        self, trial: Trial, corner_known: bool, by_torque: SignalPath | None = None
    ) -> Uncertainty:
        """Return the joint uncertainty of path and mechanics.

        ``by_torque`` is the path that the torque alone shows, where the trial has another one.
        """
        closed = self.quantity == "torque_injection"
        covariance = path_covariance(
            self.records,
            trial.path,
            loop_closed=closed,
            corner_known=corner_known,
            motion=trial.fit if closed else None,
            controller=self.loop,
        )
        problem = trial.solution.problem
        shifted = []
        for n in range(len(covariance)):
            path = moved_path(trial.path, threshold.STEP * (n == 0), threshold.STEP * (n == 1))
            other = self.views(path, trial.views.velocity.coulomb_nm)
            seen = views_of(other.velocity, other.position, path, trial.fit.loop)
            views = tuple(
                replace(v, g=o.g, sampler=o.sampler)
                for v, o in zip(problem.views, seen, strict=True)
            )
            shifted.append(Shifted(views, threshold.STEP))
        moved = path_between(by_torque or trial.path, trial.path)[: len(covariance)]
        return joint_uncertainty(problem, trial.solution.x, shifted, covariance, moved)

    def _loop(self, path: SignalPath, motion: SampledFit | None) -> LoopModel:
        """The controller that is active during the measurement."""
        if self.quantity == "torque_mode":
            return LoopModel()
        if self.loop is not None:
            return self.loop
        own, velocity = loop_spectra(self.records, path)
        lines = self.records[0].excitation.line_hz
        if motion is not None:
            own = own / motion.loop_image_factor(lines)
        return fit_loop(lines, own, velocity, path)


def _alike(one: SignalPath, other: SignalPath) -> bool:
    """Whether a fit of the mechanics would be the same with both paths."""
    apart = abs(one.command_delay_s - other.command_delay_s) * one.sample_rate_hz
    corners = (one.current_bandwidth_hz or 1.0) / (other.current_bandwidth_hz or 1.0)
    return one.hold == other.hold and apart < 0.01 and abs(np.log(corners)) < 0.03


def rank(trial: Trial) -> float:
    """Return the rank of a trial; lower is better."""
    return trial.fit.score + _implausible(trial.fit)


def _implausible(fit: SampledFit) -> float:
    """Penalty: a drive reports nothing before it happens, and takes setpoints at whole cycles."""
    path = fit.path
    first_s = min(fit.delay_s, fit.position_delay_s)
    early = max(-first_s * path.sample_rate_hz - 0.1, 0.0)
    cycles = cycles_of(path)
    return threshold.EARLY * early + threshold.FRACTION * abs(cycles - round(cycles))


def _hidden_by_friction(trial: Trial) -> bool:
    """Whether friction made lines so uncertain that other mechanics may have been hidden."""
    uncertainty = trial.views.velocity.friction
    return (
        uncertainty is not None
        and float(np.mean(np.abs(uncertainty) > threshold.HIDDEN)) > threshold.HIDDEN_SHARE
    )


def _unsure(trial: Trial, uncertainty: Uncertainty) -> bool:
    """Whether a mode within the band has a residue that may be zero."""
    low, high = trial.views.velocity.frequency_hz[0], trial.fit.valid_band_hz[1]
    pairs = zip(trial.fit.model.modes, mode_uncertainties_of(trial, uncertainty), strict=True)
    return any(d.residue > threshold.UNSURE and low < m.frequency_hz < high for m, d in pairs)


def mode_uncertainties_of(trial: Trial, uncertainty: Uncertainty) -> tuple[ModeUncertainty, ...]:
    """Return the uncertainties of the modes, with the common effect of friction on all lines."""
    given = [view for view in (trial.views.velocity, trial.views.position) if view is not None]
    together = [
        np.zeros(v.frequency_hz.size, np.complex128) if v.friction is None else v.friction
        for v in given
    ]
    return mode_uncertainties(
        trial.solution.problem,
        trial.solution.x,
        uncertainty.covariance,
        together,
        friction_seen=trial.views.velocity.coulomb_nm > 0,
    )
