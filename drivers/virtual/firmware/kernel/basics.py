"""What the parts of the 50 µs loop share."""

from __future__ import annotations

from numba import njit

from drivers.virtual.firmware.kernel import layout as k


@njit(nogil=True)
def clamp(value, low, high):  # type: ignore[no-untyped-def]
    """The value, or the bound that it is beyond."""
    return low if value < low else high if value > high else value


@njit(nogil=True)
def raise_event(s, bit):  # type: ignore[no-untyped-def]
    """Note an event of this step; a masked one ends the run."""
    s[k.S_EVENTS] = float(int(s[k.S_EVENTS]) | bit)
