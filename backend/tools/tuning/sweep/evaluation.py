"""Result of a sweep from its recordings. Pure: also works on stored recordings."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from typing import Literal

import numpy as np

from backend.analysis.loop.margins import bandwidth, closed_from_open, margins, open_from_closed
from backend.analysis.mechanics.identification.fit_problem import KnownInertia
from backend.analysis.mechanics.identification.identify import Identification, identify_with_path
from backend.analysis.mechanics.identification.resonance_table import resonance_table
from backend.analysis.mechanics.load_side_samples import unwrapped
from backend.analysis.mechanics.mechanical_model import MechanicalModel
from backend.analysis.mechanics.resonance import Resonance
from backend.analysis.response.distortion import Detected
from backend.analysis.response.frf import Frf, Quantity, Record, estimate_periodic
from backend.analysis.response.load_response import load_response, scale_of
from backend.analysis.response.reported_signals.reported import (
    charged,
    commanded,
    current_uncertainty,
    mean_cycles,
    path_uncertainty,
    slow_uncertainty,
)
from backend.analysis.response.reported_signals.reported_speed import with_position_speed
from backend.analysis.response.signal_path.sampling import (
    MODEL_SHARE,
    Hold,
    SignalPath,
    command_delay_s,
    lag_response,
    sampled_command,
)
from backend.analysis.signals.arrays import BoolArray, ComplexArray, FloatArray
from backend.axes.axis.axis import Envelope
from backend.tools.measuring import excite
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.measuring.recording import Recording
from backend.tools.measuring.waveform import Waveform
from backend.tools.thresholds import sweep_evaluation as threshold
from backend.tools.tuning.sweep.speed_injection import speed_gain
from drivers.texts.message import Text, Unsuitable, text

Records = tuple[tuple[excite.Sequence, Recording], ...]
Kind = Literal["mechanics", "speed_loop", "position_loop"]
Loop = Literal["auto", "none", "speed", "position"]

_COMMANDED = text("sweep.torque-is-commanded")
_SLOW = text("sweep.torque-follows-slowly")
_SLOW_OR_FILTERED = text("sweep.slow-or-filtered")
_DROPPED = text("sweep.torque-not-used")
_SPEED_DROPPED = text("sweep.speed-not-used")
_LOAD_DOES_NOT_FOLLOW = text("sweep.load-does-not-follow")


@dataclass(frozen=True, slots=True)
class SweepSettings:
    """What to measure and within which limits.

    ``loop`` is the loop that is closed while mechanics are measured; *auto* uses none on an axis
    that turns freely and the speed loop otherwise; a stepped sine always uses a loop, as it lasts
    too long for an axis that drifts. ``share`` is the excitation's share of the envelope's torque.
    ``rated_torque_nm`` replaces the drive's value. ``inertia_kgm2`` is that of the whole axis;
    where moves have identified it with a relative ``inertia_deviation``, the model is constrained
    to it.
    """

    envelope: Envelope
    kind: Kind = "mechanics"
    loop: Loop = "auto"
    f_min_hz: float = 5.0
    f_max_hz: float | None = None
    share: float = 0.35
    realisations: int = 2
    base_motion: bool = True
    rated_torque_nm: float | None = None
    inertia_kgm2: float | None = None
    notches_off: bool = True
    hold: Hold | None = None
    """How the drive holds setpoints between cycles; None: as the drive or the recording shows."""
    excitation: Waveform = "multisine"
    coulomb_nm: float | None = None
    """Friction that is removed from a speed loop's response; None: from the recording."""
    inertia_deviation: float | None = None
    pairs_before: int = 0
    """For a closed loop's response: pairs of realisations whose phases must not be used again."""
    odd_lines: bool = False
    """For mechanics by a multisine: odd lines only, which separate even and odd distortion."""
    reference_rad_s: float | None = None
    """For a speed loop's response: peak of the reference; None: by the inertia."""
    reference_corner_hz: float | None = None
    """For a speed loop's response: above it the lines of the reference fall; None: 40 Hz."""
    speed_dropped: bool = False
    """For a speed loop's response: the reported speed contradicts the position, which is used."""


@dataclass(frozen=True)
class LoadSide:
    """The response to the load's position, at the motor shaft, and the encoder's scale."""

    frf: Frf
    counts_per_motor_rev: float


@dataclass(frozen=True)
class SweepResult:
    """Result: ``frf`` is the best estimate, ``direct`` the one without any model.

    ``unit`` is that of the magnitude. ``model`` is None for closed loops and where no model fits
    (``trusted`` False). ``saturated_share`` is the share of the samples with the torque at its
    limit. ``current_bandwidth_hz``, ``speed_filter_hz`` and ``hold`` are as the drive reports or as
    the recording showed.
    """

    kind: Kind
    loop: Loop
    frf: Frf
    direct: Frf
    model: MechanicalModel | None
    trusted: bool
    unit: str
    resonances: tuple[Resonance, ...]
    margins: dict[str, float | bool | None]
    delay_s: float
    motion_s: float
    saturated_share: float
    warnings: tuple[Text, ...] = field(default_factory=tuple)
    current_bandwidth_hz: float | None = None
    speed_filter_hz: float | None = None
    hold: Hold | None = None
    """How setpoints are held between cycles, as the drive reports or the recording showed."""
    speed_dropped: bool = False
    """Whether the reported speed contradicts the position; only the latter was used then."""
    detected: Detected | None = None
    """Noise and distortion on the lines that were left empty, where there were any."""
    load: LoadSide | None = None
    """Of the second encoder, where it was recorded and follows the motor."""


def evaluate(
    records: Records,
    rate: float,
    facts: AxisFacts,
    settings: SweepSettings,
    loop: Literal["none", "speed", "position"],
    dc: bool,
    by_speed: bool = False,
    integral_hz: float | None = None,
) -> SweepResult:
    """Evaluate recordings; also works on stored recordings.

    ``by_speed``: the speed loop's reference was the excitation, ``integral_hz`` its integral's
    corner where the drive reports it.

    Raises:
        ValueError: nothing can be concluded from them.
    """
    hold: Hold = settings.hold or ("linear" if facts.interpolates else "zero")
    path = SignalPath(
        sample_rate_hz=rate,
        hold=hold,
        current_bandwidth_hz=facts.current_bandwidth_hz,
        command_delay_s=command_delay_s(1.0 if dc else 0.0, hold, rate),
        response_bandwidth_hz=facts.speed_filter_hz,
    )
    if settings.kind != "mechanics":
        return _evaluate_loop(records, path, settings, loop)
    # An existing object 60C2h does not prove that torques are interpolated.
    known = settings.hold is not None
    quantity: Quantity = "torque_mode" if loop == "none" else "torque_injection"
    inertia = _known_inertia(settings) if facts.torque_known else None
    taken = _taken(records)
    if (cycles := mean_cycles(taken)) is not None:
        raise Unsuitable(text("sweep.speed-is-mean", cycles=cycles))
    # A search for mechanics that explain a clipped torque takes a minute, and finds none.
    if (cut := _cut(taken, path, quantity)) > threshold.CUT:
        raise Unsuitable(text("sweep.torque-cut", cut_share=cut))
    if by_speed:
        found, taken = _by_reference(records, path, integral_hz, inertia, hold_known=known)
    else:
        found = identify_with_path(taken, path, quantity, hold_known=known, inertia=inertia)
    limit = settings.envelope.torque_percent / 100.0 * facts.rated_torque_nm
    saturated = _saturated(
        taken, found.fit.path, quantity, limit, as_reported=not found.torque_dropped
    )
    warnings = _warnings(found, saturated, facts)
    found, widened = _widened(found, facts, quantity, by_speed=by_speed)
    load, missing = _load_side(records, taken, found, quantity)
    said = warnings + widened + missing
    result = _mechanics(found, quantity, loop, saturated, _motion_s(records), facts, said)
    return replace(result, load=load)


def _load_side(
    records: Records, taken: tuple[Record, ...], found: Identification, quantity: Quantity
) -> tuple[LoadSide | None, tuple[Text, ...]]:
    """Response to the position of the second encoder, where it was recorded; or why there is none.

    ``taken`` are the records as they were evaluated for the motor.
    """
    counts = [unwrapped(r.also[:, 0]) for _, r in records if r.also is not None]
    if len(counts) != len(records):
        return None, ()
    scale = scale_of(taken, counts)
    if scale is None:
        return None, (_LOAD_DOES_NOT_FOLLOW,)
    frf = load_response(
        taken,
        [each / scale.counts_per_rad for each in counts],
        found.fit.path,
        quantity,
        coulomb_nm=found.direct.coulomb_nm,
        late_s=found.fit.position_delay_s,
        deviation=scale.deviation,
        motor=found.direct,
    )
    return LoadSide(frf, scale.counts_per_rad * 2.0 * np.pi), ()


def _widened(
    found: Identification, facts: AxisFacts, quantity: Quantity, *, by_speed: bool
) -> tuple[Identification, tuple[Text, ...]]:
    """Widen the bands by what the drive does not report of its torque; with the warnings."""
    path, lines = found.fit.path, found.direct.frequency_hz
    said: list[Text] = []
    if found.torque_is_demand:
        said.append(_COMMANDED)
    elif facts.current_bandwidth_hz is None and commanded(path):
        found = _charged(found, current_uncertainty(lines))
        said.append(_COMMANDED)
    corner = path.current_bandwidth_hz
    slow = corner is not None and _slow(corner, facts)
    # A dropped torque was replaced by another one, and an ordinary path explains the motion.
    if slow or (found.torque_unexplained and not found.torque_dropped):
        ordinary = path_uncertainty(lines)
        uncertainty = ordinary if corner is None else slow_uncertainty(lines, corner)
        found = _charged(
            found,
            np.hypot(uncertainty.real, ordinary.real)
            + 1j * np.hypot(uncertainty.imag, ordinary.imag),
        )
        said.append(_SLOW)
    if slow and quantity == "torque_injection" and facts.torque_filter_hz is None:
        # With a loop, the motion alone does not show which of the two it is.
        direct = charged(found.direct, lines, np.log(lag_response(lines, corner)))
        found = replace(found, direct=direct, corrected=direct, trusted=False)
        said.append(_SLOW_OR_FILTERED)
    if by_speed:
        found = _charged(found, 2j * np.pi * lines * threshold.BY_REFERENCE_S)
    return found, tuple(said)


def _charged(found: Identification, uncertainty: ComplexArray) -> Identification:
    """Both responses with bands widened by ``uncertainty`` [lines of the direct one]."""
    lines = found.direct.frequency_hz
    direct, corrected = (charged(x, lines, uncertainty) for x in (found.direct, found.corrected))
    return replace(found, direct=direct, corrected=corrected)


def _mechanics(
    found: Identification,
    quantity: Quantity,
    loop: Literal["none", "speed", "position"],
    saturated: float,
    motion_s: float,
    facts: AxisFacts,
    warnings: tuple[Text, ...],
) -> SweepResult:
    """Result for mechanics; without a model where none is trusted."""
    path, model = found.fit.path, found.fit.model
    resonances: tuple[Resonance, ...] = ()
    if found.trusted:
        highest_hz = found.corrected.valid_band_hz[1]
        resonances = resonance_table(model, found.corrected.frequency_hz, highest_hz, found.modes)
    return SweepResult(
        kind="mechanics",
        loop=loop,
        frf=found.corrected,
        direct=found.direct,
        model=model if found.trusted else None,
        trusted=found.trusted,
        unit="(rad/s)/Nm" if facts.torque_known else "(rad/s)/rated torque",
        resonances=resonances,
        margins=_injection_margins(found) if quantity == "torque_injection" else {},
        delay_s=path.command_delay_s + found.fit.delay_s,
        motion_s=motion_s,
        saturated_share=saturated,
        warnings=warnings,
        current_bandwidth_hz=path.current_bandwidth_hz,
        # What is no filter of first order has no corner of one.
        speed_filter_hz=None if found.speed_dropped else path.response_bandwidth_hz,
        hold=path.hold,
        speed_dropped=found.speed_dropped,
        detected=found.distortion.detected if found.distortion is not None else None,
    )


def _slow(corner_hz: float, facts: AxisFacts) -> bool:
    """Whether the torque follows more slowly than the drive reports, or than current loops do."""
    as_reported = facts.current_bandwidth_hz
    return corner_hz < (
        threshold.SLOW_HZ if as_reported is None else threshold.SLOWER * as_reported
    )


def _taken(records: Records) -> tuple[Record, ...]:
    return tuple(
        Record(s.excitation, r.velocity_rad_s, r.torque_nm, r.valid, r.position_rad)
        for s, r in records
    )


def _by_reference(
    records: Records,
    path: SignalPath,
    integral_hz: float | None,
    inertia: KnownInertia | None,
    *,
    hold_known: bool,
) -> tuple[Identification, tuple[Record, ...]]:
    """Mechanics by a speed loop's reference, and the records as if its torque had been injected.

    The loop's gains depend on the mechanics, as the speed of a light axis is sampled, too: both are
    found by iteration.
    """
    as_reported = speed_gain(records, path, integral_hz, hold_known=hold_known)
    for _ in range(threshold.ROUNDS):
        taken = _taken(as_reported.played)
        found = identify_with_path(
            taken,
            path,
            "torque_injection",
            hold_known=hold_known,
            inertia=inertia,
            loop=as_reported.loop,
        )
        again = speed_gain(records, path, integral_hz, hold_known=hold_known, motion=found.fit)
        if as_reported.loop.alike(again.loop):
            break
        as_reported = again
    return found, taken


def _known_inertia(settings: SweepSettings) -> KnownInertia | None:
    """Inertia that constrains the model; None where its uncertainty is unknown."""
    if settings.inertia_kgm2 is None or settings.inertia_deviation is None:
        return None
    return KnownInertia(settings.inertia_kgm2, settings.inertia_deviation)


def completed(facts: AxisFacts, result: SweepResult) -> AxisFacts:
    """Facts completed by the measurement of the mechanics where the drive reports nothing."""
    return replace(
        facts,
        current_bandwidth_hz=facts.current_bandwidth_hz or result.current_bandwidth_hz,
        speed_filter_hz=facts.speed_filter_hz or result.speed_filter_hz,
    )


def _saturated(
    records: tuple[Record, ...],
    path: SignalPath,
    quantity: Quantity,
    limit_nm: float,
    *,
    as_reported: bool,
) -> float:
    """Share of samples whose torque is at the envelope's limit, or less than commanded.

    ``as_reported``: the reported torque is the acting one, so that a missing part is not caused by
    a filter. Otherwise only a level counts at which the torque stays while more is commanded: a
    filter or a copy of the demand has no such level.
    """
    shares = []
    for r in records:
        if r.torque is None:
            continue
        torque = np.abs(r.torque)
        at_limit = torque >= 0.98 * limit_nm
        if quantity == "torque_mode":
            missing = _missing(r, torque, path)
            at_limit |= missing if as_reported else missing & _at_highest(torque)
        shares.append(float(np.mean(at_limit)))
    return max(shares, default=0.0)


def _cut(records: tuple[Record, ...], path: SignalPath, quantity: Quantity) -> float:
    """Share of samples at one level of torque while more was commanded; 0 where unknown."""
    shares = [0.0]
    for r in records:
        if r.torque is not None and quantity == "torque_mode":
            torque = np.abs(r.torque)
            shares.append(float(np.mean(_missing(r, torque, path) & _at_highest(torque))))
    return max(shares)


def _missing(record: Record, torque: FloatArray, path: SignalPath) -> BoolArray:
    """Where the torque [n], as absolute value, is clearly less than commanded."""
    asked = np.abs(sampled_command(record.excitation.samples, path))
    return np.asarray(asked - torque > 0.1 * np.max(asked))


def _at_highest(torque: FloatArray) -> BoolArray:
    """Where the torque [n], as absolute value, is at its maximum."""
    return np.asarray(torque >= 0.97 * np.max(torque))


def _warnings(found: Identification, saturated: float, facts: AxisFacts) -> tuple[Text, ...]:
    said = []
    if found.distortion is not None and found.distortion.play:
        said.append(text("sweep.play", share=found.distortion.level))
    elif not found.trusted:
        said.append(text("sweep.no-model"))
    rate, (_low, highest) = found.corrected.sample_rate_hz, found.corrected.valid_band_hz
    if found.trusted and highest < MODEL_SHARE * rate * (1.0 - 1e-6):
        said.append(text("sweep.folded-back", highest_hz=highest))
    if found.distortion is not None and (apart := found.distortion.detected) is not None:
        said.append(text("sweep.distortion-detected", **asdict(apart)))
    if found.torque_dropped:
        said.append(_DROPPED)
    if found.speed_dropped:
        said.append(_SPEED_DROPPED)
    if found.by_place is not None:
        said.append(
            text("sweep.by-place", amplitude_kgm2=found.by_place.amplitude_kgm2)
            if facts.torque_known
            else text("sweep.by-place-of-unknown-size")
        )
    if saturated > 0.02:
        said.append(text("sweep.torque-at-limit", share=saturated))
    coherent = found.direct.coherence[found.direct.in_band]
    if float(np.median(coherent)) < 0.9:
        said.append(text("sweep.coherence-low"))
    if found.direct.periods_dropped:
        said.append(text("sweep.periods-left-out", periods=found.direct.periods_dropped))
    if not facts.torque_known:
        said.append(text("sweep.rated-torque-unknown"))
    return tuple(said)


def _injection_margins(found: Identification) -> dict[str, float | bool | None]:
    """Margins of the loop that was closed during the measurement, from its own torque."""
    frf, fit = found.corrected, found.fit
    use = frf.in_band
    f = frf.frequency_hz[use]
    controller = fit.loop.response(f) / (1.0 + 1j * f / (fit.path.current_bandwidth_hz or np.inf))
    open_loop = controller * frf.response[use]
    return margins_of(f, open_loop)


def margins_of(f: FloatArray, open_loop: ComplexArray) -> dict[str, float | bool | None]:
    """Margins and bandwidths of an open loop, for files and pages.

    They are valid from ``from_hz`` to ``to_hz``. ``ms`` is None where |S| stays below 1 in that
    band: over all frequencies it cannot (Bode's integral), so its peak lies outside the band.
    """
    closed = closed_from_open(open_loop)
    width = bandwidth(f, closed)
    found = margins(f, open_loop)
    return {
        **asdict(found),
        **({"ms": None, "ms_hz": None} if found.ms < 1.0 else {}),
        "from_hz": float(f[0]),
        "to_hz": float(f[-1]),
        "bandwidth_hz": width.minus_3db_hz,
        "bandwidth_90deg_hz": width.minus_90deg_hz,
    }


def _evaluate_loop(
    records: Records,
    path: SignalPath,
    settings: SweepSettings,
    loop: Literal["none", "speed", "position"],
) -> SweepResult:
    """Closed loop from reference to motion; of a speed loop, without the effect of friction."""
    taken = []
    if settings.kind == "position_loop":
        for s, r in records:
            moved = r.position_rad - r.position_rad[0]
            taken.append(Record(s.excitation, moved, None, r.valid))
        coulomb_nm: float | None = 0.0
    else:
        taken += _taken(records)
        coulomb_nm = settings.coulomb_nm
        if settings.speed_dropped:
            taken = [with_position_speed(record) for record in taken]
            path = replace(path, response_bandwidth_hz=None)
    # The drive reads the reference at the beginning of its step, and the mean torque follows half a
    # step later, as does the speed: both belong to the loop (`loops_of`), not to the input path.
    path = replace(path, command_delay_s=path.command_delay_s - path.loop_delay_s)
    frf = estimate_periodic(tuple(taken), path, "closed_loop", coulomb_nm=coulomb_nm)
    use = frf.in_band & (frf.coherence > 0.8)
    found: dict[str, float | bool | None] = {}
    if np.count_nonzero(use) > 12:
        f = frf.frequency_hz[use]
        found = margins_of(f, open_from_closed(frf.response[use]))
        width = bandwidth(f, frf.response[use])
        found["bandwidth_hz"] = width.minus_3db_hz
        found["bandwidth_90deg_hz"] = width.minus_90deg_hz
    return SweepResult(
        kind=settings.kind, loop=loop, frf=frf, direct=frf, model=None, trusted=True, unit="1",
        resonances=(), margins=found, delay_s=path.command_delay_s, motion_s=_motion_s(records),
        saturated_share=0.0,
    )  # fmt: skip


def _motion_s(records: Records) -> float:
    return float(sum(s.excitation.duration_s for s, _ in records))
