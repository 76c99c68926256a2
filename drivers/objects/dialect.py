"""The CiA 402 dialect of a family, read from its profile."""

from __future__ import annotations

from drivers.cia402 import QUICK_STOP, Dialect
from profiles.schema import Profile


def dialect_of(profile: Profile) -> Dialect:
    """Return the dialect that results from the quirks in the family's profile."""
    pause, stop = profile.quirk("enable_pause"), profile.quirk("quick_stop_word")
    return Dialect(
        echoes_control=profile.quirk("own_status_word") is not None,
        quick_stop=QUICK_STOP if stop is None or stop.raw is None else stop.raw,
        pause_s=(pause.milliseconds or 0.0) / 1e3 if pause is not None else 0.0,
    )
