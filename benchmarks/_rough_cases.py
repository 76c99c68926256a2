"""The drawn axes of the rough campaign: one class of behaviour each, over all families."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.tune_accuracy import drawn
from drivers.virtual.mechanics import MechanicsSpec, RoughTorqueSpec
from drivers.virtual.mechanics.rough_feedback import RoughFeedbackSpec

FAMILIES = ("mms7", "m6l", "r6l", "generic402")
#: A range is drawn from, a list chosen from, a set taken whole, anything else as it is. Groups of
#: options are those of `RoughTorqueSpec` (torque), `RoughFeedbackSpec` (feedback), the mechanics.
Draw = tuple[float, float] | list[float] | frozenset[str] | bool | str
#: One class of behaviour each: how it is drawn.
CLASSES: dict[str, dict[str, dict[str, Draw]]] = {
    "as assumed": {},
    "held setpoints": {"torque": {"holds_torque": True, "holds_speed": True}},
    "filtered 6077h": {"torque": {"reported_filter_s": (3e-4, 2e-3)}},
    "6077h is the demand": {"torque": {"reported": "demand"}},
    "torque low-pass": {"torque": {"torque_filter_s": (2e-4, 8e-4)}},
    "loop period": {"torque": {"loop_period_s": (62.5e-6, 250e-6)}},
    "torque constant": {"torque": {"torque_constant": (0.9, 1.1)}},
    "cogging, pre-sliding": {
        "torque": {"cogging_nm": (0.005, 0.03), "presliding_rad": (2e-4, 3e-3)}
    },
    "cable drag": {"torque": {"drag_nm": (0.01, 0.06), "drag_rad": (0.2, 2.0)}},
    "inertia by place": {"torque": {"inertia_share": (0.02, 0.15)}},
    "stiffness by place": {"torque": {"stiffness_share": (0.02, 0.2)}},
    "belt slip": {"torque": {"slip_per_s": (0.5, 20.0)}},
    "supply dip": {
        "torque": {"dip_share": (0.2, 0.8), "dip_s": (5e-3, 3e-2), "dip_every_s": (0.4, 1.5)}
    },
    "encoder interpolation": {"torque": {"interpolation_rad": (2e-6, 3e-5)}},
    "jitter": {"torque": {"jitter_s": (50e-6, 150e-6)}},
    "606Ch late, a mean": {
        "feedback": {"speed_late_s": (2e-4, 1.5e-3), "speed_mean_s": (1e-3, 3e-3)}
    },
    "606Ch in steps": {"feedback": {"speed_step_rpm": (0.1, 3.0)}},
    "606Ch by a factor": {"feedback": {"speed_factor": [10.0, 0.1, -1.0, 0.0]}},
    "play, cogging": {
        "mechanics": {"backlash_rad": (5e-4, 8e-3)},
        "torque": {"cogging_nm": (0.005, 0.02), "presliding_rad": (2e-4, 2e-3)},
    },
    "brake opens late": {"mechanics": {"brake": True}, "feedback": {"brake_opens_s": (0.1, 0.4)}},
    "load out of balance": {"mechanics": {"place_nm": (0.01, 0.1)}},
    "608Fh alone": {"feedback": {"lacks": frozenset({"6092"})}},
}
#: Only a drive whose resolution the standard's objects give can lack one of them.
_ONLY = {"608Fh alone": "generic402"}


@dataclass(frozen=True)
class Case:
    """One drawn axis."""

    number: int
    kind: str
    drive: str
    spec: MechanicsSpec

    def tunes(self, share: float) -> bool:
        """Whether it is tuned, where this share of all are; the bare standard has no gains."""
        mine = int((self.number + 1) * share) > int(self.number * share)
        return mine and self.drive != "generic402"


def case_of(number: int) -> Case:
    """The axis of this number; classes and families come in turn."""
    rng = np.random.default_rng(7919 * number + 13)
    kind = list(CLASSES)[number % len(CLASSES)]
    turn, place = divmod(number, len(CLASSES))
    drive = _ONLY.get(kind) or FAMILIES[(turn + place) % len(FAMILIES)]
    options = {
        group: {name: _drawn(rng, given) for name, given in draws.items()}
        for group, draws in CLASSES[kind].items()
    }
    # Vertical axes (every fifth) need a brake by family; here all turn freely.
    base = drawn(100_000 + 5 * number + int(rng.integers(0, 4)))
    friction = base.friction.model_copy(update={"gravity_nm": 0.0})
    changed: dict[str, Any] = {
        "friction": friction,
        "rough_torque": RoughTorqueSpec(**options.get("torque", {})),
        "rough_feedback": RoughFeedbackSpec(**options.get("feedback", {})),
        **_mechanics(base, options.get("mechanics", {})),
    }
    return Case(number, kind, drive, base.model_copy(update=changed))


def _drawn(rng: np.random.Generator, given: Draw) -> Any:
    if isinstance(given, tuple):
        return float(rng.uniform(*given))
    if isinstance(given, frozenset):
        return tuple(sorted(given))
    return float(rng.choice(given)) if isinstance(given, list) else given


def _mechanics(base: MechanicsSpec, options: dict[str, Any]) -> dict[str, Any]:
    changed: dict[str, Any] = {}
    if "backlash_rad" in options:
        first = base.load[0].model_copy(update={"backlash_rad": options["backlash_rad"]})
        changed["load"] = (first, *base.load[1:])
    if "brake" in options:
        changed["motor"] = base.motor.model_copy(update={"brake": True})
    if "place_nm" in options:
        changed["place"] = base.place.model_copy(update={"torque_nm": options["place_nm"]})
    return changed
