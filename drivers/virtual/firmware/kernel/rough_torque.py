"""Non-ideal torque path and machine of the 50 µs loop (`drivers.virtual.mechanics.rough`)."""

from __future__ import annotations

import math

from numba import njit

from drivers.virtual.firmware.kernel import layout as k


@njit(nogil=True)
def rough_command(p, s):  # type: ignore[no-untyped-def]
    """Compute the power stage's actual torque from the torque command of the loops."""
    if p[k.P_ROUGH_ON] == 0.0 or int(p[k.P_LOOP]) == k.LOOP_OFF:
        s[k.S_ROUGH_DEMAND] = s[k.S_TORQUE_COMMAND]
        return
    period = p[k.P_ROUGH_PERIOD]
    s[k.S_ROUGH_CLOCK] += 1.0
    if s[k.S_ROUGH_CLOCK] >= period:
        s[k.S_ROUGH_CLOCK] -= period
        s[k.S_ROUGH_HELD] = s[k.S_TORQUE_COMMAND]
    # Half a period more, as the speed's difference is calculated over one period.
    late = int(0.5 * (period - 1.0) + 0.5)
    step = int(s[k.S_STEP])
    s[k.S_ROUGH_RING + step % k.ROUGH_STEPS] = s[k.S_ROUGH_HELD]
    torque = s[k.S_ROUGH_RING + (step - late) % k.ROUGH_STEPS]
    s[k.S_ROUGH_DEMAND] = torque
    s[k.S_ROUGH_LAGGED] += p[k.P_ROUGH_LAG] * (torque - s[k.S_ROUGH_LAGGED])
    torque = s[k.S_ROUGH_LAGGED]
    if s[k.S_STEP] % p[k.P_ROUGH_DIP_EVERY] < p[k.P_ROUGH_DIP_STEPS]:
        torque *= 1.0 - p[k.P_ROUGH_DIP_SHARE]
    s[k.S_TORQUE_COMMAND] = torque * p[k.P_ROUGH_CONSTANT]


@njit(nogil=True)
def _dahl(state, omega, limit, rest):  # type: ignore[no-untyped-def]
    """Return the next torque of Dahl's friction: a spring of ``limit``/``rest`` that yields."""
    if limit <= 0.0:
        return 0.0
    sign = 1.0 if omega > 0.0 else -1.0
    state += omega * k.STEP_S * limit / rest * (1.0 - state / limit * sign)
    return min(max(state, -limit), limit)


@njit(nogil=True)
def rough_machine(p, s, x, b):  # type: ignore[no-untyped-def]
    """Apply torques to motor and last inertia for one step, from the state before it."""
    if p[k.P_ROUGH_ON] == 0.0:
        return
    size = x.shape[0]
    angle, omega = x[0], x[1]
    s[k.S_ROUGH_FRICTION] = _dahl(
        s[k.S_ROUGH_FRICTION], omega, p[k.P_ROUGH_COULOMB], p[k.P_ROUGH_PRESLIDING]
    )
    s[k.S_ROUGH_DRAG] = _dahl(s[k.S_ROUGH_DRAG], omega, p[k.P_ROUGH_DRAG], p[k.P_ROUGH_DRAG_RAD])
    motor = -s[k.S_ROUGH_FRICTION] - s[k.S_ROUGH_DRAG]
    motor -= p[k.P_ROUGH_COG] * math.sin(p[k.P_ROUGH_COG_PER_REV] * angle)
    if p[k.P_ROUGH_INERTIA] > 0.0:
        # d(Jω)/dt of an inertia that depends on the position, by the acceleration of the last step.
        per = p[k.P_ROUGH_INERTIA_PER_REV]
        motor -= p[k.P_ROUGH_INERTIA] * math.sin(per * angle) * s[k.S_ROUGH_ALPHA]
        motor -= 0.5 * p[k.P_ROUGH_INERTIA] * per * math.cos(per * angle) * omega * omega
    last = 0.0
    if size > 3 and p[k.P_ROUGH_STIFFNESS] > 0.0:
        twist = p[k.P_ROUGH_STIFFNESS] * math.sin(p[k.P_ROUGH_STIFF_PER_REV] * angle) * x[3]
        motor -= twist
        # What the motor takes the first load gets.
        if size == 5:
            last = twist
        else:
            x[4] += k.STEP_S / p[k.P_ROUGH_FIRST_INERTIA] * twist
    for i in range(size):
        x[i] += b[0, i, 1] * motor + b[0, i, 2] * last
    if size > 3:
        x[3] -= p[k.P_ROUGH_SLIP] * k.STEP_S * x[3]


@njit(nogil=True)
def rough_report(p, s, x, omega_before):  # type: ignore[no-untyped-def]
    """Update 6077h as the drive reports it, and the acceleration of this step."""
    s[k.S_ROUGH_ALPHA] = (x[1] - omega_before) / k.STEP_S
    if p[k.P_ROUGH_ON] == 0.0:
        s[k.S_TORQUE_REPORTED] = s[k.S_TORQUE]
        return
    torque = s[k.S_TORQUE] / p[k.P_ROUGH_CONSTANT]
    if p[k.P_ROUGH_COPY] > 0.0:
        torque = s[k.S_ROUGH_DEMAND]
    s[k.S_TORQUE_REPORTED] += p[k.P_ROUGH_REPORT_LAG] * (torque - s[k.S_TORQUE_REPORTED])


@njit(nogil=True)
def interpolation_error(p, angle):  # type: ignore[no-untyped-def]
    """Return the encoder's interpolation error at this angle [rad]."""
    if p[k.P_ROUGH_ON] == 0.0:
        return 0.0
    return p[k.P_ROUGH_INTERPOLATION] * math.sin(p[k.P_ROUGH_INTERPOLATION_PER_REV] * angle)
