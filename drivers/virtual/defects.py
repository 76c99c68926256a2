"""Defects of a machine in a virtual axis, for the tools to find."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, Literal, get_args

from drivers.texts.message import Text, text
from drivers.virtual.mechanics.spec import MechanicsSpec

Defect = Literal[
    "phases_shifted",
    "phases_exchanged",
    "feedback_inverted",
    "brake_closed",
    "brake_slips",
    "coupling_loose",
    "belt_worn",
    "out_of_square",
]
DEFECTS: Final = get_args(Defect)
#: Share of the coupling's original stiffness.
LOOSE = 0.7
#: Factor of the belt's friction, and its backlash [rad].
WORN, WORN_BACKLASH_RAD = 1.2, 0.004
#: Holding torque as a share of the motor's rated torque: a good brake holds twice the rated torque.
SLIPS = 0.6
#: Angle between the motors of both sides of a gantry, first less second [rad].
OUT_OF_SQUARE_RAD = 0.12
#: Defects of the load at the motor.
OF_LOAD: Final = ("coupling_loose", "belt_worn")
#: Defects of the beam between two axes, see `drivers.virtual.mechanics.gantry`.
OF_GANTRY: Final = ("out_of_square",)
DEFECT_WORDS: Final[dict[Defect, Text]] = {
    "phases_shifted": text("virtual.defect-phases-shifted"),
    "phases_exchanged": text("virtual.defect-phases-exchanged"),
    "feedback_inverted": text("virtual.defect-feedback-inverted"),
    "brake_closed": text("virtual.defect-brake-closed"),
    "brake_slips": text("virtual.defect-brake-slips"),
    "coupling_loose": text("virtual.defect-coupling-loose"),
    "belt_worn": text("virtual.defect-belt-worn"),
    "out_of_square": text("virtual.defect-out-of-square"),
}


def planted(spec: MechanicsSpec, defect: Defect) -> MechanicsSpec:
    """Return the same axis with a defect of its own; those `OF_GANTRY` leave it unchanged.

    Those `OF_LOAD` require an axis with a load.
    """
    change = _CHANGES.get(defect)
    return spec if change is None else change(spec)


def _part(spec: MechanicsSpec, name: str, **values: Any) -> MechanicsSpec:
    return spec.model_copy(update={name: getattr(spec, name).model_copy(update=values)})


def _loose(spec: MechanicsSpec) -> MechanicsSpec:
    first, *others = spec.load
    softer = LOOSE * first.stiffness_nm_per_rad
    loose = first.model_copy(update={"stiffness_nm_per_rad": softer})
    return spec.model_copy(update={"load": (loose, *others)})


def _worn(spec: MechanicsSpec) -> MechanicsSpec:
    """Increase all friction except the fan's, and add backlash at the last inertia."""
    names = ("viscous_nms", "coulomb_nm", "static_nm", "load_coulomb_nm")
    rubbing = {name: WORN * getattr(spec.friction, name) for name in names}
    *others, last = spec.load
    gap = max(last.backlash_rad, WORN_BACKLASH_RAD)
    worn = last.model_copy(update={"backlash_rad": gap})
    return _part(spec, "friction", **rubbing).model_copy(update={"load": (*others, worn)})


def _slipping(spec: MechanicsSpec) -> MechanicsSpec:
    holds_nm = SLIPS * spec.motor.rated_torque_nm
    return _part(spec, "motor", brake=True, brake_nm=holds_nm, brake_output=True)


_CHANGES: Final[dict[Defect, Callable[[MechanicsSpec], MechanicsSpec]]] = {
    "phases_shifted": lambda spec: _part(spec, "phases", order="shifted"),
    "phases_exchanged": lambda spec: _part(spec, "phases", order="exchanged"),
    "feedback_inverted": lambda spec: _part(spec, "encoder", inverted=not spec.encoder.inverted),
    "brake_closed": lambda spec: _part(spec, "motor", brake=True, brake_supplied=False),
    "brake_slips": _slipping,
    "coupling_loose": _loose,
    "belt_worn": _worn,
}
