"""Vibration at one frequency: a sine that is faded in, held and faded out."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from backend.axes.axis.axis import Axis
from backend.axes.axis.cyclic import CyclicSession
from backend.axes.scales.units import AxisUnits
from backend.foundation.work.jobs import Progress
from backend.tools.measuring.axis_facts import read_facts
from backend.tools.measuring.computing import meanwhile
from backend.tools.measuring.recording import cycle_s, require_signals
from backend.tools.mechanics.inertia.moves import speed_move
from backend.tools.moving.dwell.evaluate import Dwelt, evaluate, long_enough, reevaluate
from backend.tools.moving.dwell.result import DwellResult
from backend.tools.moving.dwell.settings import DwellSettings
from backend.tools.moving.dwell.texts import TEXTS, report
from backend.tools.moving.moves.go_back import go_back
from backend.tools.thresholds import dwell_run as threshold
from backend.tools.tool import Run, Tool
from drivers.cia402 import Mode
from drivers.errors import NotAllowed, OutOfRange
from drivers.texts.message import text

FloatArray = npt.NDArray[np.float64]
_TURN = 2 * np.pi


@dataclass(frozen=True)
class Sequence:
    """Signals to play [n]: base speed in rpm, sine in rpm or %, and which samples are evaluated."""

    base_rpm: FloatArray
    sine: FloatArray
    counts: npt.NDArray[np.bool_]


def sequence(settings: DwellSettings, rate: float) -> Sequence:
    """Sine faded in, held for the set time and faded out, on a base speed that reciprocates."""
    lead, fade = (round(s * rate) for s in (threshold.LEAD_S, threshold.FADE_S))
    held = round(settings.duration_s * rate)
    rise = 0.5 * (1.0 - np.cos(np.pi * (np.arange(fade) + 0.5) / fade))
    shape = np.concatenate([np.zeros(lead), rise, np.ones(held), rise[::-1], np.zeros(lead)])
    by_speed = settings.by == "speed"
    amplitude = settings.amplitude_rpm if by_speed else settings.amplitude_percent
    phase = _TURN * settings.frequency_hz / rate * np.arange(shape.size)
    base = _to_and_fro(settings, shape.size, rate)
    # Where the slow speed reverses, the friction reverses, too.
    counts = np.abs(base) >= threshold.TURNING * settings.turn_rpm
    counts[: lead + fade] = counts[lead + fade + held :] = False
    return Sequence(base, amplitude * shape * np.sin(phase), counts)


def _to_and_fro(settings: DwellSettings, size: int, rate: float) -> FloatArray:
    """Speed [size] in rpm of reciprocating strokes from the start, from and to standstill."""
    if settings.turn_rpm == 0.0:
        return np.zeros(size)
    rps, total_s = settings.turn_rpm / 60.0, size / rate
    longest_s = min(
        threshold.USED * settings.travel_limit / rps + threshold.RAMP_S, threshold.STROKE_S
    )
    pairs = max(1, int(np.ceil(total_s / (2.0 * longest_s))))
    ramp, stroke = round(threshold.RAMP_S * rate), size // (2 * pairs)
    rise = 0.5 * (1.0 - np.cos(np.pi * (np.arange(ramp) + 0.5) / ramp))
    one = np.concatenate([rise, np.ones(max(stroke - 2 * ramp, 0)), rise[::-1]])
    # Whole pairs of strokes, so that the axis ends where it began.
    base = np.tile(np.concatenate([one, -one]), pairs)[:size] * settings.turn_rpm
    return np.asarray(np.concatenate([base, np.zeros(size - base.size)]))


def require_inside(settings: DwellSettings, rate: float, units: AxisUnits) -> None:
    """Check that the vibration fits into the envelope and is resolved by the setpoints.

    Raises:
        OutOfRange: states what is needed and what is permitted; nothing has moved.
    """
    envelope, highest_hz = settings.envelope, threshold.HIGHEST * rate
    if settings.frequency_hz > highest_hz:
        raise OutOfRange(
            "dwell.frequency-too-high",
            value=settings.frequency_hz,
            limit=f"{highest_hz:g} Hz",
            highest_hz=highest_hz,
        )
    by_speed = settings.by == "speed"
    needed_rpm = settings.turn_rpm + (settings.amplitude_rpm if by_speed else 0.0)
    swing_rev = settings.amplitude_rpm / 60.0 / (_TURN * settings.frequency_hz) if by_speed else 0.0
    # The shortest stroke of the slow speed consists of its two ramps.
    way_rev = 2.0 * swing_rev + settings.turn_rpm / 60.0 * threshold.RAMP_S
    permitted_rpm = threshold.FAST * envelope.speed_rpm
    if needed_rpm > permitted_rpm or way_rev > threshold.USED * envelope.travel_rev:
        raise OutOfRange(
            "dwell.beyond-envelope",
            value=needed_rpm,
            limit=f"{permitted_rpm:g} rpm",
            needed_rpm=needed_rpm,
            way_rev=way_rev,
            permitted_rpm=permitted_rpm,
            travel_rev=threshold.USED * envelope.travel_rev,
        )
    least_percent = threshold.SHARE * envelope.torque_percent
    if not by_speed and settings.amplitude_percent > least_percent:
        raise OutOfRange(
            "dwell.torque-beyond-envelope",
            value=settings.amplitude_percent,
            limit=f"{least_percent:g} %",
            permitted_percent=least_percent,
        )
    step = abs(units.velocity(1.0)) if by_speed else abs(units.torque(1.0))
    amplitude = settings.amplitude_rpm if by_speed else settings.amplitude_percent
    if amplitude < threshold.STEPS * step:
        raise OutOfRange(
            "dwell.amplitude-too-small",
            value=amplitude,
            limit=f"{threshold.STEPS * step:.3g}",
            least=threshold.STEPS * step,
            unit="rpm" if by_speed else "%",
        )
    takes_s = settings.duration_s + 2.0 * (threshold.FADE_S + threshold.LEAD_S)
    if takes_s > envelope.time_s:
        raise OutOfRange(
            "dwell.takes-too-long",
            value=takes_s,
            limit=f"{envelope.time_s:g} s",
            takes_s=takes_s,
            time_s=envelope.time_s,
        )


def require_long_enough(settings: DwellSettings, rate: float) -> Sequence:
    """The signals to play, whose time at full amplitude suffices for an evaluation.

    Raises:
        OutOfRange: states the time that is needed; nothing has moved.
    """

    def suffices(wanted: Sequence) -> bool:
        return long_enough(wanted.counts, settings.frequency_hz, rate)

    wanted = sequence(settings, rate)
    if suffices(wanted):
        return wanted
    longer = range(int(settings.duration_s) + 1, threshold.LONGEST_S + 1)
    changed = (settings.model_copy(update={"duration_s": float(s)}) for s in longer)
    least_s = next((each.duration_s for each in changed if suffices(sequence(each, rate))), None)
    if least_s is None:
        raise NotAllowed("dwell.strokes-too-short", frequency_hz=settings.frequency_hz)
    raise OutOfRange(
        "dwell.too-short",
        value=settings.duration_s,
        limit=f"{least_s:g} s",
        frequency_hz=settings.frequency_hz,
        least_s=least_s,
    )


@dataclass
class Live:
    """Present amplitude of the speed, from the newest raw samples."""

    frequency_hz: float
    rate_hz: float
    rpm_per_raw: float
    amplitude_rpm: float = 0.0
    _newest: FloatArray = field(default_factory=lambda: np.empty(0))

    def take(self, rows: FloatArray) -> bool:
        """Add rows [n, 3] of position, velocity and torque; always False: the motion continues."""
        whole = max(1, round(threshold.LIVE_S * self.frequency_hz))
        size = round(whole / self.frequency_hz * self.rate_hz)
        self._newest = np.concatenate([self._newest, rows[:, 1]])[-size:]
        speed = self._newest[np.isfinite(self._newest)]
        if self._newest.size == size and speed.size == size:
            turning = np.exp(-1j * _TURN * self.frequency_hz / self.rate_hz * np.arange(size))
            lock_in = abs(np.mean((speed - np.mean(speed)) * turning))
            self.amplitude_rpm = float(2.0 * lock_in * abs(self.rpm_per_raw))
        return False


async def run(run: Run, settings: DwellSettings) -> DwellResult:
    """Vibrate; the axis ends where it began, with its settings restored.

    Raises:
        OutOfRange: the vibration does not fit into the envelope, or is too short to be evaluated;
            nothing has moved.
        NotAllowed: the drive accepts no torque offset (60B2h) in every cycle, or the envelope or a
            fault ended the motion.
    """
    axis, session, envelope = run.axis, run.session, settings.envelope
    by_speed = settings.by == "speed"
    _require_torque(axis, session, by_speed=by_speed)
    units = await axis.require_certain_scales()
    rate = 1.0 / cycle_s(session)
    require_inside(settings, rate, units)
    wanted = require_long_enough(settings, rate)
    facts = await read_facts(axis, settings.rated_torque_nm)
    home = await axis.position_raw()
    live = Live(settings.frequency_hz, rate, units.velocity(1.0))
    recording = await speed_move(
        axis, session, wanted.base_rpm + (wanted.sine if by_speed else 0.0), envelope, facts,
        Shown(run.progress, live), until=live.take,
        torque_nm=None if by_speed else wanted.sine / 100.0 * facts.rated_torque_nm,
    )  # fmt: skip
    run.progress(0.95, text("dwell.going-back-evaluating"))
    size = recording.position_rad.size
    steps = abs(units.position(1.0)) * _TURN, abs(units.torque(1.0))
    dwelt = Dwelt(
        recording, wanted.sine[:size], wanted.counts[:size], facts.rated_torque_nm, *steps
    )
    if run.keep is not None:
        run.keep("dwell", dwelt.arrays(), dwelt.meta(settings))
    return await meanwhile(
        lambda: evaluate(dwelt, settings), go_back(axis, session, home, envelope, facts)
    )


@dataclass(frozen=True)
class Shown:
    """Progress whose step states the frequency and the amplitude measured at the motor."""

    progress: Progress
    live: Live

    def __call__(self, fraction: float) -> None:
        """Report the completed fraction of the motion, 0 to 1."""
        step = text(
            "dwell.vibrating",
            frequency_hz=self.live.frequency_hz,
            amplitude_rpm=self.live.amplitude_rpm,
        )
        self.progress(0.05 + 0.9 * fraction, step)


def _require_torque(axis: Axis, session: CyclicSession, *, by_speed: bool) -> None:
    """Check that the exchange carries speed, and a torque offset where needed, in every cycle.

    Raises:
        NotAllowed: states the missing signal.
    """
    require_signals(axis, session, Mode.CSV, False)
    key = axis.drive.key("torque_offset")
    if not by_speed and (key is None or not session.carries(axis.drive, key)):
        raise NotAllowed("dwell.no-torque-offset", drive=axis.drive.name)


TOOL = Tool(
    kind="dwell",
    title=text("dwell.title"),
    settings=DwellSettings,
    result=DwellResult,
    run=run,
    reevaluate=reevaluate,
    report=report,
    texts=TEXTS,
)
