"""Profiles that match a drive found by a scan."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

from drivers.errors import NotAllowed
from drivers.link import Found
from drivers.texts.message import Text, text
from drivers.texts.profile_errors import profile_error_text
from profiles import load_all, load_profile
from profiles.loader import ProfileError
from profiles.schema import LinkSpec, Profile


@dataclass(frozen=True, slots=True)
class Match:
    """A profile that matches a found drive, with confidence and reason."""

    profile: Profile
    confidence: Literal["certain", "likely", "possible"]
    why: Text


def match_profiles(kind: str, found: Found) -> list[Match]:
    """Profiles that match a drive found by a scan, best first."""
    matches: list[Match] = []
    for profile in load_all().values():
        if profile.link(kind) is None:
            continue
        identity = profile.identity
        # Vendor 0 does not exist (CiA 301 clause 7.5.2.21): such a drive does not report its maker.
        if identity.vendor_id is not None and found.vendor_id:
            if identity.vendor_id != found.vendor_id:
                continue
            if identity.product_code is not None and identity.product_code == found.product_code:
                matches.append(Match(profile, "certain", text("station.match-product")))
            elif not found.is_other_device:
                matches.append(Match(profile, "likely", text("station.match-vendor")))
            continue
        if found.is_other_device:
            continue
        if any(re.search(p, found.name, re.IGNORECASE) for p in identity.name_patterns):
            why = text("station.match-name", name=found.name)
            matches.append(Match(profile, "likely", why))
        else:
            # The vendor ID is unknown: the manual states none, or the drive does not report it.
            silent = "manual" if identity.vendor_id is None else "drive"
            matches.append(
                Match(profile, "possible", text("station.match-bus", bus=kind, silent=silent))
            )
    order = ("certain", "likely", "possible")
    return sorted(matches, key=lambda m: order.index(m.confidence))


def profile_for(kind: str, name: str) -> tuple[Profile, LinkSpec]:
    """The profile ``name`` and its link on a bus of this kind.

    Raises:
        NotAllowed: no such profile, or one whose drives have no such port: its values would be
            written to a drive of another family.
    """
    try:
        profile = load_profile(name)
    except ProfileError as error:
        raise NotAllowed(
            profile_error_text(error), value=name, remedy="station.choose-listed-profile"
        ) from error
    spec = profile.link(kind)
    if spec is None:
        kinds = ", ".join(link.kind for link in profile.links)
        raise NotAllowed(
            "station.no-port-must-drive",
            value=name,
            limit=kinds,
            profile_title=profile.title,
            kind=kind,
        )
    return profile, spec
