"""One step of two axes on one beam (`drivers.virtual.mechanics.gantry`), and the loop over them."""

from __future__ import annotations

from pathlib import Path

from numba import njit

from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.kernel.basics import clamp
from drivers.virtual.firmware.kernel.control import control
from drivers.virtual.firmware.kernel.generate import generate
from drivers.virtual.firmware.kernel.loop import sources
from drivers.virtual.firmware.kernel.measure import measure
from drivers.virtual.firmware.kernel.plant import beyond, dry_friction, opposing, pull
from drivers.virtual.firmware.kernel.protect import monitor, protect
from drivers.virtual.firmware.kernel.rough_torque import rough_command, rough_report
from drivers.virtual.firmware.kernel.supply import supply


@njit(nogil=True)
def _command(p, s):  # type: ignore[no-untyped-def]
    """Compute setpoints and loops of one drive."""
    if s[k.S_ROUGH_WAIT] > 0.0:
        s[k.S_ROUGH_WAIT] -= 1.0
    else:
        generate(p, s)
    control(p, s)
    rough_command(p, s)


@njit(nogil=True)
def _rub(p, x, at, b, column, scratch):  # type: ignore[no-untyped-def]
    """Apply dry friction of the motor whose states begin at ``at``, as for a single axis."""
    most = dry_friction(p, x[at : at + 3])
    if most <= 0.0:
        return
    needed = -scratch[at + 1] / b[at + 1, column]
    friction = clamp(needed, -most, most)
    for i in range(x.shape[0]):
        scratch[i] += b[i, column] * friction
    if friction == needed:
        scratch[at + 1] = 0.0
        if x[at + 1] == 0.0:
            scratch[at] = x[at]


@njit(nogil=True)
def _end_stop(p, at, b, column, scratch):  # type: ignore[no-untyped-def]
    """Apply an inelastic impact of the motor on the end of its travel."""
    over = beyond(p, scratch[at : at + 3], 3)
    if over * scratch[at + 1] > 0.0:
        push = -scratch[at + 1] / b[at + 1, column]
        for i in range(scratch.shape[0]):
            scratch[i] += b[i, column] * push
        scratch[at + 1] = 0.0
        scratch[at] -= beyond(p, scratch[at : at + 3], 3)


@njit(nogil=True)
def step_pair(p1, s1, p2, s2, x, a, b, scratch):  # type: ignore[no-untyped-def]
    """Do one exact step of both motors and the beam, then friction and end stops of each motor."""
    x1, x2 = x[0:3], x[3:6]
    m1 = -opposing(p1, s1, x1) - pull(p1, x1, 3)
    m2 = -opposing(p2, s2, x2) - pull(p2, x2, 3)
    for i in range(x.shape[0]):
        total = b[i, 0] * s1[k.S_TORQUE_COMMAND] + b[i, 1] * s2[k.S_TORQUE_COMMAND]
        total += b[i, 2] * m1 + b[i, 3] * m2 + b[i, 4]
        for j in range(x.shape[0]):
            total += a[i, j] * x[j]
        scratch[i] = total
    _rub(p1, x, 0, b, 2, scratch)
    _rub(p2, x, 3, b, 3, scratch)
    _end_stop(p1, 0, b, 2, scratch)
    _end_stop(p2, 3, b, 3, scratch)
    for i in range(x.shape[0]):
        x[i] = scratch[i]
    s1[k.S_TORQUE], s2[k.S_TORQUE] = x[2], x[5]


@njit(nogil=True)
def _finish(p, s, x, omega, random):  # type: ignore[no-untyped-def]
    """Update one drive after its step; return True if an event ends the run."""
    rough_report(p, s, x, omega)
    supply(p, s, x)
    measure(p, s, x, random)
    protect(p, s)
    s[k.S_TRACE + int(s[k.S_STEP]) % k.TRACE_STEPS] = s[k.S_TORQUE_COMMAND]
    s[k.S_STEP] += 1.0
    monitor(p, s)
    return int(s[k.S_EVENTS]) & int(p[k.P_EVENT_MASK]) != 0


def compiled(source_digest: str):  # type: ignore[no-untyped-def]
    """Return `run_pair`, cached on disk as `drivers.virtual.firmware.kernel.loop.run` is."""

    @njit(cache=True, nogil=True)
    def run_pair(  # type: ignore[no-untyped-def]
        steps, p1, s1, random1, p2, s2, random2, x, a, b, scratch
    ):
        """Advance both by up to ``steps``; end early after a step with a masked event of one.

        Shapes: as `run`, but x and scratch [10], a [10, 10], b [10, 5]. Returns the steps done.
        """
        _ = source_digest
        for done in range(steps):
            _command(p1, s1)
            _command(p2, s2)
            omega1, omega2 = x[1], x[4]
            step_pair(p1, s1, p2, s2, x, a, b, scratch)
            first = _finish(p1, s1, x[0:3], omega1, random1)
            second = _finish(p2, s2, x[3:6], omega2, random2)
            if first or second:
                return done + 1
            s1[k.S_EVENTS] = 0.0
            s2[k.S_EVENTS] = 0.0
        return steps

    return run_pair


run_pair = compiled(sources(Path(__file__).parent))
