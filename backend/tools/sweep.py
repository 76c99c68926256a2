"""Frequency response of an axis over a bus with cyclic process data.

*mechanics*: torque to velocity, either with no loop (CST) or by torque offsets beside a closed
speed (CSV) or position loop (CSP), as a vertical or limited axis needs. *speed_loop* and
*position_loop*: from the loop's own reference to what the axis does.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from backend.analysis.excitation import scaled
from backend.axis import Axis
from backend.cyclic import CyclicSession
from backend.jobs import Progress
from backend.tools import excite, speed_injection
from backend.tools import notch as notch_tool
from backend.tools.axis_facts import AxisFacts, read_facts
from backend.tools.gains import read_gains
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
    takes_torque,
)
from backend.tools.sweep_evaluation import (
    Loop,
    SweepResult,
    SweepSettings,
    evaluate,
)
from backend.tools.temporary import temporary
from drivers.cia402 import Mode
from drivers.errors import NotAllowed, OutOfRange

Keep = Callable[[str, dict[str, npt.NDArray[np.generic]], dict[str, object]], None]

_TURN = 2 * np.pi
_MODE_OF = {"none": Mode.CST, "speed": Mode.CSV, "position": Mode.CSP}
#: A loop's reference that took too much torque is played again, this much smaller.
_ATTEMPTS, _WEAKER = 4, 0.4


@dataclass(frozen=True)
class _Setup:
    """Everything that was found out before the excitation is made."""

    rate: float
    facts: AxisFacts
    loop: Literal["none", "speed", "position"]
    room: excite.Room
    rigid: excite.Rigid
    torque_step_nm: float
    by_speed: bool = False
    """Mechanics by the speed loop's reference, where no torque can be added beside the loop."""
    integral_hz: float | None = None


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
    if loop == "auto" and (settings.excitation == "stepped" or not takes_torque(axis, session)):
        loop = "speed"
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
                loop = _choose(axis, settings, probed)
        setup = await _setup(axis, session, settings, facts, loop, probed)
        beside = not closed and setup.loop != "none" and not setup.by_speed
        require_signals(axis, session, _MODE_OF[setup.loop], beside)
        progress(0.08, "designing the excitation")
        sequences = await asyncio.to_thread(_sequences, setup, settings)
        if setup.by_speed:
            progress(0.09, "feeling how much torque the speed loop makes")
            sequences = await _by_speed(axis, session, settings, setup, sequences, home, progress)
        records = await _play_fitting(axis, session, settings, setup, sequences, home, progress)
    await go_back(axis, session, home, settings.envelope, facts)
    raw, meta = _raw(records, setup, settings, session)
    if keep is not None:
        keep(f"sweep-{settings.kind}", raw, meta)
    progress(0.95, "evaluating")
    try:
        return await asyncio.to_thread(
            evaluate, records, setup.rate, facts, settings, setup.loop, _dc(session),
            setup.by_speed, setup.integral_hz,
        )  # fmt: skip
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
    if settings.excitation == "stepped" and settings.loop == "none":
        raise OutOfRange("a stepped sine lasts too long for an axis that no loop holds",
                         remedy="measure it with the speed loop closed")  # fmt: skip
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
        if slot.enable_key is not None and slot.enable_bit is not None:
            # The other bits switch filters that the loop is used with.
            if not drive.unreachable_why(drive.parameter(slot.enable_key)):
                before = off.get(slot.enable_key, await drive.raw(slot.enable_key))
                off[slot.enable_key] = before & ~(1 << slot.enable_bit)
        elif slot.enable_key is not None:
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


def _choose(axis: Axis, settings: SweepSettings, probed: Probed) -> Literal["none", "speed"]:
    """No loop on an axis that stays where it is and whose inertia rules, else the speed loop.

    Where friction takes more of the base motion's torque than inertia, a torque that is off by
    little makes a speed that is off by much.
    """
    drifts = abs(probed.gravity_nm) > max(0.5 * probed.coulomb_nm, 0.01 * probed.rated_nm)
    if drifts:
        return _held_by_loop(axis, settings.loop, probed.gravity_nm)
    momentum_nm = excite.base_torque_nm(probed.inertia_kgm2, settings.envelope.speed_rpm)
    light = 4 / np.pi * probed.coulomb_nm > momentum_nm
    return "speed" if light and settings.loop == "auto" else "none"


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
    torque_percent = min(envelope.torque_percent, await _drive_limit_percent(axis))
    room = excite.Room(
        torque_nm=torque_percent / 100.0 * rated,
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
    by_speed = settings.kind == "mechanics" and kind == "speed" and not _can_offset(axis, session)
    integral_hz = None
    if by_speed:
        with contextlib.suppress(NotAllowed):
            integral_hz = (await read_gains(axis, facts)).integral_hz
    return _Setup(1.0 / cycle_s(session), facts, kind, room, rigid, step, by_speed, integral_hz)


async def _drive_limit_percent(axis: Axis) -> float:
    """The drive's own torque limit: what is asked beyond it does not come."""
    drive, units = axis.drive, await axis.units()
    limits = [np.inf]
    for role in ("torque_limit_positive", "torque_limit_negative", "max_torque"):
        key = drive.key(role)
        if key is not None and not drive.unreachable_why(drive.parameter(key)):
            limits.append(abs(units.torque(await drive.raw(key))))
    return float(min(limits))


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
                waveform=settings.excitation,
            )  # fmt: skip
        if setup.loop == "none":
            return excite.torque_mode(
                setup.rate, band, setup.room, setup.rigid, setup.torque_step_nm,
                share=settings.share, realisations=settings.realisations,
                base=settings.base_motion, waveform=settings.excitation,
            )  # fmt: skip
        if setup.by_speed:
            return speed_injection.sequences(
                setup.rate, band, setup.room, speed_injection.FIRST_RAD_S, settings.realisations,
                settings.excitation, base=settings.base_motion,
            )  # fmt: skip
        return excite.beside_loop(
            setup.rate, band, setup.room, setup.torque_step_nm, share=settings.share,
            realisations=settings.realisations, position=setup.loop == "position",
            base=settings.base_motion, waveform=settings.excitation,
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


async def _by_speed(
    axis: Axis, session: CyclicSession, settings: SweepSettings, setup: _Setup,
    sequences: tuple[excite.Sequence, ...], home: int, progress: Progress,
) -> tuple[excite.Sequence, ...]:  # fmt: skip
    """The excitation made so large that its torque has the wanted share."""
    trial = Progress(lambda: progress(0.09, "feeling how much torque the speed loop makes"))
    ((sent, recording),) = await _play_fitting(
        axis, session, settings, setup, sequences[:1], home, trial
    )
    share_nm = settings.share * setup.room.torque_nm
    peak = speed_injection.fitting_amplitude(sent, recording, setup.room, share_nm)
    factor = peak / speed_injection.FIRST_RAD_S
    return tuple(replace(s, excitation=scaled(s.excitation, factor)) for s in sequences)


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
        records.append((await _as_sent(axis, sequence, settings, setup, sent, start), recording))
    return tuple(records)


async def _play_fitting(
    axis: Axis, session: CyclicSession, settings: SweepSettings, setup: _Setup,
    sequences: tuple[excite.Sequence, ...], home_raw: int, progress: Progress,
) -> tuple[tuple[excite.Sequence, Recording], ...]:  # fmt: skip
    """As `_play_all`; where a loop answers with too much torque the excitation becomes smaller.

    How much torque that takes depends on the loop's gains, which are what is measured.
    """
    attempts = _ATTEMPTS if setup.loop != "none" else 1
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
    if settings.kind != "mechanics" or setup.by_speed:
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
    setup: _Setup,
    sent: Play,
    start: int,
) -> excite.Sequence:  # fmt: skip
    """The excitation as the rounded set-points say; estimators must know what really went out."""
    if settings.kind == "mechanics" and not setup.by_speed:
        return sequence
    units = await axis.units()
    if sent.mode is Mode.CSP:
        values = (sent.values - start) * (units.position(1.0) * _TURN)
    else:
        values = sent.values * (units.velocity(1.0) * _TURN / 60.0)
    return replace(
        sequence, excitation=replace(sequence.excitation, samples=np.asarray(values, np.float64))
    )


def _dc(session: CyclicSession) -> bool:
    return session.synchronous


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
                "realisation": e.realisation, "segments": [asdict(tone) for tone in e.segments],
            }
        )  # fmt: skip
    return arrays, {
        "tool": "sweep",
        "sample_rate_hz": setup.rate,
        "loop": setup.loop,
        "by_speed": setup.by_speed,
        "integral_hz": setup.integral_hz,
        "dc": _dc(session),
        "facts": asdict(setup.facts),
        "settings": asdict(settings),
        "excitation": structure,
    }
