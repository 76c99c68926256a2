"""Notch filters: one vendor-neutral form, and its encodings in each drive.

A notch has a centre, a -3 dB bandwidth and a depth, H(s) = (s² + d·g·s + w²)/(s² + g·s + w²)
with w = 2π·f_c, g = 2π·f_b, d = 10^(depth/20). Encodings follow tuning.md section 4; MMS7's
formulas are equations (15) to (18) of its manual (004:3495), read as explained there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.analysis.signals.arrays import ComplexArray, FloatArray

TURN = 2.0 * np.pi

#: Stored value of a coefficient c is round(c * COEFFICIENT_SCALE) + COEFFICIENT_OFFSET (UINT16).
COEFFICIENT_SCALE = 10_000
COEFFICIENT_OFFSET = 32_768
_MOST_STEPS = float(1 << 53)


@dataclass(frozen=True)
class Notch:
    """Centre (Hz), -3 dB bandwidth (Hz) and depth (dB, negative: gain at the centre).

    The -3 dB bandwidth of a notch shallower than 10 dB is smaller than the value: the bandwidth is
    then taken where the power is half-way between that of the centre and that of the passband.
    """

    center_hz: float
    width_hz: float
    depth_db: float

    def __post_init__(self) -> None:
        if self.center_hz <= 0 or self.width_hz <= 0:
            raise ValueError(f"notch at {self.center_hz} Hz, {self.width_hz} Hz wide: not positive")
        if self.depth_db > 0:
            raise ValueError(f"notch depth {self.depth_db} dB would amplify; use 0 or less")

    def response(self, frequency_hz: FloatArray) -> ComplexArray:
        """Return the continuous-time response."""
        s = 1j * TURN * np.asarray(frequency_hz, dtype=np.float64)
        w, g = TURN * self.center_hz, TURN * self.width_hz
        d = 10.0 ** (self.depth_db / 20.0)
        return np.asarray((s * s + d * g * s + w * w) / (s * s + g * s + w * w))


@dataclass(frozen=True)
class NotchCoefficients:
    """Raw UINT16 values of H(z) = (z² + a1·z + a2)/(z² + b1·z + b2)."""

    a1: int
    a2: int
    b1: int
    b2: int


@dataclass(frozen=True)
class RealisedNotch:
    """The notch as the drive realises it: frequency of the lowest gain, width and depth.

    ``dc_gain_db`` is the gain at 0 Hz, which rounding can change; ``stable`` is False when the
    rounded filter has a pole on or outside the unit circle and must not be written.
    """

    center_hz: float
    width_hz: float
    depth_db: float
    dc_gain_db: float
    stable: bool


def _stored(coefficient: float) -> int:
    # Python rounds halves to even; the manual's formula rounds halves up.
    value = int(np.floor(coefficient * COEFFICIENT_SCALE + 0.5)) + COEFFICIENT_OFFSET
    if not 0 <= value <= 0xFFFF:
        raise ValueError(f"notch coefficient {coefficient:.4f} does not fit into 16 bits")
    return value


def highest_hz(sample_time_s: float) -> float:
    """Half the rate of the loop: no centre or width above it can be encoded."""
    return 0.5 / sample_time_s


def encode_coefficients(notch: Notch, sample_time_s: float) -> NotchCoefficients:
    """Encode MMS7 2008h: a1 = w² + d·g - 2, a2 = 1 - d·g, b1 = w² + g - 2, b2 = 1 - g, w and g
    times ts.

    Raises:
        ValueError: a coefficient exceeds 16 bits, or the rounded filter is not stable.
    """
    highest = highest_hz(sample_time_s)
    if not max(notch.center_hz, notch.width_hz) <= highest:
        raise ValueError(
            f"notch at {notch.center_hz:g} Hz, {notch.width_hz:g} Hz wide: "
            f"outside 0 to {highest:g} Hz"
        )
    w, g = TURN * notch.center_hz * sample_time_s, TURN * notch.width_hz * sample_time_s
    d = 10.0 ** (notch.depth_db / 20.0)
    raw = NotchCoefficients(
        a1=_stored(w * w + d * g - 2.0),
        a2=_stored(1.0 - d * g),
        b1=_stored(w * w + g - 2.0),
        b2=_stored(1.0 - g),
    )
    if not is_stable(raw):
        raise ValueError(
            f"a notch at {notch.center_hz:g} Hz, {notch.width_hz:g} Hz wide is not stable with "
            f"coefficient steps of 1/{COEFFICIENT_SCALE}; raise the centre or narrow the width"
        )
    return raw


def coefficient_values(raw: NotchCoefficients) -> tuple[float, float, float, float]:
    """Return (a1, a2, b1, b2) as numbers."""
    a1, a2, b1, b2 = (
        (value - COEFFICIENT_OFFSET) / COEFFICIENT_SCALE
        for value in (raw.a1, raw.a2, raw.b1, raw.b2)
    )
    return a1, a2, b1, b2


def is_stable(raw: NotchCoefficients) -> bool:
    """Check Jury's conditions on z² + b1·z + b2, in integers to exclude rounding errors."""
    b1, b2 = raw.b1 - COEFFICIENT_OFFSET, raw.b2 - COEFFICIENT_OFFSET
    one = COEFFICIENT_SCALE
    return abs(b2) < one and one + b1 + b2 > 0 and one - b1 + b2 > 0


def coefficients_response(
    raw: NotchCoefficients, frequency_hz: FloatArray, sample_time_s: float
) -> ComplexArray:
    """Return the exact discrete response of the rounded filter."""
    a1, a2, b1, b2 = coefficient_values(raw)
    z = np.exp(1j * TURN * np.asarray(frequency_hz, dtype=np.float64) * sample_time_s)
    return np.asarray((z * z + a1 * z + a2) / (z * z + b1 * z + b2), dtype=np.complex128)


def decode_coefficients(raw: NotchCoefficients, sample_time_s: float) -> Notch:
    """Return f_c, f_b and depth of these coefficients.

    Raises:
        ValueError: the coefficients are not those of a notch (w² or g not positive).
    """
    _, a2, b1, b2 = coefficient_values(raw)
    w2, g = 1.0 + b1 + b2, 1.0 - b2
    if round(w2 * COEFFICIENT_SCALE) <= 0 or round(g * COEFFICIENT_SCALE) <= 0:
        raise ValueError(f"coefficients {raw} describe no notch")
    depth = max((1.0 - a2) / g, 1e-6)
    return Notch(
        center_hz=float(np.sqrt(w2)) / (TURN * sample_time_s),
        width_hz=g / (TURN * sample_time_s),
        depth_db=min(0.0, 20.0 * float(np.log10(depth))),
    )


def realised(raw: NotchCoefficients, sample_time_s: float) -> RealisedNotch:
    """Read the notch from the rounded filter's response, with the width as defined by `Notch`."""
    a1, a2, b1, b2 = coefficient_values(raw)
    stable = is_stable(raw)
    f = np.geomspace(1.0, 0.499 / sample_time_s, 20_000)
    db = 20 * np.log10(np.maximum(np.abs(coefficients_response(raw, f, sample_time_s)), 1e-12))
    lowest = int(np.argmin(db))
    dc = 20 * np.log10(abs(1 + a1 + a2) / abs(1 + b1 + b2)) if stable and 1 + a1 + a2 else -np.inf
    level = 10 * np.log10((10 ** (dc / 10) + 10 ** (db[lowest] / 10)) / 2)
    width = float("nan")
    left = np.flatnonzero(db[:lowest] > level)
    right = np.flatnonzero(db[lowest:] > level)
    if db[lowest] < level and left.size and right.size:
        width = float(f[lowest + right[0]] - f[left[-1]])
    return RealisedNotch(float(f[lowest]), width, float(db[lowest]), float(dc), stable)


@dataclass(frozen=True)
class IntegerRange:
    """Limits of a raw parameter, inclusive, from the drive's profile, and its scale.

    A value is ``raw * scale + offset``: in Hz for frequencies and widths, in dB of attenuation for
    depths, or a dimensionless level.
    """

    low: int
    high: int
    scale: float = 1.0
    offset: float = 0.0

    def step(self, value: float) -> int:
        """Return the nearest step, allowed or not."""
        step = np.floor((value - self.offset) / self.scale + 0.5)
        # Infinity is no integer, and no parameter has as many steps.
        return int(np.clip(step, -_MOST_STEPS, _MOST_STEPS))

    def nearest(self, value: float) -> int:
        """Return the nearest allowed step."""
        return min(max(self.step(value), self.low), self.high)

    def value(self, raw: float) -> float:
        """Return the value of a raw value."""
        # Scales such as 0.1 are not exact in binary.
        return float(f"{raw * self.scale + self.offset:.12g}")


def encode_hz_width(notch: Notch, frequency: IntegerRange, width: IntegerRange) -> tuple[int, int]:
    """Encode for M6-L: frequency and width in steps of Hz; the depth is fixed.

    The width is moved to the nearest allowed one.

    Raises:
        ValueError: the centre is outside the range.
    """
    return _frequency(notch, frequency), width.nearest(notch.width_hz)


def encode_hz_width_db(
    notch: Notch, frequency: IntegerRange, width: IntegerRange, depth: IntegerRange
) -> tuple[int, int, int]:
    """Encode for DS_C: frequency and width in Hz, depth as attenuation in dB."""
    return (
        _frequency(notch, frequency),
        width.nearest(notch.width_hz),
        depth.nearest(-notch.depth_db),
    )


def decode_hz_width_db(
    raw: tuple[int, int, int], frequency: IntegerRange, width: IntegerRange, depth: IntegerRange
) -> Notch:
    """Decode Hz, Hz, dB of attenuation.

    Raises:
        ValueError: the values are not those of a notch.
    """
    hz, wide, deep = raw
    return Notch(frequency.value(hz), width.value(wide), -depth.value(deep))


@dataclass(frozen=True)
class LevelCalibration:
    """Measured effect of width and depth levels, for which the manual prints no formula (R6L).

    ``width_ratio`` maps a level to f_b/f_c, ``depth_db`` a level to depth; both from responses
    with and without the notch. Levels in between are interpolated.
    """

    width_ratio: tuple[tuple[int, float], ...]
    depth_db: tuple[tuple[int, float], ...]


def encode_hz_levels(
    notch: Notch,
    frequency: IntegerRange,
    width: IntegerRange,
    depth: IntegerRange,
    calibration: LevelCalibration,
) -> tuple[int, int, int]:
    """Encode for R6L: frequency in Hz and the levels whose measured effect is nearest."""
    centre = _frequency(notch, frequency)
    share = notch.width_hz / frequency.value(centre)
    ratio = _nearest_level(calibration.width_ratio, share, width)
    return centre, ratio, _nearest_level(calibration.depth_db, notch.depth_db, depth)


def decode_hz_levels(
    centre_hz: float, width_level: int, depth_level: int, calibration: LevelCalibration
) -> Notch:
    """Return the notch with the measured effect of these levels."""
    ratio = _interpolated(calibration.width_ratio, width_level)
    depth = min(0.0, _interpolated(calibration.depth_db, depth_level))
    return Notch(centre_hz, ratio * centre_hz, depth)


def _frequency(notch: Notch, allowed: IntegerRange) -> int:
    raw = allowed.step(notch.center_hz)
    if not allowed.low <= raw <= allowed.high:
        low, high = sorted((allowed.value(allowed.low), allowed.value(allowed.high)))
        raise ValueError(f"{notch.center_hz:g} Hz is outside {low:g} to {high:g} Hz")
    return raw


def _interpolated(points: tuple[tuple[int, float], ...], level: float) -> float:
    if not points:
        raise ValueError("the levels have not been measured on this drive yet")
    ordered = sorted(points)
    return float(np.interp(level, [p[0] for p in ordered], [p[1] for p in ordered]))


def _nearest_level(
    points: tuple[tuple[int, float], ...], wanted: float, allowed: IntegerRange
) -> int:
    if not points:
        raise ValueError("the levels have not been measured on this drive yet")
    ordered = sorted(points)
    # The effect of levels outside the measured range is not known.
    low, high = max(allowed.low, ordered[0][0]), min(allowed.high, ordered[-1][0])
    levels = np.arange(low, high + 1)
    known = np.interp(levels, [p[0] for p in ordered], [p[1] for p in ordered])
    return int(levels[np.argmin(np.abs(known - wanted))])
