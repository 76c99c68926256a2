"""How an axis answers a commanded step of speed, or a commanded move."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from backend.analysis.signals.step import MoveMetrics, StepMetrics, move_metrics, step_metrics
from backend.axis.axis import Axis, Envelope
from backend.axis.cyclic import CyclicSession
from backend.tools.autotune.axis_facts import read_facts
from backend.tools.jog.cyclic import run_up
from backend.tools.measuring.recording import (
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
from backend.tools.measuring.temporary import stopping_hard
from backend.tools.moves.go_back import go_back
from backend.work.jobs import Progress
from drivers.cia402 import Mode
from drivers.errors import OutOfRange
from drivers.texts.message import text

Keep = Callable[[str, dict[str, npt.NDArray[np.generic]], dict[str, object]], None]
_TURN = 2 * np.pi
#: A settling window is so many times the noise at least: what leaves a narrower one is noise.
_NOISES = 10.0
#: Rest before the step.
LEAD_S = 0.05


@dataclass(frozen=True, slots=True)
class StepSettings:
    """``size`` in rpm (speed) or rev (move). A move runs at ``speed_rpm`` and ``acceleration``."""

    envelope: Envelope
    kind: Literal["speed", "move"] = "speed"
    size: float = 100.0
    hold_s: float = 0.25
    speed_rpm: float = 300.0
    acceleration_rpm_s: float = 6000.0
    window: float | None = None
    """Settling window in rpm or rev; 2 % of the size where None."""
    rated_torque_nm: float | None = None


@dataclass(frozen=True)
class StepResult:
    """Curves [n] in rpm or rev and % of rated torque, and the numbers read from them."""

    kind: Literal["speed", "move"]
    time_s: npt.NDArray[np.float64]
    demand: npt.NDArray[np.float64]
    actual: npt.NDArray[np.float64]
    torque_percent: npt.NDArray[np.float64]
    step: StepMetrics | None
    move: MoveMetrics | None
    torque_peak_percent: float
    torque_rms_percent: float
    noise: float = 0.0
    """Standard deviation about the trend of a speed that is held, in rpm, or of the position at the
    end of a move, in rev."""
    window: float | None = None
    """The settling window, in rpm or rev."""
    widened: bool = False
    """Whether noise is more than a tenth of the usual window, so that a wider one was taken."""


async def step_response(
    axis: Axis,
    session: CyclicSession,
    settings: StepSettings,
    progress: Progress,
    keep: Keep | None = None,
) -> StepResult:
    """Play the step and read the numbers; the axis ends where it began.

    Raises:
        OutOfRange: the step leaves the envelope; nothing has moved.
        NotAllowed: the envelope or a fault ended it.
    """
    units, rate = await axis.require_certain_scales(), 1.0 / cycle_s(session)
    speed = settings.kind == "speed"
    mode = Mode.CSV if speed else Mode.CSP
    require_signals(axis, session, mode, False)
    facts = await read_facts(axis, settings.rated_torque_nm)
    demand = _demand(settings, rate)
    home = await axis.position_raw()
    async with (
        stopping_hard(axis, settings.envelope.speed_rpm),
        enabled(axis, session, mode) as start,
    ):
        await quiet(axis)
        if speed:
            raw = np.round(demand * (units.velocity_raw(1e6) / 1e6))
        else:
            raw = start + np.round(demand * (units.position_raw(1e6) / 1e6))
        recording = await play(
            axis, session, Play(mode, raw.astype(np.int64)),
            await bus_limits(axis, settings.envelope, start), facts.rated_torque_nm,
            share(progress, 0.1, 0.85, text("step.stepping")),
        )  # fmt: skip
    await go_back(axis, session, home, settings.envelope, facts)
    if keep is not None:
        arrays: dict[str, npt.NDArray[np.generic]] = {**recording.arrays(), "demand": demand}
        keep("step", arrays, {
            "tool": "step", "sample_rate_hz": rate, "facts": asdict(facts),
            "settings": asdict(settings),
        })  # fmt: skip
    return evaluate(recording, demand, settings, facts.rated_torque_nm)


def _demand(settings: StepSettings, rate: float) -> npt.NDArray[np.float64]:
    """Commanded speed in rpm, or position in rev from the start."""
    envelope = settings.envelope
    lead, hold = np.zeros(round(LEAD_S * rate)), round(settings.hold_s * rate)
    if settings.kind == "speed":
        highest, name, travelled = abs(settings.size), "rpm", 0.0
        travelled = highest / 60.0 * settings.hold_s
    else:
        highest, name, travelled = settings.speed_rpm, "rpm", abs(settings.size)
    if highest > envelope.speed_rpm or travelled > envelope.travel_rev:
        raise OutOfRange(
            "step.step-needs-rev-more",
            value=settings.size,
            limit=f"{envelope.speed_rpm:g} rpm, {envelope.travel_rev:g} rev",
            highest=highest,
            name=name,
            travelled_rev=travelled,
            speed_rpm=envelope.speed_rpm,
            travel_rev=envelope.travel_rev,
        )
    if settings.kind == "speed":
        return np.concatenate([lead, np.full(hold, settings.size), np.zeros(hold)])
    way = run_up(
        abs(settings.size), settings.speed_rpm / 60.0, settings.acceleration_rpm_s / 60.0, 1 / rate
    )
    end = np.full(hold, abs(settings.size))
    return np.asarray(np.concatenate([lead, way, end]) * np.sign(settings.size))


def evaluate(
    recording: Recording,
    demand: npt.NDArray[np.float64],
    settings: StepSettings,
    rated_torque_nm: float,
) -> StepResult:
    """Numbers from a recording."""
    rate = recording.sample_rate_hz
    time = np.arange(demand.size) / rate
    torque = recording.torque_nm / rated_torque_nm * 100.0
    begin = round(LEAD_S * rate)
    step = move = None
    noise, widened, window = 0.0, False, settings.window
    if settings.kind == "speed":
        actual = recording.velocity_rad_s * 60.0 / _TURN
        end = begin + round(settings.hold_s * rate)
        noise = _noise(actual[begin + (end - begin) // 2 : end])
        if window is None:
            usual = 0.02 * abs(settings.size)
            window, widened = max(usual, _NOISES * noise), _NOISES * noise > usual
        step = step_metrics(
            time[begin:end], actual[begin:end], target=settings.size, initial=0.0, window=window
        )  # fmt: skip
    else:
        actual = (recording.position_rad - recording.position_rad[0]) / _TURN
        noise = _noise(actual[-round(0.5 * settings.hold_s * rate) :])
        if window is None:
            usual = 0.02 * abs(settings.size)
            window, widened = max(usual, _NOISES * noise), _NOISES * noise > usual
        move = move_metrics(time, demand, actual, window=window, torque=torque)
    return StepResult(
        settings.kind, time, demand, actual, torque, step, move,
        float(np.max(np.abs(torque))), float(np.sqrt(np.mean(torque**2))),
        noise, window, widened,
    )  # fmt: skip


def _noise(part: npt.NDArray[np.float64]) -> float:
    """Standard deviation about a parabola, in the unit of the signal; 0 for too few samples."""
    if part.size < 8:
        return 0.0
    x = np.linspace(-1.0, 1.0, part.size)
    return float(np.std(part - np.polynomial.Legendre.fit(x, part, 2)(x)))


def significant_size(result: StepResult) -> float:
    """The size in rpm whose usual settling window is ten times the noise that this step shows."""
    return _NOISES * result.noise / 0.02


def as_json(result: StepResult) -> dict[str, object]:
    """Curves and numbers for files and pages."""
    return {
        "kind": result.kind,
        "unit": "rpm" if result.kind == "speed" else "rev",
        "time_s": result.time_s.tolist(),
        "demand": result.demand.tolist(),
        "actual": result.actual.tolist(),
        "torque_percent": result.torque_percent.tolist(),
        "step": asdict(result.step) if result.step else None,
        "move": asdict(result.move) if result.move else None,
        "noise": result.noise,
        "window": result.window,
        "widened": result.widened,
        "torque_peak_percent": result.torque_peak_percent,
        "torque_rms_percent": result.torque_rms_percent,
    }
