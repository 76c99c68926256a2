"""What the machine on a virtual drive's shaft is made of, as read from TOML.

All quantities are at the motor shaft. Positive torque turns towards positive positions.
"""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field, model_validator


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class MotorSpec(_Part):
    """The motor: rotor inertia and the rating that torque in ‰ refers to."""

    inertia_kgm2: float = Field(gt=0)
    rated_torque_nm: float = Field(gt=0)
    rated_speed_rpm: float = Field(gt=0)
    brake: bool = False
    """A holding brake of twice the rated torque is mounted."""


class FrictionSpec(_Part):
    """Friction at the motor shaft and a constant torque on the last inertia of the chain.

    The motor holds the load with ``+gravity_nm``: the load itself pulls to negative positions.
    """

    viscous_nms: float = Field(default=0.0, ge=0)
    coulomb_nm: float = Field(default=0.0, ge=0)
    gravity_nm: float = 0.0


class EncoderSpec(_Part):
    """Motor encoder; noise is the standard deviation of white Gaussian noise in counts."""

    counts_per_rev: int = Field(default=2**23, ge=16)
    noise_counts: float = Field(default=0.0, ge=0)


class TravelSpec(_Part):
    """Mechanical end stops of the last inertia, in motor revolutions from the start position."""

    min_rev: float = -math.inf
    max_rev: float = math.inf

    @model_validator(mode="after")
    def _in_order(self) -> TravelSpec:
        if not (self.min_rev < self.max_rev and self.min_rev <= 0 <= self.max_rev):
            raise ValueError(
                f"travel: the start position 0 must lie between min_rev {self.min_rev} and "
                f"max_rev {self.max_rev}, and there must be room between them"
            )
        return self


class SwitchSpec(_Part):
    """Positions of the switches, in motor revolutions from the start position.

    Limit switches default to 0.25 revolutions before the end stops. The home switch is a cam
    that is active from ``home_from_rev`` to ``home_to_rev``; either end may be infinite.
    """

    negative_limit_rev: float | None = None
    positive_limit_rev: float | None = None
    home_from_rev: float = 0.2
    home_to_rev: float = 0.7


class SupplySpec(_Part):
    """The DC supply. One that cannot sink lets regeneration raise the bus voltage."""

    voltage_v: float = Field(default=48.0, gt=0)
    resistance_ohm: float = Field(default=0.05, gt=0)
    capacitance_f: float = Field(default=1e-3, gt=0)
    sinks: bool = True
    ambient_c: float = 25.0


class LoadSpec(_Part):
    """One more inertia, hung on the one before by a spring with damping and maybe backlash.

    ``backlash_rad`` is the whole width of the gap.
    """

    inertia_kgm2: float = Field(gt=0)
    stiffness_nm_per_rad: float = Field(gt=0)
    damping_nms_per_rad: float = Field(default=0.0, ge=0)
    backlash_rad: float = Field(default=0.0, ge=0)


class MechanicsSpec(_Part):
    """A motor, what hangs on it, and what it hangs on."""

    motor: MotorSpec
    friction: FrictionSpec = FrictionSpec()
    encoder: EncoderSpec = EncoderSpec()
    travel: TravelSpec = TravelSpec()
    switches: SwitchSpec = SwitchSpec()
    supply: SupplySpec = SupplySpec()
    load: tuple[LoadSpec, ...] = ()

    @model_validator(mode="after")
    def _backlash_count(self) -> MechanicsSpec:
        if sum(load.backlash_rad > 0 for load in self.load) > 3:
            raise ValueError("load: at most three couplings of a chain may have backlash")
        return self

    @property
    def total_inertia_kgm2(self) -> float:
        """Motor and all loads, as seen below the first resonance."""
        return self.motor.inertia_kgm2 + sum(load.inertia_kgm2 for load in self.load)

    @property
    def limit_switches_rev(self) -> tuple[float, float]:
        """Where the negative and the positive limit switch trip, motor revolutions."""
        negative, positive = self.switches.negative_limit_rev, self.switches.positive_limit_rev
        return (
            self.travel.min_rev + 0.25 if negative is None else negative,
            self.travel.max_rev - 0.25 if positive is None else positive,
        )


def load_mechanics(path: Path) -> MechanicsSpec:
    """Read a mechanics file.

    Raises:
        OSError: it cannot be read.
        ValueError: not TOML, or a field is missing, unknown or out of range (named).
    """
    return MechanicsSpec.model_validate(tomllib.loads(path.read_text("utf-8")))


def standard_mechanics() -> MechanicsSpec:
    """A 400 W motor with a rigid load of twice its inertia and a little friction."""
    return MechanicsSpec(
        motor=MotorSpec(inertia_kgm2=5e-5, rated_torque_nm=1.27, rated_speed_rpm=3000),
        friction=FrictionSpec(viscous_nms=2e-4, coulomb_nm=0.03),
        load=(LoadSpec(inertia_kgm2=1e-4, stiffness_nm_per_rad=2000, damping_nms_per_rad=0.02),),
    )
