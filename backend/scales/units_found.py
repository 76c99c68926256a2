"""What a measured factor between 606Ch and 6064h most likely is, as a unit that drives have."""

from __future__ import annotations

#: A measured factor this near to a usual unit is that unit.
_NEAR = 0.03
_TENS = (1.0, 10.0, 100.0, 1000.0, 10_000.0)


def nearest_unit(raw_per_inc_s: float, counts_per_rev: float) -> tuple[float, str]:
    """Raw 606Ch per rpm, and the name of its unit: that measured, or a usual one that is near.

    ``raw_per_inc_s`` is raw 606Ch per increment per second, as `compare.measured_scale` finds it.
    """
    per_rpm = raw_per_inc_s * counts_per_rev / 60.0
    usual = [(counts_per_rev / 60.0, "inc/s")]
    usual += [(ten, "rpm" if ten == 1.0 else f"{1 / ten:g} rpm") for ten in _TENS]
    for candidate, name in usual:
        if abs(per_rpm - candidate) <= _NEAR * candidate:
            return candidate, name
    return per_rpm, f"{1 / per_rpm:.4g} rpm"
