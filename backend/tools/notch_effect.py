"""What the notch values of a drive mean, measured on the drive where no manual prints it.

The same torque is played without a notch and with some of its values, all at one frequency; what
they do is read from the reported torque (:mod:`backend.analysis.notch_effect`). M6-L prints no
depth, R6L only levels. Every value is put back.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from backend.analysis.arrays import ComplexArray, FloatArray
from backend.analysis.notch import LevelCalibration, Notch
from backend.analysis.notch_effect import NotchEffect, fit_effect
from backend.analysis.sampling import SignalPath
from backend.axis import Axis, Envelope
from backend.cyclic import CyclicSession
from backend.drive import Drive
from backend.jobs import Progress
from backend.tools import excite
from backend.tools.axis_facts import AxisFacts
from backend.tools.go_back import go_back
from backend.tools.notch import plan_notches
from backend.tools.notch_meaning import NotchMeaning
from backend.tools.recording import Play, bus_limits, cycle_s, enabled, play, require_signals, share
from backend.tools.temporary import temporary
from drivers.cia402 import Mode
from drivers.errors import NotAllowed
from profiles.schema import NotchSlot

_TURN = 2 * np.pi
#: Where the notch is tried: share of the sample rate, and limits in Hz.
_PLACE, _LOWEST_HZ, _HIGHEST_HZ = 0.12, 55.0, 400.0
#: Widths in shares of the centre (Hz), or level pairs (width, depth).
_WIDTHS = (0.5, 0.2)
_SHARE_OF_TORQUE = 0.35
#: An axis that only trembles: its lines begin here, and it may go so far and so fast. Nothing
#: holds it, so that rounded torques let it drift by some hundredths of a revolution.
_STILL_FROM_HZ, _STILL_REV, _STILL_RPM = 30.0, 0.3, 150.0
#: Less than this to the nearest end is too little for it.
_LEAST_ROOM_REV = 0.1


@dataclass(frozen=True)
class _Trial:
    """Values of one slot that are tried: levels or Hz."""

    width: int
    depth: int | None


def unknown(drive: Drive) -> bool:
    """Whether the family has notches whose effect no manual prints."""
    spec = drive.profile.notch
    return spec is not None and spec.encoding in ("hz_width", "hz_levels")


async def measure_meaning(
    axis: Axis,
    session: CyclicSession,
    envelope: Envelope,
    facts: AxisFacts,
    rigid: excite.Rigid,
    path: SignalPath,
    progress: Progress,
    *,
    still: bool = False,
) -> NotchMeaning:
    """Try values of the first notch on an axis that no load pulls, without a loop.

    ``path`` lies between set-point and torque, as a measurement of the mechanics found it. With
    ``still`` the axis only trembles where it stands: what a notch does to the torque shows
    without any travel, and friction is no part of it.

    Raises:
        NotAllowed: the axis cannot be measured so, or the notch does nothing that can be seen.
    """
    drive = axis.drive
    spec = drive.profile.notch
    if spec is None or not unknown(drive):
        raise NotAllowed(f"{drive.name}: what its notches do is printed in the manual",
                         drive=drive.name)  # fmt: skip
    require_signals(axis, session, Mode.CST, False)
    rate = 1.0 / cycle_s(session)
    centre = round(min(max(_PLACE * rate, _LOWEST_HZ), _HIGHEST_HZ))
    slot = spec.slots[0]
    trials = _trials(drive, slot, centre)
    home = await axis.position_raw()
    sequence = await asyncio.to_thread(_sequence, rate, envelope, facts, rigid, still)
    effects: list[tuple[_Trial, NotchEffect | None]] = []
    off = await plan_notches(drive, [])
    plain: ComplexArray | None = None
    for number, trial in enumerate([None, *trials]):
        low = number / (len(trials) + 1)
        words = f"notch {number} of {len(trials)}" if trial else "without a notch"
        told = share(progress, low, low + 1.0 / (len(trials) + 1), f"trying {words}")
        async with temporary(axis, off | ({} if trial is None else _raw(slot, centre, trial))):
            seen = await _torque(axis, session, sequence, envelope, facts, home, told)
        await go_back(axis, session, home, envelope, facts)
        if plain is None or trial is None:
            plain = seen
            continue
        effects.append((trial, _effect(sequence, seen / plain, path)))
    return _meaning(drive, centre, effects)


def room_to_tremble(
    envelope: Envelope, at_rev: float, ends_rev: tuple[float, float] | None
) -> Envelope | None:
    """The envelope of an axis that stays where it stands; None too near to an end for it."""
    to_end = _STILL_REV if ends_rev is None else min(at_rev - ends_rev[0], ends_rev[1] - at_rev)
    room_rev = min(_STILL_REV, envelope.travel_rev, 0.8 * to_end)
    if room_rev < _LEAST_ROOM_REV:
        return None
    speed_rpm = min(envelope.speed_rpm, _STILL_RPM)
    return replace(envelope, travel_rev=room_rev, speed_rpm=speed_rpm)


def _trials(drive: Drive, slot: NotchSlot, centre: int) -> list[_Trial]:
    """Values that show how width and depth go."""
    if slot.depth_key is None:
        return [_Trial(round(share * centre), None) for share in _WIDTHS]
    low_w, high_w = _limits(drive, slot.width_key)
    low_d, high_d = _limits(drive, slot.depth_key)
    middle = round(0.5 * (low_w + high_w))
    span = high_d - low_d
    depths = [round(low_d + part * span) for part in (0.0, 0.08, 0.2, 0.4, 0.7)]
    some = [_Trial(middle, depth) for depth in depths]
    wide = [round(low_w + part * (high_w - low_w)) for part in (0.15, 1.0)]
    return some + [_Trial(width, depths[1]) for width in wide]


def _limits(drive: Drive, key: str | None) -> tuple[int, int]:
    low, high = drive.parameter(key or "").raw_limits
    return int(low or 0), int(high or 0)


def _raw(slot: NotchSlot, centre: int, trial: _Trial) -> dict[str, int]:
    pairs = ((slot.frequency_key, centre), (slot.width_key, trial.width),
             (slot.depth_key, trial.depth))  # fmt: skip
    return {key: value for key, value in pairs if key is not None and value is not None}


def _sequence(
    rate: float, envelope: Envelope, facts: AxisFacts, rigid: excite.Rigid, still: bool
) -> excite.Sequence:
    """The excitation of a frequency response, one realisation of it."""
    rated = facts.rated_torque_nm
    room = excite.Room(
        envelope.torque_percent / 100.0 * rated, envelope.speed_rpm * _TURN / 60.0,
        envelope.travel_rev * _TURN,
    )  # fmt: skip
    band = excite.band_for(rate, _STILL_FROM_HZ if still else 5.0, None)
    try:
        made = excite.torque_mode(
            rate, band, room, rigid, 0.0, share=_SHARE_OF_TORQUE, realisations=1, base=not still
        )
    except ValueError as error:
        raise NotAllowed(
            f"the envelope does not allow to measure the notches: {error}",
            remedy="widen travel, speed or torque of the envelope",
        ) from error
    return made[0]


async def _torque(
    axis: Axis, session: CyclicSession, sequence: excite.Sequence, envelope: Envelope,
    facts: AxisFacts, home: int, told: Callable[[float], None],
) -> ComplexArray:  # fmt: skip
    """Spectrum of the reported torque at the lines, over the whole periods."""
    units = await axis.units()
    step = units.torque(1.0) / 100.0 * facts.rated_torque_nm
    e = sequence.excitation
    raw = np.round(e.samples / step).astype(np.int64)
    async with enabled(axis, session, Mode.CST):
        recording = await play(
            axis, session, Play(Mode.CST, raw), await bus_limits(axis, envelope, home),
            facts.rated_torque_nm, told,
        )  # fmt: skip
    blocks = []
    for number in range(e.transient_periods, e.periods):
        cut = slice(e.first_sample + number * e.period_samples, None)
        block, valid = (x[cut][: e.period_samples] for x in (recording.torque_nm, recording.valid))
        if np.all(valid):
            blocks.append(np.fft.rfft(block)[e.lines])
    if not blocks:
        raise NotAllowed(
            f"{axis.drive.name}: samples were lost in every period", drive=axis.drive.name,
            remedy="look at the link quality; the computer or the bus is overloaded",
        )  # fmt: skip
    return np.asarray(np.mean(blocks, axis=0))


def _effect(sequence: excite.Sequence, ratio: ComplexArray, path: SignalPath) -> NotchEffect | None:
    try:
        return fit_effect(sequence.excitation.line_hz, ratio, path)
    except ValueError:
        return None


def _meaning(
    drive: Drive, centre: int, effects: list[tuple[_Trial, NotchEffect | None]]
) -> NotchMeaning:
    """What the trials say together."""
    seen = [(trial, effect.notch) for trial, effect in effects if effect is not None]
    if not seen:
        raise NotAllowed(
            f"{drive.name}: its notch at {centre} Hz does nothing that the torque shows",
            drive=drive.name,
            remedy="look whether another function of the drive owns the notches",
        )
    if seen[0][0].depth is None:
        scale = float(np.mean([notch.width_hz / trial.width for trial, notch in seen]))
        depth = float(np.mean([notch.depth_db for _trial, notch in seen]))
        return NotchMeaning(float(centre), None, scale, depth)
    # The same width was tried with several depths: the deep ones show it best.
    widths: dict[int, list[Notch]] = {}
    for trial, notch in seen:
        widths.setdefault(trial.width, []).append(notch)
    ratios = []
    for level, notches in sorted(widths.items()):
        deep = sorted(notches, key=lambda n: n.depth_db)[:3]
        weights: FloatArray = np.array([-n.depth_db for n in deep])
        ratio = float(np.average([n.width_hz / n.center_hz for n in deep], weights=weights))
        ratios.append((level, ratio))
    middle = seen[0][0].width
    depths = [(t.depth or 0, n.depth_db) for t, n in seen if t.width == middle]
    flat = [(t.depth or 0, 0.0) for t, e in effects if e is None and t.width == middle]
    return NotchMeaning(
        float(centre), LevelCalibration(tuple(ratios), _every_level(drive, depths + flat))
    )


def _every_level(drive: Drive, points: list[tuple[int, float]]) -> tuple[tuple[int, float], ...]:
    """Depth of each level between those that were tried, by what is left of the amplitude."""
    spec = drive.profile.notch
    assert spec is not None
    low, high = _limits(drive, spec.slots[0].depth_key)
    ordered = sorted(points)
    levels = np.arange(max(low, ordered[0][0]), min(high, ordered[-1][0]) + 1)
    left = np.interp(levels, [p[0] for p in ordered], [10 ** (p[1] / 20) for p in ordered])
    return tuple((int(n), float(20 * np.log10(a))) for n, a in zip(levels, left, strict=True))


def path_of(rate: float, facts: AxisFacts, hold: str | None, delay_s: float) -> SignalPath:
    """The path between set-point and torque, as a frequency response found it."""
    path = SignalPath(rate, current_bandwidth_hz=facts.current_bandwidth_hz,
                      command_delay_s=delay_s)  # fmt: skip
    return replace(path, hold="linear") if hold == "linear" else path
