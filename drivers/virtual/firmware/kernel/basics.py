"""Functions shared by the parts of the 50 µs loop."""

from __future__ import annotations

from numba import njit

from drivers.virtual.firmware.kernel import layout as k


@njit(nogil=True)
def clamp(value, low, high):  # type: ignore[no-untyped-def]
    """Return the value limited to the range from ``low`` to ``high``."""
    return low if value < low else high if value > high else value


@njit(nogil=True)
def raise_event(s, bit):  # type: ignore[no-untyped-def]
    """Record an event of this step; a masked one ends the run."""
    s[k.S_EVENTS] = float(int(s[k.S_EVENTS]) | bit)
