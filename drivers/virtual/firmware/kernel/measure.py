"""Measurements of the drive: encoder, feedback filters (004:3262-3282) and switches."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.kernel.basics import raise_event
from drivers.virtual.firmware.kernel.rough_torque import interpolation_error


@njit(nogil=True)
def _normal(s, random):  # type: ignore[no-untyped-def]
    """Return a standard normal number (Marsaglia's polar method, xorshift64*), one spare kept."""
    if s[k.S_HAS_SPARE] > 0.0:
        s[k.S_HAS_SPARE] = 0.0
        return s[k.S_SPARE_NORMAL]
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
            s[k.S_SPARE_NORMAL] = v * factor
            s[k.S_HAS_SPARE] = 1.0
            return u * factor


@njit(nogil=True)
def measure(p, s, x, random):  # type: ignore[no-untyped-def]
    """Update encoder, feedback filters and switches."""
    shaft = (x[0] + interpolation_error(p, x[0])) * p[k.P_ENCODER_SENSE]
    counts = shaft * p[k.P_COUNTS_PER_RAD]
    if p[k.P_NOISE] > 0.0:
        counts += p[k.P_NOISE] * _normal(s, random)
    theta = math.floor(counts) / p[k.P_COUNTS_PER_RAD]
    if p[k.P_ENCODER_DEAD] > 0.0:
        theta = s[k.S_THETA]
        if not int(s[k.S_FAULTS]) & k.F_SENSOR:
            s[k.S_FAULTS] = float(int(s[k.S_FAULTS]) | k.F_SENSOR)
            raise_event(s, k.EV_FAULT)
    raw = (theta - s[k.S_THETA]) / k.STEP_S
    s[k.S_THETA] = theta
    s[k.S_OMEGA_RAW] = raw
    # A tracking low-pass: the filter lags accelerations, not constant speed.
    predicted = s[k.S_THETA_FILTERED] + s[k.S_OMEGA_LOW] * k.STEP_S
    s[k.S_THETA_FILTERED] = predicted + p[k.P_POSITION_FILTER] * (theta - predicted)
    s[k.S_OMEGA_LOW] += p[k.P_SPEED_FILTER] * (raw - s[k.S_OMEGA_LOW])
    observed = s[k.S_OMEGA_OBSERVED]
    friction = 0.0
    if observed > 0.1:
        friction = p[k.P_OBSERVER_COULOMB]
    elif observed < -0.1:
        friction = -p[k.P_OBSERVER_COULOMB]
    drive = (s[k.S_TORQUE] - p[k.P_OBSERVER_VISCOUS] * observed - friction) / p[
        k.P_OBSERVER_INERTIA
    ]
    observed += drive * k.STEP_S
    s[k.S_OMEGA_OBSERVED] = observed + p[k.P_OBSERVER_GAIN] * (raw - observed)
    s[k.S_OMEGA] = s[k.S_OMEGA_OBSERVED] if p[k.P_SPEED_SOURCE] > 0.5 else s[k.S_OMEGA_LOW]

    signals = 0
    if x[0] <= p[k.P_LIMIT_NEGATIVE]:
        signals |= k.SIG_NEGATIVE
    if x[0] >= p[k.P_LIMIT_POSITIVE]:
        signals |= k.SIG_POSITIVE
    if p[k.P_HOME_FROM] <= x[0] <= p[k.P_HOME_TO]:
        signals |= k.SIG_HOME
    signals ^= int(p[k.P_SIGNAL_INVERTED])
    forced = int(p[k.P_SIGNAL_FORCED])
    signals = (signals & ~forced) | (int(p[k.P_SIGNAL_FORCED_ON]) & forced)
    s[k.S_SIGNALS] = float(signals)
    watched = int(p[k.P_WATCH_MASK])
    if watched and (signals & watched) != int(p[k.P_WATCH_VALUE]):
        raise_event(s, k.EV_SIGNAL)
    turn = math.floor(x[0] / p[k.P_INDEX_RAD])
    if turn != s[k.S_INDEX_COUNT]:
        s[k.S_INDEX_ANGLE] = max(turn, s[k.S_INDEX_COUNT]) * p[k.P_INDEX_RAD]
        s[k.S_INDEX_COUNT] = turn
        raise_event(s, k.EV_INDEX)
