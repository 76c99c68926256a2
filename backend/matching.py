"""Which profile fits what a scan found."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

from drivers.link import Found
from profiles import load_all
from profiles.schema import Profile


@dataclass(frozen=True, slots=True)
class Match:
    """A profile that fits a found drive. Confidence: certain, likely or possible."""

    profile: Profile
    confidence: Literal["certain", "likely", "possible"]
    why: str


def match_profiles(kind: str, found: Found) -> list[Match]:
    """Profiles that fit what a scan saw, best first."""
    matches: list[Match] = []
    for profile in load_all().values():
        if profile.link(kind) is None:
            continue
        identity = profile.identity
        if identity.vendor_id is not None and found.vendor_id is not None:
            if identity.vendor_id != found.vendor_id:
                continue
            if identity.product_code is not None and identity.product_code == found.product_code:
                matches.append(Match(profile, "certain", "vendor and product code agree"))
            else:
                matches.append(Match(profile, "likely", "the vendor agrees"))
            continue
        if any(re.search(p, found.name, re.IGNORECASE) for p in identity.name_patterns):
            matches.append(Match(profile, "likely", f"its name {found.name!r} fits"))
        else:
            text = f"it answers over {kind}; the manual prints no identity to compare"
            matches.append(Match(profile, "possible", text))
    order = ("certain", "likely", "possible")
    return sorted(matches, key=lambda m: order.index(m.confidence))
