"""Conversion between units of parameters and SI units."""

from __future__ import annotations

import math
import re

from drivers.virtual.firmware.cia402.base import RPM

TWO_PI = 2 * math.pi
MS = 1e-3


def per_rad_s(unit: str, position_per_rad: float) -> float:
    """Return raw units per rad/s (or rad/s²) of ``inc/s``, ``rpm``, ``0.1 rpm``, ``rpm/s``."""
    match = re.match(r"\s*([\d.]*)\s*(rpm|r/min)", unit)
    if match is None:
        return position_per_rad
    return 1 / RPM / float(match.group(1) or 1)


def volt_factor(unit: str) -> float:
    """Return raw units of a voltage per volt."""
    return 1e3 if unit == "mV" else 1.0


def si_factor(unit: str) -> float:
    """Return engineering units per SI unit for the ratings that profiles print."""
    return {
        "mNm": 1e3, "Nm": 1.0, "mA": 1e3, "A": 1.0, "rpm": 1.0, "kg·m²": 1.0, "g·cm²": 1e7,
        "kg·cm²": 1e4, "1e-7 kg·m²": 1e7,
    }.get(unit, 1.0)  # fmt: skip
