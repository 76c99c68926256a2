"""Numbers formatted for people; a dash where there is none."""

from __future__ import annotations

import math
from collections.abc import Mapping
from datetime import UTC, datetime

NONE = "—"


def fixed(value: float | None, decimals: int, unit: str = "") -> str:
    """Number with fixed decimals, a true minus sign and its unit."""
    if value is None or not math.isfinite(value):
        return NONE
    text = f"{value:.{decimals}f}".replace("-", "−")
    return text if not unit else f"{text}{unit}" if unit == "°" else f"{text} {unit}"


def significant(value: float | None, unit: str = "", digits: int = 4) -> str:
    """Number with this many significant digits; powers of ten as 1.2e−4."""
    if value is None or not math.isfinite(value):
        return NONE
    text = f"{value:.{digits}g}".replace("-", "−")
    return f"{text} {unit}".rstrip()


def hertz(value: float | None) -> str:
    """Frequency in Hz or kHz."""
    if value is None or not math.isfinite(value):
        return NONE
    return significant(value / 1000, "kHz") if value >= 1000 else significant(value, "Hz")


def milliseconds(value_s: float | None) -> str:
    """Time in ms, from seconds."""
    return fixed(None if value_s is None else value_s * 1e3, 1, "ms")


def moment(value: datetime) -> str:
    """Date and time in UTC."""
    return f"{value.astimezone(UTC):%Y-%m-%d %H:%M:%S}"


def margin(margins: Mapping[str, bool | float | None], name: str) -> float | None:
    """Figure of a loop; None where it could not be read."""
    value = margins.get(name)
    return None if value is None or isinstance(value, bool) else float(value)
