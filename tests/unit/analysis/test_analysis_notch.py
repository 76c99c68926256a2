"""Notch encodings against values worked out by hand from tuning.md section 4."""

import control
import numpy as np
import pytest

from backend.analysis.loop.notch import (
    IntegerRange,
    LevelCalibration,
    Notch,
    NotchCoefficients,
    coefficients_response,
    decode_coefficients,
    decode_hz_levels,
    decode_hz_width_db,
    encode_coefficients,
    encode_hz_levels,
    encode_hz_width,
    encode_hz_width_db,
    realised,
)

TS = 50e-6


# w = 2π·400·50e-6 = 0.1256637, w² = 0.0157914; g = 2π·100·50e-6 = 0.0314159; d = 0.1
# a1 = 0.0157914 + 0.0031416 - 2 = -1.9810670 -> -19811 + 32768 = 12957
# a2 = 1 - 0.0031416 = 0.9968584 -> 9969 + 32768 = 42737
# b1 = 0.0157914 + 0.0314159 - 2 = -1.9527927 -> -19528 + 32768 = 13240
# b2 = 1 - 0.0314159 = 0.9685841 -> 9686 + 32768 = 42454
# second: w² = (2π·2000·ts)² = 0.3947842, g = 2π·400·ts = 0.1256637, d = 10^(-19/20) = 0.1122018
# a1 = 0.3947842 + 0.0140997 - 2 = -1.5911161 -> 16857; a2 = 0.9859003 -> 42627
# b1 = 0.3947842 + 0.1256637 - 2 = -1.4795521 -> 17972 (−14796); b2 = 0.8743363 -> 41511
# third: 100 Hz, 50 Hz, -7 dB: w² = 0.0009870, g = 0.0157080, d = 0.4466836
# a1 = 0.0009870 + 0.0070165 - 2 = -1.9919966 -> 12848; a2 = 0.9929835 -> 42698
# b1 = 0.0009870 + 0.0157080 - 2 = -1.9833051 -> 12935; b2 = 0.9842920 -> 42611
@pytest.mark.parametrize(
    ("notch", "raw"),
    [
        (Notch(400.0, 100.0, -20.0), NotchCoefficients(12957, 42737, 13240, 42454)),
        (Notch(2000.0, 400.0, -19.0), NotchCoefficients(16857, 42627, 17972, 41511)),
        (Notch(100.0, 50.0, -7.0), NotchCoefficients(12848, 42698, 12935, 42611)),
    ],
)
def test_coefficients_are_those_of_the_formulas(notch, raw):
    assert encode_coefficients(notch, TS) == raw


def test_decoding_shows_what_rounding_leaves():
    # From the hand-computed values: w² = 1 - 1.9833 + 0.9843 = 0.0010 -> f_c = 100.66 Hz
    back = decode_coefficients(encode_coefficients(Notch(100.0, 50.0, -7.0), TS), TS)
    assert back.center_hz == pytest.approx(np.sqrt(0.0010) / (2 * np.pi * TS), rel=1e-6)
    # g = 1 - 0.9843 = 0.0157 -> 49.97 Hz; d = (1 - 0.9930)/0.0157 -> -7.02 dB
    assert back.width_hz == pytest.approx(49.97, abs=0.01)
    assert back.depth_db == pytest.approx(20 * np.log10(0.0070 / 0.0157), abs=1e-3)


@pytest.mark.parametrize("center", [160.0, 400.0, 1000.0, 1900.0])
def test_round_trip_within_a_step(center):
    back = decode_coefficients(encode_coefficients(Notch(center, 100.0, -20.0), TS), TS)
    step = 2e-4 / (2 * (2 * np.pi * TS) ** 2 * center)  # d(w²) of two half steps
    assert abs(back.center_hz - center) <= step * 1.01


def test_too_low_centre_is_refused_rather_than_written_unstable():
    # w² of 10 Hz is 9.9e-6: rounded coefficients put a pole on z = 1.
    with pytest.raises(ValueError, match="not stable"):
        encode_coefficients(Notch(10.0, 100.0, -20.0), TS)


def test_realised_response_against_control_library():
    raw = encode_coefficients(Notch(400.0, 100.0, -20.0), TS)
    h = control.tf([1, -1.9811, 0.9969], [1, -1.9528, 0.9686], TS)
    f = np.geomspace(5.0, 9000.0, 200)
    expected = h(np.exp(2j * np.pi * f * TS))
    assert np.allclose(coefficients_response(raw, f, TS), expected, rtol=1e-9)
    r = realised(raw, TS)
    assert r.stable
    assert r.center_hz == pytest.approx(400.0, rel=0.03)
    assert r.depth_db == pytest.approx(-20.0, abs=0.5)
    # 1 + a1 + a2 = 0.0158 and 1 + b1 + b2 = 0.0158: no change of gain at standstill
    assert r.dc_gain_db == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("depth_db", [-2.0, -3.5, -8.0, -30.0])
def test_what_the_drive_does_is_as_wide_as_what_was_asked_however_shallow(depth_db):
    """|H|² of the continuous notch is (1 + d²)/2 on both edges of its bandwidth."""
    n = Notch(800.0, 200.0, depth_db)
    low = -100 + np.sqrt(100**2 + 800**2)
    power = np.abs(n.response(np.array([low, low + 200.0]))) ** 2
    assert power == pytest.approx((1 + 10 ** (depth_db / 10)) / 2)
    made = realised(encode_coefficients(n, TS), TS)
    # The backward difference moves both edges; a step of b2 is 0.3 Hz.
    assert made.width_hz == pytest.approx(200.0, rel=0.08)


def test_continuous_notch_has_its_depth_and_minus_3_db_width():
    n = Notch(300.0, 60.0, -60.0)
    low = -30 + np.sqrt(30**2 + 300**2)
    db = 20 * np.log10(np.abs(n.response(np.array([300.0, low, low + 60.0]))))
    assert db == pytest.approx([-60.0, -3.01, -3.01], abs=0.01)


def test_whole_hertz_encodings():
    hz, width = IntegerRange(50, 4000), IntegerRange(10, 1000)
    assert encode_hz_width(Notch(433.5, 86.4, -20.0), hz, width) == (434, 86)
    assert encode_hz_width(Notch(433.4, 3.0, -20.0), hz, width) == (433, 10)
    with pytest.raises(ValueError, match="outside 50 to 4000"):
        encode_hz_width(Notch(4400.0, 100.0, -20.0), hz, width)
    depth = IntegerRange(0, 60)
    raw = encode_hz_width_db(Notch(433.4, 86.4, -17.6), hz, width, depth)
    assert raw == (433, 86, 18)
    assert decode_hz_width_db(raw, hz, width, depth) == Notch(433.0, 86.0, -18.0)


def test_levels_need_a_measured_calibration():
    hz, level, depth = IntegerRange(50, 4000), IntegerRange(0, 20), IntegerRange(0, 99)
    n = Notch(500.0, 250.0, -14.0)
    with pytest.raises(ValueError, match="not been measured"):
        encode_hz_levels(n, hz, level, depth, LevelCalibration((), ()))
    known = LevelCalibration(((0, 0.1), (20, 2.1)), ((0, -40.0), (99, 0.0)))
    raw = encode_hz_levels(n, hz, level, depth, known)
    assert raw == (500, 4, 64)
    assert decode_hz_levels(*raw, known).width_hz == pytest.approx(250.0)


def test_no_level_is_taken_whose_effect_was_not_measured():
    """What is asked beyond the measured levels gets the last of them, not one that may do more."""
    hz, level, depth = IntegerRange(50, 4000), IntegerRange(0, 20), IntegerRange(0, 99)
    known = LevelCalibration(((10, 0.51), (16, 0.8)), ((8, -22.0), (70, -3.0)))
    narrow, wide = (Notch(500.0, width, -40.0) for width in (100.0, 900.0))
    assert encode_hz_levels(narrow, hz, level, depth, known) == (500, 10, 8)
    assert encode_hz_levels(wide, hz, level, depth, known) == (500, 16, 8)
    assert encode_hz_levels(Notch(500.0, 300.0, -1.0), hz, level, depth, known)[2] == 70


@pytest.mark.parametrize("bad", [(0.0, 10.0, -3.0), (10.0, -1.0, -3.0), (10.0, 10.0, 3.0)])
def test_nonsense_notches_are_refused(bad):
    with pytest.raises(ValueError, match="notch"):
        Notch(*bad)
