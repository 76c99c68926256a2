"""Check whether 606Ch and 6064h of a whole recording report the same motion.

The loop supervises them while the axis moves (`drivers.objects.feedback`) and must decide at once.
The check of a recording also covers low speeds and reciprocating motion, and comes before any
result is computed from 606Ch.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from drivers.halt import HaltCause, Halted
from drivers.objects.feedback import FeedbackScale, disagreement

FloatArray = npt.NDArray[np.float64]

_WINDOW_S = 0.04
"""Length of the means that are compared [s]; a lag of 606Ch by some cycles hardly matters then."""
_RELATIVE = 0.25
"""Relative deviation of the scale that lag, averaging and rounding may cause."""
_COUNTS = 2.0
_IGNORED_SHARE = 1 / 6
"""Share of the difference that the loop ignores: 5 of 30 rpm. A coarser 606Ch widens it to its own
step, but to no more than `_MOST_STEPS` times the loop's value."""
_MOST_STEPS = 3.0


def disagreement_of(
    position: FloatArray,
    velocity: FloatArray,
    cycle_s: float,
    scale: FeedbackScale,
    valid: npt.NDArray[np.bool_] | None = None,
) -> Halted | None:
    """The contradiction between raw 6064h and 606Ch [n] of a recording; None where they agree.

    Only means over samples that are all ``valid`` [n] count, as samples in a gap are not measured.
    ``value`` and ``limit`` of the result are the root mean squares of the reported speed and of the
    speed from the position, in raw 606Ch; ``value`` is negative where the signs are opposite.
    """
    length = max(round(_WINDOW_S / cycle_s), 2)
    count = (len(position) - 1) // length
    if count < 2:
        return None
    edges = np.arange(count + 1) * length
    means = 0.5 * (velocity[1:] + velocity[:-1])[: count * length]
    reported = means.reshape(count, length).mean(axis=1)
    seen = _moved(position[edges]) / (length * cycle_s) * scale.velocity_per_inc_s
    if valid is not None:
        lost = np.concatenate([[0], np.cumsum(~valid)])
        whole = lost[edges[1:] + 1] == lost[edges[:-1]]
        reported, seen = reported[whole], seen[whole]
        if reported.size < 2:
            return None
    power = float(np.mean(seen**2))
    rms_reported, rms_seen = float(np.sqrt(np.mean(reported**2))), float(np.sqrt(power))
    steps = np.abs(np.diff(velocity))
    finest = float(np.min(steps[steps > 0], initial=np.inf))
    ignored = max(
        scale.ignored * _IGNORED_SHARE,
        min(finest, _MOST_STEPS * scale.ignored) if np.isfinite(finest) else 0.0,
        _COUNTS / (length * cycle_s) * abs(scale.velocity_per_inc_s),
    )
    if float(np.sqrt(np.mean((reported - seen) ** 2))) <= ignored:
        return None
    factor = float(np.mean(reported * seen)) / power if power else np.inf
    if abs(factor - 1.0) <= _RELATIVE:
        return None
    sign = -1.0 if factor < 0 else 1.0
    kind = disagreement(sign * rms_reported, rms_seen)
    return Halted(HaltCause.CONTRADICTION, "speed", sign * rms_reported, rms_seen, kind.value)


def measured_scale(position: FloatArray, velocity: FloatArray, cycle_s: float) -> float | None:
    """Raw 606Ch per increment per second of a recording, by least squares over means.

    None where the axis hardly moved or the two speeds are not correlated.
    """
    length = max(round(_WINDOW_S / cycle_s), 2)
    count = (len(position) - 1) // length
    if count < 3:
        return None
    edges = np.arange(count + 1) * length
    means = 0.5 * (velocity[1:] + velocity[:-1])[: count * length]
    reported = means.reshape(count, length).mean(axis=1)
    seen = _moved(position[edges]) / (length * cycle_s)
    power, other = float(np.sum(seen**2)), float(np.sum(reported**2))
    if not power or not other:
        return None
    together = float(np.sum(reported * seen))
    return together / power if together**2 > _TOGETHER * power * other else None


def _moved(places: FloatArray) -> FloatArray:
    """Differences of 32-bit positions, also across their overflow."""
    return np.asarray((np.diff(places) + 2.0**31) % 2.0**32 - 2.0**31)


_TOGETHER = 0.95
"""Squared correlation above which two speeds are the same quantity in different units."""
