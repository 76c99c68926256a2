"""Specification of the machine on a virtual drive's shaft, as read from TOML.

All quantities are at the motor shaft. Positive torque turns towards positive positions.
"""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from drivers.texts.message import Unsuitable, text
from drivers.virtual.mechanics.load_encoder import LoadEncoderSpec
from drivers.virtual.mechanics.rough import RoughTorqueSpec
from drivers.virtual.mechanics.rough_feedback import RoughFeedbackSpec

#: Servo motors produce three to three and a half times their rated torque for a short time.
_PEAK_PER_RATED = 3.5


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class _Finite(_Part):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class MotorSpec(_Finite):
    """The motor: rotor inertia and the rating to which torque in ‰ refers."""

    inertia_kgm2: float = Field(gt=0)
    rated_torque_nm: float = Field(gt=0)
    rated_speed_rpm: float = Field(gt=0)
    brake: bool = False
    """A holding brake is mounted."""
    brake_nm: float | None = Field(
        default=None, gt=0, description="slips at this torque; twice the rated one without it"
    )
    brake_windup_rad: float = Field(
        default=0.0, ge=0, le=0.2, description="twist of its hub at the torque that it slips at"
    )
    brake_output: bool = Field(
        default=False,
        description="its coil is on the drive's output for it, and has no current while no output "
        "has that function; else it follows the power stage",
    )
    brake_supplied: bool = Field(
        default=True, description="the supply of its coil is there; it never opens without"
    )


class FrictionSpec(_Finite):
    """Friction at the motor shaft, and torques on the last inertia of the chain.

    Friction begins at ``static_nm``, if that is more than ``coulomb_nm``, and falls to it within
    ``stribeck_rad_s`` (Stribeck's curve): by exp(-(ω/ω_s)²), or by 1 - tanh(ω/ω_s) if
    ``stribeck_law`` is "tanh". The motor holds the load with ``+gravity_nm``: the load itself pulls
    to negative positions. ``fan_nms2`` grows with the square of the speed, as the torque of a fan,
    a pump or a stirrer does.
    """

    viscous_nms: float = Field(default=0.0, ge=0)
    coulomb_nm: float = Field(default=0.0, ge=0)
    static_nm: float = Field(default=0.0, ge=0)
    stribeck_rad_s: float = Field(default=1.0, gt=0)
    stribeck_law: Literal["gaussian", "tanh"] = "gaussian"
    load_coulomb_nm: float = Field(
        default=0.0, ge=0, description="dry friction of the last inertia, behind the couplings"
    )
    gravity_nm: float = 0.0
    fan_nms2: float = Field(default=0.0, ge=0)


class PlaceSpec(_Finite):
    """A torque that depends on the position of the last inertia, signed as required of the motor.

    ``torque_nm`` · sin(2π (position − ``at_rev``) / ``period_rev``), positions in motor
    revolutions. A period of one revolution is a load out of balance on the shaft, a longer one an
    arm behind a gear, and one far longer than the travel a spring of 2π · ``torque_nm`` /
    ``period_rev`` per revolution.
    """

    torque_nm: float = 0.0
    period_rev: float = Field(default=1.0, gt=0)
    at_rev: float = 0.0


class RippleSpec(_Finite):
    """Periodic torque of the motor itself, signed as required of the motor, by its angle θ [rad].

    ``revolution_nm`` sin(θ + φ) of a bearing or a coupling, ``pole_pair_nm`` sin(pθ + φ) of a
    current offset with p ``pole_pairs``, and cogging of two harmonics, ``cogging_nm`` sin(cθ + φ)
    and ``cogging_second_nm`` sin(2cθ + φ), with c ``cogging_per_rev`` and φ ``phase_rad``.
    """

    revolution_nm: float = Field(default=0.0, ge=0)
    pole_pair_nm: float = Field(default=0.0, ge=0)
    pole_pairs: int = Field(default=4, ge=1, le=64)
    cogging_nm: float = Field(default=0.0, ge=0)
    cogging_second_nm: float = Field(default=0.0, ge=0)
    cogging_per_rev: int = Field(default=24, ge=1, le=512)
    phase_rad: float = 0.0


class EncoderSpec(_Finite):
    """Motor encoder; noise is the standard deviation of white Gaussian noise in counts.

    Wrong connections: ``inverted`` counts backwards, and ``counted_share`` of the
    ``counts_per_rev`` arrives per revolution of the shaft. The field of a motor commutated by it
    then runs away from its rotor.
    """

    counts_per_rev: int = Field(default=2**23, ge=16)
    noise_counts: float = Field(default=0.0, ge=0)
    inverted: bool = False
    counted_share: float = Field(default=1.0, gt=0, le=8)


class PhaseSpec(_Finite):
    """Connection of the motor's phases, and the source of the commutation angle.

    "exchanged": two phases; the field turns against the rotor, and the torque of a constant current
    is -cos(2pθ - ``angle_deg``) of its correct value. "shifted": all three by one place, 120°
    electrical; the torque is -0.5 of it. ``angle_deg`` is an error of the commutation angle,
    electrical. With "hall" the rotor's angle comes from a separate sensor, not from the encoder.
    """

    order: Literal["right", "exchanged", "shifted"] = "right"
    angle_deg: float = 0.0
    pole_pairs: int = Field(default=4, ge=1, le=64)
    commutation: Literal["encoder", "hall"] = "encoder"

    @property
    def wrong(self) -> bool:
        """Whether the torque does not correspond to the current."""
        return self.order != "right" or self.angle_deg != 0.0


class TravelSpec(_Part):
    """Mechanical end stops of the last inertia, in motor revolutions from the start position."""

    min_rev: float = -math.inf
    max_rev: float = math.inf

    @model_validator(mode="after")
    def _in_order(self) -> TravelSpec:
        if not (self.min_rev < self.max_rev and self.min_rev <= 0 <= self.max_rev):
            raise Unsuitable(text("mechanics.travel-order", low=self.min_rev, high=self.max_rev))
        return self


class SwitchSpec(_Part):
    """Positions of the switches, in motor revolutions from the start position.

    Limit switches default to 0.25 revolutions before the end stops, or to a tenth of a short
    travel. The home switch is a cam that is active from ``home_from_rev`` to ``home_to_rev``;
    either end may be infinite.
    """

    negative_limit_rev: float | None = None
    positive_limit_rev: float | None = None
    home_from_rev: float = 0.2
    home_to_rev: float = 0.7

    @model_validator(mode="after")
    def _in_order(self) -> SwitchSpec:
        low, high = self.negative_limit_rev, self.positive_limit_rev
        if low is not None and high is not None and not low < high:
            raise Unsuitable(text("mechanics.switch-order", low=low, high=high))
        if not self.home_from_rev < self.home_to_rev:
            begin, end = self.home_from_rev, self.home_to_rev
            raise Unsuitable(text("mechanics.home-cam", begin=begin, end=end))
        return self


class SupplySpec(_Finite):
    """The DC supply. One that cannot sink lets regeneration raise the bus voltage.

    Without ``braking_resistor`` nothing is connected where the drive needs its braking resistor
    (the bridge B1-B2 of an EP3E is open, the terminals RB of a DS_C are empty).
    """

    voltage_v: float = Field(default=48.0, gt=0)
    resistance_ohm: float = Field(default=0.05, gt=0)
    capacitance_f: float = Field(default=1e-3, gt=0)
    sinks: bool = True
    braking_resistor: bool = True
    ambient_c: float = 25.0


class LoadSpec(_Finite):
    """A further inertia, coupled to the one before by a spring with damping and optional backlash.

    ``backlash_rad`` is the whole width of the gap.
    """

    inertia_kgm2: float = Field(gt=0)
    stiffness_nm_per_rad: float = Field(gt=0)
    damping_nms_per_rad: float = Field(default=0.0, ge=0)
    backlash_rad: float = Field(default=0.0, ge=0)


class MechanicsSpec(_Part):
    """A motor, its load and its mounting."""

    motor: MotorSpec
    friction: FrictionSpec = FrictionSpec()
    place: PlaceSpec = PlaceSpec()
    ripple: RippleSpec = RippleSpec()
    encoder: EncoderSpec = EncoderSpec()
    phases: PhaseSpec = PhaseSpec()
    travel: TravelSpec = TravelSpec()
    switches: SwitchSpec = SwitchSpec()
    supply: SupplySpec = SupplySpec()
    load: tuple[LoadSpec, ...] = ()
    load_encoder: LoadEncoderSpec | None = None
    rough_feedback: RoughFeedbackSpec = RoughFeedbackSpec()
    rough_torque: RoughTorqueSpec = RoughTorqueSpec()

    @model_validator(mode="after")
    def _backlash_count(self) -> MechanicsSpec:
        if sum(load.backlash_rad > 0 for load in self.load) > 3:
            raise Unsuitable(text("mechanics.backlash-count"))
        return self

    @model_validator(mode="after")
    def _can_be_held(self) -> MechanicsSpec:
        most_nm = _PEAK_PER_RATED * self.motor.rated_torque_nm
        place = self.place
        furthest = max(
            abs(end - place.at_rev) for end in (self.travel.min_rev, self.travel.max_rev)
        )
        reached = math.sin(2 * math.pi * min(furthest / place.period_rev, 0.25))
        pull_nm = abs(self.friction.gravity_nm) + abs(place.torque_nm) * reached
        if pull_nm > most_nm:
            raise Unsuitable(
                text(
                    "mechanics.cannot-hold-place" if place.torque_nm else "mechanics.cannot-hold",
                    gravity_nm=self.friction.gravity_nm,
                    torque_nm=place.torque_nm,
                    peak=_PEAK_PER_RATED,
                    most_nm=most_nm,
                )
            )
        return self

    @model_validator(mode="after")
    def _switches_can_be_reached(self) -> MechanicsSpec:
        low, high = self.limit_switches_rev
        if not low < high:
            raise Unsuitable(text("mechanics.switch-room", low=low, high=high))
        for name, place in (("negative_limit_rev", low), ("positive_limit_rev", high)):
            if not self.travel.min_rev <= place <= self.travel.max_rev:
                raise Unsuitable(
                    text(
                        "mechanics.switch-beyond-stops",
                        name=name,
                        place=place,
                        low=self.travel.min_rev,
                        high=self.travel.max_rev,
                    )
                )
        return self

    @property
    def total_inertia_kgm2(self) -> float:
        """Inertia of motor and all loads, effective below the first resonance."""
        return self.motor.inertia_kgm2 + sum(load.inertia_kgm2 for load in self.load)

    @property
    def limit_switches_rev(self) -> tuple[float, float]:
        """Where the negative and the positive limit switch trip, motor revolutions."""
        negative, positive = self.switches.negative_limit_rev, self.switches.positive_limit_rev
        margin = min(0.25, 0.1 * (self.travel.max_rev - self.travel.min_rev))
        return (
            self.travel.min_rev + margin if negative is None else negative,
            self.travel.max_rev - margin if positive is None else positive,
        )


def load_mechanics(path: Path) -> MechanicsSpec:
    """Read a mechanics file.

    Raises:
        OSError: it cannot be read.
        ValueError: not TOML, or a field is missing, unknown or out of range (named).
    """
    return MechanicsSpec.model_validate(tomllib.loads(path.read_text("utf-8")))


def standard_mechanics() -> MechanicsSpec:
    """Return a 400 W motor with a rigid load of twice its inertia and a little friction."""
    return MechanicsSpec(
        motor=MotorSpec(inertia_kgm2=5e-5, rated_torque_nm=1.27, rated_speed_rpm=3000),
        friction=FrictionSpec(viscous_nms=2e-4, coulomb_nm=0.03),
        load=(LoadSpec(inertia_kgm2=1e-4, stiffness_nm_per_rad=2000, damping_nms_per_rad=0.02),),
    )
