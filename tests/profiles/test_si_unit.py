"""Unit codes of 60A8h to 60ABh against the values that drives' manuals print for them."""

from __future__ import annotations

import math

import pytest

from profiles.si_unit import decode_si_unit


@pytest.mark.parametrize(
    ("code", "name", "rpm"),
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
def test_speed_of_a_turning_axis(code: int, name: str, rpm: float) -> None:
    unit = decode_si_unit(code)
    assert unit is not None
    assert unit.name == name
    assert unit.turns is not None
    assert unit.seconds is not None
    assert unit.factor * unit.turns / unit.seconds * 60.0 == pytest.approx(rpm, rel=1e-9)


@pytest.mark.parametrize(
    ("code", "name", "turns"),
    [
        (0x00B40000, "rev", 1.0),
        (0x00410000, "°", 1.0 / 360.0),
        (0xFF410000, "0.1 °", 1.0 / 3600.0),
        (0x00420000, "′", 1.0 / 21_600.0),
        (0x00430000, "″", 1.0 / 1_296_000.0),
        (0x00100000, "rad", 0.15915494309189535),
    ],
)
def test_angles(code: int, name: str, turns: float) -> None:
    unit = decode_si_unit(code)
    assert unit is not None
    assert unit.turns is not None
    assert (unit.name, unit.counts, unit.seconds) == (name, False, None)
    assert unit.factor * unit.turns == pytest.approx(turns, rel=1e-12)


@pytest.mark.parametrize(
    ("code", "name"),
    [
        (0x00B50000, "inc"),
        (0x00B50300, "inc/s"),
        (0x00B55700, "inc/s²"),
        (0xFD010000, "mm"),
        (0xFA010000, "µm"),
        (0xFD010300, "mm/s"),
        (0xFD015700, "mm/s²"),
        (0x00B45700, "rev/s²"),
    ],
)
def test_names(code: int, name: str) -> None:
    unit = decode_si_unit(code)
    assert unit is not None
    assert unit.name == name
    assert unit.counts == name.startswith("inc")


@pytest.mark.parametrize(
    "code",
    [
        0,  # nobody gave a unit
        0x00B44701,  # reserved byte in use
        0x00FF4700,  # unknown numerator
        0x00B4FF00,  # unknown denominator
        0x00AC0000,  # steps: a maker's own
        0x7FB44700,  # a power of ten that nobody means
        0xFFFFFFFF,
        -1,
        1 << 32,
        0x00264700,  # volts per minute
    ],
)
def test_what_is_not_certain_is_none(code: int) -> None:
    assert decode_si_unit(code) is None
