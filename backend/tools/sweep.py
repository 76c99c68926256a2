"""Frequency response of an axis over a bus with cyclic process data.

*mechanics*: torque to velocity, either with no loop (CST) or by torque offsets beside a closed
speed (CSV) or position loop (CSP), as a vertical or limited axis needs. *speed_loop* and
*position_loop*: from the loop's own reference to what the axis does.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from backend.analysis import excitation as signals
from backend.analysis.arrays import ComplexArray, FloatArray
from backend.analysis.excitation import scaled
from backend.analysis.fit import Resonance
from backend.analysis.frf import Frf, Quantity, Record, estimate_periodic
from backend.analysis.identify import Identification, identify_mechanics
from backend.analysis.margins import bandwidth, closed_from_open, margins, open_from_closed
from backend.analysis.mechanical_model import MechanicalModel
from backend.analysis.sampling import STEP_LEAD_S, Hold, SignalPath, fit_path, sampled_command
from backend.axis import Axis, Envelope
from backend.cyclic import CyclicSession
from backend.jobs import Progress
from backend.tools import excite
from backend.tools import notch as notch_tool
from backend.tools.axis_facts import AxisFacts, read_facts
from backend.tools.go_back import go_back
from backend.tools.probe import PULLED, Probed, holding_torque, probe_axis
from backend.tools.recording import (
    Play,
    Recording,
    bus_limits,
    cycle_s,
    enabled,
    play,
    quiet,
    require_signals,
    share,
)
from backend.tools.temporary import temporary
from drivers.cia402 import Mode
from drivers.errors import NotAllowed, OutOfRange

Kind = Literal["mechanics", "speed_loop", "position_loop"]
Loop = Literal["auto", "none", "speed", "position"]
Keep = Callable[[str, dict[str, npt.NDArray[np.generic]], dict[str, object]], None]

_TURN = 2 * np.pi
_MODE_OF = {"none": Mode.CST, "speed": Mode.CSV, "position": Mode.CSP}
#: Weak modes below this are artefacts of friction more often than mechanics.
_LOWEST_MODE_HZ = 15.0
_WEAK_DB, _LEAST_DB, _LEAST_SHARE = 3.0, 1.0, 0.2
#: Share of the distance of two lines that a mode's half width must have.
_NARROWEST = 0.15
#: A loop's reference that took too much torque is played again, this much smaller.
_ATTEMPTS, _WEAKER = 4, 0.4


@dataclass(frozen=True, slots=True)
class SweepSettings:
    """What to measure and within which limits.

    ``loop`` is the loop that is closed while mechanics are measured; *auto* takes none on an
    axis that turns freely and the speed loop otherwise. ``share`` is the excitation's share of
    the envelope's torque. ``rated_torque_nm`` overrides what the drive says.
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
    """How the drive holds set-points between cycles; None asks the drive, or the recording."""


@dataclass(frozen=True)
class SweepResult:
    """The answer: ``frf`` is the best estimate, ``direct`` the one without any model.

    ``unit`` of the magnitude. ``model`` is None for closed loops and where no model fits
    (``trusted`` False); ``warnings`` are sentences. ``saturated_share`` of the samples had the
    torque at its limit.
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
    warnings: tuple[str, ...] = field(default_factory=tuple)
    current_bandwidth_hz: float | None = None
    speed_filter_hz: float | None = None
    hold: Hold | None = None
    """What the drive tells of its loops, or what the recording showed of them."""


@dataclass(frozen=True)
class _Setup:
    """Everything that was found out before the excitation is made."""

    rate: float
    facts: AxisFacts
    loop: Literal["none", "speed", "position"]
    room: excite.Room
    rigid: excite.Rigid
    torque_step_nm: float


async def sweep(
    axis: Axis,
    session: CyclicSession,
    settings: SweepSettings,
    progress: Progress,
    keep: Keep | None = None,
) -> SweepResult:
    """Measure; ``keep`` is handed the raw data before they are evaluated.

    Raises:
        OutOfRange: settings that make no sense; nothing has moved.
        NotAllowed: the axis cannot be measured so, or the envelope ended it; says why.
        LinkLost: samples were lost; nothing is concluded from the rest.
    """
    _check(settings)
    closed = settings.kind != "mechanics"
    loop = {"speed_loop": "speed", "position_loop": "position"}.get(settings.kind, settings.loop)
    facts = await read_facts(axis, settings.rated_torque_nm)
    home = await axis.position_raw()
    filters = await _filters_off(axis, settings)
    async with temporary(axis, filters):
        probed: Probed | None = None
        if loop in ("auto", "none"):
            require_signals(axis, session, Mode.CST, False)
            progress(0.0, "looking for a load that pulls the axis")
            held = await holding_torque(axis, session, facts)
            if abs(held) > PULLED * facts.rated_torque_nm:
                loop = _held_by_loop(axis, settings.loop, held)
            else:
                progress(0.02, "feeling the axis with a small torque")
                probed = await probe_axis(axis, session, settings.envelope, facts, home)
                loop = _choose(axis, session, settings, probed)
        setup = await _setup(axis, session, settings, facts, loop, probed)
        require_signals(axis, session, _MODE_OF[setup.loop], not closed and setup.loop != "none")
        progress(0.08, "designing the excitation")
        sequences = await asyncio.to_thread(_sequences, setup, settings)
        records = await _play_fitting(axis, session, settings, setup, sequences, home, progress)
    await go_back(axis, session, home, settings.envelope, facts)
    raw, meta = _raw(records, setup, settings, session)
    if keep is not None:
        keep(f"sweep-{settings.kind}", raw, meta)
    progress(0.95, "evaluating")
    try:
        return await asyncio.to_thread(
            evaluate, records, setup.rate, facts, settings, setup.loop, _dc(session)
        )
    except ValueError as error:
        raise NotAllowed(
            f"{axis.drive.name}: the recording cannot be evaluated: {error}",
            drive=axis.drive.name,
            remedy="raise the excitation, or look for lost samples and saturated torque",
        ) from error


def _check(settings: SweepSettings) -> None:
    if not 0.01 <= settings.share <= 0.9:
        raise OutOfRange("the excitation takes 1 to 90 % of the permitted torque",
                         value=settings.share, limit="0.01…0.9")  # fmt: skip
    if not 1 <= settings.realisations <= 8:
        raise OutOfRange("1 to 8 realisations are possible", value=settings.realisations,
                         limit="1…8")  # fmt: skip
    if settings.f_min_hz < 3.0:
        raise OutOfRange("the lowest line must lie above the base motion, at 3 Hz or more",
                         value=settings.f_min_hz, limit="3 Hz")  # fmt: skip
    if settings.f_max_hz is not None and settings.f_max_hz < 4 * settings.f_min_hz:
        raise OutOfRange("the band must span at least two octaves", value=settings.f_max_hz,
                         limit=f"{4 * settings.f_min_hz:g} Hz or more")  # fmt: skip


async def _filters_off(axis: Axis, settings: SweepSettings) -> dict[str, int]:
    """Notches and the torque filter lie in the path of the torque: mechanics are measured without.

    A family without an enable bit takes a notch out by its highest frequency.
    """
    if settings.kind != "mechanics" or not settings.notches_off:
        return {}
    drive, off = axis.drive, dict[str, int]()
    for number, slot in enumerate(drive.profile.notch.slots if drive.profile.notch else ()):
        if slot.enable_key is not None:
            off[slot.enable_key] = 0
        else:
            off |= notch_tool.encode(drive.profile, drive.name, number, None, None).raw
    gains = drive.profile.gains
    if gains is not None and gains.torque_filter is not None:
        low, _high = drive.parameter(gains.torque_filter).raw_limits
        if low == 0:
            off[gains.torque_filter] = 0
    reachable = {k: v for k, v in off.items() if not drive.unreachable_why(drive.parameter(k))}
    return {key: raw for key, raw in sorted(reachable.items()) if await drive.raw(key) != raw}


def _choose(
    axis: Axis, session: CyclicSession, settings: SweepSettings, probed: Probed
) -> Literal["none", "speed"]:
    """No loop on an axis that stays where it is and whose inertia rules, else the speed loop.

    Where friction takes more of the base motion's torque than inertia, a torque that is off by
    little makes a speed that is off by much.
    """
    drifts = abs(probed.gravity_nm) > max(0.5 * probed.coulomb_nm, 0.01 * probed.rated_nm)
    if drifts:
        return _held_by_loop(axis, settings.loop, probed.gravity_nm)
    momentum_nm = excite.base_torque_nm(probed.inertia_kgm2, settings.envelope.speed_rpm)
    light = 4 / np.pi * probed.coulomb_nm > momentum_nm
    return "speed" if light and settings.loop == "auto" and _can_offset(axis, session) else "none"


def _can_offset(axis: Axis, session: CyclicSession) -> bool:
    """Whether torque can be injected beside a closed loop."""
    key = axis.drive.key("torque_offset")
    return key is not None and session.carries(axis.drive, key)


def _held_by_loop(axis: Axis, wanted: Loop, pull_nm: float) -> Literal["speed"]:
    if wanted == "none":
        raise NotAllowed(
            f"{axis.drive.name}: a load of {pull_nm:.3g} Nm pulls the axis, so it cannot be "
            "measured without a closed loop",
            drive=axis.drive.name,
            value=round(pull_nm, 4),
            remedy="measure with the speed or position loop closed",
        )
    return "speed"


async def _setup(
    axis: Axis, session: CyclicSession, settings: SweepSettings, facts: AxisFacts, loop: str,
    probed: Probed | None,
) -> _Setup:  # fmt: skip
    units, envelope = await axis.units(), settings.envelope
    rated = facts.rated_torque_nm
    step = units.torque(1.0) / 100.0 * rated
    room = excite.Room(
        torque_nm=envelope.torque_percent / 100.0 * rated,
        speed_rad_s=envelope.speed_rpm * _TURN / 60.0,
        travel_rad=envelope.travel_rev * _TURN,
    )
    inertia = settings.inertia_kgm2 or (probed.inertia_kgm2 if probed else None)
    rigid = excite.Rigid(
        inertia or facts.drive_inertia_kgm2 or 1e-4,
        probed.coulomb_nm if probed else 0.0,
        probed.gravity_nm if probed else 0.0,
    )
    kind: Literal["none", "speed", "position"] = (
        "none" if loop == "none" else "position" if loop == "position" else "speed"
    )
    return _Setup(1.0 / cycle_s(session), facts, kind, room, rigid, step)


def _sequences(setup: _Setup, settings: SweepSettings) -> tuple[excite.Sequence, ...]:
    """The excitation; too little room becomes the user's error."""
    band = excite.band_for(setup.rate, settings.f_min_hz, settings.f_max_hz)
    try:
        if settings.kind != "mechanics":
            position = settings.kind == "position_loop"
            amplitude, step = _reference_size(setup, position)
            return excite.loop_reference(
                setup.rate, band, setup.room, step, amplitude=amplitude,
                realisations=settings.realisations, position=position, base=settings.base_motion,
            )  # fmt: skip
        if setup.loop == "none":
            return excite.torque_mode(
                setup.rate, band, setup.room, setup.rigid, setup.torque_step_nm,
                share=settings.share, realisations=settings.realisations,
                base=settings.base_motion,
            )  # fmt: skip
        return excite.beside_loop(
            setup.rate, band, setup.room, setup.torque_step_nm, share=settings.share,
            realisations=settings.realisations, position=setup.loop == "position",
            base=settings.base_motion,
        )  # fmt: skip
    except ValueError as error:
        raise OutOfRange(
            f"the envelope does not allow this measurement: {error}",
            remedy="widen travel, speed or torque of the envelope",
        ) from error


def _reference_size(setup: _Setup, position: bool) -> tuple[float, float]:
    """Amplitude of a loop's reference (rad/s or rad), and 1e-4 of it as its rounding."""
    speed = 0.15 * setup.room.speed_rad_s
    # Torque to follow the fall-off corner's acceleration must stay far from the limit, since
    # lines and resonances add up.
    corner = _TURN * (20.0 if position else 40.0)
    speed = min(speed, setup.room.torque_nm / 8.0 / setup.rigid.inertia_kgm2 / corner, 8.0)
    size = speed / corner if position else speed
    return size, 0.0


async def _play_all(
    axis: Axis,
    session: CyclicSession,
    settings: SweepSettings,
    setup: _Setup,
    sequences: tuple[excite.Sequence, ...],
    home_raw: int,
    progress: Progress,
) -> tuple[tuple[excite.Sequence, Recording], ...]:
    """Every realisation, from the same place as far as the travel asks for it."""
    units = await axis.units()
    records: list[tuple[excite.Sequence, Recording]] = []
    limits = await bus_limits(axis, settings.envelope, home_raw)
    for number, sequence in enumerate(sequences):
        away = abs(units.position(await axis.position_raw() - home_raw))
        if number and away > 0.15 * settings.envelope.travel_rev:
            await go_back(axis, session, home_raw, settings.envelope, setup.facts)
        low = 0.1 + 0.85 * number / len(sequences)
        told = share(progress, low, low + 0.85 / len(sequences),
                     f"measuring, realisation {number + 1} of {len(sequences)}")  # fmt: skip
        async with enabled(axis, session, _MODE_OF[setup.loop]) as start:
            if setup.loop != "none":
                await quiet(axis)
            sent = await _to_raw(axis, sequence, setup, settings, start)
            recording = await play(axis, session, sent, limits, setup.facts.rated_torque_nm, told)
        records.append((await _as_sent(axis, sequence, settings, sent, start), recording))
    return tuple(records)


async def _play_fitting(
    axis: Axis, session: CyclicSession, settings: SweepSettings, setup: _Setup,
    sequences: tuple[excite.Sequence, ...], home_raw: int, progress: Progress,
) -> tuple[tuple[excite.Sequence, Recording], ...]:  # fmt: skip
    """As `_play_all`; a loop that answers its reference with too much torque gets a smaller one.

    How much torque a reference takes depends on the loop's gains, which are what is measured.
    """
    attempts = 1 if settings.kind == "mechanics" else _ATTEMPTS
    for attempt in range(attempts):
        try:
            return await _play_all(axis, session, settings, setup, sequences, home_raw, progress)
        except NotAllowed as error:
            if attempt == attempts - 1 or "torque" not in error.message:
                raise
        await quiet(axis)
        await go_back(axis, session, home_raw, settings.envelope, setup.facts)
        sequences = tuple(replace(s, excitation=scaled(s.excitation, _WEAKER)) for s in sequences)
    raise AssertionError


async def _to_raw(
    axis: Axis, sequence: excite.Sequence, setup: _Setup, settings: SweepSettings, start: int
) -> Play:
    units = await axis.units()
    torque = 1.0 / setup.torque_step_nm
    speed = units.velocity_raw(1e6) / 1e6 * 60.0 / _TURN
    place = units.position_raw(1e6) / 1e6 / _TURN
    samples = sequence.excitation.samples
    base = np.zeros(samples.size) if sequence.base is None else sequence.base
    if setup.loop == "none":
        return Play(Mode.CST, np.round(samples * torque).astype(np.int64))
    mode = _MODE_OF[setup.loop]
    scale, shift = (place, start) if mode is Mode.CSP else (speed, 0)
    if settings.kind != "mechanics":
        return Play(mode, shift + np.round((base + samples) * scale).astype(np.int64))
    return Play(
        mode,
        shift + np.round(base * scale).astype(np.int64),
        "torque_offset",
        np.round(samples * torque).astype(np.int64),
    )


async def _as_sent(
    axis: Axis,
    sequence: excite.Sequence,
    settings: SweepSettings,
    sent: Play,
    start: int,
) -> excite.Sequence:  # fmt: skip
    """The excitation as the rounded set-points say; estimators must know what really went out."""
    if settings.kind == "mechanics":
        return sequence
    units = await axis.units()
    if sent.mode is Mode.CSP:
        values = (sent.values - start) * (units.position(1.0) * _TURN)
    else:
        values = sent.values * (units.velocity(1.0) * _TURN / 60.0)
    return replace(
        sequence, excitation=replace(sequence.excitation, samples=np.asarray(values, np.float64))
    )


# --- evaluation (pure) ----------------------------------------------------------------


def evaluate(
    records: tuple[tuple[excite.Sequence, Recording], ...],
    rate: float,
    facts: AxisFacts,
    settings: SweepSettings,
    loop: Literal["none", "speed", "position"],
    dc: bool,
) -> SweepResult:
    """From recordings to the answer; also works on recordings that were kept.

    Raises:
        ValueError: nothing can be concluded from them.
    """
    hold: Hold = settings.hold or ("linear" if facts.interpolates else "zero")
    path = SignalPath(
        sample_rate_hz=rate,
        hold=hold,
        current_bandwidth_hz=facts.current_bandwidth_hz,
        command_delay_s=max((1.0 / rate if dc else 0.0) - (hold == "linear") * STEP_LEAD_S, 0.0),
        response_bandwidth_hz=facts.speed_filter_hz,
    )
    if settings.kind != "mechanics":
        return _evaluate_loop(records, path, settings, loop)
    taken = tuple(
        Record(s.excitation, r.velocity_rad_s, r.torque_nm, r.valid, r.position_rad)
        for s, r in records
    )
    quantity: Quantity = "torque_mode" if loop == "none" else "torque_injection"
    path = _found_path(taken, path, quantity == "torque_injection")
    found = identify_mechanics(taken, path, quantity)
    limit = settings.envelope.torque_percent / 100.0 * facts.rated_torque_nm
    saturated = _saturated(taken, path, quantity, limit)
    warnings = _warnings(found, saturated, facts)
    return SweepResult(
        kind="mechanics",
        loop=loop,
        frf=found.corrected,
        direct=found.direct,
        model=found.fit.model if found.trusted else None,
        trusted=found.trusted,
        unit="(rad/s)/Nm" if facts.torque_known else "(rad/s)/rated torque",
        resonances=resonance_table(
            found.fit.model, found.corrected.frequency_hz, found.corrected.valid_band_hz[1]
        )
        if found.trusted
        else (),
        margins=_injection_margins(found) if quantity == "torque_injection" else {},
        delay_s=path.command_delay_s + found.fit.delay_s,
        motion_s=_motion_s(records),
        saturated_share=saturated,
        warnings=warnings,
        current_bandwidth_hz=path.current_bandwidth_hz,
        speed_filter_hz=found.fit.path.response_bandwidth_hz,
        hold=path.hold,
    )


def completed(facts: AxisFacts, result: SweepResult) -> AxisFacts:
    """Facts with what the mechanics' measurement found where the drive tells nothing."""
    return replace(
        facts,
        current_bandwidth_hz=facts.current_bandwidth_hz or result.current_bandwidth_hz,
        speed_filter_hz=facts.speed_filter_hz or result.speed_filter_hz,
    )


def _found_path(records: tuple[Record, ...], path: SignalPath, closed: bool) -> SignalPath:
    """Delay between a set-point and its torque, from the last period of the reported torque."""
    commands, torques, lines = [], [], []
    for r in records:
        e = r.excitation
        if r.torque is None:
            continue
        last = e.first_sample + (e.periods - 1) * e.period_samples
        cut = slice(last, last + e.period_samples)
        if r.valid is not None and not np.all(r.valid[cut]):
            continue
        commands.append(e.samples[cut])
        torques.append(r.torque[cut])
        lines.append(e.lines)
    if not commands:
        return path
    return fit_path(
        tuple(commands), tuple(torques), tuple(lines), path, loop_closed=closed,
        hold_known=path.hold == "linear",
    )  # fmt: skip


def _saturated(
    records: tuple[Record, ...], path: SignalPath, quantity: Quantity, limit_nm: float
) -> float:
    """Share of samples whose torque is at the envelope's limit, or not what was commanded."""
    shares = []
    for r in records:
        if r.torque is None:
            continue
        at_limit = np.abs(r.torque) >= 0.98 * limit_nm
        if quantity == "torque_mode":
            asked = sampled_command(r.excitation.samples, path)
            size = float(np.max(np.abs(asked)))
            at_limit |= np.abs(asked) - np.abs(r.torque) > 0.1 * size
        shares.append(float(np.mean(at_limit)))
    return max(shares, default=0.0)


def _warnings(found: Identification, saturated: float, facts: AxisFacts) -> tuple[str, ...]:
    words = []
    if not found.trusted:
        words.append(
            "no mechanical model explains the recording: only the part of the plot below a tenth "
            "of the sample rate is shown, and nothing is designed from it"
        )
    if saturated > 0.02:
        words.append(
            f"the torque was at its limit, or not what was commanded, for {saturated:.0%} of the "
            "time: lower the excitation or raise the limit"
        )
    coherent = found.direct.coherence[found.direct.in_band]
    if float(np.median(coherent)) < 0.9:
        words.append("coherence is low: raise the excitation, or look for backlash and friction")
    if found.direct.periods_dropped:
        words.append(f"{found.direct.periods_dropped} periods had lost samples and were left out")
    if not facts.torque_known:
        words.append("the drive does not tell its rated torque: magnitudes are per rated torque")
    return tuple(words)


def resonance_table(
    model: MechanicalModel, lines_hz: FloatArray, highest_hz: float
) -> tuple[Resonance, ...]:
    """Resonances and antiresonances that the lines show, ascending; heights are local, in dB.

    A mode that hardly rises, or that is narrower than what lies between two lines, explains noise.
    """
    rows: list[Resonance] = []
    for mode in model.modes:
        height = model.height_db(mode)
        place = int(np.clip(np.searchsorted(lines_hz, mode.frequency_hz), 1, lines_hz.size - 1))
        gap_hz = float(lines_hz[place] - lines_hz[place - 1])
        low = mode.frequency_hz < _LOWEST_MODE_HZ
        shown = height > _WEAK_DB if low else model.prominence(mode) > _LEAST_SHARE
        wide = mode.damping * mode.frequency_hz > _NARROWEST * gap_hz
        inside = lines_hz[0] < mode.frequency_hz <= highest_hz
        if shown and wide and inside and mode.damping < 1.0:
            rows.append(Resonance("resonance", mode.frequency_hz, mode.damping, height))
    kept = [row.frequency_hz for row in rows]
    for frequency, damping in model.antiresonances():
        # An antiresonance belongs to a resonance above it, which may lie beyond the band.
        above = any(f > frequency for f in kept) or frequency > 0.25 * highest_hz
        if not above or not lines_hz[0] < frequency <= highest_hz:
            continue
        around = np.array([frequency * 0.5, frequency, frequency * 2.0])
        db = 20 * np.log10(np.abs(model.response(around)))
        depth = float(db[1] - (db[0] + db[2]) / 2)
        if depth < -_LEAST_DB:
            rows.append(Resonance("antiresonance", frequency, damping, depth))
    return tuple(sorted(rows, key=lambda row: row.frequency_hz))


def _injection_margins(found: Identification) -> dict[str, float | bool | None]:
    """Margins of the loop that was closed meanwhile, from its own torque."""
    frf, fit = found.corrected, found.fit
    use = frf.in_band
    f = frf.frequency_hz[use]
    controller = fit.loop.response(f) / (1.0 + 1j * f / (fit.path.current_bandwidth_hz or np.inf))
    open_loop = controller * frf.response[use]
    return margins_of(f, open_loop)


def margins_of(f: FloatArray, open_loop: ComplexArray) -> dict[str, float | bool | None]:
    """Margins and bandwidths of an open loop, for files and pages."""
    closed = closed_from_open(open_loop)
    width = bandwidth(f, closed)
    return {
        **asdict(margins(f, open_loop)),
        "bandwidth_hz": width.minus_3db_hz,
        "bandwidth_90deg_hz": width.minus_90deg_hz,
    }


def _evaluate_loop(
    records: tuple[tuple[excite.Sequence, Recording], ...],
    path: SignalPath,
    settings: SweepSettings,
    loop: Literal["none", "speed", "position"],
) -> SweepResult:
    """Closed loop from its reference to the motion."""
    position = settings.kind == "position_loop"
    taken = []
    for sequence, r in records:
        response = r.position_rad - r.position_rad[0] if position else r.velocity_rad_s
        taken.append(Record(sequence.excitation, response, r.torque_nm, r.valid))
    frf = estimate_periodic(tuple(taken), path, "closed_loop")
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


def _motion_s(records: tuple[tuple[excite.Sequence, Recording], ...]) -> float:
    return float(sum(s.excitation.duration_s for s, _ in records))


def _dc(session: CyclicSession) -> bool:
    return bool(session.state and session.state.dc)


# --- raw data -------------------------------------------------------------------------


def _raw(
    records: tuple[tuple[excite.Sequence, Recording], ...],
    setup: _Setup,
    settings: SweepSettings,
    session: CyclicSession,
) -> tuple[dict[str, npt.NDArray[np.generic]], dict[str, object]]:
    """Arrays and facts from which `reevaluate` makes the same answer again."""
    arrays: dict[str, npt.NDArray[np.generic]] = {}
    structure = []
    for number, (sequence, recording) in enumerate(records):
        arrays[f"{number}/excitation"] = sequence.excitation.samples
        arrays[f"{number}/lines"] = sequence.excitation.lines
        for name, values in recording.arrays().items():
            arrays[f"{number}/{name}"] = values
        e = sequence.excitation
        structure.append(
            {
                "kind": e.kind, "first_sample": e.first_sample,
                "period_samples": e.period_samples, "periods": e.periods,
                "transient_periods": e.transient_periods, "base_line": e.base_line,
                "realisation": e.realisation,
            }
        )  # fmt: skip
    return arrays, {
        "tool": "sweep",
        "sample_rate_hz": setup.rate,
        "loop": setup.loop,
        "dc": _dc(session),
        "facts": asdict(setup.facts),
        "settings": asdict(settings),
        "excitation": structure,
    }


def reevaluate(arrays: dict[str, npt.NDArray[np.generic]], meta: dict[str, object]) -> SweepResult:
    """The answer again, from kept raw data.

    Raises:
        ValueError: not the raw data of a sweep.
    """
    try:
        return _reevaluate(arrays, meta)
    except (KeyError, TypeError) as error:
        raise ValueError(f"not the raw data of a sweep: {error!r}") from error


def _reevaluate(arrays: dict[str, npt.NDArray[np.generic]], meta: dict[str, object]) -> SweepResult:
    rate = float(str(meta["sample_rate_hz"]))
    given, told, structure = meta["settings"], meta["facts"], meta["excitation"]
    if not isinstance(given, dict) or not isinstance(told, dict) or not isinstance(structure, list):
        raise TypeError("settings, facts or excitation")
    settings = SweepSettings(**{**given, "envelope": Envelope(**given["envelope"])})
    records = []
    for number, part in enumerate(structure):
        excitation = signals.Excitation(
            samples=np.asarray(arrays[f"{number}/excitation"], np.float64),
            sample_rate_hz=rate,
            lines=np.asarray(arrays[f"{number}/lines"], np.int64),
            **part,
        )
        columns = {
            name: np.asarray(arrays[f"{number}/{name}"], np.float64)
            for name in ("position_rad", "velocity_rad_s", "torque_nm", "sent", "offset")
        }
        valid = np.asarray(arrays[f"{number}/valid"], np.bool_)
        records.append((excite.Sequence(excitation), Recording(rate, **columns, valid=valid)))
    loop = str(meta["loop"])
    closed: Literal["none", "speed", "position"] = (
        "none" if loop == "none" else "position" if loop == "position" else "speed"
    )
    return evaluate(tuple(records), rate, AxisFacts(**told), settings, closed, bool(meta["dc"]))


def as_json(result: SweepResult) -> dict[str, object]:
    """The form that ``servodeck sweep --out`` writes (architecture.md)."""
    frf = result.frf
    return {
        "kind": result.kind,
        "loop": result.loop,
        "sample_rate_hz": frf.sample_rate_hz,
        "valid_band_hz": list(frf.valid_band_hz),
        "frequency_hz": frf.frequency_hz.tolist(),
        "magnitude_db": frf.magnitude_db.tolist(),
        "phase_deg": frf.phase_deg.tolist(),
        "coherence": frf.coherence.tolist(),
        "std_db": _numbers(frf.std_db),
        "std_deg": _numbers(frf.std_deg),
        "resonances": [
            {
                "kind": r.kind, "frequency_hz": r.frequency_hz, "damping": r.damping,
                "height_db": r.height_db,
            }
            for r in result.resonances
        ],
        "margins": result.margins,
        "unit": result.unit,
        "trusted": result.trusted,
        "delay_s": result.delay_s,
        "motion_s": result.motion_s,
        "saturated_share": result.saturated_share,
        "current_bandwidth_hz": result.current_bandwidth_hz,
        "speed_filter_hz": result.speed_filter_hz,
        "coulomb_nm": frf.coulomb_nm,
        "noise": _numbers(frf.noise),
        "distortion": _numbers(frf.distortion),
        "periods_used": frf.periods_used,
        "periods_dropped": frf.periods_dropped,
        "direct": {
            "valid_band_hz": list(result.direct.valid_band_hz),
            "magnitude_db": result.direct.magnitude_db.tolist(),
            "phase_deg": result.direct.phase_deg.tolist(),
            "std_db": _numbers(result.direct.std_db),
            "std_deg": _numbers(result.direct.std_deg),
        },
        "model": asdict(result.model) if result.model is not None else None,
        "warnings": list(result.warnings),
    }  # fmt: skip


def _numbers(values: FloatArray) -> list[float | None]:
    """JSON knows no NaN."""
    return [float(v) if np.isfinite(v) else None for v in values]
