"""Identification of mechanics: direct estimate, delay, model, and estimate without images.

The steps of tuning.md section 2 in one call: a direct estimate; a continuous model fitted
through hold and sampling that also finds the delay; the direct estimate again, with the delay
and the folded images removed. The corrected lines remain measurements: the model only supplies
the ratio between the sampled and the true response.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from backend.analysis.mechanics.identification.fit_problem import KnownInertia
from backend.analysis.mechanics.identification.identification_trials import (
    TRUSTED_ERROR,
    Task,
    Trial,
    mode_uncertainties_of,
    rank,
)
from backend.analysis.mechanics.identification.inertia_by_place import (
    InertiaByPlace,
    inertia_by_place,
)
from backend.analysis.mechanics.identification.mode_uncertainty import ModeUncertainty
from backend.analysis.response.distortion import Distortion, distortion
from backend.analysis.response.frf import Frf
from backend.analysis.response.reported_signals.reported import charged, current_uncertainty
from backend.analysis.response.reported_signals.reported_demand import (
    demand_path,
    with_acting_torque,
)
from backend.analysis.response.reported_signals.reported_speed import (
    signals_differ,
    speed_contradicts,
    speed_suspect,
    surely_contradicts,
)
from backend.analysis.response.signal_path.path_fit import (
    at_whole_cycles,
    find_paths,
    torque_left,
)
from backend.analysis.response.signal_path.reference_gain import ReferenceLoop
from backend.analysis.response.signal_path.sampled_model import SampledFit
from backend.analysis.response.signal_path.sampling import (
    DIRECT_SHARE,
    USUAL_CURRENT_HZ,
    SignalPath,
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
from backend.analysis.response.uncertainty import Uncertainty
from backend.analysis.signals.arrays import ComplexArray
from backend.analysis.signals.line_spectra import Quantity, Record
from backend.analysis.signals.transient_removal import settled
from backend.analysis.thresholds import identify as threshold
from backend.analysis.thresholds import model_fit


@dataclass(frozen=True)
class Identification:
    """The result of one measurement of the mechanics.

    ``direct`` is the estimate with only hold, current loop and delay divided out, and its band
    (0.25 of the sample rate); ``corrected`` has the folded images removed as well and is valid up
    to 0.4; ``fit`` is the model used for that. When no model fits (``trusted`` False), both are the
    plain estimate with a band of 0.1 of the sample rate. Where ``distortion`` shows backlash, the
    model is not trusted either: both are the direct estimate, without the lines beyond its band.
    """

    direct: Frf
    corrected: Frf
    fit: SampledFit
    trusted: bool = True
    distortion: Distortion | None = None
    modes: tuple[ModeUncertainty, ...] = ()
    """Uncertainty of each mode of the model; empty where no model is trusted."""
    torque_dropped: bool = False
    """Whether the reported torque cannot be the mechanics' input, and was not used as such."""
    torque_is_demand: bool = False
    """Whether the reported torque is the demand of a closed loop; its lag was then added."""
    speed_dropped: bool = False
    """Whether the reported speed contradicts the position, and was not used."""
    torque_unexplained: bool = False
    """Whether hold, delay and one lag do not explain the reported torque."""
    by_place: InertiaByPlace | None = None
    """The position-dependent part of the inertia; the band covers all positions."""


def identify_mechanics(
    records: tuple[Record, ...],
    path: SignalPath,
    quantity: Quantity,
    *,
    coulomb_nm: float | None = None,
    max_modes: int = 4,
    jitter_s: float = 0.0,
) -> Identification:
    """Identify the mechanics from torque to velocity from periodic recordings.

    ``quantity`` is *torque_mode* or *torque_injection*; ``path`` contains the known delays, the
    remaining delay is fitted. ``coulomb_nm`` as in :func:`estimate_periodic`, None estimates it.
    """
    task = Task(settled(records), quantity, max_modes, jitter_s)
    found = task.refined(task.trial(path, coulomb_nm), lambda _: path)
    if coulomb_nm is None:
        task, found = task.balanced(found)
    found, uncertainty = task.with_sure_modes(
        found, task.uncertainty(found, corner_known=True), True
    )
    return _identification(task, found, uncertainty)


def identify_with_path(
    records: tuple[Record, ...],
    path: SignalPath,
    quantity: Quantity,
    *,
    hold_known: bool,
    inertia: KnownInertia | None = None,
    loop: ReferenceLoop | None = None,
) -> Identification:
    """Identify as `identify_mechanics`, and take from the recording what ``path`` does not state.

    The torque alone cannot always show whether setpoints are interpolated; the motion can: a wrong
    answer leaves a negative delay, or a roll-off that no mechanics have. With a closed loop, path
    and mechanics depend on each other and are refined in turn. ``inertia`` is that of the whole
    axis, where moves have shown it. ``loop`` is the closed loop, where it was identified from its
    reference; the path is then known as well.
    """
    closed = quantity == "torque_injection"
    corner_known = path.current_bandwidth_hz is not None
    demand = None
    if closed and loop is None:
        demand = demand_path(records, path, hold_known=hold_known)
    given, corner_hz = records, path.current_bandwidth_hz or USUAL_CURRENT_HZ
    if demand is not None:
        path = replace(path, current_bandwidth_hz=corner_hz)
        records = tuple(with_acting_torque(record, demand, corner_hz) for record in given)
    task = Task(
        settled(records), quantity, inertia=inertia, loop=None if loop is None else loop.controller
    )
    if loop is None:
        paths = find_paths(task.records, path, loop_closed=closed, hold_known=hold_known)
    else:
        paths = (replace(loop.path, response_bandwidth_hz=path.response_bandwidth_hz),)

    begun = task

    def with_loop(other: Task) -> list[Trial]:
        if loop is not None or other is begun:
            return other.trials(paths)
        by_speed = find_paths(other.records, path, loop_closed=True, hold_known=hold_known)
        return other.trials(by_speed)

    if closed:
        task, trials = _with_true_speed(task, paths[0], with_loop)
        if demand is not None and trials[0].fit.loop.closed:
            fit = trials[0].fit
            records = tuple(with_acting_torque(r, demand, corner_hz, fit) for r in given)
            fresh = replace(task, records=settled(records))
            task = fresh if task.speed_used else fresh.without_speed()
            trials = with_loop(task)
        dropped = False
    else:
        task, trials, dropped = _by_motion(task, paths, corner_known)
    best = trials[0]

    def again(fit: SampledFit) -> SignalPath:  # only with a closed loop
        known = replace(path, hold=fit.path.hold)
        return find_paths(
            task.records, known, loop_closed=True, hold_known=True, motion=fit, controller=task.loop
        )[0]

    task, found = task.balanced(task.refined(best, again))
    uncertainty = task.uncertainty(found, corner_known)
    by_torque = found.path
    for _ in range(threshold.PASSES if np.all(np.isfinite(uncertainty.path_step)) else 0):
        if np.all(np.abs(uncertainty.path_step) < threshold.SETTLED * uncertainty.path_std):
            break
        found = task.moved(found, uncertainty)
        uncertainty = task.uncertainty(found, corner_known, by_torque)
    found, uncertainty = task.with_sure_modes(found, uncertainty, corner_known)
    alike = [t for t in trials[1:] if rank(t) < rank(best) + threshold.UNDECIDED]
    made = _undecided(_identification(task, found, uncertainty), best, alike)
    unexplained_torque = (
        not closed
        and all(record.torque is not None for record in records)
        and torque_left(settled(records), made.fit.path) > threshold.TORQUE_LEFT
    )
    if demand is not None:
        # The lag that was added is that of an ordinary loop, not one that was seen.
        lines = made.direct.frequency_hz
        unseen = current_uncertainty(lines)
        made = replace(
            made,
            direct=charged(made.direct, lines, unseen),
            corrected=charged(made.corrected, lines, unseen),
        )
    return replace(
        made,
        torque_dropped=dropped,
        torque_is_demand=demand is not None,
        torque_unexplained=unexplained_torque,
        speed_dropped=not task.speed_used,
    )


def _with_true_speed(
    task: Task, path: SignalPath, trials_of: Callable[[Task], list[Trial]]
) -> tuple[Task, list[Trial]]:
    """Task and trials without the reported speed where it contradicts the position, else with it.

    Decided before anything else: a late speed looks like mechanics, or like a late torque. Where
    both already differ by more than delay and lag, the position is tried alone first: a search for
    mechanics that explain both takes long, and finds none. ``path`` is any one of the trials.
    """
    shown = all(r.position is not None and not r.excitation.segments for r in task.records)
    if not task.speed_used or not shown:
        return task, trials_of(task)
    alone, others = task.without_speed(), list[Trial]()
    views = task.views(path, None)
    if views.position is not None and signals_differ(views.velocity, views.position, path):
        others = trials_of(alone)
        both = task.trial(others[0].path, None, None, others[0].solution)
        if surely_contradicts(both.solution, others[0].solution):
            return alone, others
    trials = trials_of(task)
    if not speed_suspect(trials[0].solution):
        return task, trials
    others = others or trials_of(alone)
    contradicts = speed_contradicts(trials[0].solution, others[0].solution)
    return (alone, others) if contradicts else (task, trials)


def _by_motion(
    task: Task, paths: tuple[SignalPath, ...], corner_known: bool
) -> tuple[Task, list[Trial], bool]:
    """Trials without the reported torque where it cannot be the mechanics' input; else with it.

    A torque that is reported late, or a copy of the demand, shows another path than the one to the
    mechanics. Collocated mechanics are passive, and so is the model by construction: a lag that
    does not exist leaves them unexplained. So both holds are tried with ordinary paths that only
    the motion adjusts, and used where they explain the motion clearly better. The last value
    states whether they were.

    A path that is implausible by itself is first tried with the mechanics found from the motion as
    a start: a search without a start converges slowly on a wrong path.
    """
    odd = _odd(task, paths[0], corner_known)
    trials: list[Trial] = []
    if not odd:
        task, trials = _with_true_speed(task, paths[0], lambda t: t.trials(paths))
    if trials and not _suspect(task, trials[0], corner_known):
        return task, trials, False
    alone = replace(task, records=tuple(replace(record, torque=None) for record in task.records))
    likeliest = trials[0].path if trials else paths[0]
    reported = likeliest.current_bandwidth_hz if corner_known else None
    found: list[Trial] = []
    for corner in (reported or USUAL_CURRENT_HZ, threshold.SLOW_HZ):
        begun = replace(likeliest, current_bandwidth_hz=corner)
        if found:
            tried = alone.of_both_holds(begun)
        else:
            alone, tried = _with_true_speed(alone, begun, partial(Task.of_both_holds, path=begun))
        tried = sorted([alone.by_motion(tried[0]), *tried[1:]], key=rank)
        # Mechanics imitate a slow torque, and fit a little better by it: it has to explain more.
        better = not found or _explains(
            tried[0].fit, found[0].fit, threshold.BY_MOTION, threshold.CLEARLY
        )
        found = [*tried, *found] if better else [*found, *tried]
        if _explained(found[0].fit):
            break
    if not alone.speed_used and task.speed_used:
        task = task.without_speed()
    best = found[0].fit
    if not trials:
        begun_there = [task.trial(each, None, None, found[0].solution) for each in paths]
        if _explains(best, min(begun_there, key=rank).fit, threshold.BY_FAR, threshold.FAR_CLEARLY):
            return alone, found, True
        trials = task.trials(paths)
    if _explains(best, trials[0].fit, threshold.BY_MOTION, threshold.CLEARLY):
        return alone, found, True
    return task, trials, False


def _explained(fit: SampledFit) -> bool:
    """Whether nothing but noise is left, or next to nothing."""
    noise = float(np.sqrt(max(fit.noise**2 - model_fit.FLOOR**2, 0.0)))
    return fit.error < max(threshold.EXPLAINED, noise)


def _explains(one: SampledFit, other: SampledFit, by: float, share: float) -> bool:
    """Whether a fit's score is better by ``by``, and its misfit below this share of the other's."""
    return one.score < other.score - by and one.error < share * other.error


def _odd(task: Task, path: SignalPath, corner_known: bool) -> bool:
    """Whether the path from the reported torque is implausible for a torque that acts."""
    if any(record.torque is None for record in task.records):
        return False
    corner = path.current_bandwidth_hz or USUAL_CURRENT_HZ
    odd = not corner_known and not threshold.ORDINARY_HZ[0] < corner < threshold.ORDINARY_HZ[1]
    left = torque_left(task.records, path)
    # A fraction of a cycle is plausible where it explains the torque to its rounding.
    parts = not at_whole_cycles(path) and left > threshold.ROUNDED
    return odd or parts or left > threshold.TORQUE_LEFT


def _suspect(task: Task, trial: Trial, corner_known: bool) -> bool:
    """Whether the motion indicates that the reported torque is not the one that drives it."""
    if any(record.torque is None for record in task.records):
        return False
    # A late torque is late for both, a late speed only for itself.
    left_s = trial.fit.position_delay_s if trial.views.position else trial.fit.delay_s
    late = abs(left_s) > threshold.LEFT_BY_TORQUE_S
    return late or _odd(task, trial.path, corner_known) or _beyond_passive(trial)


def _beyond_passive(trial: Trial) -> bool:
    """Whether the phase between torque and speed exceeds that of passive mechanics.

    Aliasing shifts the phase of lines below a quarter of the sample rate by a few degrees.
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


def _identification(task: Task, trial: Trial, uncertainty: Uncertainty) -> Identification:
    """The estimates, corrected by the result of the fit."""
    views, path, fit = trial.views, trial.path, trial.fit
    spoilt = distortion(task.records, path, task.quantity, views.velocity)
    by_place = inertia_by_place(task.records, fit.path, task.quantity, views.velocity.coulomb_nm)

    def everywhere(frf: Frf) -> Frf:
        return frf if by_place is None else by_place.charged(frf)

    if fit.error > max(TRUSTED_ERROR, 1.5 * fit.noise):
        # An unknown speed filter would remain in the lines; the position passes none.
        unfiltered = path.response_bandwidth_hz is None or not views.speed_used
        if views.position is not None and unfiltered:
            plain = unexplained(views.position, trial.solution, 1)
        else:
            plain = unexplained(views.velocity, trial.solution, 0)
        plain = everywhere(plain)
        return Identification(plain, plain, fit, False, spoilt, by_place=by_place)
    parts = ways_of(views.velocity, views.position, path, fit, uncertainty)
    # Images stay in the direct estimate: its band must contain them.
    direct = [widened(p.lines, p.factor, 1.0, p.direct) for p in parts]
    corrected = [without_images(p.lines, p.factor, task.jitter_s, p.corrected) for p in parts]
    # Backlash changes the stiffness, and so all lines above the one where it shows most.
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
        for mode, each in zip(
            fit.model.modes, mode_uncertainties_of(trial, uncertainty), strict=True
        )
    )
    return Identification(lines, best, fit, True, spoilt, uncertainties, by_place=by_place)


def _without_path(trial: Trial) -> ComplexArray:
    """The motion's response without delay, filter and images."""
    raw, fit = trial.views.velocity, trial.fit
    if trial.views.position is not None and not trial.views.speed_used:
        raw = trial.views.position
        late = delay_response(raw.frequency_hz, fit.position_delay_s)
        return np.asarray(raw.response / late / fit.image_factor(raw.frequency_hz, integrated=True))
    late = delay_response(raw.frequency_hz, fit.delay_s)
    if trial.path.response_bandwidth_hz is None:
        late = late * lag_response(raw.frequency_hz, fit.path.response_bandwidth_hz)
    return np.asarray(raw.response / late / fit.image_factor(raw.frequency_hz))


def _undecided(found: Identification, best: Trial, others: list[Trial]) -> Identification:
    """Add to the band the change of the lines for another path that explains as much."""
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
