"""Motion classes of a profile's parameters.

The first of these that covers a writable object determines its class: the profile's rules in their
order (a person's rules precede the profile's own), then the table of the standard objects. An
object that none of them covers counts as ``energises``: an unknown object may move the axis.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import yaml
from pydantic import TypeAdapter

from profiles.motion.rule import MotionRule
from profiles.schema import Parameter, Profile

STANDARD_FILE = Path(__file__).with_name("standard.yaml")

#: CiA 402 places the objects of each further axis of one device 800h after those of the axis before
#: (CiA 402-1 clause 7.1; ETG.6010 clause 5.1): 6000h–67FFh, 6800h–6FFFh … up to 9FFFh.
_AXES = range(0x6000, 0xA000)
_AXIS_STEP = 0x800
#: Communication objects of CiA 301.
_COMMUNICATION = range(0x1000, 0x2000)
_UNCLASSIFIED = "nobody has said yet what writing it does"


@cache
def standard_rules() -> tuple[MotionRule, ...]:
    """Return the table of the objects of CiA 301, CiA 402 and ETG.1000.6."""
    data = yaml.safe_load(STANDARD_FILE.read_text("utf-8"))
    return TypeAdapter(tuple[MotionRule, ...]).validate_python(data["motion_rules"])


def standard_rule(key: str) -> MotionRule | None:
    """Return the standard's rule for a key of any axis, or None for a manufacturer's object."""
    if key.startswith("PA_"):
        return None
    index = int(key[:4], 16)
    if index not in _COMMUNICATION and index not in _AXES:
        return None
    if index in _AXES:
        key = f"{_AXES.start + (index - _AXES.start) % _AXIS_STEP:04X}:{key[5:]}"
    return next((rule for rule in standard_rules() if rule.covers(key)), None)


def classified(profile: Profile) -> Profile:
    """Return the profile with the motion class of every writable object."""
    parameters = tuple(_classified(profile, p) for p in profile.parameters)
    # Rebuilt, not copied: a copy would keep the cached tables of the old one.
    fields = {name: getattr(profile, name) for name in Profile.model_fields}
    return Profile.model_construct(profile.model_fields_set, **{**fields, "parameters": parameters})


def _classified(profile: Profile, parameter: Parameter) -> Parameter:
    if parameter.access == "ro":
        return parameter
    rule = next((r for r in profile.motion_rules if r.covers(parameter.key)), None)
    if rule is not None:
        origin: str = rule.origin
    else:
        rule = standard_rule(parameter.key)
        origin = "standard"
    if rule is None:
        update: dict[str, object] = {
            "motion": "energises",
            "motion_origin": "unclassified",
            "motion_reason": _UNCLASSIFIED,
            "safe_in_motion": False,
        }
    else:
        update = {
            "motion": rule.motion,
            "motion_origin": origin,
            "motion_reason": rule.reason,
            "safe_in_motion": rule.safe_in_motion,
        }
    return parameter.model_copy(update=update)
