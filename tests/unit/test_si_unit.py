"""Unit codes of 60A8h to 60ABh against the values that CiA 402-2 and drives' manuals print."""

from __future__ import annotations

import math

import pytest

from profiles.si_unit import Quantity, decode_si_unit, unit_text


@pytest.mark.parametrize(
    ("code", "text", "rpm"),
    [
        (0x00B44700, "rpm", 1.0),
        (0xFFB44700, "0.1 rpm", 0.1),
        (0xFEB44700, "0.01 rpm", 0.01),
        (0xFDB44700, "0.001 rpm", 0.001),
        (0x00B40300, "rev/s", 60.0),
        (0x00410300, "°/s", 1.0 / 6.0),
        (0xFF410300, "0.1 °/s", 1.0 / 60.0),
        (0x00100300, "rad/s", 60.0 / (2.0 * math.pi)),
    ],
)
def test_speed_of_a_turning_axis(code: int, text: str, rpm: float) -> None:
    unit = decode_si_unit(code, "velocity")
    assert unit is not None
    assert unit.text == text
    assert unit.base == "rev"
    assert unit.rpm_per_raw == pytest.approx(rpm, rel=1e-9)


@pytest.mark.parametrize(
    ("code", "quantity", "text", "base", "factor"),
    [
        (0x00B50000, "position", "inc", "inc", 1.0),
        (0x00B50300, "velocity", "inc/s", "inc", 1.0),
        (0x00B55700, "acceleration", "inc/s²", "inc", 1.0),
        (0x00B5A000, "jerk", "inc/s³", "inc", 1.0),
        (0x00B40000, "position", "rev", "rev", 1.0),
        (0x00410000, "position", "°", "rev", 1.0 / 360.0),
        (0xFF410000, "position", "0.1 °", "rev", 1.0 / 3600.0),
        (0xFD410000, "position", "0.001 °", "rev", 1.0 / 360_000.0),
        (0x00420000, "position", "′", "rev", 1.0 / 21_600.0),
        (0x00430000, "position", "″", "rev", 1.0 / 1_296_000.0),
        (0x00100000, "position", "rad", "rev", 0.15915494309189535),
        (0xFD010000, "position", "mm", "m", 0.001),
        (0xFA010000, "position", "µm", "m", 1e-6),
        (0xFD010300, "velocity", "mm/s", "m", 0.001),
        (0xFD014700, "velocity", "mm/min", "m", 0.001 / 60.0),
        (0xFD015700, "acceleration", "mm/s²", "m", 0.001),
        (0xFD01A000, "jerk", "mm/s³", "m", 0.001),
        (0x00B45700, "acceleration", "rev/s²", "rev", 1.0),
    ],
)
def test_units(code: int, quantity: Quantity, text: str, base: str, factor: float) -> None:
    unit = decode_si_unit(code, quantity)
    assert unit is not None
    assert (unit.text, unit.base, unit.code) == (text, base, code)
    assert unit.factor == pytest.approx(factor, rel=1e-12)


@pytest.mark.parametrize(
    ("code", "quantity"),
    [
        (0, "velocity"),  # nobody gave a unit
        (0x00B44700, "position"),  # a speed is no position
        (0x00B40000, "velocity"),  # a position is no speed
        (0x00B44700, "acceleration"),
        (0x00B45700, "jerk"),
        (0x00B44701, "velocity"),  # reserved byte in use
        (0x0047B400, "velocity"),  # bytes of another order
        (0x00FF4700, "velocity"),  # unknown numerator
        (0x00B4FF00, "velocity"),  # unknown denominator
        (0x00AC0000, "position"),  # steps: a maker's own
        (0x7FB44700, "velocity"),  # a power of ten that nobody means
        (0xFFFFFFFF, "velocity"),
        (-1, "velocity"),
        (1 << 32, "velocity"),
        (0x00264700, "velocity"),  # volts per minute
    ],
)
def test_what_is_not_certain_is_none(code: int, quantity: Quantity) -> None:
    assert decode_si_unit(code, quantity) is None


def test_only_a_turning_speed_has_rpm() -> None:
    for code, quantity in ((0x00B50300, "velocity"), (0x00B40000, "position")):
        unit = decode_si_unit(code, quantity)  # type: ignore[arg-type]
        assert unit is not None
        assert unit.rpm_per_raw is None


@pytest.mark.parametrize(
    ("code", "text"),
    [
        (0xFD040000, "mA"), (0x00260000, "V"), (0xFD030000, "ms"), (0x00470000, "min"),
        (0x002D0000, "°C"), (0x03200000, "kHz"), (0xFF2D0000, "0.1 °C"), (0xFF260000, "0.1 V"),
        (0x00FE0000, ""), (0, ""), (0x00000300, ""),
    ],
)  # fmt: skip
def test_texts(code: int, text: str) -> None:
    assert unit_text(code) == text
