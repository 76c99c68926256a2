"""The machine driven by a virtual drive: an inertia chain with friction, gravity and end stops."""

from drivers.virtual.mechanics.chain import analytic_response
from drivers.virtual.mechanics.friction_curve import friction_nm, ripple_nm
from drivers.virtual.mechanics.gantry import GantrySpec, gantry_response
from drivers.virtual.mechanics.load_encoder import LoadEncoderSpec
from drivers.virtual.mechanics.rough import RoughTorqueSpec
from drivers.virtual.mechanics.spec import (
    EncoderSpec,
    FrictionSpec,
    LoadSpec,
    MechanicsSpec,
    MotorSpec,
    PhaseSpec,
    PlaceSpec,
    RippleSpec,
    SupplySpec,
    SwitchSpec,
    TravelSpec,
    load_mechanics,
    standard_mechanics,
)

__all__ = [
    "EncoderSpec",
    "FrictionSpec",
    "GantrySpec",
    "LoadEncoderSpec",
    "LoadSpec",
    "MechanicsSpec",
    "MotorSpec",
    "PhaseSpec",
    "PlaceSpec",
    "RippleSpec",
    "RoughTorqueSpec",
    "SupplySpec",
    "SwitchSpec",
    "TravelSpec",
    "analytic_response",
    "friction_nm",
    "gantry_response",
    "load_mechanics",
    "ripple_nm",
    "standard_mechanics",
]
