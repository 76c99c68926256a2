"""One step of the mechanics: the exact linear chain, then friction and end stops.

Friction is time-stepping on the velocity level (J. J. Moreau, "Unilateral contact and dry friction
in finite freedom dynamics", 1988): the friction torque of a step is the one that ends it at
standstill, limited to the Coulomb torque, so that nothing chatters.
"""

from __future__ import annotations

import math

from numba import njit

from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.kernel.basics import clamp


@njit(nogil=True)
def _behind(x, size):  # type: ignore[no-untyped-def]
    """Return the angle of the last inertia of the chain [rad]."""
    behind = x[0]
    for i in range(3, size, 2):
        behind -= x[i]
    return behind


@njit(nogil=True)
def pull(p, x, size):  # type: ignore[no-untyped-def]
    """Return the load torque on the last inertia: gravity, position-dependent, and fan."""
    torque = p[k.P_GRAVITY]
    if p[k.P_PLACE_NM] != 0.0:
        angle = _behind(x, size) - p[k.P_PLACE_AT]
        torque += p[k.P_PLACE_NM] * math.sin(p[k.P_PLACE_PER_RAD] * angle)
    if p[k.P_FAN] != 0.0:
        speed = x[size - 1] if size > 3 else x[1]
        torque += p[k.P_FAN] * speed * abs(speed)
    return torque


@njit(nogil=True)
def beyond(p, x, size):  # type: ignore[no-untyped-def]
    """Return how far the last inertia is beyond an end stop, signed."""
    behind = _behind(x, size)
    if behind > p[k.P_STOP_MAX]:
        return behind - p[k.P_STOP_MAX]
    if behind < p[k.P_STOP_MIN]:
        return behind - p[k.P_STOP_MIN]
    return 0.0


@njit(nogil=True)
def _stribeck(p, omega):  # type: ignore[no-untyped-def]
    """Return the friction above Coulomb's at this speed."""
    slow = abs(omega) / p[k.P_STRIBECK]
    if p[k.P_STRIBECK_TANH] > 0.0:
        return p[k.P_STICTION] * (1.0 - math.tanh(slow))
    return p[k.P_STICTION] * math.exp(-slow * slow)


@njit(nogil=True)
def _ripple(p, angle):  # type: ignore[no-untyped-def]
    """Return the periodic torque that the motor must produce at this angle."""
    at, cogging = p[k.P_RIPPLE_PHASE], p[k.P_RIPPLE_COGGING_PER_REV]
    torque = p[k.P_RIPPLE_REVOLUTION] * math.sin(angle + at)
    torque += p[k.P_RIPPLE_POLE_PAIR] * math.sin(p[k.P_RIPPLE_POLE_PAIRS] * angle + at)
    torque += p[k.P_RIPPLE_COGGING] * math.sin(cogging * angle + at)
    return torque + p[k.P_RIPPLE_COGGING_SECOND] * math.sin(2.0 * cogging * angle + at)


@njit(nogil=True)
def _torque_share(p, angle):  # type: ignore[no-untyped-def]
    """Return the torque of a wrongly phased motor relative to that of a correct one.

    The field is at ±(p·θc + 90°) + an angle (minus: two phases exchanged), θc being the angle used
    for commutation; the torque is the sine of the electrical angle from rotor to field.
    """
    pairs = p[k.P_POLE_PAIRS]
    commutates = pairs * p[k.P_COMMUTATION_SENSE] * angle + 0.5 * math.pi
    return math.sin(p[k.P_FIELD_SENSE] * commutates + p[k.P_FIELD_ANGLE] - pairs * angle)


@njit(nogil=True)
def _grip(p, s, angle, speed):  # type: ignore[no-untyped-def]
    """Return the torque of a closed brake: elastic hub, slipping at its holding torque."""
    most, stiffness = p[k.P_BRAKE_TORQUE], p[k.P_BRAKE_STIFFNESS]
    give = most / stiffness
    twist = angle - s[k.S_BRAKE_ANCHOR]
    if abs(twist) > give:
        s[k.S_BRAKE_ANCHOR] = angle - math.copysign(give, twist)
        return math.copysign(most, twist)
    return clamp(stiffness * twist + p[k.P_BRAKE_DAMPING] * speed, -most, most)


@njit(nogil=True)
def _gripped(p):  # type: ignore[no-untyped-def]
    """Return whether a holding brake would be closed."""
    return int(p[k.P_LOOP]) == k.LOOP_OFF or p[k.P_BRAKE_CLOSED] > 0.0


@njit(nogil=True)
def _elastic(p):  # type: ignore[no-untyped-def]
    """Return whether there is a brake with an elastic hub."""
    return p[k.P_BRAKE_STIFFNESS] > 0.0 and p[k.P_BRAKE_TORQUE] > 0.0


@njit(nogil=True)
def opposing(p, s, x):  # type: ignore[no-untyped-def]
    """Return the motor's torque demand besides its load: ripple, wrong phases, elastic brake."""
    torque = _ripple(p, x[0])
    # Shorted windings brake without commutation, so that it cannot be wrong.
    if p[k.P_PHASES_WRONG] > 0.0 and int(p[k.P_LOOP]) != k.LOOP_OFF:
        torque += (1.0 - _torque_share(p, x[0])) * x[2]
    if _gripped(p) and _elastic(p):
        torque += _grip(p, s, x[0], x[1])
    else:
        s[k.S_BRAKE_ANCHOR] = x[0]
    return torque


@njit(nogil=True)
def dry_friction(p, x):  # type: ignore[no-untyped-def]
    """Return the maximum dry friction at the motor, including a rigid brake."""
    coulomb = p[k.P_COULOMB]
    if p[k.P_STICTION] > 0.0:
        coulomb += _stribeck(p, x[1])
    if _gripped(p) and not _elastic(p):
        coulomb += p[k.P_BRAKE_TORQUE]
    return coulomb


@njit(nogil=True)
def _load_friction(p, x, scratch, b, last):  # type: ignore[no-untyped-def]
    """Apply dry friction of the last inertia, by the same rule as the motor's."""
    most = p[k.P_LOAD_COULOMB]
    needed = -scratch[last] / b[last, 2]
    friction = clamp(needed, -most, most)
    for i in range(x.shape[0]):
        scratch[i] += b[i, 2] * friction
    if friction == needed:
        scratch[last] = 0.0


@njit(nogil=True)
def step_plant(p, s, x, a, b, gap_state, half_gap, scratch):  # type: ignore[no-untyped-def]
    """Do one exact step of the linear chain, then friction and end stops on the velocity level."""
    size = x.shape[0]
    contact = 0
    for g in range(gap_state.shape[0]):
        if abs(x[gap_state[g]]) >= half_gap[g]:
            contact |= 1 << g
    am, bm = a[contact], b[contact]
    load = pull(p, x, size)
    motor = opposing(p, s, x)
    for i in range(size):
        total = bm[i, 0] * s[k.S_TORQUE_COMMAND] - bm[i, 1] * motor - bm[i, 2] * load
        for j in range(size):
            total += am[i, j] * x[j]
        for g in range(gap_state.shape[0]):
            if contact >> g & 1:
                total += bm[i, 3 + g] * (1.0 if x[gap_state[g]] > 0.0 else -1.0)
        scratch[i] = total
    coulomb = dry_friction(p, x)
    friction = 0.0
    if coulomb > 0.0:
        needed = -scratch[1] / bm[1, 1]
        friction = clamp(needed, -coulomb, coulomb)
        for i in range(size):
            scratch[i] += bm[i, 1] * friction
        if friction == needed:
            scratch[1] = 0.0
            if x[1] == 0.0:
                scratch[0] = x[0]
    last = size - 1 if size > 3 else 1
    if p[k.P_LOAD_COULOMB] > 0.0 and size > 3:
        _load_friction(p, x, scratch, bm, last)
    over = beyond(p, scratch, size)
    if over * scratch[last] > 0.0:
        push = -scratch[last] / bm[last, 2]
        for i in range(size):
            scratch[i] += bm[i, 2] * push
        scratch[last] = 0.0
        # The remaining penetration is removed as an inelastic impact.
        over = beyond(p, scratch, size)
        if size > 3:
            scratch[size - 2] += over
        else:
            scratch[0] -= over
    for i in range(size):
        x[i] = scratch[i]
    s[k.S_TORQUE] = x[2]
