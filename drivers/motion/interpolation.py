"""The interpolation period 60C2h, for every bus with a cycle."""

from __future__ import annotations

from drivers.errors import NotAllowed


def interpolation_period(cycle_ns: int) -> tuple[int, int]:
    """Return value and exponent for 60C2h (CiA 402-2 clause 12.5): value × 10^exponent seconds.

    Raises:
        NotAllowed: no such pair represents the cycle exactly.
    """
    for exponent in (-3, -4, -5, -6):
        unit_ns = 10 ** (9 + exponent)
        if cycle_ns % unit_ns == 0 and cycle_ns // unit_ns <= 255:
            return cycle_ns // unit_ns, exponent
    raise NotAllowed("cyclic.cycle-cannot-reported-drive", cycle_us=cycle_ns / 1000)
