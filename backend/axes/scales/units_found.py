"""The usual unit of 606Ch that matches a measured factor between 606Ch and 6064h."""

from __future__ import annotations

#: Relative tolerance within which a measured factor matches a usual unit, as the cycles of a busy
#: computer are not equally long. Where two usual units match, only one within the smaller
#: tolerance counts.
_NEAR, _MUCH_NEARER = 0.12, 0.02
_TENS = (1.0, 10.0, 100.0, 1000.0, 10_000.0)


def nearest_unit(raw_per_inc_s: float, counts_per_rev: float) -> tuple[float, str] | None:
    """Raw 606Ch per rpm and the name of its unit, where exactly one usual unit matches; else None.

    ``raw_per_inc_s``: raw 606Ch per increment per second, as `compare.measured_scale` returns it.
    Any other factor is not a usual unit: a person states it from the data sheet.
    """
    per_rpm = raw_per_inc_s * counts_per_rev / 60.0
    usual = [(counts_per_rev / 60.0, "inc/s")]
    usual += [(ten, "rpm" if ten == 1.0 else f"{1 / ten:g} rpm") for ten in _TENS]
    for most in (_NEAR, _MUCH_NEARER):
        near = [unit for unit in usual if abs(per_rpm - unit[0]) <= most * unit[0]]
        if len(near) == 1:
            return near[0]
    return None
