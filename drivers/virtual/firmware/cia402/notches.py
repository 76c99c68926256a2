"""Notches of the families that represent them as frequency, width and depth."""

from __future__ import annotations

import math

from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.objects.dictionary import ObjectDictionary
from drivers.virtual.firmware.objects.settings import Biquad, notch_biquad
from profiles.schema import NotchSlot, Profile


def notches_of(profile: Profile, od: ObjectDictionary) -> tuple[Biquad, ...]:
    """Return the enabled notches, at most four."""
    spec = profile.notch
    if spec is None:
        return ()
    found = (_notch(profile, od, spec.encoding, slot) for slot in spec.slots)
    return tuple(notch for notch in found if notch is not None)[:4]


def _notch(profile: Profile, od: ObjectDictionary, encoding: str, slot: NotchSlot) -> Biquad | None:
    def value(key: str | None) -> float:
        parameter = profile.by_key.get(key or "")
        return 0.0 if parameter is None else float(parameter.to_value(od.number(parameter.key)))

    if slot.enable_key is not None:
        flags = int(od.number(slot.enable_key))
        on = flags if slot.enable_bit is None else flags >> slot.enable_bit & 1
        if not on:
            return None
    centre, width, depth = (
        value(slot.frequency_key),
        value(slot.width_key),
        value(slot.depth_key),
    )
    if encoding == "hz_levels":
        # No formula is printed: width level/20 of the centre, depth level in percent of the
        # remaining amplitude (0 is deepest). The default, the highest frequency, is off.
        frequency = profile.by_key[slot.frequency_key or ""]
        if od.number(frequency.key) == frequency.default_raw:
            return None
        width, depth = centre * max(width, 1) / 20, 20 * math.log10(max(depth, 1) / 100)
    elif encoding == "hz_width":
        depth = -40.0
    if not 0 < centre < 0.4 / k.STEP_S or width <= 0:
        return None
    return notch_biquad(centre, width, -abs(depth), k.STEP_S)
