"""Times, distances and verdict from the trace of a safety function. Pure: also from stored data."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import scipy

from backend.tools.thresholds import safety_check_evaluate as threshold
from backend.tools.tool import Arrays, Meta
from backend.tools.watching.safety_check.result import (
    Exceeded,
    Obstacle,
    SafetyResult,
    Sign,
    Signature,
    Verdict,
)
from backend.tools.watching.safety_check.settings import SafetySettings

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
_POINTS = 400
#: Metadata that the checksum of the signature covers.
_SIGNED = (
    "settings", "measured_at", "sample_rate_hz", "asked_until", "reports", "profile", "drive_id",
    "identity",
)  # fmt: skip
_ARRAYS = (
    "position_rev",
    "speed_rpm",
    "torque_percent",
    "commanded_rpm",
    "enabled",
    "quick_stop",
    "valid",
)


@dataclass(frozen=True)
class Trace:
    """Trace [n], one sample per cycle.

    ``commanded_rpm`` as planned; ``enabled`` and ``quick_stop`` as the drive reports. From sample
    ``asked_until`` on, the tool itself ended the motion.
    """

    position_rev: FloatArray
    speed_rpm: FloatArray
    torque_percent: FloatArray
    commanded_rpm: FloatArray
    enabled: BoolArray
    quick_stop: BoolArray
    valid: BoolArray
    sample_rate_hz: float
    asked_until: int
    measured_at: str
    reports: tuple[str, ...] = ()
    """Codes and names of the faults that the drive had at the end."""

    def until(self, end: int) -> Trace:
        """The part before this sample."""
        return replace(self, **{name: getattr(self, name)[:end] for name in _ARRAYS})

    def arrays(self) -> dict[str, npt.NDArray[np.generic]]:
        """The samples as arrays for storage."""
        return {name: getattr(self, name) for name in _ARRAYS}

    def facts(self) -> dict[str, object]:
        """The scalar facts for storage, with the arrays."""
        return {
            "sample_rate_hz": self.sample_rate_hz,
            "asked_until": self.asked_until,
            "measured_at": self.measured_at,
            "reports": list(self.reports),
        }


def reevaluate(arrays: Arrays, meta: Meta) -> SafetyResult:
    """Evaluate stored raw data again; with the signature where there is one.

    Raises:
        ValueError: not the raw data of a safety check.
    """
    given = meta.get("settings")
    if meta.get("tool") != "safety-check" or not isinstance(given, dict):
        raise ValueError("not the raw data of a safety check")
    reports = meta.get("reports")

    def number(name: str) -> FloatArray:
        return np.asarray(arrays[name], np.float64)

    def flag(name: str) -> BoolArray:
        return np.asarray(arrays[name], np.bool_)

    trace = Trace(
        position_rev=number("position_rev"),
        speed_rpm=number("speed_rpm"),
        torque_percent=number("torque_percent"),
        commanded_rpm=number("commanded_rpm"),
        enabled=flag("enabled"),
        quick_stop=flag("quick_stop"),
        valid=flag("valid"),
        sample_rate_hz=float(str(meta["sample_rate_hz"])),
        asked_until=int(str(meta["asked_until"])),
        measured_at=str(meta["measured_at"]),
        reports=tuple(map(str, reports)) if isinstance(reports, (list, tuple)) else (),
    )
    found = evaluate(trace, SafetySettings.model_validate(given))
    signature = meta.get("signature")
    if not isinstance(signature, Mapping):
        return found
    known = Signature.model_validate({**signature, "intact": True})
    now = digest(arrays, meta, known.person, known.signed, known.notes)
    kept = known.model_copy(update={"intact": now == known.sha256})
    return found.model_copy(update={"signature": kept})


def digest(arrays: Arrays, meta: Meta, person: str, signed: str, notes: str) -> str:
    """SHA-256 over the trace, the settings, and the signing person and time."""
    content = {name: meta.get(name) for name in _SIGNED}
    content |= {"person": person, "signed": signed, "notes": notes}
    found = hashlib.sha256(json.dumps(content, sort_keys=True, ensure_ascii=False).encode())
    for name in sorted(arrays):
        found.update(name.encode())
        found.update(np.ascontiguousarray(arrays[name]).tobytes())
    return found.hexdigest()


def signed(arrays: Arrays, meta: Meta, person: str, when: str, notes: str) -> dict[str, object]:
    """Signature record to be stored with the raw data.

    Raises:
        ValueError: not the raw data of a safety check, or signed already.
    """
    if meta.get("tool") != "safety-check" or "signature" in meta:
        raise ValueError("not the raw data of a safety check that nobody has signed")
    return {
        "person": person,
        "signed": when,
        "notes": notes,
        "sha256": digest(arrays, meta, person, when, notes),
    }


def evaluate(trace: Trace, settings: SafetySettings) -> SafetyResult:
    """Result, from the samples before the tool itself ended the motion."""
    return _Check(trace.until(trace.asked_until), settings).result()


class _Check:
    """Evaluation of one trace."""

    def __init__(self, trace: Trace, settings: SafetySettings) -> None:
        self._trace, self._settings, self._rate = trace, settings, trace.sample_rate_hz
        window = max(1, round(threshold.WINDOW_S * self._rate))
        place = trace.position_rev
        speed = np.zeros_like(place)
        if place.size > window:
            speed[window:] = (place[window:] - place[:-window]) * self._rate / window * 60.0
        self._speed = speed
        self._torque = np.abs(scipy.ndimage.median_filter(trace.torque_percent, threshold.FILTER))
        self._noise = self._torque_noise()
        found = self._first_sign()
        self._at: int | None = None if found is None else found[0]
        self._sign: Sign | None = None if found is None else found[1]

    def _torque_noise(self) -> float:
        """Torque that is distinguished from noise, from the time before enabling [%]."""
        enabled = np.flatnonzero(self._trace.enabled)
        quiet = self._trace.torque_percent[: enabled[0]] if enabled.size else np.empty(0)
        scatter = float(np.std(quiet)) if quiet.size > threshold.FILTER else 0.0
        offset = abs(float(np.mean(quiet))) if quiet.size > threshold.FILTER else 0.0
        return max(
            offset + threshold.DEVIATIONS * scatter / math.sqrt(threshold.FILTER / 1.5),
            threshold.LEAST_PERCENT,
        )

    def _steady(self) -> BoolArray:
        """Samples at which the commanded speed has been constant, and not zero, for `STEADY_S`."""
        commanded = self._trace.commanded_rpm
        changed = np.flatnonzero(np.diff(commanded, prepend=commanded[:1]) != 0.0)
        since = np.zeros(commanded.size, np.int64)
        since[changed] = changed
        age = np.arange(commanded.size) - np.maximum.accumulate(since)
        steady: BoolArray = (age >= threshold.STEADY_S * self._rate) & (commanded != 0.0)
        return steady

    def _first_sign(self) -> tuple[int, Sign] | None:
        """First sample that shows the function, and the kind of sign; None where there is none."""
        trace, n = self._trace, self._trace.enabled.size
        asked = np.arange(n) < trace.asked_until
        began = np.flatnonzero(trace.enabled & (trace.commanded_rpm != 0.0))
        if not began.size:
            return None
        after = np.arange(n) > began[0]
        signs: list[tuple[int, Sign]] = []
        left = np.flatnonzero(after & asked & ~trace.enabled & trace.valid)
        if left.size:
            signs.append((int(left[0]), "state"))
        commanded = trace.commanded_rpm
        slow = self._steady() & asked & trace.valid & trace.enabled
        slow &= trace.speed_rpm * np.sign(commanded) < threshold.LEFT * np.abs(commanded)
        lasts = max(1, round(threshold.LASTS_S * self._rate))
        run = np.convolve(slow, np.ones(lasts), "valid") >= lasts
        reached = np.flatnonzero(
            self._steady()
            & (trace.speed_rpm * np.sign(commanded) >= threshold.LEFT * np.abs(commanded))
        )
        if reached.size:
            found = np.flatnonzero(run & (np.arange(run.size) > reached[0]))
            if found.size:
                signs.append((int(found[0]), "speed"))
        return min(signs, default=None)

    def _last_above(self, values: FloatArray, limit: float, begin: int) -> int | None:
        """First sample, not before ``begin``, from which no value exceeds the limit; else None."""
        above = np.flatnonzero(values[begin:] > limit)
        found = begin if not above.size else begin + int(above[-1]) + 1
        return found if found < values.size else None

    def _rest(self, at: int, stands_rpm: float) -> int | None:
        """First sample from which the axis stays at its final position; None if it still turns."""
        last = np.abs(self._speed[-max(1, round(threshold.BEFORE_S * self._rate)) :])
        if float(np.median(last)) > stands_rpm:
            return None
        away = np.abs(self._trace.position_rev - self._trace.position_rev[-1])
        return self._last_above(
            away, max(threshold.SETTLED * float(away[at]), threshold.RESOLVED_REV), at
        )

    def result(self) -> SafetyResult:
        settings, trace = self._settings, self._trace
        known = {
            "function": settings.function,
            "device": settings.device,
            "person": settings.person,
            "measured_at": trace.measured_at,
            "torque_noise_percent": self._noise,
            "highest_rpm": float(np.max(np.abs(self._speed), initial=0.0)),
            "limited_rpm": settings.limited_rpm,
            "reports": trace.reports,
        }
        if self._at is None:
            verdict: Verdict = "not_triggered"
            if settings.function == "speed_limit" and self._followed():
                verdict = "no_reaction"
            return SafetyResult.model_validate(
                {**known, "verdict": verdict, **self._shown(max(trace.asked_until - 1, 0))}
            )
        return SafetyResult.model_validate({**known, **self._of_sign(self._at)})

    def _followed(self) -> bool:
        highest = float(np.max(np.abs(self._speed), initial=0.0))
        return highest >= threshold.FOLLOWED * self._settings.speed_rpm

    def _of_sign(self, at: int) -> dict[str, object]:
        rate, settings = self._rate, self._settings
        before = slice(max(0, at - round(threshold.BEFORE_S * rate)), at)
        speed = float(np.median(self._speed[before])) if at else 0.0
        rest = self._rest(
            at, max(threshold.STANDSTILL_SHARE * abs(speed), threshold.STANDSTILL_RPM)
        )
        torque = float(np.median(self._torque[before])) if at else 0.0
        if settings.function == "ss1":
            end = self._torque.size if rest is None else rest
            torque = max(torque, float(np.max(self._torque[at:end], initial=0.0)))
        free = self._last_above(self._torque, self._noise, max(0, at - round(0.05 * rate)))
        distinct = torque >= threshold.DISTINCT * self._noise
        found: dict[str, object] = {
            "sign": self._sign,
            "speed_rpm": speed,
            "torque_before_percent": torque,
            "watched_ms": 1e3 * (self._speed.size - at) / rate,
            **self._shown(at),
        }
        if rest is not None:
            way = abs(float(self._trace.position_rev[rest] - self._trace.position_rev[at]))
            found |= {"stop_ms": 1e3 * (rest - at) / rate, "stop_rev": way}
        if free is not None:
            found["torque_after_percent"] = float(np.max(self._torque[free:], initial=0.0))
            if distinct:
                took = max(0.0, 1e3 * (free - at) / rate)
                cycle = 1e3 / rate
                found |= {
                    "torque_free_ms": took,
                    "torque_free_ci95_ms": (max(0.0, took - cycle), took + 2 * cycle),
                    "speed_at_torque_free_rpm": float(self._speed[free]),
                }
        obstacle = self._obstacle(at, speed, distinct=distinct)
        if settings.function == "ss1" and free is not None and self._cut(at, free, speed):
            obstacle = "quick_stop_cut"
        exceeded = self._exceeded(found)
        found |= {"obstacle": obstacle, "exceeded": exceeded}
        found["verdict"] = self._verdict(at, rest, free, speed, obstacle, exceeded, distinct)
        return found

    def _obstacle(self, at: int, speed: float, *, distinct: bool) -> Obstacle | None:
        settings = self._settings
        end = min(self._trace.valid.size, at + round(settings.watch_s * self._rate))
        if not np.all(self._trace.valid[max(0, at - round(0.02 * self._rate)) : end]):
            return "samples_lost"
        if settings.function != "speed_limit" and abs(speed) < 0.8 * settings.speed_rpm:
            return "too_slow"
        torque_off = settings.function in ("sto", "ss1")
        if torque_off and bool(np.all(self._trace.enabled[at:])):
            return "stayed_enabled"
        if torque_off and not distinct:
            return "torque_in_noise"
        return None

    def _cut(self, at: int, free: int, speed: float) -> bool:
        """Whether the power was removed by the exchange at the beginning of a quick stop."""
        fast = abs(float(self._speed[free])) > threshold.AT_STANDSTILL * abs(speed)
        return fast and bool(np.any(self._trace.quick_stop[at : free + 1]))

    def _exceeded(self, found: Mapping[str, object]) -> tuple[Exceeded, ...]:
        settings = self._settings
        pairs: tuple[tuple[Exceeded, object, float | None], ...] = (
            ("torque_free", found.get("torque_free_ms"), settings.torque_free_limit_ms),
            ("stop_time", found.get("stop_ms"), settings.stop_limit_ms),
            ("stop_distance", found.get("stop_rev"), settings.stop_limit_rev),
        )
        over = [n for n, value, limit in pairs if limit is not None and _above(value, limit)]
        limited = settings.limited_rpm
        if settings.function == "speed_limit" and limited is not None:
            highest = float(np.max(np.abs(self._speed), initial=0.0))
            if highest > (1.0 + threshold.SPEED_MARGIN) * limited:
                over.append("speed")
        return tuple(over)

    def _verdict(
        self, at: int, rest: int | None, free: int | None, speed: float,
        obstacle: Obstacle | None, exceeded: tuple[Exceeded, ...], distinct: bool,
    ) -> Verdict:  # fmt: skip
        settings = self._settings
        stops = settings.function != "speed_limit"
        torque_off = settings.function in ("sto", "ss1")
        left = np.flatnonzero(~self._trace.enabled[at:])
        if torque_off and free is None:
            return "torque_remains"
        if stops and rest is None:
            return "still_turning"
        if torque_off and left.size and bool(np.any(self._trace.enabled[at + int(left[0]) :])):
            return "restarted"
        if (
            settings.function == "ss1"
            and free is not None
            and distinct
            and obstacle != "quick_stop_cut"
            and abs(float(self._speed[free])) > threshold.AT_STANDSTILL * abs(speed)
        ):
            return "power_off_at_speed"
        if exceeded:
            return "beyond_limits"
        limits = (settings.torque_free_limit_ms, settings.stop_limit_ms, settings.stop_limit_rev)
        # A limit is met by a measured value only: a limit switch may leave the torque on, and an
        # axis at limited speed may never stop.
        known = (free if distinct else None, rest, rest)
        unknown = any(
            limit is not None and at is None for limit, at in zip(limits, known, strict=True)
        )
        if obstacle is not None or unknown:
            return "not_shown"
        judged = any(each is not None for each in limits) or settings.function == "speed_limit"
        return "within_limits" if judged else "recorded"

    def _shown(self, at: int) -> dict[str, object]:
        """The trace around the first sign, thinned for a plot."""
        begin = max(0, at - round(threshold.SHOWN_BEFORE_S * self._rate))
        step = max(1, -(-(self._speed.size - begin) // _POINTS))
        rows = np.arange(begin, self._speed.size, step)
        return {
            "trace_ms": tuple((1e3 * (rows - at) / self._rate).tolist()),
            "trace_rpm": tuple(self._speed[rows].tolist()),
            "trace_commanded_rpm": tuple(self._trace.commanded_rpm[rows].tolist()),
            "trace_torque_percent": tuple(self._trace.torque_percent[rows].tolist()),
        }


def _above(value: object, limit: float) -> bool:
    """Whether a known value is above the limit; unknown values are covered by other verdicts."""
    return isinstance(value, float) and value > limit
