"""Reasons for the release of a held button, as the page reports them."""

from __future__ import annotations

from typing import Annotated, Literal, get_args

from pydantic import BeforeValidator

from drivers.texts.message import Text, text

Release = Literal[
    "released", "pointer-cancelled", "focus-lost", "page-hidden", "page-left", "page-silent",
    "escape", "another-key", "another-jog", "another-guest", "axis-changed", "connection-lost",
    "stop",
]  # fmt: skip
_KNOWN: frozenset[object] = frozenset(get_args(Release))


def _known(given: object) -> object:
    return given if isinstance(given, str) and given in _KNOWN else "released"


#: A release counts with any reason: an unknown one is treated as "released".
ReleaseOfPage = Annotated[Release, BeforeValidator(_known)]

#: Texts for the end of a jog.
END_OF_JOG: dict[Release, Text] = {
    "released": text("jog.end-released"),
    "pointer-cancelled": text("jog.end-pointer-cancelled"),
    "focus-lost": text("jog.end-focus-lost"),
    "page-hidden": text("jog.end-page-hidden"),
    "page-left": text("jog.end-page-left"),
    "page-silent": text("jog.end-page-silent"),
    "escape": text("jog.end-escape"),
    "another-key": text("jog.end-another-key"),
    "another-jog": text("jog.end-another-jog"),
    "another-guest": text("jog.end-another-guest"),
    "axis-changed": text("jog.end-axis-changed"),
    "connection-lost": text("jog.end-connection-lost"),
    "stop": text("motion.stop-was-pressed"),
}
#: The same for the enabling button that the person on site holds for a guest.
END_OF_ENABLING: dict[Release, Text] = {
    **END_OF_JOG,
    "released": text("people.end-enabling-released"),
    "connection-lost": text("people.end-site-connection"),
    "page-silent": text("people.end-site-silent"),
}


def end_of_jog(release: Release) -> Text:
    """Text for the end of a jog by this release."""
    return END_OF_JOG[release]


def end_of_enabling(release: Release) -> Text:
    """Text for the end of a guest's permission to move by this release of the enabling button."""
    return END_OF_ENABLING[release]
