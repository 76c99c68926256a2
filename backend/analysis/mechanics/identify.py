"""From recordings to mechanics: direct estimate, delay, model, and estimate without images.

The steps of tuning.md section 2 in one call: a direct estimate; a continuous model fitted
through hold and sampling that also finds the delay; the direct estimate again, with the delay
and the folded images taken out. The corrected lines stay measurements: the model only supplies
the ratio between what sampling shows and what is there.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from backend.analysis.loop.loop_fit import fit_loop
from backend.analysis.mechanics.fit_problem import KnownInertia
from backend.analysis.mechanics.inertia_by_place import InertiaByPlace, inertia_by_place
from backend.analysis.mechanics.mode_uncertainty import ModeUncertainty, mode_uncertainties
from backend.analysis.mechanics.model_fit import Solution, fit_sampled_model, views_of
from backend.analysis.mechanics.reversals import with_balanced_reversals
from backend.analysis.response.distortion import Distortion, distortion
from backend.analysis.response.frf import Frf, estimate_periodic
from backend.analysis.response.path_fit import (
    at_whole_cycles,
    find_paths,
    moved_path,
    path_between,
    path_covariance,
    torque_left,
)
from backend.analysis.response.reference_gain import ReferenceLoop
from backend.analysis.response.sampled_model import LoopModel, SampledFit
from backend.analysis.response.sampling import (
    DIRECT_SHARE,
    USUAL_CURRENT_HZ,
    Hold,
    SignalPath,
    command_delay_s,
    cycles_of,
    delay_response,
    lag_response,
)
from backend.analysis.response.stated_band import (
    distorted,
    ended_where_unknown,
    pooled,
    unexplained,
    widened,
    without_images,
)
from backend.analysis.response.two_signals import ways_of
from backend.analysis.response.uncertainty import Shifted, Uncertainty
from backend.analysis.response.uncertainty import uncertainty as joint_uncertainty
from backend.analysis.signals.arrays import ComplexArray
from backend.analysis.signals.line_spectra import Quantity, Record, loop_spectra, speed_lag_s
from backend.analysis.signals.transient_removal import settled
from backend.analysis.thresholds import identify as threshold

TRUSTED_ERROR = threshold.TRUSTED_ERROR

_HOLDS: tuple[Hold, ...] = ("zero", "linear")


@dataclass(frozen=True)
class Identification:
    """Everything about one measurement of the mechanics.

    ``direct`` is the estimate with only hold, current loop and delay divided out and its honest
    band (0.25 of the sample rate); ``corrected`` has the folded images removed as well and holds
    to 0.4; ``fit`` is the model that did it. When no model fits (``trusted`` False), both are the
    plain estimate with a band of 0.1 of the sample rate. Where ``distortion`` shows play, the
    model is not trusted either: both are the direct estimate, without the lines beyond its band.
    """

    direct: Frf
    corrected: Frf
    fit: SampledFit
    trusted: bool = True
    distortion: Distortion | None = None
    modes: tuple[ModeUncertainty, ...] = ()
    """How exactly each mode of the model is known; empty where no model is trusted."""
    torque_dropped: bool = False
    """Whether the reported torque cannot be the mechanics' input, and was not used as such."""
    torque_unexplained: bool = False
    """Whether hold, delay and one lag do not explain the reported torque."""
    by_place: InertiaByPlace | None = None
    """The inertia's part that goes with the place; the band holds the response of all places."""


def identify_mechanics(
    records: tuple[Record, ...],
    path: SignalPath,
    quantity: Quantity,
    *,
    coulomb_nm: float | None = None,
    max_modes: int = 4,
    jitter_s: float = 0.0,
) -> Identification:
    """Mechanics from torque to velocity out of periodic recordings.

    ``quantity`` is *torque_mode* or *torque_injection*; ``path`` holds the known delays, what is
    left is found by the fit. ``coulomb_nm`` as in :func:`estimate_periodic`, None estimates it.
    """
    task = _Task(settled(records), quantity, max_modes, jitter_s)
    found = task.refined(task.trial(path, coulomb_nm), lambda _: path)
    if coulomb_nm is None:
        task, found = task.balanced(found)
    found, uncertainty = task.with_sure_modes(
        found, task.uncertainty(found, corner_known=True), True
    )
    return _identification(task, found, uncertainty)


def identify_with_path(
    records: tuple[Record, ...], path: SignalPath, quantity: Quantity, *, hold_known: bool,
    inertia: KnownInertia | None = None, loop: ReferenceLoop | None = None,
) -> Identification:  # fmt: skip
    """As `identify_mechanics`, with what ``path`` does not tell found from the recording.

    The torque alone cannot always tell whether setpoints are interpolated; the motion can: a
    wrong answer leaves a delay that is negative, or a roll-off that no mechanics have. Beside a
    closed loop, path and mechanics need each other, and are refined in turn. ``inertia`` is the
    whole axis', where moves have shown it. ``loop`` is the closed loop, where its
    reference has shown it: the path, too, is known then.
    """
    closed = quantity == "torque_injection"
    corner_known = path.current_bandwidth_hz is not None
    task = _Task(
        settled(records), quantity, inertia=inertia, loop=None if loop is None else loop.controller
    )
    if loop is None:
        paths = find_paths(task.records, path, loop_closed=closed, hold_known=hold_known)
    else:
        paths = (replace(loop.path, response_bandwidth_hz=path.response_bandwidth_hz),)
    if closed:
        trials, dropped = task.trials(paths), False
    else:
        task, trials, dropped = _by_motion(task, paths, corner_known)
    best = trials[0]

    def again(fit: SampledFit) -> SignalPath:  # only beside a closed loop
        known = replace(path, hold=fit.path.hold)
        return find_paths(
            task.records, known, loop_closed=True, hold_known=True, motion=fit, controller=task.loop
        )[0]  # fmt: skip

    task, found = task.balanced(task.refined(best, again))
    uncertainty = task.uncertainty(found, corner_known)
    by_torque = found.path
    for _ in range(threshold.PASSES if np.all(np.isfinite(uncertainty.path_step)) else 0):
        if np.all(np.abs(uncertainty.path_step) < threshold.SETTLED * uncertainty.path_std):
            break
        found = task.moved(found, uncertainty)
        uncertainty = task.uncertainty(found, corner_known, by_torque)
    found, uncertainty = task.with_sure_modes(found, uncertainty, corner_known)
    alike = [t for t in trials[1:] if _rank(t) < _rank(best) + threshold.UNDECIDED]
    made = _undecided(_identification(task, found, uncertainty), best, alike)
    unexplained_torque = (
        not closed
        and all(record.torque is not None for record in records)
        and torque_left(settled(records), made.fit.path) > threshold.TORQUE_LEFT
    )
    return replace(made, torque_dropped=dropped, torque_unexplained=unexplained_torque)


def _by_motion(
    task: _Task, paths: tuple[SignalPath, ...], corner_known: bool
) -> tuple[_Task, list[_Trial], bool]:
    """Trials without the reported torque, where that cannot be the mechanics' input; else with it.

    A torque that is reported late, or a copy of the demand, tells another path than the one to the
    mechanics. Collocated mechanics are passive, which the model's are by construction: a lag that
    is not there leaves them unexplained. So both holds are tried with ordinary paths that the
    motion alone moves, and taken where that explains the motion clearly better. The last value
    tells whether they were.

    A path that is odd by itself is tried from the motion's mechanics first: a search from nothing
    with a wrong path finds no end for long.
    """
    odd = _odd(task, paths[0], corner_known)
    trials = [] if odd else task.trials(paths)
    if trials and not _suspect(task, trials[0], corner_known):
        return task, trials, False
    alone = replace(task, records=tuple(replace(record, torque=None) for record in task.records))
    likeliest = trials[0].path if trials else paths[0]
    reported = likeliest.current_bandwidth_hz if corner_known else None
    found: list[_Trial] = []
    for corner in (reported or USUAL_CURRENT_HZ, threshold.SLOW_HZ):
        begun = replace(likeliest, current_bandwidth_hz=corner)
        found += [alone.at_cycles(begun, hold) for hold in _HOLDS]
        found.sort(key=_rank)
        found[0] = alone.by_motion(found[0])
        if found[0].fit.error < threshold.EXPLAINED:
            break
    found.sort(key=_rank)
    best = found[0].fit
    if not trials:
        begun_there = [task.trial(each, None, None, found[0].solution) for each in paths]
        if _explains(
            best, min(begun_there, key=_rank).fit, threshold.BY_FAR, threshold.FAR_CLEARLY
        ):
            return alone, found, True
        trials = task.trials(paths)
    if _explains(best, trials[0].fit, threshold.BY_MOTION, threshold.CLEARLY):
        return alone, found, True
    return task, trials, False


def _explains(one: SampledFit, other: SampledFit, by: float, share: float) -> bool:
    """Whether a fit is better than another by this much, and its misfit this share of it."""
    return one.score < other.score - by and one.error < share * other.error


def _odd(task: _Task, path: SignalPath, corner_known: bool) -> bool:
    """Whether the path that the reported torque tells is none of a torque that acts."""
    if any(record.torque is None for record in task.records):
        return False
    corner = path.current_bandwidth_hz or USUAL_CURRENT_HZ
    odd = not corner_known and not threshold.ORDINARY_HZ[0] < corner < threshold.ORDINARY_HZ[1]
    left = torque_left(task.records, path)
    # Parts of a cycle are no reason where they explain the torque to its rounding.
    parts = not at_whole_cycles(path) and left > threshold.ROUNDED
    return odd or parts or left > threshold.TORQUE_LEFT


def _suspect(task: _Task, trial: _Trial, corner_known: bool) -> bool:
    """Whether the motion shows that the reported torque may be another than what drives it."""
    if any(record.torque is None for record in task.records):
        return False
    late = abs(trial.fit.delay_s) > threshold.LEFT_BY_TORQUE_S
    return late or _odd(task, trial.path, corner_known) or _beyond_passive(trial)


def _beyond_passive(trial: _Trial) -> bool:
    """Whether lines show a phase that no passive mechanics have between torque and speed.

    Sampling folds a few degrees into the lines below a quarter of its rate.
    """
    frf = trial.views.position or trial.views.velocity
    late = trial.fit.position_delay_s if trial.views.position else trial.fit.delay_s
    use = (frf.frequency_hz < DIRECT_SHARE * frf.sample_rate_hz) & (
        frf.coherence > threshold.COHERENT
    )
    if np.count_nonzero(use) < threshold.FEW:
        return False
    true = frf.response[use] / delay_response(frf.frequency_hz[use], late)
    return (
        float(np.mean(np.abs(np.degrees(np.angle(true))) > 90.0 + threshold.PASSIVE_DEG))
        > threshold.PASSIVE_SHARE
    )


@dataclass(frozen=True)
class _Trial:
    """A fit, and the estimates and the path that it was made with."""

    views: _Views
    path: SignalPath
    solution: Solution

    @property
    def fit(self) -> SampledFit:
        """What it says."""
        return self.solution.fit


@dataclass(frozen=True)
class _Task:
    """What stays the same from trial to trial."""

    records: tuple[Record, ...]
    quantity: Quantity
    max_modes: int = 4
    jitter_s: float = 0.0
    inertia: KnownInertia | None = None
    loop: LoopModel | None = None

    def trial(
        self, path: SignalPath, coulomb_nm: float | None = None, motion: SampledFit | None = None,
        start: Solution | None = None,
    ) -> _Trial:  # fmt: skip
        """Estimates and fit with one path; ``motion`` is a fit before, which tells the images."""
        if self.quantity == "closed_loop":
            raise ValueError("mechanics are identified from torque, not from a loop's reference")
        views = self.views(path, coulomb_nm)
        solution = fit_sampled_model(
            views.velocity, path, from_position=views.position, loop=self._loop(path, motion),
            max_modes=self.max_modes, start=start, inertia=self.inertia,
        )  # fmt: skip
        return _Trial(views, path, solution)

    def trials(self, paths: tuple[SignalPath, ...]) -> list[_Trial]:
        """All that are worth it, best first: fractions of a cycle where no whole ones do.

        Torque and motion are reported together, so a path that leaves much delay is a wrong one.
        """
        first = [p for p in paths if at_whole_cycles(p)] or list(paths)
        tried = sorted((self.trial(p) for p in first), key=_rank)
        if abs(tried[0].fit.delay_s) * paths[0].sample_rate_hz > threshold.LEFT_LATE:
            tried += [self.trial(p) for p in paths if p not in first]
        return sorted(tried, key=_rank)

    def at_cycles(self, path: SignalPath, hold: Hold) -> _Trial:
        """A fit with this hold and the whole cycles of delay that leave the least of one."""
        rate = path.sample_rate_hz
        # What is too early shows as a delay that is left, what is too late may not.
        cycles = max(math.floor(path.command_delay_s * rate - 0.25), 0)
        late_s = command_delay_s(cycles, hold, rate)
        trial = self.trial(replace(path, hold=hold, command_delay_s=late_s))
        more = round(trial.fit.delay_s * rate)
        if more == 0 or cycles + more < 0:
            return trial
        late_s = command_delay_s(cycles + more, hold, rate)
        other = self.trial(replace(path, hold=hold, command_delay_s=late_s))
        return min(trial, other, key=_rank)

    def by_motion(self, trial: _Trial) -> _Trial:
        """The same with a path that only the motion moves, from where it is usual."""
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

    def views(self, path: SignalPath, coulomb_nm: float | None) -> _Views:
        """Estimates from what was recorded."""
        velocity = estimate_periodic(
            self.records, path, self.quantity, coulomb_nm=coulomb_nm, jitter_s=self.jitter_s
        )
        if any(record.position is None for record in self.records):
            return _Views(velocity, None)
        position = estimate_periodic(
            self.records, path, self.quantity, coulomb_nm=velocity.coulomb_nm,
            jitter_s=self.jitter_s, position=True,
        )  # fmt: skip
        return _Views(velocity, position)

    def refined(self, first: _Trial, path_of: Callable[[SampledFit], SignalPath]) -> _Trial:
        """Loop, path and mechanics in turn: each is needed to take the images out of the others."""
        last = first
        for _ in range(threshold.PASSES if self.quantity == "torque_injection" else 0):
            path = path_of(last.fit)
            change = abs(self._loop(path, last.fit).c0 / last.fit.loop.c0 - 1.0)
            if _alike(path, last.path) and change < 0.003:
                break
            last = self.trial(path, last.views.velocity.coulomb_nm, last.fit)
        return last

    def balanced(self, trial: _Trial) -> tuple[_Task, _Trial]:
        """The same refined with friction as the balance of torques tells it at reversals.

        The round whose friction leaves the realisations most alike: a balance that is off bends
        friction and damping against each other.
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
            anew = n == 0 and _hidden_by_friction(trial)
            last = task.trial(trial.path, None, motion, None if anew else last.solution)
            least = best[1].views.velocity.scatter_left
            if last.views.velocity.scatter_left < threshold.AS_ALIKE * least:
                best = task, last
        return best

    def with_sure_modes(
        self, trial: _Trial, uncertainty: Uncertainty, corner_known: bool
    ) -> tuple[_Trial, Uncertainty]:
        """The same with fewer modes as long as one of them may as well be none.

        Two that share what one does are as little known, each by itself.
        """
        motion = trial.fit if self.quantity == "torque_injection" else None
        while trial.fit.error <= TRUSTED_ERROR and _unsure(trial, uncertainty):
            task = replace(self, max_modes=len(trial.fit.model.modes) - 1)
            fewer = task.trial(trial.path, trial.views.velocity.coulomb_nm, motion)
            if fewer.fit.score > trial.fit.score + threshold.WORTH_A_MODE:
                break
            trial, uncertainty = fewer, task.uncertainty(fewer, corner_known)
        return trial, uncertainty

    def moved(self, trial: _Trial, uncertainty: Uncertainty) -> _Trial:
        """The same mechanics refined on the path that torque and motion together would have."""
        most = np.maximum(2.0 * uncertainty.path_std, threshold.LONGEST_STEP)
        step = np.clip(uncertainty.path_step, -most, most)
        path = moved_path(trial.path, float(step[0]), float(step[1]) if step.size > 1 else 0.0)
        motion = trial.fit if self.quantity == "torque_injection" else None
        return self.trial(path, trial.views.velocity.coulomb_nm, motion, trial.solution)

    def uncertainty(
        self, trial: _Trial, corner_known: bool, by_torque: SignalPath | None = None
    ) -> Uncertainty:
        """How far path and mechanics may be off together.

        ``by_torque`` is the path that the torque alone tells, where the trial has another one.
        """
        closed = self.quantity == "torque_injection"
        covariance = path_covariance(
            self.records, trial.path, loop_closed=closed, corner_known=corner_known,
            motion=trial.fit if closed else None, controller=self.loop,
        )  # fmt: skip
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
        """The controller that is closed meanwhile."""
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
    """Whether another fit of the mechanics would give the same."""
    apart = abs(one.command_delay_s - other.command_delay_s) * one.sample_rate_hz
    corners = (one.current_bandwidth_hz or 1.0) / (other.current_bandwidth_hz or 1.0)
    return one.hold == other.hold and apart < 0.01 and abs(np.log(corners)) < 0.03


def _rank(trial: _Trial) -> float:
    """Less is better."""
    return trial.fit.score + _implausible(trial.fit)


def _implausible(fit: SampledFit) -> float:
    """A drive does not report what has not happened yet, and takes setpoints at whole cycles."""
    path = fit.path
    first_s = min(fit.delay_s, fit.position_delay_s)
    early = max(-first_s * path.sample_rate_hz - 0.1, 0.0)
    cycles = cycles_of(path)
    return threshold.EARLY * early + threshold.FRACTION * abs(cycles - round(cycles))


def _identification(task: _Task, trial: _Trial, uncertainty: Uncertainty) -> Identification:
    """The estimates with what the fit found taken out."""
    views, path, fit = trial.views, trial.path, trial.fit
    spoilt = distortion(task.records, path, task.quantity, views.velocity)
    by_place = inertia_by_place(
        task.records, fit.path, task.quantity, views.velocity.coulomb_nm
    )  # fmt: skip

    def everywhere(frf: Frf) -> Frf:
        return frf if by_place is None else by_place.charged(frf)

    if fit.error > max(TRUSTED_ERROR, 1.5 * fit.noise):
        # A filter of the speed that nobody tells would stay in the lines; the position has none.
        if views.position is not None and path.response_bandwidth_hz is None:
            plain = unexplained(views.position, trial.solution, 1)
        else:
            plain = unexplained(views.velocity, trial.solution, 0)
        plain = everywhere(plain)
        return Identification(plain, plain, fit, False, spoilt, by_place=by_place)
    parts = ways_of(views.velocity, views.position, path, fit, uncertainty)
    # Images stay in the direct estimate: its band must contain them.
    direct = [widened(p.lines, p.factor, 1.0, p.direct) for p in parts]
    corrected = [without_images(p.lines, p.factor, task.jitter_s, p.corrected) for p in parts]
    # Play changes stiffness, and so everything above the frequency where it shows most.
    share = (
        np.maximum.accumulate(spoilt.share) if spoilt.play else threshold.AVERAGED * spoilt.share
    )
    best, lines = (everywhere(distorted(pooled(parts), share)) for parts in (corrected, direct))
    if spoilt.play:
        lines = lines.cut(lines.valid_band_hz[1])
        return Identification(lines, lines, fit, False, spoilt, by_place=by_place)
    best = ended_where_unknown(best)
    moved = None if by_place is None else by_place.share(best)
    uncertainties = tuple(
        each.with_band(mode, best.frequency_hz, spoilt.share, moved)
        for mode, each in zip(fit.model.modes, _mode_uncertainties(trial, uncertainty), strict=True)
    )
    return Identification(lines, best, fit, True, spoilt, uncertainties, by_place=by_place)


def _hidden_by_friction(trial: _Trial) -> bool:
    """Whether lines were so uncertain by friction that other mechanics may have been there."""
    uncertainty = trial.views.velocity.friction
    return (
        uncertainty is not None
        and float(np.mean(np.abs(uncertainty) > threshold.HIDDEN)) > threshold.HIDDEN_SHARE
    )


def _unsure(trial: _Trial, uncertainty: Uncertainty) -> bool:
    """Whether a mode within the band has a part in the response that may be nothing."""
    low, high = trial.views.velocity.frequency_hz[0], trial.fit.valid_band_hz[1]
    pairs = zip(trial.fit.model.modes, _mode_uncertainties(trial, uncertainty), strict=True)
    return any(d.residue > threshold.UNSURE and low < m.frequency_hz < high for m, d in pairs)


def _mode_uncertainties(trial: _Trial, uncertainty: Uncertainty) -> tuple[ModeUncertainty, ...]:
    """With what friction may do to all lines together."""
    given = [view for view in (trial.views.velocity, trial.views.position) if view is not None]
    together = [
        np.zeros(v.frequency_hz.size, np.complex128) if v.friction is None else v.friction
        for v in given
    ]
    return mode_uncertainties(
        trial.solution.problem, trial.solution.x, uncertainty.covariance, together,
        friction_seen=trial.views.velocity.coulomb_nm > 0,
    )  # fmt: skip


def _without_path(trial: _Trial) -> ComplexArray:
    """The velocity's response without delay, filter and images."""
    raw, fit = trial.views.velocity, trial.fit
    late = delay_response(raw.frequency_hz, fit.delay_s)
    if trial.path.response_bandwidth_hz is None:
        late = late * lag_response(raw.frequency_hz, fit.path.response_bandwidth_hz)
    return np.asarray(raw.response / late / fit.image_factor(raw.frequency_hz))


def _undecided(found: Identification, best: _Trial, others: list[_Trial]) -> Identification:
    """Charge to the band how far another path that explains as much would move the lines."""
    if not found.trusted or not others:
        return found
    apart = np.log(np.array([_without_path(t) for t in others]) / _without_path(best))
    size, turn = (np.max(np.abs(part), axis=0) * 0.5 for part in (apart.real, apart.imag))

    def wider(frf: Frf) -> Frf:
        return replace(
            frf,
            std_db=np.hypot(frf.std_db, 20 / np.log(10) * size),
            std_deg=np.hypot(frf.std_deg, np.degrees(turn)),
        )

    return replace(found, direct=wider(found.direct), corrected=wider(found.corrected))


@dataclass(frozen=True)
class _Views:
    """The same mechanics by way of the reported velocity and of the reported position."""

    velocity: Frf
    position: Frf | None
