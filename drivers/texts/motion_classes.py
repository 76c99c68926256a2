"""Why a person cannot set the motion class of an object, as messages of the catalogue."""

from __future__ import annotations

from drivers.texts.message import Text, text
from profiles.motion.decisions import CannotClassify, why_fixed
from profiles.schema import Parameter, Profile


def fixed_text(profile: Profile, parameter: Parameter) -> Text | None:
    """Return why a person cannot change the class of this object; None if it is possible."""
    why = why_fixed(profile, parameter)
    return None if why is None else Text(why)


def refusal_text(error: CannotClassify) -> Text:
    """Return why the class of an object was not changed, with the object."""
    if "name" not in error.params:
        return Text(error.code, error.params)
    return text("motion.class-fixed", **error.params, why=Text(error.code))
