"""First careful test of an axis: whether and which way it moves, and its rough inertia.

A small torque doublet, doubled until the axis moves well, yields inertia and friction to within
some ten per cent: enough to scale an excitation, but not a result.
"""

from __future__ import annotations

import asyncio
import itertools
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from backend.axes.axis.axis import Axis, Envelope
from backend.axes.axis.cyclic import CyclicSession
from backend.axes.drive.readings import Reading
from backend.tools.measuring import excite
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.measuring.interrupted import Interrupted, require_enabled
from backend.tools.measuring.recording import (
    Play,
    Recording,
    bus_limits,
    cycle_s,
    dwell,
    enabled,
    play,
)
from backend.tools.thresholds import inertia_probe as threshold
from drivers.cia402 import Mode
from drivers.errors import LinkTimeout, NotAllowed

_TURN = 2 * np.pi

PULLED = threshold.PULLED


@dataclass(frozen=True)
class Probed:
    """Rough values [kg·m², Nm]."""

    inertia_kgm2: float
    coulomb_nm: float
    gravity_nm: float
    rated_nm: float


@dataclass(frozen=True)
class Standing:
    """Torque of the speed loop at standstill: its mean [Nm], and its ripple in % of rated torque.

    The ripple is the RMS of some readings about their trend.
    """

    torque_nm: float
    ripple_percent: float


async def holding_torque(axis: Axis, session: CyclicSession, facts: AxisFacts) -> float:
    """Mean torque [Nm] with which the speed loop holds the axis at standstill, as `standing`."""
    return (await standing(axis, session, facts)).torque_nm


async def standing(axis: Axis, session: CyclicSession, facts: AxisFacts) -> Standing:
    """Torque with which the speed loop holds the axis at standstill.

    A load with a static torque would fall as soon as the loop is opened.

    Raises:
        NotAllowed: the axis oscillates under its speed loop.
        Interrupted: the speed loop does not hold it.
        LinkTimeout: half or more of the readings of torque or speed failed.
    """
    units, drive = await axis.units(), axis.drive
    key, speed = drive.require("torque_actual"), drive.require("velocity_actual")
    async with enabled(axis, session, Mode.CSV):
        await asyncio.sleep(threshold.SETTLE_S)
        began_s, began_raw = time.monotonic(), await axis.position_raw()
        readings = [await drive.read_many([key, speed]) for _ in range(threshold.READINGS)]
        passed_s = time.monotonic() - began_s
        moved_rev = units.position(await axis.position_raw() - began_raw)
        # A disabled drive reports no torque: a load on its brake would seem to need none, and would
        # fall.
        await require_enabled(axis)
    raws = _known(drive.name, [(r[key], r[speed]) for r in readings])
    torque = np.array([units.torque(t) for t, _ in raws])
    turning = np.array([units.velocity(v) for _, v in raws])
    if (
        float(np.std(torque)) > threshold.RESTLESS_PERCENT
        and float(np.std(turning)) > threshold.RESTLESS_RPM
    ):
        raise NotAllowed(
            "inertia.not-stand-still-under",
            drive=drive.name,
            ptp_percent=float(np.ptp(torque)),
            ptp_rpm=float(np.ptp(turning)),
        )
    if abs(float(np.mean(turning))) > threshold.FALLING_RPM:
        if abs(moved_rev) * 60.0 < threshold.FALLING_RPM * passed_s:
            # Speed without travel: an oscillation that the readings sample at one phase.
            raise NotAllowed(
                "inertia.not-stand-still-under",
                drive=drive.name,
                ptp_percent=2.0 * abs(float(np.mean(torque))),
                ptp_rpm=2.0 * abs(float(np.mean(turning))),
            )
        raise Interrupted(
            "inertia.turns-rpm-rated-torque",
            drive=drive.name,
            np_rpm=float(np.mean(turning)),
            np_percent=float(np.mean(torque)),
        )
    trend = np.polynomial.Legendre.fit(np.arange(torque.size), torque, 1)
    rest = torque - trend(np.arange(torque.size))
    ripple = float(np.sqrt(np.sum(rest**2) / max(torque.size - 2, 1)))
    return Standing(float(np.mean(torque)) / 100.0 * facts.rated_torque_nm, ripple)


def _known(name: str, pairs: Sequence[tuple[Reading, Reading]]) -> list[tuple[int, int]]:
    """Raw torque and speed of the readings that have both; a few may be lost on the way.

    An unread torque is no torque of zero: a load that is taken to pull nothing would fall.

    Raises:
        LinkTimeout: half or more of them could not be read.
    """
    found = [
        (torque.integer, speed.integer)
        for torque, speed in pairs
        if torque.integer is not None and speed.integer is not None
    ]
    if 2 * len(found) <= len(pairs):
        lost = next(each for pair in pairs for each in pair if each.integer is None)
        raise LinkTimeout(
            "moves.not-read-during-motion", drive=name, parameter=lost.key, error=lost.problem
        )
    return found


async def probe_axis(
    axis: Axis, session: CyclicSession, envelope: Envelope, facts: AxisFacts, home_raw: int,
    inertia_kgm2: float | None = None, *, moved_before: bool = False,
) -> Probed:  # fmt: skip
    """Test the axis in CST, from 2 % of rated torque upwards.

    ``moved_before``: earlier moves have shown whether a brake opens late (`Axis.brake_wait_s`).
    With a known inertia, the test begins at half of the torque that would move it well without
    friction, but at no more than a quarter of the permitted torque.

    Raises:
        NotAllowed: it does not move with the permitted torque, it moves the wrong way, or it left
            the envelope.
    """
    units, drive = await axis.units(), axis.drive
    rated, rate = facts.rated_torque_nm, 1.0 / cycle_s(session)
    step = units.torque(1.0) / 100.0 * rated
    highest = 0.9 * envelope.torque_percent / 100.0 * rated
    limits = await bus_limits(axis, envelope, home_raw)
    enough = min(threshold.ENOUGH_RAD_S, 0.4 * envelope.speed_rpm * _TURN / 60.0)
    first = threshold.FIRST_SHARE * rated
    if inertia_kgm2 is not None:
        # A quarter of the doublet is half a sine: its mean torque is 2/π of its peak.
        needed = enough * inertia_kgm2 / (2.0 / np.pi * threshold.DURATION_S / 4.0)
        first = max(first, min(0.5 * needed, 0.25 * highest))
    peak = min(first, highest)
    waited = moved_before
    async with enabled(axis, session, Mode.CST):
        # The first sequence counts towards the time that a brake may take to open.
        open_s = time.monotonic() + threshold.BRAKE_S
        while True:
            values = excite.probe(rate, peak, threshold.DURATION_S, step)
            raw = np.round(values / step).astype(np.int64)
            recording = await play(
                axis, session, Play(Mode.CST, raw), limits, rated, lambda _fraction: None
            )
            moved = float(np.max(np.abs(recording.velocity_rad_s)))
            if moved >= enough or peak >= highest:
                break
            if moved < threshold.STOOD * enough and not waited:
                # A brake that opens late must not release an axis under ever more torque.
                waited = True
                # Repeat the last setpoint, zero torque: otherwise it would expire and disable the
                # axis.
                await dwell(axis, session, max(open_s - time.monotonic(), 0.0))
                continue
            # Doubling brings a free axis to the wanted speed without overshooting it far.
            peak = min(2.0 * peak, highest)
    # A twisting shaft or backlash in a brake moves the encoder a little; a turning axis moves more.
    if moved < threshold.STOOD * enough:
        raise NotAllowed(
            "inertia.not-move-rated-torque",
            drive=drive.name,
            value=round(moved, 4),
            limit=f"{enough:.3g} rad/s",
            peak=peak / rated,
        )
    return _judged(drive.name, recording, rated)


def _judged(name: str, recording: Recording, rated_nm: float) -> Probed:
    """Rough values from the last pulses.

    A heavy load on a soft coupling swings against the motor, so that the fit of a rigid body has
    little inertia, or less than none. The momentum that the motor took is then all that is known.

    Raises:
        NotAllowed: the motion gave energy to the motor, or a rigid body moved against the torque.
    """
    fit = rough_fit(
        recording.torque_nm, recording.velocity_rad_s, recording.sample_rate_hz, recording.valid
    )
    taken = _momentum(recording) / float(np.max(np.abs(recording.velocity_rad_s)))
    require_right_sign(name, recording)
    if fit.inertia_kgm2 < -threshold.AGAINST * taken and _energy(recording) < threshold.GAINED:
        raise _wrong_sign(name)
    inertia = fit.inertia_kgm2 if fit.inertia_kgm2 >= threshold.RIGID * taken else taken
    return Probed(inertia, max(fit.coulomb_nm, 0.0), fit.gravity_nm, rated_nm)


def _momentum(recording: Recording) -> float:
    """Half of the range of the torque's integral [Nms]: what the first pulse gave."""
    given = np.cumsum(np.where(recording.valid, recording.torque_nm, 0.0))
    return float(np.ptp(np.concatenate([[0.0], given]))) / recording.sample_rate_hz / 2.0


def _energy(recording: Recording) -> float:
    """Energy that the motor gave, as a share of what went to and fro; below 0 it took some."""
    power = (recording.torque_nm * recording.velocity_rad_s)[recording.valid]
    return float(np.sum(power)) / max(float(np.sum(np.abs(power))), 1e-12)


def require_right_sign(name: str, recording: Recording) -> None:
    """Check the signs: between two standstills at one position, a motor can only lose energy.

    Raises:
        NotAllowed: torque times speed shows a gain: one of them has the wrong sign.
    """
    if _energy(recording) < -threshold.GAINED:
        raise _wrong_sign(name)


def _wrong_sign(name: str) -> NotAllowed:
    return NotAllowed("inertia.moves-against-torque-sign", drive=name)


@dataclass(frozen=True)
class RoughFit:
    """Least-squares fit of T = J·a + Tc·sign(v) + Tg [kg·m², Nm, Nm]."""

    inertia_kgm2: float
    coulomb_nm: float
    gravity_nm: float


def smoothed(
    signal: npt.NDArray[np.float64], valid: npt.NDArray[np.bool_], rate: float
) -> npt.NDArray[np.float64]:
    """Mean [n] over 20 ms around each sample, of the valid samples.

    Signals smoothed in the same way stay consistent; the steps of a coarse encoder, which are no
    acceleration, mostly vanish.
    """
    window = np.ones(2 * round(0.5 * threshold.SMOOTHED_S * rate) + 1)
    taken = np.convolve(np.where(valid, signal, 0.0), window, "same")
    return np.asarray(taken / np.maximum(np.convolve(valid.astype(np.float64), window, "same"), 1))


def rough_fit(
    torque: npt.NDArray[np.float64],
    velocity: npt.NDArray[np.float64],
    rate: float,
    valid: npt.NDArray[np.bool_],
) -> RoughFit:
    """Fit momentum instead of acceleration: ∫T = J·Δv + Tc·∫sign(v) + Tg·t, per moving stretch.

    Integrals need no derivative of a quantised speed.
    """
    dt = 1.0 / rate
    peak = float(np.max(np.abs(velocity)))
    moving = (np.abs(velocity) > 0.1 * peak) & valid
    edges = np.flatnonzero(np.diff(np.concatenate([[False], moving, [False]]).astype(int)))
    rows, momenta = [], []
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        if end - begin < 6:
            continue
        # Several intervals within a stretch: over a whole stretch, the speed change is zero.
        points = np.unique(np.linspace(begin, end - 1, 7).astype(int))
        for a, b in itertools.pairwise(points):
            between = slice(a, b)
            momentum = float(np.sum(torque[between])) * dt
            sign = float(np.sum(np.sign(velocity[between]))) * dt
            rows.append([velocity[b] - velocity[a], sign, (b - a) * dt])
            momenta.append(momentum)
    if len(rows) < 6:
        swing = float(np.max(np.abs(np.cumsum(torque)))) * dt
        direction = float(np.sign(np.dot(torque[:-1], np.diff(velocity))) or 1.0)
        return RoughFit(direction * swing / max(2 * peak, 1e-9), 0.0, 0.0)
    x = np.linalg.lstsq(np.array(rows), np.array(momenta), rcond=None)[0]
    return RoughFit(float(x[0]), float(x[1]), float(x[2]))
