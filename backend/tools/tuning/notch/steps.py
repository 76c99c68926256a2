"""Steps of a notch's frequency, width and depth, by the unit and scale in the profile."""

from __future__ import annotations

import math

from backend.analysis.loop.notch import IntegerRange
from drivers.texts.message import Unsuitable, text
from profiles.schema import Parameter

#: Documented units of frequencies, in Hz. A value without a unit is in Hz, as its encoding states.
_HZ = {"": 1.0, "Hz": 1.0, "0.1 Hz": 0.1, "kHz": 1e3, "rad/s": 0.5 / math.pi}


def level_steps(parameter: Parameter) -> IntegerRange:
    """Raw limits of levels, whose effect is measured."""
    low, high = parameter.raw_limits
    return IntegerRange(int(low or 0), int(high if high is not None else 0xFFFF))


def hz_steps(parameter: Parameter) -> IntegerRange:
    """Limits and steps of a frequency or a width in Hz.

    Raises:
        Unsuitable: its unit is not one of frequency.
    """
    unit = _HZ.get(parameter.unit)
    if unit is None:
        raise Unsuitable(
            text("notch.unit-of-frequency", parameter=parameter.key, unit=parameter.unit)
        )
    raw = level_steps(parameter)
    return IntegerRange(raw.low, raw.high, parameter.scale * unit, parameter.offset * unit)


def attenuation_steps(parameter: Parameter) -> IntegerRange:
    """Limits and steps of a depth as attenuation in dB.

    Values of 0 and above are an attenuation, values of 0 and below the gain at the centre.

    Raises:
        Unsuitable: its unit is not dB, or its limits have both signs, so that its meaning is
            ambiguous.
    """
    if parameter.unit not in ("", "dB"):
        raise Unsuitable(text("notch.unit-of-depth", parameter=parameter.key, unit=parameter.unit))
    raw = level_steps(parameter)
    shown = IntegerRange(raw.low, raw.high, parameter.scale, parameter.offset)
    low, high = sorted((shown.value(raw.low), shown.value(raw.high)))
    if low < 0 < high:
        raise Unsuitable(
            text("notch.sign-of-depth", parameter=parameter.key, lowest_db=low, highest_db=high)
        )
    if high > 0:
        return shown
    return IntegerRange(raw.low, raw.high, -parameter.scale, -parameter.offset)
