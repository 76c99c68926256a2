"""Help of CiA 402 objects, for parameters whose profile has none."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import yaml

from profiles.schema import Profile

HELP_FILE = Path(__file__).with_name("standard_help.yaml")


@cache
def _known() -> dict[str, str]:
    found: dict[str, str] = yaml.safe_load(HELP_FILE.read_text("utf-8"))
    return found


def with_standard_help(profile: Profile) -> Profile:
    """Return the profile with the standard's help where its own has none."""
    known = _known()
    parameters = tuple(
        p.model_copy(update={"help": known[p.key]}) if not p.help and p.key in known else p
        for p in profile.parameters
    )
    # Rebuilt, not copied: a copy would keep the cached tables of the old one.
    fields = {name: getattr(profile, name) for name in Profile.model_fields}
    return Profile.model_construct(profile.model_fields_set, **{**fields, "parameters": parameters})
