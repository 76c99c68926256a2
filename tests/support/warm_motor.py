"""A motor that becomes warm as its physics have it, for what is computed from a catalogue alone.

Four bodies (slots, end windings, iron, frame) instead of the two that the product assumes; copper
of 0.393 %/K; convection that grows with the rise to the power of 1.25; iron losses with the speed
to the power of 1.5; a torque constant that falls with the current (saturation). Rated torque and
time constant are measured on it as a maker does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

FloatArray = npt.NDArray[np.float64]
#: Rise of the end winding at rated torque, in K (class F next to 40 °C, with a reserve).
RATED_RISE_K = 105.0
_COPPER = 0.00393


@dataclass(frozen=True)
class WarmMotor:
    """Conductances in W/K, heat capacities in J/K; losses at rated load in W."""

    slot_to_iron: float = 4.0
    ends_to_slot: float = 5.0
    ends_to_frame: float = 0.8
    iron_to_frame: float = 9.0
    capacities: tuple[float, float, float, float] = (90.0, 60.0, 500.0, 900.0)
    iron_share: float = 0.2
    saturation: float = 0.02

    def current(self, torque: FloatArray) -> FloatArray:
        """Per unit, at this torque per unit of rated."""
        size = np.abs(torque)
        return size * (1.0 + self.saturation * np.maximum(size - 1.0, 0.0))

    def rates(
        self,
        rise: FloatArray,
        copper: float,
        iron: float,
        ambient_c: float,
        losses: float,
        air: float,
    ) -> FloatArray:
        """K/s of each body; ``copper`` is current², ``losses`` the rated ones in W."""
        slot, ends, core, frame = rise
        at_rated = 1.0 + _COPPER * (RATED_RISE_K + 40.0 - 20.0)
        resistance = [
            (1.0 + _COPPER * (each + ambient_c - 20.0)) / at_rated for each in (slot, ends)
        ]
        of_copper = (1.0 - self.iron_share) * losses * copper
        heat_slot = 0.6 * of_copper * resistance[0]
        heat_ends = 0.4 * of_copper * resistance[1]
        to_iron = self.slot_to_iron * (slot - core)
        to_slot = self.ends_to_slot * (ends - slot)
        across = self.ends_to_frame * (ends - frame)
        to_frame = self.iron_to_frame * (core - frame)
        away = air * frame * max(frame, 1e-6) ** 0.25
        flows = np.array(
            [
                heat_slot + to_slot - to_iron,
                heat_ends - to_slot - across,
                self.iron_share * losses * iron + to_iron - to_frame,
                to_frame + across - away,
            ]
        )
        return np.asarray(flows / np.array(self.capacities))

    def calibrated(self, losses: float) -> float:
        """Convection at which the rated load ends at the rated rise of the end winding."""

        def beyond(air: float) -> float:
            ended = self.course(losses, air, 1.0, 1.0, 40.0, 1e6)
            return float(ended[1][1, -1]) - RATED_RISE_K

        return float(brentq(beyond, 0.02 * losses / 60.0, 5.0 * losses / 60.0, xtol=1e-6))

    def course(
        self,
        losses: float,
        air: float,
        copper: float,
        iron: float,
        ambient_c: float,
        until_s: float,
    ) -> tuple[FloatArray, FloatArray]:
        """Times and rises [4, n] from cold under constant losses."""
        done = solve_ivp(
            lambda _t, rise: self.rates(rise, copper, iron, ambient_c, losses, air),
            (0.0, until_s),
            np.zeros(4),
            method="LSODA",
            rtol=1e-6,
            atol=1e-6,
        )
        return done.t, done.y

    def time_constant_s(self, losses: float, air: float) -> float:
        """As catalogues state it: 63.2 % of the final rise, under the rated losses."""
        times, rises = self.course(losses, air, 1.0, 1.0, 40.0, 40_000.0)
        reached = rises[1] / rises[1, -1]
        return float(np.interp(1.0 - np.exp(-1.0), reached, times))

    def too_warm_s(
        self,
        losses: float,
        air: float,
        torque: FloatArray,
        speed_ratio: FloatArray,
        ambient_c: float = 40.0,
    ) -> float | None:
        """When the end winding exceeds its temperature at rated load; the cycle is short."""
        copper = float(np.mean(self.current(torque) ** 2))
        iron = float(np.mean(np.abs(speed_ratio) ** 1.5))
        limit = RATED_RISE_K + 40.0 - ambient_c
        times, rises = self.course(losses, air, copper, iron, ambient_c, 60_000.0)
        over = np.flatnonzero(rises[1] >= limit)
        if not over.size:
            return None
        first = int(over[0])
        return float(
            np.interp(limit, rises[1, first - 1 : first + 1], times[first - 1 : first + 1])
        )
