"""Braking energy and the resistor that must take it: pure, in SI units.

Equations 9, 11 and 12 of manual 004 (004:2250 to 004:2300), which are the energy balance of a mass
that is braked: what the capacitors of the DC bus do not take up must go into the resistor.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from drivers.errors import OutOfRange


@dataclass(frozen=True, slots=True)
class BrakingCycle:
    """What is braked, how hard and how often.

    ``inertia_kgm2`` is that of motor and load together at the motor's shaft. ``efficiency`` is
    the part of the kinetic energy that comes back to the drive (1 is the safe assumption).
    ``fall_energy_j`` is what a vertical axis gives back in one cycle besides.
    """

    inertia_kgm2: float
    speed_rpm: float
    deceleration_s: float
    cycle_s: float
    stops_per_cycle: float = 2.0
    efficiency: float = 1.0
    fall_energy_j: float = 0.0


@dataclass(frozen=True, slots=True)
class Resistor:
    """A resistor: its value and the power it may dissipate for long."""

    resistance_ohm: float
    power_w: float


@dataclass(frozen=True, slots=True)
class BrakingLimits:
    """What the drive offers and allows; None where the manual prints nothing."""

    capacitor_j: float = 0.0
    built_in: Resistor | None = None
    min_external_ohm: float | None = None
    max_external_w: float | None = None
    on_voltage_v: float | None = None


Verdict = Literal["capacitor", "built_in", "external", "beyond", "unknown"]


@dataclass(frozen=True, slots=True)
class BrakingResult:
    """Energies of one stop in J, powers in W, resistances in Ω.

    ``verdict``: the capacitors are enough; the built-in resistor is; an external one is needed
    (``external_w`` and the range of ohms); more than the drive allows; or no limit is known.
    """

    kinetic_j: float
    returned_j: float
    excess_j: float
    average_w: float
    peak_w: float
    verdict: Verdict
    external_w: float | None
    min_ohm: float | None
    max_ohm: float | None
    possible: bool


def braking(cycle: BrakingCycle, limits: BrakingLimits) -> BrakingResult:
    """Energy and power of a cycle against the limits of the drive.

    The greatest resistance still passes the peak power at the threshold voltage, V²/R ≥ P.

    Raises:
        OutOfRange: the stops take longer than the cycle in which they are said to happen.
    """
    stopping_s = cycle.deceleration_s * cycle.stops_per_cycle
    if not stopping_s <= cycle.cycle_s:
        raise OutOfRange(
            "functions.stops-not-fit-cycle",
            value=stopping_s,
            limit=f"{cycle.cycle_s:g} s",
            stops_per_cycle=cycle.stops_per_cycle,
            deceleration_s=cycle.deceleration_s,
            cycle_s=cycle.cycle_s,
        )
    speed = cycle.speed_rpm * math.tau / 60.0
    kinetic = 0.5 * cycle.inertia_kgm2 * speed**2
    returned = kinetic * cycle.efficiency
    excess = max(0.0, returned - limits.capacitor_j)
    average = (excess * cycle.stops_per_cycle + cycle.fall_energy_j) / cycle.cycle_s
    # Torque times speed is greatest when braking begins: J·ω/t·ω, twice the mean.
    peak = 2.0 * returned / cycle.deceleration_s
    verdict = _verdict(average, peak, limits)
    needs = verdict in ("external", "beyond", "unknown") and average > 0
    volts = limits.on_voltage_v
    greatest = volts**2 / peak if volts and needs and peak > 0 else None
    least = limits.min_external_ohm if needs else None
    return BrakingResult(
        kinetic_j=kinetic,
        returned_j=returned,
        excess_j=excess,
        average_w=average,
        peak_w=peak,
        verdict=verdict,
        external_w=average if needs else None,
        min_ohm=least,
        max_ohm=greatest,
        possible=verdict != "beyond" and (least is None or greatest is None or least <= greatest),
    )


def _verdict(average_w: float, peak_w: float, limits: BrakingLimits) -> Verdict:
    if average_w <= 0:
        return "capacitor"
    built_in = limits.built_in
    if built_in is not None and average_w <= built_in.power_w:
        volts = limits.on_voltage_v
        # What the resistor cannot pass at the threshold raises the bus voltage further.
        if volts is None or peak_w <= volts**2 / built_in.resistance_ohm:
            return "built_in"
    if limits.max_external_w is not None:
        together = limits.max_external_w + (built_in.power_w if built_in else 0.0)
        return "external" if average_w <= together else "beyond"
    known = built_in is not None or limits.min_external_ohm is not None
    return "external" if known else "unknown"
