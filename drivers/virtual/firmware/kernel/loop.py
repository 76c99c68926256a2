"""One compiled function that advances an axis by many steps without the interpreter lock.

A step is demand, control, plant, supply, measurement, protections. All data are in flat float64
arrays: parameters and state as in `layout`, and the chain's state ``x`` with its exact
discretisation ``a``, ``b`` (`drivers.virtual.mechanics.chain`).
"""

from __future__ import annotations

import hashlib
from pathlib import Path

from numba import njit

from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.kernel.control import control
from drivers.virtual.firmware.kernel.generate import generate
from drivers.virtual.firmware.kernel.measure import measure
from drivers.virtual.firmware.kernel.plant import step_plant
from drivers.virtual.firmware.kernel.protect import monitor, protect
from drivers.virtual.firmware.kernel.rough_torque import (
    rough_command,
    rough_machine,
    rough_report,
)
from drivers.virtual.firmware.kernel.supply import supply


def sources(folder: Path) -> str:
    """Return a digest of all sources of `run`: the Python files of this folder.

    Raises:
        OSError: they cannot be read.
    """
    digest = hashlib.sha256()
    for file in sorted(folder.glob("*.py")):
        text = file.read_bytes()
        digest.update(f"{file.name} {len(text)}\n".encode() + text)
    return digest.hexdigest()


def compiled(source_digest: str):  # type: ignore[no-untyped-def]
    """Return `run`, cached on disk between starts for exactly these sources.

    numba detects changes in this file alone, yet the machine code contains every part of the loop
    and every index of the layout. Variables in a function's closure are part of its key on disk,
    which is the purpose of the digest. The parts themselves are not cached, so none can be out of
    date.
    """

    @njit(cache=True, nogil=True)
    def run(  # type: ignore[no-untyped-def]
        steps, p, s, x, a, b, gap_state, half_gap, scratch, random
    ):
        """Advance by up to ``steps``; end early after a step that raised a masked event.

        The caller clears S_EVENTS. Shapes: p [P_SIZE], s [S_SIZE], x and scratch [n], a [c, n, n],
        b [c, n, 3 + g], gap_state and half_gap [g], random [1] uint64 (never zero). Returns the
        steps done.
        """
        _ = source_digest
        for done in range(steps):
            if s[k.S_ROUGH_WAIT] > 0.0:
                s[k.S_ROUGH_WAIT] -= 1.0
            else:
                generate(p, s)
            control(p, s)
            rough_command(p, s)
            omega = x[1]
            rough_machine(p, s, x, b)
            step_plant(p, s, x, a, b, gap_state, half_gap, scratch)
            rough_report(p, s, x, omega)
            supply(p, s, x)
            measure(p, s, x, random)
            protect(p, s)
            s[k.S_TRACE + int(s[k.S_STEP]) % k.TRACE_STEPS] = s[k.S_TORQUE_COMMAND]
            s[k.S_STEP] += 1.0
            monitor(p, s)
            if int(s[k.S_EVENTS]) & int(p[k.P_EVENT_MASK]):
                return done + 1
            s[k.S_EVENTS] = 0.0
        return steps

    return run


run = compiled(sources(Path(__file__).parent))
