"""Braking energy and the braking resistor for it, in SI units, without I/O.

Equations 9, 11 and 12 of manual 004 (004:2250 to 004:2300), the energy balance of braking: energy
that the capacitors of the DC bus cannot store must be dissipated by the resistor.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from drivers.errors import OutOfRange


@dataclass(frozen=True, slots=True)
class BrakingCycle:
    """A braking cycle.

    ``inertia_kgm2``: motor and load together, at the motor's shaft. ``efficiency``: share of the
    kinetic energy that returns to the drive (1 is the safe assumption). ``fall_energy_j``:
    additional energy that a vertical axis returns in one cycle.
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
    """A braking resistor: its resistance and its continuous power."""

    resistance_ohm: float
    power_w: float


@dataclass(frozen=True, slots=True)
class BrakingLimits:
    """Capabilities and limits of the drive; None where the manual does not state them."""

    capacitor_j: float = 0.0
    built_in: Resistor | None = None
    min_external_ohm: float | None = None
    max_external_w: float | None = None
    on_voltage_v: float | None = None


Verdict = Literal["capacitor", "built_in", "external", "beyond", "unknown"]


@dataclass(frozen=True, slots=True)
class BrakingResult:
    """Energies of one stop in J, powers in W, resistances in Ω.

    ``verdict``: the capacitors suffice; the built-in resistor suffices; an external one is needed
    (``external_w``, ``min_ohm``, ``max_ohm``); more than the drive permits; or no limit is known.
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
    """Energy and power of a cycle, compared with the limits of the drive.

    The largest resistance still dissipates the peak power at the threshold voltage, V²/R ≥ P.

    Raises:
        OutOfRange: the stops take longer than the cycle.
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
        # Power that the resistor cannot dissipate at the threshold raises the bus voltage further.
        if volts is None or peak_w <= volts**2 / built_in.resistance_ohm:
            return "built_in"
    if limits.max_external_w is not None:
        together = limits.max_external_w + (built_in.power_w if built_in else 0.0)
        return "external" if average_w <= together else "beyond"
    known = built_in is not None or limits.min_external_ohm is not None
    return "external" if known else "unknown"
