"""Maximum-length binary sequences."""

from __future__ import annotations

import numpy as np

from backend.analysis.signals.arrays import FloatArray
from backend.analysis.signals.excitation import Excitation, choose_lines
from backend.analysis.signals.ramps import ramped_periods

#: Feedback taps of maximum-length shift registers (Xilinx XAPP052, table 3).
_PRBS_TAPS: dict[int, tuple[int, ...]] = {
    7: (7, 6), 8: (8, 6, 5, 4), 9: (9, 5), 10: (10, 7), 11: (11, 9), 12: (12, 6, 4, 1),
    13: (13, 4, 3, 1), 14: (14, 5, 3, 1), 15: (15, 14),
}  # fmt: skip


def prbs_period(order: int, samples_per_bit: int = 1, realisation: int = 0) -> FloatArray:
    """Return one period of a maximum-length binary sequence without its mean, peak 1.

    Raises:
        ValueError: the order is outside 7 to 15.
    """
    if order not in _PRBS_TAPS:
        raise ValueError(f"PRBS order {order} is outside 7 to 15")
    length = 2**order - 1
    state = 1 + (realisation * 7919) % length
    bits = np.empty(length)
    for i in range(length):
        bits[i] = 1.0 if state & 1 else -1.0
        feedback = 0
        for tap in _PRBS_TAPS[order]:
            feedback ^= state >> (order - tap)
        state = (state >> 1) | ((feedback & 1) << (order - 1))
    period = np.repeat(bits, samples_per_bit)
    period -= np.mean(period)
    return np.asarray(period / np.max(np.abs(period)))


def prbs(
    *,
    sample_rate_hz: float,
    order: int = 11,
    samples_per_bit: int = 1,
    periods: int = 3,
    transient_periods: int = 1,
    f_min_hz: float = 0.0,
    f_max_hz: float | None = None,
    realisation: int = 0,
    ramp_samples: int | None = None,
    integrations: int = 0,
) -> Excitation:
    """Return a maximum-length binary sequence of 2^order - 1 bits, without its mean, peak 1.

    ``realisation`` selects the starting state, that is a cyclic shift. Lines are the bins between
    ``f_min_hz`` and ``f_max_hz`` (default 0.4 of the bit rate, where the power is half).

    Raises:
        ValueError: the order is outside 7 to 15, or no period is left after settling.
    """
    if periods <= transient_periods:
        raise ValueError(f"{periods} periods leave none after {transient_periods} of settling")
    period = prbs_period(order, samples_per_bit, realisation)
    resolution = sample_rate_hz / period.size
    upper = 0.4 * sample_rate_hz / samples_per_bit if f_max_hz is None else f_max_hz
    ramp = period.size // 2 if ramp_samples is None else ramp_samples
    return Excitation(
        kind="prbs",
        samples=ramped_periods(period, periods, ramp, integrations),
        sample_rate_hz=sample_rate_hz,
        first_sample=ramp,
        period_samples=period.size,
        periods=periods,
        transient_periods=transient_periods,
        lines=choose_lines(max(f_min_hz, resolution), upper, resolution),
        realisation=realisation,
    )
