"""Modes of operation against trapezoids, ramps and loop theory."""

from __future__ import annotations

import math
import struct

import numpy as np
import pytest

from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.mechanics import EncoderSpec, FrictionSpec, LoadSpec, TravelSpec

from .servo_bench import REV, TURN, Bench, rigid

RELATIVE = 1 << 6


def move(b: Bench, target: int, extra: int = 0) -> None:
    b.set("607A:00", target)
    b.set("6040:00", 0x0F | extra)
    b.set("6040:00", 0x1F | extra)


@pytest.mark.parametrize(
    ("turns", "speed", "up", "down"),
    [(10, 10, 50, 50), (10, 10, 100, 25), (0.5, 10, 50, 50), (-3, 5, 20, 40)],
)
def test_pp_move_takes_the_time_of_its_trapezoid(
    bench, turns: float, speed: float, up: float, down: float
) -> None:
    b = bench()
    b.enable(1)
    b.set("6081:00", speed * REV)
    b.set("6083:00", up * REV)
    b.set("6084:00", down * REV)
    move(b, round(turns * REV))
    distance = abs(turns)
    ramps = speed**2 / (2 * up) + speed**2 / (2 * down)
    if distance >= ramps:
        expected = speed / up + speed / down + (distance - ramps) / speed
    else:
        peak = math.sqrt(2 * distance * up * down / (up + down))
        expected = peak / up + peak / down
    time_s = b.run_until(
        lambda: abs(b.get("6062:00") - round(turns * REV)) == 0 and b.get("6062:00") != 0, 5, 1e-4
    )
    # The demand rounds to the target when ½·a·t² is half an increment.
    assert time_s == pytest.approx(expected, abs=math.sqrt(1 / (down * REV)) + 1.5e-4)
    b.run_until(lambda: bool(b.status & 1 << 10), 0.3)
    assert abs(b.get("6064:00") - turns * REV) <= 182


def test_pp_handshake_and_relative_moves(bench) -> None:
    b = bench()
    b.enable(1)
    assert not b.status & 1 << 12
    move(b, REV)
    assert b.status & 1 << 12
    assert not b.status & 1 << 10
    b.set("6040:00", 0x0F)
    assert not b.status & 1 << 12
    b.run(0.6)
    assert b.status & 1 << 10
    for _ in range(2):
        move(b, REV // 2, RELATIVE)
    b.run(1.0)
    # Relative to the target before, not to where the axis happened to be.
    assert b.get("6064:00") == pytest.approx(2 * REV, abs=182)


def test_pp_new_target_on_the_way_is_taken_at_once(bench) -> None:
    b = bench()
    b.enable(1)
    move(b, 50 * REV)
    b.run(1.0)
    move(b, 5 * REV)
    peak = 0
    for _ in range(300):
        b.run(0.01)
        peak = max(peak, b.get("6062:00"))
    # At 1 s the demand is at 9 rev with 10 rev/s and brakes at 50 rev/s²: 1 rev more.
    assert peak / REV == pytest.approx(10.0, abs=0.02)
    assert b.get("6064:00") == pytest.approx(5 * REV, abs=182)


def test_pp_without_a_master_finishes_and_stops(bench) -> None:
    b = bench()
    b.enable(1)
    move(b, 3 * REV)
    b.run(10.0)
    assert b.get("6064:00") == pytest.approx(3 * REV, abs=5)
    assert abs(b.get("606C:00")) < REV // 100


def test_pp_stays_inside_software_limits_and_says_so(bench) -> None:
    b = bench()
    b.set("607D:01", -REV)
    b.set("607D:02", 2 * REV)
    b.enable(1)
    move(b, 5 * REV)
    b.run(1.0)
    assert b.get("6064:00") == pytest.approx(2 * REV, abs=182)
    assert b.status & 1 << 11
    move(b, REV)
    assert not b.status & 1 << 11


def test_pv_ramps_and_bits(bench) -> None:
    b = bench()
    b.enable(3)
    b.run(0.02)
    assert b.status & 1 << 12  # standing
    b.set("60FF:00", -20 * REV)
    b.run(0.2)
    assert b.get("606C:00") / REV == pytest.approx(-10, abs=0.1)
    assert not b.status & (1 << 12 | 1 << 10)
    b.run(0.3)
    assert b.get("606C:00") / REV == pytest.approx(-20, abs=0.05)
    assert b.status & 1 << 10
    b.run(5.0)  # nobody commands any more: it keeps running
    assert b.get("606C:00") / REV == pytest.approx(-20, abs=0.05)


def test_pv_is_limited_by_607f_and_6080(bench) -> None:
    b = bench()
    b.set("607F:00", 10 * REV)
    b.enable(3)
    b.set("60FF:00", 40 * REV)
    b.run(1.5)
    assert b.get("606C:00") / REV == pytest.approx(10, abs=0.05)
    b.set("6080:00", 300)  # rpm
    b.run(1.0)
    assert b.get("606C:00") / REV == pytest.approx(5, abs=0.05)


def test_pt_follows_its_slope_and_its_limits(bench) -> None:
    b = bench(rigid(friction=FrictionSpec(coulomb_nm=10.0)))
    b.set("6087:00", 1000)
    b.enable(4)
    b.set("6071:00", 500)
    b.run(0.25)
    assert b.get("6077:00") == pytest.approx(250, abs=3)
    assert b.get("6074:00") == pytest.approx(250, abs=3)
    b.run(0.3)
    assert b.get("6077:00") == 500
    b.set("6072:00", 300)
    b.run(0.01)
    assert b.get("6077:00") == 300


def test_pt_speed_stays_under_2005_08(bench) -> None:
    b = bench()
    b.set("2005:08", 600)
    b.apply()
    b.enable(4)
    b.set("6071:00", 100)
    b.run(1.0)
    assert b.get("606C:00") / REV == pytest.approx(10, rel=0.05)


def cyclic(b: Bench) -> tuple[object, object]:
    rx = b.servo.map_process_data(
        [0x60400010, 0x60600008, 0x607A0020, 0x60FF0020, 0x60710010, 0x60B20010], "rx"
    )
    tx = b.servo.map_process_data([0x60410010, 0x60640020, 0x606C0020, 0x60770010], "tx")
    return rx, tx


def test_csp_interpolates_between_cycles(bench) -> None:
    b = bench()
    b.enable(8)
    rx, _ = cyclic(b)
    rx.unpack(struct.pack("<HbiihH", 15, 8, 1000, 0, 0, 0))  # type: ignore[attr-defined]
    demands = []
    for _ in range(20):
        b.run(50e-6)
        demands.append(b.get("6062:00"))
    np.testing.assert_allclose(demands, np.arange(1, 21) * 50, atol=1)
    b.run(1e-3)  # the next cycle is late: the last output is repeated
    assert b.get("6062:00") == 1000


def test_csp_interpolates_over_a_steady_grid_finer_than_60c2(bench) -> None:
    """At 4 kHz with 60C2h at 1 ms: from the third equal spacing on, 5 steps per cycle."""
    b = bench()
    b.enable(8)
    rx, _ = cyclic(b)
    for cycle in range(1, 9):
        rx.unpack(struct.pack("<HbiihH", 15, 8, cycle * 100, 0, 0, 0))  # type: ignore[attr-defined]
        b.run(250e-6)
        if cycle >= 4:
            assert b.get("6062:00") == cycle * 100
    b.run(50e-6)  # late: what comes off the grid is interpolated over 60C2h again
    rx.unpack(struct.pack("<HbiihH", 15, 8, 1800, 0, 0, 0))  # type: ignore[attr-defined]
    b.run(250e-6)
    assert b.get("6062:00") == pytest.approx(800 + 1000 * 5 / 20, abs=1)


def test_csp_follows_a_ramp_with_the_lag_of_its_gain(bench) -> None:
    """Following error v/Kp with Kp = 2π·20 Hz; speed feed-forward takes it away."""
    for feed_forward in (0, 4):
        b = bench()
        b.set("2004:01", feed_forward)
        b.apply()
        b.enable(8)
        rx, _ = cyclic(b)
        for cycle in range(1, 801):
            rx.unpack(struct.pack("<HbiihH", 15, 8, cycle * 655, 0, 0, 0))  # type: ignore[attr-defined]
            b.run(1e-3)
        lag = b.get("60F4:00")
        expected = 0 if feed_forward else 655_000 / (TURN * 20)
        assert lag == pytest.approx(expected, abs=60)


def test_csv_and_cst(bench) -> None:
    b = bench()
    b.enable(9)
    rx, _ = cyclic(b)
    rx.unpack(struct.pack("<HbiihH", 15, 9, 0, 5 * REV, 0, 0))  # type: ignore[attr-defined]
    b.run(0.2)
    assert b.get("606C:00") / REV == pytest.approx(5, abs=0.02)
    rx.unpack(struct.pack("<HbiihH", 15, 10, 0, 0, 100, 20))  # type: ignore[attr-defined]
    b.run(1e-3)
    before = b.get("606C:00")
    b.run(5e-3)
    # 12 % of 1.27 Nm on 5e-5 kgm².
    gained = (b.get("606C:00") - before) / REV * TURN
    assert gained == pytest.approx(0.12 * 1.27 / 5e-5 * 5e-3, rel=0.05)


def test_impedance_mode_is_a_spring_and_damper(bench) -> None:
    """Held against 0.05 Nm with Kp = 0.5 Nm/rad the axis yields 0.1 rad (figure 53)."""
    b = bench(rigid(friction=FrictionSpec(gravity_nm=0.05)))
    b.set("2080:01", 0.5)
    b.set("2080:03", 0.01)
    b.enable(-4)
    b.run(1.0)
    assert b.servo.axis.angle_rad == pytest.approx(-0.1, rel=1e-3)
    b.set("2080:01", 1.0)  # acts at once (004:4539)
    b.run(1.0)
    assert b.servo.axis.angle_rad == pytest.approx(-0.05, rel=1e-3)
    b.set("60B2:00", round(0.05 / 1.27 * 1000))  # the torque offset carries the weight
    b.run(1.0)
    assert b.servo.axis.angle_rad == pytest.approx(0.0, abs=2e-3)


def test_following_error_bit_without_a_fault(bench) -> None:
    b = bench()
    b.set("6065:00", 1000)
    b.set("6066:00", 20)
    b.enable(8)
    rx, _ = cyclic(b)
    for cycle in range(1, 100):
        rx.unpack(struct.pack("<HbiihH", 15, 8, cycle * 655, 0, 0, 0))  # type: ignore[attr-defined]
        b.run(1e-3)
    assert b.status & 1 << 13
    assert b.status & 0x6F == 0x27


def test_mode_change_while_running_is_bumpless(bench) -> None:
    b = bench()
    b.enable(3)
    b.set("60FF:00", 10 * REV)
    b.run(0.5)
    b.set("6060:00", 4)
    b.set("6071:00", 0)
    assert b.get("6061:00") == 4
    b.run(0.05)
    assert b.get("606C:00") / REV == pytest.approx(10, rel=0.05)


def test_unsupported_mode_is_refused(bench) -> None:
    from drivers.virtual.device import ABORT_VALUE_RANGE, SdoAbort

    b = bench()
    with pytest.raises(SdoAbort) as refused:
        b.set("6060:00", 7)
    assert refused.value.code == ABORT_VALUE_RANGE
    assert b.get("6060:00") == 0


@pytest.mark.parametrize(("option", "turned_deg"), [(0, -260), (1, -260), (2, 100), (3, 100)])
def test_modulo_axis_goes_the_way_of_60f2h(bench, option: int, turned_deg: int) -> None:
    """A 360° axis at 300° is sent to 40° (table 24, 004:2104-2157)."""
    b = bench()
    turn = 36000
    b.set("6092:01", turn)
    for key in ("6081:00", "6083:00", "6084:00", "607F:00"):
        b.set(key, 10 * turn)
    b.set("607B:01", 0)
    b.set("607B:02", turn)
    b.enable(1)
    move(b, 30000)
    b.run(1.0)
    assert b.get("6064:00") == pytest.approx(30000, abs=100)
    start = b.servo.axis.angle_rad
    b.set("60F2:00", option << 6)
    move(b, 4000)
    b.run(1.5)
    assert b.get("6064:00") == pytest.approx(4000, abs=100)
    assert math.degrees(b.servo.axis.angle_rad - start) == pytest.approx(turned_deg, abs=2)


def test_modulo_position_never_leaves_its_range(bench) -> None:
    b = bench()
    b.set("607B:01", 0)
    b.set("607B:02", REV)
    b.enable(3)
    b.set("60FF:00", -3 * REV)
    for _ in range(100):
        b.run(0.013)
        assert 0 <= b.get("6064:00") <= REV


# --- loops ------------------------------------------------------------------------------------
def speed_response(b: Bench, f_hz: float) -> complex:
    """Closed speed loop at one frequency, by torque-free injection into the speed setpoint."""
    axis = b.servo.axis
    axis.run_cyclic(k.LOOP_SPEED)
    period = round(1 / (f_hz * k.STEP_S))
    settle, use = math.ceil(0.3 / (period * k.STEP_S)), math.ceil(0.2 / (period * k.STEP_S))
    speeds = np.zeros(period * use)
    for i in range(period * (settle + use)):
        axis.s[k.S_IP_SPEED] = 5.0 * math.sin(TURN * i / period)
        if i >= period * settle:
            speeds[i - period * settle] = axis._x[1]
        axis.run(1)
    carrier = np.exp(-1j * TURN * np.arange(period * use) / period)
    return complex(2 * np.mean(speeds * carrier) / (5.0 * -1j))


@pytest.mark.parametrize(("bandwidth", "integral"), [(500, 20), (1000, 100), (2000, 20)])
def test_speed_loop_is_what_its_gains_say(bench, bandwidth: int, integral: int) -> None:
    """T = L/(1 + L·F): L = 2πf_b·(1 + 2πf_i/s)/s·C·hold, F the filter and the difference."""
    b = bench(rigid(encoder=EncoderSpec(counts_per_rev=2**28)))
    b.set("2005:03", bandwidth)
    b.set("2005:04", integral)
    b.apply()
    b.enable(9)
    f = 10.0
    while f < 400.0:
        f_used = 1 / (round(1 / (f * k.STEP_S)) * k.STEP_S)
        s = 1j * TURN * f_used
        gain = TURN * bandwidth / 10 * (1 + TURN * integral / 10 / s) / s
        hold = (1 - np.exp(-s * k.STEP_S)) / (s * k.STEP_S)
        loop = gain * hold / (1 + s / (TURN * 1000))
        a = math.exp(-TURN * 1000 * k.STEP_S)
        z = np.exp(s * k.STEP_S)
        feedback = (1 - 1 / z) / (s * k.STEP_S) * (1 - a) / (1 - a / z)
        expected = loop / (1 + loop * feedback)
        found = speed_response(b, f)
        assert abs(20 * math.log10(abs(found / expected))) < 0.15, f
        assert abs(math.degrees(np.angle(found / expected))) < 1.5, f
        f *= 2.3


def test_stiffness_level_replaces_the_gains(bench) -> None:
    b = bench()
    b.set("2005:0E", 1)
    b.set("2005:0F", 20)
    b.apply()
    p, inertia = b.servo.axis.p, b.get("2001:06") * 1e-7
    assert p[k.P_KP_POSITION_1] == pytest.approx(TURN * 32.9)
    assert p[k.P_KP_SPEED_1] == pytest.approx(TURN * 115 * inertia)
    assert p[k.P_KI_SPEED_1] == pytest.approx(TURN * 115 * inertia * TURN * 22.7)


def test_notch_takes_its_frequency_out_of_the_torque(bench) -> None:
    """A −20 dB notch of 400 Hz / 100 Hz, in coefficients rounded to 10⁻⁴ (004:3494-3499)."""
    ts = 50e-6
    w, g, d = (TURN * 400 * ts) ** 2, TURN * 100 * ts, 10 ** (-20 / 20)
    coefficients = (w + d * g - 2, 1 - d * g, w + g - 2, 1 - g)
    b = bench(rigid(friction=FrictionSpec(coulomb_nm=10.0)))
    for i, value in enumerate(coefficients):
        b.set(f"2008:{2 + i:02X}", round(value * 10000) + 32768)
    b.set("2008:01", 1)
    b.apply()
    b.enable(10)
    axis = b.servo.axis
    axis.p[k.P_TORQUE_SPEED_LIMIT] = 1e9
    for f_hz in (100.0, 400.0, 1000.0):
        period = round(1 / (f_hz * ts))
        torque = np.zeros(period * 20)
        for i in range(period * 60):
            axis.s[k.S_IP_TORQUE] = 0.1 * math.sin(TURN * i / period)
            axis.run(1)
            if i >= period * 40:
                torque[i - period * 40] = axis.s[k.S_TORQUE_COMMAND]
        found = 2 * np.mean(torque * np.exp(-1j * TURN * np.arange(period * 20) / period))
        a1, a2, b1, b2 = (round(c * 10000) / 10000 for c in coefficients)
        z = np.exp(1j * TURN / period)
        expected = (z**2 + a1 * z + a2) / (z**2 + b1 * z + b2)
        assert found / (0.1 * -1j) == pytest.approx(expected, abs=1e-3)
        if f_hz == 400.0:
            assert abs(found) / 0.1 < 0.2


def test_gain_switching_below_the_error_threshold(bench) -> None:
    b = bench()
    b.set("2005:09", 1)
    b.set("2005:0A", 1000)
    b.set("2005:0B", 10)
    b.apply()
    b.enable(1)
    b.run(0.005)
    assert b.servo.axis.s[k.S_GAIN_MIX] == pytest.approx(0.5, abs=0.01)
    b.run(0.01)
    assert b.servo.axis.s[k.S_GAIN_MIX] == 1.0
    move(b, 10 * REV)
    b.run(0.5)
    assert b.servo.axis.s[k.S_GAIN_MIX] == 0.0


def test_user_units(bench) -> None:
    """6091h 10:1 and 6092h 3600 units per load turn: one motor turn is 360 units."""
    b = bench()
    b.set("6091:01", 10)
    b.set("6092:01", 3600)
    b.set("6081:00", 3600)
    b.set("6083:00", 36000)
    b.set("6084:00", 36000)
    b.set("607F:00", 36000)
    b.enable(1)
    move(b, 720)
    b.run(1.0)
    assert b.servo.axis.angle_rad == pytest.approx(2 * TURN, abs=0.05)
    assert b.get("6063:00") == pytest.approx(2 * REV, abs=200)


def test_polarity_turns_position_and_speed_round(bench) -> None:
    b = bench()
    b.set("607E:00", 0xC0)
    b.enable(1)
    move(b, REV)
    b.run(0.7)
    assert b.get("6064:00") == pytest.approx(REV, abs=182)
    assert b.servo.axis.angle_rad == pytest.approx(-TURN, abs=0.05)


# --- homing -----------------------------------------------------------------------------------
TRAVEL = TravelSpec(min_rev=-2.0, max_rev=2.0)


def homing_bench(bench, start_rev: float) -> Bench:
    spec = rigid(travel=TRAVEL)
    b = bench(spec)
    for terminal, function in ((1, 1), (2, 2), (3, 3)):
        b.set(f"2030:{terminal:02X}", function)
    b.apply()
    b.set("6099:01", 2 * REV)
    b.set("6099:02", REV // 4)
    b.set("609A:00", 50 * REV)
    if start_rev:
        b.enable(1)
        move(b, round(start_rev * REV))
        b.run(3.0)
        b.set("6040:00", 6)
    return b


def home(b: Bench, method: int) -> float:
    """Runs a method; returns the encoder angle of the new zero in revolutions."""
    b.set("6098:00", method)
    b.enable(6)
    b.set("6040:00", 0x1F)
    if method not in (35, 37):  # those two are done at once
        assert not b.status & (1 << 12 | 1 << 10)
    b.run_until(lambda: bool(b.status & (1 << 12 | 1 << 13)), 60.0, 0.01)
    assert b.status & 1 << 12, "homing error"
    assert b.status & 1 << 10
    return b.servo.core.zero_rad / TURN


# Limit switches at ±1.75, cam from 0.2 to 0.7, index at whole turns.
EDGE = 0.002


@pytest.mark.long(keep=3)
@pytest.mark.parametrize("start", [-1.0, 0.4, 1.2])
@pytest.mark.parametrize(
    ("method", "zero"),
    [
        (1, -1.0), (2, 1.0), (17, -1.75), (18, 1.75),
        (7, 0.0), (11, 1.0), (10, 1.0), (14, 0.0),
        (23, 0.2), (24, 0.2), (25, 0.7), (26, 0.7), (27, 0.7), (28, 0.7), (29, 0.2), (30, 0.2),
    ],
)  # fmt: skip
def test_homing_on_switches(bench, method: int, zero: float, start: float) -> None:
    b = homing_bench(bench, start)
    assert home(b, method) == pytest.approx(zero, abs=1e-6 if zero % 1 == 0 else EDGE)
    # The axis ends at the home position, which is the new zero.
    assert abs(b.get("6064:00")) < 300


@pytest.mark.long(keep=5)
@pytest.mark.parametrize(
    ("method", "start", "zero"),
    [
        (3, -0.5, 0.0), (4, -0.5, 1.0), (19, -0.5, 0.2), (20, -0.5, 0.2),
        (3, 0.4, 0.0), (4, 0.4, 1.0), (5, 1.2, 1.0), (6, 1.2, 0.0), (21, 1.2, 0.7), (22, 1.2, 0.7),
        (33, 0.4, 0.0), (34, 0.4, 1.0), (34, -1.5, -1.0), (35, 0.4, 0.4), (37, -0.5, -0.5),
    ],
)  # fmt: skip
def test_homing_from_one_side(bench, method: int, start: float, zero: float) -> None:
    b = homing_bench(bench, start)
    assert home(b, method) == pytest.approx(zero, abs=1e-6 if zero % 1 == 0 else EDGE)


@pytest.mark.parametrize(("method", "zero"), [(-2, 2.0), (-3, -2.0)])
def test_homing_against_the_mechanical_stop(bench, method: int, zero: float) -> None:
    b = bench(rigid(travel=TRAVEL))
    b.set("2070:01", 200)
    b.set("2070:02", 100)
    b.set("6099:01", 2 * REV)
    assert home(b, method) == pytest.approx(zero, abs=1e-4)
    assert b.get("6077:00") < 200


def test_home_offset_puts_zero_beyond_home(bench) -> None:
    """The zero position is the home position plus the offset (004:7231-7236)."""
    b = homing_bench(bench, 0.0)
    b.set("607C:00", 1000)
    home(b, 35)
    assert b.get("6064:00") == pytest.approx(-1000, abs=2)


def test_homing_fails_on_the_limit_switch_and_at_the_time_out(bench) -> None:
    b = homing_bench(bench, 1.2)
    b.set("6098:00", 3)  # looks for the switch towards positive and meets the limit
    b.enable(6)
    b.set("6040:00", 0x1F)
    b.run(3.0)
    assert b.status & 1 << 13
    assert not b.status & 1 << 12
    assert b.status & 0x6F == 0x27  # an error of homing, not a fault
    assert abs(b.get("606C:00")) < REV // 50
    b = bench()
    b.set("2070:03", 1)
    b.set("6098:00", 17)  # no switch anywhere
    b.enable(6)
    b.set("6040:00", 0x1F)
    b.run(0.9)
    assert not b.status & 1 << 13
    b.run(0.2)
    assert b.status & 1 << 13


def test_homing_starts_when_bit_4_was_set_before_enabling(bench) -> None:
    b = bench()
    b.set("6060:00", 6)
    b.set("6098:00", 35)
    b.set("6040:00", 0x06)
    b.set("6040:00", 0x16)
    b.set("6040:00", 0x1F)
    b.run(0.01)
    assert b.status & 1 << 12


def test_limit_switch_stops_a_move_with_a_fault(bench) -> None:
    """POS_LIMIT (004:4793-4801); away from the switch the axis may move again."""
    b = homing_bench(bench, 0.0)
    b.enable(3)
    b.set("60FF:00", REV)
    b.run(2.5)
    assert b.get("200B:0B") == 1 << 5
    assert b.get("60FD:00") & 0x7 == 0x2
    b.run(0.5)
    b.set("6040:00", 0)
    b.set("6040:00", 0x80)
    b.set("60FF:00", -REV)
    b.enable(3)
    b.run(1.0)
    assert b.status & 0x6F == 0x27
    assert b.get("606C:00") < 0


def test_inertia_identification(bench) -> None:
    """The measured inertia of a load of three times the rotor, within 2 %."""
    spec = rigid(
        friction=FrictionSpec(viscous_nms=2e-4, coulomb_nm=0.04),
        load=(LoadSpec(inertia_kgm2=1.5e-4, stiffness_nm_per_rad=5000, damping_nms_per_rad=0.05),),
    )
    b = bench(spec)
    b.enable(1)
    b.set("6040:00", 0x080F)
    assert b.status & 1 << 14
    seen = set()
    for _ in range(600):
        b.run(0.01)
        seen.add(b.get("200C:05"))
        if not b.status & 1 << 14:
            break
    assert {1, 2, 4, 5, 7, 8, 9, 12} <= seen
    assert b.get("200C:05") == 12
    assert b.get("200C:0A") == pytest.approx(2e-4 * 1e7, rel=0.02)
    assert b.get("200C:0C") == pytest.approx(40, abs=4)
    assert b.get("2001:06") == b.get("200C:0A")
    b.set("6040:00", 0x000F)
    assert b.status & 0x6F == 0x27


@pytest.mark.parametrize("rounds", [2, 6])
def test_identification_stays_inside_its_rounds(bench, rounds: int) -> None:
    """200Ch:04 limits the revolutions of the inertia test (004:6332-6337)."""
    load = LoadSpec(inertia_kgm2=1e-3, stiffness_nm_per_rad=5000, damping_nms_per_rad=0.05)
    b = bench(rigid(friction=FrictionSpec(coulomb_nm=0.04), load=(load,)))
    b.set("200C:01", 1)
    b.set("200C:04", rounds)
    b.enable(1)
    b.set("6040:00", 0x080F)
    turns = []
    while b.status & 1 << 14:
        b.run(0.005)
        turns.append(b.servo.axis.angle_rad / TURN)
    assert max(turns) - min(turns) < rounds * 1.1
    assert b.get("200C:05") == 12
    assert b.get("200C:0A") == pytest.approx(1.05e-3 * 1e7, rel=0.03)


def test_identification_fails_on_an_axis_that_cannot_move(bench) -> None:
    b = bench(rigid(friction=FrictionSpec(coulomb_nm=10.0)))
    before = b.get("2001:06")
    b.enable(1)
    b.set("6040:00", 0x080F)
    b.run_until(lambda: not b.status & 1 << 14, 60.0, 0.1)
    assert b.get("200C:05") == 16
    assert b.get("2001:06") == before


def test_identification_ends_with_bit_11(bench) -> None:
    b = bench()
    b.enable(1)
    b.set("6040:00", 0x080F)
    b.run(0.3)
    b.set("6040:00", 0x000F)
    assert not b.status & 1 << 14
    assert b.get("200C:05") == 0
    b.run(0.5)
    assert abs(b.get("606C:00")) < REV // 10
