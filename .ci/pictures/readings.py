"""Figures of a run: the value as it was measured, and the text that pages quote.

The virtual drives have noise, so the last digits of a measurement differ between runs. Each figure
is quoted with as many digits as repeat.
"""

from __future__ import annotations

import math
from typing import Any

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def rounded(value: float, digits: int) -> str:
    """A value with so many significant digits; small ones with a power of ten.

    Raises:
        ValueError: the value is not finite.
    """
    if not math.isfinite(value):
        raise ValueError(f"{value} is no figure")
    if value == 0:
        return "0"
    exponent = math.floor(math.log10(abs(float(f"{value:.{digits - 1}e}"))))
    if exponent < -3:
        return f"{value / 10.0**exponent:.{digits - 1}f}·10{str(exponent).translate(_RAISED)}"
    shown = round(value, digits - 1 - exponent)
    return f"{shown:.{max(digits - 1 - exponent, 0)}f}".replace("-", "−")


class Readings:
    """Figures by name."""

    def __init__(self) -> None:
        self.figures: dict[str, dict[str, Any]] = {}

    def add(self, name: str, value: float, unit: str, digits: int) -> None:
        """A figure with its unit; ``digits``: the significant ones that repeat.

        Raises:
            ValueError: the name is there already, or the value is not finite.
        """
        if name in self.figures:
            raise ValueError(f"two figures {name}")
        self.figures[name] = {"value": value, "unit": unit, "text": rounded(value, digits)}
