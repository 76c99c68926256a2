"""Motion classes that a person of a station assigns to objects of an imported profile.

They are stored as rules in ``motion.yaml`` next to the imported ``profile.yaml``. The loader joins
files in name order and the first rule counts, so a person's rules precede all others. Profiles that
come with servodeck have their classes from a manual, standard objects from the standard: those
cannot be changed here.
"""

from __future__ import annotations

from pathlib import Path

import yaml
from pydantic import TypeAdapter

from profiles.loader import is_own, load_profile, user_folder
from profiles.motion.classify import standard_rule
from profiles.motion.rule import Motion, MotionRule
from profiles.replacing import move_into_place
from profiles.schema import Parameter, Profile

FILE_NAME = "motion.yaml"
_MAX_REASON = 500


class CannotClassify(Exception):
    """A person cannot assign the class of this object.

    ``code`` of the catalogue states the reason, with its facts as ``params``.
    """

    def __init__(self, code: str, **params: str) -> None:
        super().__init__(code, params)
        self.code = code
        self.params = params


def why_fixed(profile: Profile, parameter: Parameter) -> str | None:
    """Return why a person cannot change the motion class of this object, as a catalogue code.

    None if it is possible.
    """
    if parameter.access == "ro":
        return "motion.class-not-writable"
    if not is_own(profile.drive):
        return "motion.class-from-manual"
    if standard_rule(parameter.key) is not None:
        return "motion.class-of-standard"
    if any(
        rule.origin == "profile" and rule.covers(parameter.key) for rule in profile.motion_rules
    ):
        return "motion.class-in-profile"
    return None


def classify(
    drive: str, key: str, motion: Motion, *, reason: str, safe_in_motion: bool = False
) -> Parameter:
    """Assign a motion class to one object of an imported profile; return its new state.

    Raises:
        CannotClassify: the class of this object cannot be assigned, or there is no reason.
        ProfileError: no such profile, or it cannot be read.
        ValueError: ``safe_in_motion`` for another class than ``at_enable``.
        OSError: the profile's folder cannot be written.
    """
    parameter = _changeable(drive, key)
    reported = " ".join(reason.split())[:_MAX_REASON]
    if not reported:
        raise CannotClassify("motion.class-needs-reason", key=parameter.key)
    rule = MotionRule(
        keys=(parameter.key,),
        motion=motion,
        safe_in_motion=safe_in_motion,
        reason=reported,
        origin="person",
    )
    _write(drive, (rule, *_without(drive, parameter.key)))
    return load_profile(drive).by_key[parameter.key]


def forget(drive: str, key: str) -> Parameter:
    """Remove a person's class: the object counts as ``energises`` again.

    Raises:
        CannotClassify, ProfileError, OSError: as `classify`.
    """
    parameter = _changeable(drive, key)
    _write(drive, _without(drive, parameter.key))
    return load_profile(drive).by_key[parameter.key]


def _changeable(drive: str, key: str) -> Parameter:
    profile = load_profile(drive)
    parameter = profile.parameter(key)
    if parameter is None:
        raise CannotClassify("motion.class-of-no-parameter", profile_title=profile.title, key=key)
    if why := why_fixed(profile, parameter):
        raise CannotClassify(
            why, profile_title=profile.title, key=parameter.key, name=parameter.name
        )
    return parameter


def _without(drive: str, key: str) -> tuple[MotionRule, ...]:
    """Return a person's rules of this profile, without that of one object."""
    rules = (rule for rule in load_profile(drive).motion_rules if rule.origin == "person")
    return tuple(rule for rule in rules if rule.keys != (key,))


def _write(drive: str, rules: tuple[MotionRule, ...]) -> None:
    """Write completely or not at all: a partial file would remove the classes of all objects."""
    path: Path = user_folder() / drive / FILE_NAME
    if not rules:
        path.unlink(missing_ok=True)
        return
    dumped = TypeAdapter(tuple[MotionRule, ...]).dump_python(rules, mode="json")
    text = yaml.safe_dump({"motion_rules": dumped}, allow_unicode=True, sort_keys=False)
    part = path.with_suffix(".part")
    try:
        part.write_text(text, "utf-8")
        move_into_place(part, path)
    except OSError:
        part.unlink(missing_ok=True)
        raise
