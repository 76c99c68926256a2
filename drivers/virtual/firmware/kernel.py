"""The 50 µs loop of one virtual drive: measure, command, control, plant, supply, protections.

One compiled function advances one axis by many steps without the interpreter lock. Everything
it needs travels in flat float64 arrays: parameters ``p`` (written by the firmware), state ``s``
(owned by the loop) and the chain's state ``x`` with its exact discretisation ``a``, ``b``
(`drivers.virtual.mechanics.chain`). SI units throughout: rad, rad/s, Nm, A, V, °C.

The constants live here and not in a module of their own because numba's cache notices changes
of this file only.

Sources: loop structure 004:2849-2896 (figure 33) and 004:3127-3174; feedback filters
004:3262-3282; gain switching 004:3061-3096; linear interpolation over 60C2h 004:7618-7621;
protections 004:4703-4917. Friction is time-stepping on the velocity level (J. J. Moreau,
"Unilateral contact and dry friction in finite freedom dynamics", 1988): the friction torque of
a step is the one that ends it at rest, limited to the Coulomb torque, so nothing chatters.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import njit

STEP_S = 50e-6
STEP_NS = 50_000

# --- what the command generator does -------------------------------------------------------
GEN_OFF, GEN_POSITION, GEN_VELOCITY, GEN_TORQUE, GEN_CYCLIC, GEN_TORQUE_STOP = range(6)
# --- which loops are closed ----------------------------------------------------------------
LOOP_OFF, LOOP_POSITION, LOOP_SPEED, LOOP_TORQUE, LOOP_IMPEDANCE = range(5)
# --- events that end a run early, as bits --------------------------------------------------
EV_FAULT, EV_STOPPED, EV_ARRIVED, EV_SIGNAL, EV_INDEX, EV_STALL, EV_ALARM_CLOCK, EV_LIMIT = (
    1 << bit for bit in range(8)
)  # fmt: skip
# --- protections: bits of the MMS7's error status 200Bh:0Bh (004:6254-6282), then those that
#     other families have ------------------------------------------------------------------
(
    F_OVER_CURRENT, F_UNDER_VOLTAGE, F_LOCKED, F_POWER_STAGE, F_OVERLOAD, F_POSITION_LIMIT,
    F_SENSOR, F_MEMORY, F_OVER_TEMPERATURE, F_OVER_VOLTAGE, F_OVER_SPEED, F_SPEED_ERROR,
    F_WATCHDOG, F_FOLLOWING,
) = (1 << bit for bit in range(14))  # fmt: skip
# --- switches, as bits of P_SIGNAL_* and S_SIGNALS ------------------------------------------
SIG_NEGATIVE, SIG_POSITIVE, SIG_HOME = 1, 2, 4

# --- when the second gains act: P_SWITCH_KIND (conditions as M6-L 000:3399, R6L 002:10800) -----
(
    SWITCH_OFF, SWITCH_SMALL_ERROR, SWITCH_INPUT, SWITCH_TORQUE, SWITCH_SPEED_DEMAND,
    SWITCH_SPEED, SWITCH_ACCELERATION, SWITCH_ERROR, SWITCH_COMMANDED, SWITCH_UNFINISHED,
    SWITCH_COMMANDED_OR_FAST,
) = range(11)  # fmt: skip
# --- what a limit switch does: P_LIMIT_STOPS --------------------------------------------------
LIMIT_IGNORED, LIMIT_FAULT, LIMIT_HOLDS = range(3)

# --- parameters -----------------------------------------------------------------------------
(
    P_GEN, P_LOOP, P_EVENT_MASK, P_TARGET, P_V_MAX, P_ACC, P_DEC, P_STOPPING, P_STOP_DEC,
    P_V_TARGET, P_T_TARGET, P_T_SLOPE, P_STOP_SPEED, P_STOP_TORQUE,
    P_KP_POSITION_1, P_KP_POSITION_2, P_KP_SPEED_1, P_KP_SPEED_2, P_KI_SPEED_1, P_KI_SPEED_2,
    P_SWITCH_LEVEL, P_SWITCH_TIME, P_SWITCH_KIND, P_SPEED_OUT_LIMIT, P_POSITION_OUT_LIMIT,
    P_TORQUE_SPEED_LIMIT, P_MAX_SPEED, P_T_MAX, P_T_MIN,
    P_FF_SPEED, P_FF_SPEED_COEFFICIENT, P_FF_TORQUE, P_FF_TORQUE_COEFFICIENT,
    P_POSITION_FILTER, P_SPEED_FILTER, P_SPEED_SOURCE, P_OBSERVER_GAIN, P_OBSERVER_INERTIA,
    P_OBSERVER_VISCOUS, P_OBSERVER_COULOMB, P_NOTCH_COUNT,
    P_COUNTS_PER_RAD, P_NOISE, P_ENCODER_DEAD,
    P_COULOMB, P_GRAVITY, P_STOP_MIN, P_STOP_MAX, P_BRAKE_TORQUE,
    P_LIMIT_NEGATIVE, P_LIMIT_POSITIVE, P_HOME_FROM, P_HOME_TO,
    P_SIGNAL_FORCED, P_SIGNAL_FORCED_ON, P_SIGNAL_INVERTED, P_WATCH_MASK, P_WATCH_VALUE,
    P_LIMIT_STOPS, P_ALARM_STEP,
    P_KT, P_RESISTANCE, P_SUPPLY_V, P_SUPPLY_R, P_SUPPLY_C, P_SUPPLY_SINKS, P_BRAKE_R,
    P_BRAKE_ON_V, P_BRAKE_OFF_V, P_BRAKE_ENABLED, P_THERMAL_K_PER_W, P_THERMAL_S, P_AMBIENT,
    P_OCP_A, P_UVLO_V, P_OVP_V, P_LOCK_ANGLE, P_LOCK_S, P_OVERLOAD_NM, P_OVERLOAD_S,
    P_OTP_C, P_OVER_SPEED, P_SPEED_ERROR, P_SPEED_ERROR_S, P_RATED_NM,
    P_POSITION_WINDOW, P_SPEED_WINDOW, P_ZERO_SPEED, P_FOLLOWING_WINDOW, P_STALL_NM, P_STALL_S,
    P_STALL_SPEED, P_Z_KP, P_Z_KI, P_Z_KD, P_Z_FILTER, P_Z_LIMIT, P_LOAD_RATIO_S,
    P_POWER_LIMIT_V, P_INDEX_RAD, P_TORQUE_FILTER, P_FOLLOWING_S,
    P_TORQUE_FILTER_2, P_SWITCH_HYSTERESIS, P_SWITCH_DELAY, P_SWITCH_INPUT, P_LIMIT_DEC,
    P_DYNAMIC_BRAKE, P_BRAKE_CLOSED, P_I2T_LIMIT, P_LOCK_NM, P_FRICTION_POSITIVE,
    P_FRICTION_NEGATIVE, P_FRICTION_VISCOUS, P_TORQUE_BIAS, P_I2T_RATED_NM,
    P_THIRD_GAINS, P_THIRD_DELAY, P_KP_POSITION_3, P_KP_SPEED_3, P_KI_SPEED_3,
    P_SHAPE_ON, P_SHAPE_A11, P_SHAPE_A12, P_SHAPE_A21, P_SHAPE_A22, P_SHAPE_B1, P_SHAPE_B2,
    P_QUADRANT_POSITIVE, P_QUADRANT_NEGATIVE, P_QUADRANT_DELAY, P_QUADRANT_FILTER,
    P_QUADRANT_ANGLE, P_PLACE_NM, P_PLACE_PER_RAD, P_PLACE_AT, P_FAN,
    P_STICTION, P_STRIBECK,
) = range(139)  # fmt: skip
P_NOTCHES = 139
"""Start of the notches: per notch a1, a2, b1, b2 of (z² + a1·z + a2)/(z² + b1·z + b2)."""
P_SIZE = P_NOTCHES + 16

# --- state ----------------------------------------------------------------------------------
(
    S_STEP, S_EVENTS, S_FAULTS, S_THETA, S_THETA_FILTERED, S_OMEGA_RAW, S_OMEGA, S_OMEGA_LOW,
    S_OMEGA_OBSERVED, S_P_DEMAND, S_V_DEMAND, S_A_DEMAND, S_T_DEMAND, S_STOPPED, S_ARRIVED,
    S_SPEED_REFERENCE, S_INTEGRAL, S_FF_SPEED, S_FF_TORQUE, S_GAIN_MIX, S_TORQUE_COMMAND,
    S_TORQUE, S_CURRENT, S_SATURATED, S_SPEED_LIMITED,
    S_VOLTAGE, S_BRAKE_DUTY, S_BRAKE_ON, S_TEMPERATURE,
    S_LOAD_RATIO, S_SIGNALS, S_INDEX_ANGLE, S_INDEX_COUNT,
    S_LOCK_ANCHOR, S_LOCK_T, S_OVERLOAD_T, S_SPEED_ERROR_T,
    S_POSITION_T, S_SPEED_T, S_ZERO_T, S_FOLLOWING_T, S_STALL_T,
    S_IP_POSITION, S_IP_POSITION_INC, S_IP_SPEED, S_IP_SPEED_INC, S_IP_TORQUE, S_IP_TORQUE_INC,
    S_IP_LEFT, S_Z_INTEGRAL, S_Z_SPEED, S_SPARE_NORMAL, S_HAS_SPARE, S_LIMIT_ACTIVE, S_UQ,
    S_TORQUE_FILTERED, S_SECOND_GAINS, S_SWITCH_T, S_I2T, S_LIMIT_HELD,
    S_THIRD_MIX, S_REST_T, S_SHAPE, S_SHAPE_RATE,
    S_QUADRANT_SIGN, S_QUADRANT_T, S_QUADRANT_FROM, S_QUADRANT,
) = range(68)  # fmt: skip
S_NOTCHES = 68
"""Start of the notch states, two per notch."""
S_TRACE = S_NOTCHES + 8
"""Start of the last TRACE_STEPS torque commands, as a ring by the step counter."""
TRACE_STEPS = 4096
S_SIZE = S_TRACE + TRACE_STEPS

Array = npt.NDArray[np.float64]


@njit(cache=True, nogil=True)
def _clamp(value, low, high):  # type: ignore[no-untyped-def]
    return low if value < low else high if value > high else value


@njit(cache=True, nogil=True)
def _event(s, bit):  # type: ignore[no-untyped-def]
    s[S_EVENTS] = float(int(s[S_EVENTS]) | bit)


@njit(cache=True, nogil=True)
def _normal(s, random):  # type: ignore[no-untyped-def]
    """Standard normal by Marsaglia's polar method on xorshift64*, one spare kept."""
    if s[S_HAS_SPARE] > 0.0:
        s[S_HAS_SPARE] = 0.0
        return s[S_SPARE_NORMAL]
    while True:
        u = v = 0.0
        for i in range(2):
            word = random[0]
            word ^= word >> np.uint64(12)
            word ^= word << np.uint64(25)
            word ^= word >> np.uint64(27)
            random[0] = word
            scrambled = (word * np.uint64(0x2545F4914F6CDD1D)) >> np.uint64(11)
            uniform = float(scrambled) * (2.0 / 9007199254740992.0) - 1.0
            if i == 0:
                u = uniform
            else:
                v = uniform
        q = u * u + v * v
        if 0.0 < q < 1.0:
            factor = math.sqrt(-2.0 * math.log(q) / q)
            s[S_SPARE_NORMAL] = v * factor
            s[S_HAS_SPARE] = 1.0
            return u * factor


@njit(cache=True, nogil=True)
def _measure(p, s, x, random):  # type: ignore[no-untyped-def]
    """Encoder, feedback filters and switches."""
    counts = x[0] * p[P_COUNTS_PER_RAD]
    if p[P_NOISE] > 0.0:
        counts += p[P_NOISE] * _normal(s, random)
    theta = math.floor(counts) / p[P_COUNTS_PER_RAD]
    if p[P_ENCODER_DEAD] > 0.0:
        theta = s[S_THETA]
        if not int(s[S_FAULTS]) & F_SENSOR:
            s[S_FAULTS] = float(int(s[S_FAULTS]) | F_SENSOR)
            _event(s, EV_FAULT)
    raw = (theta - s[S_THETA]) / STEP_S
    s[S_THETA] = theta
    s[S_OMEGA_RAW] = raw
    # A tracking low pass: the filter lags accelerations, not constant speed.
    predicted = s[S_THETA_FILTERED] + s[S_OMEGA_LOW] * STEP_S
    s[S_THETA_FILTERED] = predicted + p[P_POSITION_FILTER] * (theta - predicted)
    s[S_OMEGA_LOW] += p[P_SPEED_FILTER] * (raw - s[S_OMEGA_LOW])
    observed = s[S_OMEGA_OBSERVED]
    friction = 0.0
    if observed > 0.1:
        friction = p[P_OBSERVER_COULOMB]
    elif observed < -0.1:
        friction = -p[P_OBSERVER_COULOMB]
    drive = (s[S_TORQUE] - p[P_OBSERVER_VISCOUS] * observed - friction) / p[P_OBSERVER_INERTIA]
    observed += drive * STEP_S
    s[S_OMEGA_OBSERVED] = observed + p[P_OBSERVER_GAIN] * (raw - observed)
    s[S_OMEGA] = s[S_OMEGA_OBSERVED] if p[P_SPEED_SOURCE] > 0.5 else s[S_OMEGA_LOW]

    signals = 0
    if x[0] <= p[P_LIMIT_NEGATIVE]:
        signals |= SIG_NEGATIVE
    if x[0] >= p[P_LIMIT_POSITIVE]:
        signals |= SIG_POSITIVE
    if p[P_HOME_FROM] <= x[0] <= p[P_HOME_TO]:
        signals |= SIG_HOME
    signals ^= int(p[P_SIGNAL_INVERTED])
    forced = int(p[P_SIGNAL_FORCED])
    signals = (signals & ~forced) | (int(p[P_SIGNAL_FORCED_ON]) & forced)
    s[S_SIGNALS] = float(signals)
    watched = int(p[P_WATCH_MASK])
    if watched and (signals & watched) != int(p[P_WATCH_VALUE]):
        _event(s, EV_SIGNAL)
    turn = math.floor(x[0] / p[P_INDEX_RAD])
    if turn != s[S_INDEX_COUNT]:
        s[S_INDEX_ANGLE] = max(turn, s[S_INDEX_COUNT]) * p[P_INDEX_RAD]
        s[S_INDEX_COUNT] = turn
        _event(s, EV_INDEX)


@njit(cache=True, nogil=True)
def _approach(value, goal, rise, fall):  # type: ignore[no-untyped-def]
    """One step of a speed ramp: ``rise`` away from zero, ``fall`` towards it."""
    difference = goal - value
    limit = rise if value * difference >= 0.0 else fall
    if difference > limit:
        return value + limit
    if difference < -limit:
        return value - limit
    return goal


@njit(cache=True, nogil=True)
def _held(p, s, towards):  # type: ignore[no-untyped-def]
    """Whether an active limit switch forbids this direction (sign of ``towards``)."""
    held = False
    if p[P_LIMIT_STOPS] == LIMIT_HOLDS:
        signals = int(s[S_SIGNALS])
        held = (towards > 0.0 and signals & SIG_POSITIVE != 0) or (
            towards < 0.0 and signals & SIG_NEGATIVE != 0
        )
    if held and s[S_LIMIT_HELD] == 0.0:
        _event(s, EV_LIMIT)
    s[S_LIMIT_HELD] = 1.0 if held else 0.0
    return held


@njit(cache=True, nogil=True)
def _generate_position(p, s):  # type: ignore[no-untyped-def]
    speed = s[S_V_DEMAND]
    if p[P_STOPPING] > 0.0:
        new = _approach(speed, 0.0, 0.0, p[P_STOP_DEC] * STEP_S)
    elif _held(p, s, p[P_TARGET] - s[S_P_DEMAND]):
        new = _approach(speed, 0.0, 0.0, p[P_LIMIT_DEC] * STEP_S)
        if new == 0.0:
            p[P_TARGET] = s[S_P_DEMAND]  # what lies behind the switch is given up
    else:
        distance = p[P_TARGET] - s[S_P_DEMAND]
        fall = p[P_DEC] * STEP_S
        half = 0.5 * fall
        allowed = math.sqrt(half * half + 2.0 * p[P_DEC] * abs(distance)) - half
        goal = math.copysign(min(p[P_V_MAX], allowed), distance)
        new = _approach(speed, goal, p[P_ACC] * STEP_S, fall * 1.0001)
        if new * distance >= 0.0 and abs(new) * STEP_S >= abs(distance) and abs(new) <= 2.0 * fall:
            new = 0.0
            s[S_P_DEMAND] = p[P_TARGET]
            if s[S_ARRIVED] == 0.0:
                s[S_ARRIVED] = 1.0
                _event(s, EV_ARRIVED)
    s[S_P_DEMAND] += new * STEP_S
    s[S_A_DEMAND] = (new - speed) / STEP_S
    s[S_V_DEMAND] = new


@njit(cache=True, nogil=True)
def _generate_velocity(p, s):  # type: ignore[no-untyped-def]
    speed = s[S_V_DEMAND]
    if p[P_STOPPING] > 0.0:
        new = _approach(speed, 0.0, 0.0, p[P_STOP_DEC] * STEP_S)
    elif _held(p, s, p[P_V_TARGET]):
        new = _approach(speed, 0.0, 0.0, p[P_LIMIT_DEC] * STEP_S)
    else:
        new = _approach(speed, p[P_V_TARGET], p[P_ACC] * STEP_S, p[P_DEC] * STEP_S)
        s[S_ARRIVED] = 1.0 if new == p[P_V_TARGET] else 0.0
    s[S_A_DEMAND] = (new - speed) / STEP_S
    s[S_V_DEMAND] = new
    s[S_P_DEMAND] = s[S_THETA]


@njit(cache=True, nogil=True)
def _generate_cyclic(p, s):  # type: ignore[no-untyped-def]
    speed = s[S_V_DEMAND]
    loop = int(p[P_LOOP])
    held = False
    if p[P_LIMIT_STOPS] == LIMIT_HOLDS:
        towards = s[S_IP_POSITION_INC] if loop == LOOP_POSITION else s[S_IP_SPEED]
        if loop in (LOOP_TORQUE, LOOP_IMPEDANCE):
            towards = s[S_IP_TORQUE] if s[S_OMEGA] * s[S_IP_TORQUE] >= 0.0 else 0.0
        held = _held(p, s, towards)
    if held and loop == LOOP_POSITION:
        s[S_IP_LEFT] = 0.0
        s[S_V_DEMAND] = 0.0
    elif s[S_IP_LEFT] > 0.0:
        s[S_IP_LEFT] -= 1.0
        s[S_IP_POSITION] += s[S_IP_POSITION_INC]
        s[S_IP_SPEED] += s[S_IP_SPEED_INC]
        s[S_IP_TORQUE] += s[S_IP_TORQUE_INC]
        if loop == LOOP_POSITION:
            s[S_V_DEMAND] = s[S_IP_POSITION_INC] / STEP_S
    elif loop == LOOP_POSITION:
        s[S_V_DEMAND] = 0.0
    if loop == LOOP_POSITION:
        s[S_P_DEMAND] = s[S_IP_POSITION]
        s[S_T_DEMAND] = 0.0
    elif loop == LOOP_SPEED:
        s[S_V_DEMAND] = 0.0 if held else s[S_IP_SPEED]
        s[S_P_DEMAND] = s[S_THETA]
        s[S_T_DEMAND] = 0.0
    else:
        s[S_V_DEMAND] = s[S_OMEGA]
        s[S_P_DEMAND] = s[S_IP_POSITION] if loop == LOOP_IMPEDANCE else s[S_THETA]
        s[S_T_DEMAND] = 0.0 if held else s[S_IP_TORQUE]
    s[S_A_DEMAND] = (s[S_V_DEMAND] - speed) / STEP_S
    s[S_ARRIVED] = 1.0


@njit(cache=True, nogil=True)
def _generate(p, s):  # type: ignore[no-untyped-def]
    kind = int(p[P_GEN])
    if kind == GEN_POSITION:
        _generate_position(p, s)
    elif kind == GEN_VELOCITY:
        _generate_velocity(p, s)
    elif kind == GEN_CYCLIC:
        _generate_cyclic(p, s)
    elif kind in (GEN_TORQUE, GEN_TORQUE_STOP):
        if kind == GEN_TORQUE:
            goal = 0.0 if p[P_STOPPING] > 0.0 else p[P_T_TARGET]
            if _held(p, s, goal):
                goal = 0.0
            slope = p[P_T_SLOPE] * STEP_S
            s[S_T_DEMAND] += _clamp(goal - s[S_T_DEMAND], -slope, slope)
            s[S_ARRIVED] = 1.0 if s[S_T_DEMAND] == goal else 0.0
        else:
            # The speed controller against zero speed, limited to the braking torque: it does not
            # overshoot as a constant torque would.
            limit = p[P_STOP_TORQUE]
            s[S_T_DEMAND] = _clamp(-p[P_KP_SPEED_1] * s[S_OMEGA], -limit, limit)
        s[S_V_DEMAND] = s[S_OMEGA]
        s[S_A_DEMAND] = 0.0
        s[S_P_DEMAND] = s[S_THETA]
    else:
        s[S_P_DEMAND] = s[S_THETA]
        s[S_V_DEMAND] = 0.0
        s[S_A_DEMAND] = 0.0
        s[S_T_DEMAND] = 0.0
    if p[P_STOPPING] > 0.0 and s[S_STOPPED] == 0.0:
        ramped = kind in (GEN_TORQUE, GEN_TORQUE_STOP) or s[S_V_DEMAND] == 0.0
        if ramped and abs(s[S_OMEGA]) <= p[P_STOP_SPEED]:
            s[S_STOPPED] = 1.0
            _event(s, EV_STOPPED)


@njit(cache=True, nogil=True)
def _switch_measure(s, kind):  # type: ignore[no-untyped-def]
    """The quantity that a gain switching condition compares with its level, SI units."""
    error = abs(s[S_P_DEMAND] - s[S_THETA])
    if kind == SWITCH_TORQUE:
        return abs(s[S_TORQUE_COMMAND])
    if kind == SWITCH_SPEED_DEMAND:
        return abs(s[S_V_DEMAND])
    if kind == SWITCH_SPEED:
        return abs(s[S_OMEGA])
    if kind == SWITCH_ACCELERATION:
        return abs(s[S_A_DEMAND])
    if kind == SWITCH_ERROR:
        return error
    if kind == SWITCH_COMMANDED_OR_FAST and s[S_V_DEMAND] == 0.0:
        return abs(s[S_OMEGA])
    return 0.0


@njit(cache=True, nogil=True)
def _select_gains(p, s, loop):  # type: ignore[no-untyped-def]
    """Share of the second gains, 0 to 1.

    To the second gains at once above level + hysteresis, back when the quantity has been below
    level − hysteresis for the delay.
    """
    kind = int(p[P_SWITCH_KIND])
    goal = s[S_SECOND_GAINS]
    if kind == SWITCH_OFF:
        goal = 0.0
    elif kind == SWITCH_SMALL_ERROR:
        error = abs(s[S_P_DEMAND] - s[S_THETA_FILTERED])
        goal = 1.0 if loop == LOOP_POSITION and error < p[P_SWITCH_LEVEL] else 0.0
    else:
        if kind == SWITCH_INPUT:
            on = p[P_SWITCH_INPUT] > 0.0
            off = not on
        elif kind in (SWITCH_COMMANDED, SWITCH_UNFINISHED) or (
            kind == SWITCH_COMMANDED_OR_FAST and s[S_V_DEMAND] != 0.0
        ):
            on = s[S_V_DEMAND] != 0.0
            if kind == SWITCH_UNFINISHED:
                on = on or abs(s[S_P_DEMAND] - s[S_THETA]) > p[P_POSITION_WINDOW]
            off = not on
        else:
            measure = _switch_measure(s, kind)
            on = measure > p[P_SWITCH_LEVEL] + p[P_SWITCH_HYSTERESIS]
            off = measure < max(p[P_SWITCH_LEVEL] - p[P_SWITCH_HYSTERESIS], 1e-9)
        s[S_SWITCH_T] = s[S_SWITCH_T] + STEP_S if off else 0.0
        if on:
            goal = 1.0
        elif off and s[S_SWITCH_T] >= p[P_SWITCH_DELAY]:
            goal = 0.0
    s[S_SECOND_GAINS] = goal
    rate = STEP_S / max(p[P_SWITCH_TIME], STEP_S)
    s[S_GAIN_MIX] = _clamp(goal, s[S_GAIN_MIX] - rate, s[S_GAIN_MIX] + rate)
    return s[S_GAIN_MIX]


@njit(cache=True, nogil=True)
def _third_share(p, s, loop):  # type: ignore[no-untyped-def]
    """Share of the third gains, 0 to 1: they hold an axis whose command has come to rest."""
    resting = loop == LOOP_POSITION and s[S_V_DEMAND] == 0.0
    s[S_REST_T] = s[S_REST_T] + STEP_S if resting else 0.0
    on = p[P_THIRD_GAINS] > 0.0 and resting and s[S_REST_T] >= p[P_THIRD_DELAY]
    rate = STEP_S / max(p[P_SWITCH_TIME], STEP_S)
    share = _clamp(1.0 if on else 0.0, s[S_THIRD_MIX] - rate, s[S_THIRD_MIX] + rate)
    s[S_THIRD_MIX] = share
    return share


@njit(cache=True, nogil=True)
def _shape(p, s):  # type: ignore[no-untyped-def]
    """What a notch (s² + ω²)/(s² + 2ζωs + ω²) takes from the demanded position, and its rate.

    The part taken is 2ζω/(s² + 2ζωs + ω²) of the demanded speed, so that a constant position
    passes unchanged and the swing of a load at ω is not excited.
    """
    if p[P_SHAPE_ON] == 0.0:
        s[S_SHAPE] = 0.0
        s[S_SHAPE_RATE] = 0.0
        return
    taken, rate, speed = s[S_SHAPE], s[S_SHAPE_RATE], s[S_V_DEMAND]
    s[S_SHAPE] = p[P_SHAPE_A11] * taken + p[P_SHAPE_A12] * rate + p[P_SHAPE_B1] * speed
    s[S_SHAPE_RATE] = p[P_SHAPE_A21] * taken + p[P_SHAPE_A22] * rate + p[P_SHAPE_B2] * speed


@njit(cache=True, nogil=True)
def _quadrant_compensation(p, s):  # type: ignore[no-untyped-def]
    """Torque after the demand has turned round: late, filtered, and over a length of travel."""
    sign = 1.0 if s[S_V_DEMAND] > 0.0 else -1.0 if s[S_V_DEMAND] < 0.0 else 0.0
    if sign != 0.0 and sign != s[S_QUADRANT_SIGN]:
        turned = s[S_QUADRANT_SIGN] != 0.0
        s[S_QUADRANT_SIGN] = sign
        s[S_QUADRANT_T] = 0.0 if turned else -1.0  # setting off is no turn
        s[S_QUADRANT_FROM] = s[S_P_DEMAND]
    if s[S_QUADRANT_T] >= 0.0:
        s[S_QUADRANT_T] += STEP_S
    near = abs(s[S_P_DEMAND] - s[S_QUADRANT_FROM]) < p[P_QUADRANT_ANGLE]
    goal = 0.0
    if near and s[S_QUADRANT_T] > p[P_QUADRANT_DELAY]:
        positive = s[S_QUADRANT_SIGN] > 0.0
        goal = p[P_QUADRANT_POSITIVE] if positive else -p[P_QUADRANT_NEGATIVE]
    s[S_QUADRANT] += p[P_QUADRANT_FILTER] * (goal - s[S_QUADRANT])
    return s[S_QUADRANT]


@njit(cache=True, nogil=True)
def _friction_compensation(p, s):  # type: ignore[no-untyped-def]
    """Torque that the drive adds for friction by the direction of the demand, and its bias."""
    torque = p[P_TORQUE_BIAS] + p[P_FRICTION_VISCOUS] * s[S_V_DEMAND]
    torque += _quadrant_compensation(p, s)
    if s[S_V_DEMAND] > 0.0:
        torque += p[P_FRICTION_POSITIVE]
    elif s[S_V_DEMAND] < 0.0:
        torque -= p[P_FRICTION_NEGATIVE]
    return torque


@njit(cache=True, nogil=True)
def _speed_controller(p, s, reference, mix, third):  # type: ignore[no-untyped-def]
    """PI controller with torque feed-forward; returns the torque and the integral's increment."""
    kp = p[P_KP_SPEED_1] + mix * (p[P_KP_SPEED_2] - p[P_KP_SPEED_1])
    kp += third * (p[P_KP_SPEED_3] - kp)
    ki = p[P_KI_SPEED_1] + mix * (p[P_KI_SPEED_2] - p[P_KI_SPEED_1])
    ki += third * (p[P_KI_SPEED_3] - ki)
    error = reference - s[S_OMEGA]
    limit = p[P_SPEED_OUT_LIMIT]
    torque = _clamp(kp * error + s[S_INTEGRAL], -limit, limit)
    wanted = p[P_FF_TORQUE] * s[S_A_DEMAND]
    s[S_FF_TORQUE] += p[P_FF_TORQUE_COEFFICIENT] * (wanted - s[S_FF_TORQUE])
    increment = ki * error * STEP_S
    if abs(torque) >= limit and increment * torque > 0.0:
        increment = 0.0
    return torque + s[S_FF_TORQUE], increment


@njit(cache=True, nogil=True)
def _impedance(p, s):  # type: ignore[no-untyped-def]
    """Impedance controller of figure 53 (004:4548-4565)."""
    error = s[S_IP_POSITION] - s[S_THETA]
    s[S_Z_SPEED] += p[P_Z_FILTER] * (s[S_IP_SPEED] - s[S_OMEGA] - s[S_Z_SPEED])
    limit = p[P_Z_LIMIT]
    s[S_Z_INTEGRAL] = _clamp(s[S_Z_INTEGRAL] + p[P_Z_KI] * error * STEP_S, -limit, limit)
    torque = p[P_Z_KP] * error + s[S_Z_INTEGRAL] + p[P_Z_KD] * s[S_Z_SPEED]
    return _clamp(torque, -limit, limit) + s[S_T_DEMAND]


@njit(cache=True, nogil=True)
def _control(p, s):  # type: ignore[no-untyped-def]
    loop = int(p[P_LOOP])
    if loop == LOOP_OFF:
        s[S_INTEGRAL] = 0.0
        s[S_FF_SPEED] = 0.0
        s[S_FF_TORQUE] = 0.0
        # Dynamic braking: the shorted windings brake in proportion to the speed.
        s[S_TORQUE_COMMAND] = -p[P_DYNAMIC_BRAKE] * s[S_OMEGA]
        s[S_SATURATED] = 0.0
        s[S_TORQUE_FILTERED] = 0.0
        s[S_SPEED_REFERENCE] = s[S_OMEGA]
        s[S_SHAPE] = 0.0
        s[S_SHAPE_RATE] = 0.0
        s[S_QUADRANT] = 0.0
        s[S_QUADRANT_SIGN] = 0.0
        for i in range(8):
            s[S_NOTCHES + i] = 0.0
        return
    increment = 0.0
    s[S_SPEED_LIMITED] = 0.0
    if loop in (LOOP_POSITION, LOOP_SPEED):
        mix = _select_gains(p, s, loop)
        third = _third_share(p, s, loop)
        reference = s[S_V_DEMAND]
        if loop == LOOP_POSITION:
            _shape(p, s)
            error = s[S_P_DEMAND] - s[S_SHAPE] - s[S_THETA_FILTERED]
            kp = p[P_KP_POSITION_1] + mix * (p[P_KP_POSITION_2] - p[P_KP_POSITION_1])
            kp += third * (p[P_KP_POSITION_3] - kp)
            wanted = p[P_FF_SPEED] * (s[S_V_DEMAND] - s[S_SHAPE_RATE])
            s[S_FF_SPEED] += p[P_FF_SPEED_COEFFICIENT] * (wanted - s[S_FF_SPEED])
            limit = p[P_POSITION_OUT_LIMIT]
            reference = _clamp(kp * error, -limit, limit) + s[S_FF_SPEED]
            if int(p[P_GEN]) == GEN_CYCLIC:
                reference += s[S_IP_SPEED]
        else:
            s[S_SHAPE] = 0.0
            s[S_SHAPE_RATE] = 0.0
        limited = _clamp(reference, -p[P_MAX_SPEED], p[P_MAX_SPEED])
        s[S_SPEED_LIMITED] = 0.0 if limited == reference else 1.0
        s[S_SPEED_REFERENCE] = limited
        torque, increment = _speed_controller(p, s, limited, mix, third)
        torque += _friction_compensation(p, s)
        if int(p[P_GEN]) == GEN_CYCLIC:
            torque += s[S_IP_TORQUE]
    else:
        s[S_INTEGRAL] = 0.0
        s[S_SPEED_REFERENCE] = s[S_OMEGA]
        torque = s[S_T_DEMAND] if loop == LOOP_TORQUE else _impedance(p, s)
        limit = p[P_TORQUE_SPEED_LIMIT]
        upper = p[P_KP_SPEED_1] * (limit - s[S_OMEGA])
        lower = p[P_KP_SPEED_1] * (-limit - s[S_OMEGA])
        if torque > upper or torque < lower:
            s[S_SPEED_LIMITED] = 1.0
            torque = _clamp(torque, lower, upper)

    share = s[S_GAIN_MIX]
    lag = p[P_TORQUE_FILTER] + share * (p[P_TORQUE_FILTER_2] - p[P_TORQUE_FILTER])
    s[S_TORQUE_FILTERED] += lag * (torque - s[S_TORQUE_FILTERED])
    torque = s[S_TORQUE_FILTERED]
    for i in range(int(p[P_NOTCH_COUNT])):
        c, z = P_NOTCHES + 4 * i, S_NOTCHES + 2 * i
        out = torque + s[z]
        s[z] = p[c] * torque - p[c + 2] * out + s[z + 1]
        s[z + 1] = p[c + 1] * torque - p[c + 3] * out
        torque = out
    # The voltage that the bus leaves over limits the current at speed.
    emf = p[P_KT] * s[S_OMEGA] / 3.0
    room = s[S_VOLTAGE] * p[P_POWER_LIMIT_V]
    high = min(p[P_T_MAX], max(0.0, (room - emf) / p[P_RESISTANCE]) * p[P_KT])
    low = max(p[P_T_MIN], -max(0.0, (room + emf) / p[P_RESISTANCE]) * p[P_KT])
    command = _clamp(torque, low, high)
    s[S_SATURATED] = 0.0 if command == torque else 1.0
    if command == torque or increment * (torque - command) < 0.0:
        s[S_INTEGRAL] += increment
    s[S_TORQUE_COMMAND] = command


@njit(cache=True, nogil=True)
def _behind(x, size):  # type: ignore[no-untyped-def]
    """Angle of the last inertia of the chain, in rad."""
    behind = x[0]
    for i in range(3, size, 2):
        behind -= x[i]
    return behind


@njit(cache=True, nogil=True)
def _pull(p, x, size):  # type: ignore[no-untyped-def]
    """What the load takes of the last inertia: its weight, by its place, and as a fan does."""
    pull = p[P_GRAVITY]
    if p[P_PLACE_NM] != 0.0:
        angle = _behind(x, size) - p[P_PLACE_AT]
        pull += p[P_PLACE_NM] * math.sin(p[P_PLACE_PER_RAD] * angle)
    if p[P_FAN] != 0.0:
        speed = x[size - 1] if size > 3 else x[1]
        pull += p[P_FAN] * speed * abs(speed)
    return pull


@njit(cache=True, nogil=True)
def _beyond(p, x, size):  # type: ignore[no-untyped-def]
    """How far the last inertia is beyond an end stop, signed."""
    behind = _behind(x, size)
    if behind > p[P_STOP_MAX]:
        return behind - p[P_STOP_MAX]
    if behind < p[P_STOP_MIN]:
        return behind - p[P_STOP_MIN]
    return 0.0


@njit(cache=True, nogil=True)
def _step_plant(p, s, x, a, b, gap_state, half_gap, scratch):  # type: ignore[no-untyped-def]
    """One exact step of the linear chain, then friction and end stops on the velocity level."""
    size = x.shape[0]
    contact = 0
    for g in range(gap_state.shape[0]):
        if abs(x[gap_state[g]]) >= half_gap[g]:
            contact |= 1 << g
    am, bm = a[contact], b[contact]
    pull = _pull(p, x, size)
    for i in range(size):
        total = bm[i, 0] * s[S_TORQUE_COMMAND] - bm[i, 2] * pull
        for j in range(size):
            total += am[i, j] * x[j]
        for g in range(gap_state.shape[0]):
            if contact >> g & 1:
                total += bm[i, 3 + g] * (1.0 if x[gap_state[g]] > 0.0 else -1.0)
        scratch[i] = total
    coulomb = p[P_COULOMB]
    if p[P_STICTION] > 0.0:
        slow = x[1] / p[P_STRIBECK]
        coulomb += p[P_STICTION] * math.exp(-slow * slow)
    if int(p[P_LOOP]) == LOOP_OFF or p[P_BRAKE_CLOSED] > 0.0:
        coulomb += p[P_BRAKE_TORQUE]
    friction = 0.0
    if coulomb > 0.0:
        needed = -scratch[1] / bm[1, 1]
        friction = _clamp(needed, -coulomb, coulomb)
        for i in range(size):
            scratch[i] += bm[i, 1] * friction
        if friction == needed:
            scratch[1] = 0.0
            if x[1] == 0.0:
                scratch[0] = x[0]
    last = size - 1 if size > 3 else 1
    beyond = _beyond(p, scratch, size)
    if beyond * scratch[last] > 0.0:
        push = -scratch[last] / bm[last, 2]
        for i in range(size):
            scratch[i] += bm[i, 2] * push
        scratch[last] = 0.0
        # What the push over the step did not take back is taken back as an inelastic impact.
        beyond = _beyond(p, scratch, size)
        if size > 3:
            scratch[size - 2] += beyond
        else:
            scratch[0] -= beyond
    for i in range(size):
        x[i] = scratch[i]
    s[S_TORQUE] = x[2]


@njit(cache=True, nogil=True)
def _supply(p, s, x):  # type: ignore[no-untyped-def]
    """DC bus, braking resistor, heat and load ratio."""
    current = s[S_TORQUE] / p[P_KT]
    s[S_CURRENT] = current
    copper = 3.0 * p[P_RESISTANCE] * current * current
    # Without the power stage nothing comes to the bus: shorted windings burn the energy themselves.
    power = s[S_TORQUE] * x[1] + copper if int(p[P_LOOP]) != LOOP_OFF else 0.0
    s[S_UQ] = p[P_RESISTANCE] * current + p[P_KT] * x[1] / 3.0
    volts = s[S_VOLTAGE]
    if volts >= p[P_BRAKE_ON_V]:
        s[S_BRAKE_ON] = 1.0
    elif volts <= p[P_BRAKE_OFF_V]:
        s[S_BRAKE_ON] = 0.0
    chopper = s[S_BRAKE_ON] * p[P_BRAKE_ENABLED]
    drain = power / max(volts, 5.0) + chopper * volts / p[P_BRAKE_R]
    c = p[P_SUPPLY_C]
    # Implicit in the supply's resistance, which is much faster than one step.
    fed = (volts + STEP_S / c * (p[P_SUPPLY_V] / p[P_SUPPLY_R] - drain)) / (
        1.0 + STEP_S / (c * p[P_SUPPLY_R])
    )
    if fed > p[P_SUPPLY_V] and p[P_SUPPLY_SINKS] == 0.0:
        fed = max(volts - STEP_S / c * drain, min(fed, p[P_SUPPLY_V]))
    s[S_VOLTAGE] = max(fed, 0.0)
    s[S_BRAKE_DUTY] += (chopper - s[S_BRAKE_DUTY]) * STEP_S / 0.1
    heat = p[P_AMBIENT] + copper * p[P_THERMAL_K_PER_W]
    s[S_TEMPERATURE] += (heat - s[S_TEMPERATURE]) * STEP_S / p[P_THERMAL_S]
    ratio = abs(s[S_TORQUE]) / p[P_RATED_NM]
    s[S_LOAD_RATIO] += (ratio - s[S_LOAD_RATIO]) * STEP_S / p[P_LOAD_RATIO_S]


@njit(cache=True, nogil=True)
def _protect(p, s):  # type: ignore[no-untyped-def]
    faults = 0
    powered = int(p[P_LOOP]) != LOOP_OFF
    if powered and abs(s[S_CURRENT]) * 1.4142135623730951 > p[P_OCP_A]:
        faults |= F_OVER_CURRENT
    if s[S_VOLTAGE] < p[P_UVLO_V]:
        faults |= F_UNDER_VOLTAGE
    if s[S_VOLTAGE] > p[P_OVP_V]:
        faults |= F_OVER_VOLTAGE
    if s[S_TEMPERATURE] > p[P_OTP_C]:
        faults |= F_OVER_TEMPERATURE
    if abs(s[S_OMEGA]) > p[P_OVER_SPEED]:
        faults |= F_OVER_SPEED
    torque = abs(s[S_TORQUE])
    s[S_OVERLOAD_T] = s[S_OVERLOAD_T] + STEP_S if torque > p[P_OVERLOAD_NM] else 0.0
    if s[S_OVERLOAD_T] > p[P_OVERLOAD_S]:
        faults |= F_OVERLOAD
    share = torque / p[P_I2T_RATED_NM]
    s[S_I2T] = max(0.0, s[S_I2T] + (share * share - 1.0) * STEP_S)
    if s[S_I2T] > p[P_I2T_LIMIT]:
        faults |= F_OVERLOAD
    loop = int(p[P_LOOP])
    closed = loop in (LOOP_POSITION, LOOP_SPEED)
    away = closed and abs(s[S_SPEED_REFERENCE] - s[S_OMEGA]) > p[P_SPEED_ERROR]
    s[S_SPEED_ERROR_T] = s[S_SPEED_ERROR_T] + STEP_S if away else 0.0
    if s[S_SPEED_ERROR_T] > p[P_SPEED_ERROR_S]:
        faults |= F_SPEED_ERROR
    if loop == LOOP_POSITION and s[S_FOLLOWING_T] > p[P_FOLLOWING_S]:
        faults |= F_FOLLOWING
    pushing = closed and powered and torque > p[P_LOCK_NM]
    if pushing and loop == LOOP_POSITION:
        goal = p[P_TARGET] if int(p[P_GEN]) == GEN_POSITION else s[S_P_DEMAND]
        pushing = abs(goal - s[S_THETA]) > p[P_LOCK_ANGLE]
    if pushing and abs(s[S_THETA] - s[S_LOCK_ANCHOR]) < p[P_LOCK_ANGLE]:
        s[S_LOCK_T] += STEP_S
    else:
        s[S_LOCK_T] = 0.0
        s[S_LOCK_ANCHOR] = s[S_THETA]
    if s[S_LOCK_T] > p[P_LOCK_S]:
        faults |= F_LOCKED
    signals = int(s[S_SIGNALS])
    into = 0.0
    if signals & SIG_NEGATIVE and s[S_OMEGA] < -p[P_STOP_SPEED]:
        into = 1.0
    if signals & SIG_POSITIVE and s[S_OMEGA] > p[P_STOP_SPEED]:
        into = 1.0
    s[S_LIMIT_ACTIVE] = into
    if into > 0.0 and powered and p[P_LIMIT_STOPS] == LIMIT_FAULT:
        faults |= F_POSITION_LIMIT
    before = int(s[S_FAULTS])
    if faults & ~before:
        s[S_FAULTS] = float(before | faults)
        _event(s, EV_FAULT)


@njit(cache=True, nogil=True)
def _monitor(p, s):  # type: ignore[no-untyped-def]
    error = abs(s[S_P_DEMAND] - s[S_THETA])
    arrived = s[S_ARRIVED] > 0.0
    near = arrived and error <= p[P_POSITION_WINDOW]
    s[S_POSITION_T] = s[S_POSITION_T] + STEP_S if near else 0.0
    near = arrived and abs(s[S_V_DEMAND] - s[S_OMEGA]) <= p[P_SPEED_WINDOW]
    s[S_SPEED_T] = s[S_SPEED_T] + STEP_S if near else 0.0
    slow = abs(s[S_OMEGA]) <= p[P_ZERO_SPEED]
    s[S_ZERO_T] = s[S_ZERO_T] + STEP_S if slow else 0.0
    s[S_FOLLOWING_T] = s[S_FOLLOWING_T] + STEP_S if error > p[P_FOLLOWING_WINDOW] else 0.0
    if p[P_STALL_NM] > 0.0:
        stalled = abs(s[S_TORQUE]) >= p[P_STALL_NM] and abs(s[S_OMEGA]) < p[P_STALL_SPEED]
        s[S_STALL_T] = s[S_STALL_T] + STEP_S if stalled else 0.0
        if s[S_STALL_T] > p[P_STALL_S]:
            _event(s, EV_STALL)
    if s[S_STEP] >= p[P_ALARM_STEP]:
        _event(s, EV_ALARM_CLOCK)


@njit(cache=True, nogil=True)
def run(  # type: ignore[no-untyped-def]
    steps, p, s, x, a, b, gap_state, half_gap, scratch, random
):
    """Advance by up to ``steps``; ends early after a step that raised a masked event.

    The caller clears S_EVENTS. Shapes: p [P_SIZE], s [S_SIZE], x and scratch [n],
    a [c, n, n], b [c, n, 3 + g],
    gap_state and half_gap [g], random [1] uint64 (never zero). Returns the steps done.
    """
    for k in range(steps):
        _generate(p, s)
        _control(p, s)
        _step_plant(p, s, x, a, b, gap_state, half_gap, scratch)
        _supply(p, s, x)
        _measure(p, s, x, random)
        _protect(p, s)
        s[S_TRACE + int(s[S_STEP]) % TRACE_STEPS] = s[S_TORQUE_COMMAND]
        s[S_STEP] += 1.0
        _monitor(p, s)
        if int(s[S_EVENTS]) & int(p[P_EVENT_MASK]):
            return k + 1
        s[S_EVENTS] = 0.0
    return steps
