"""Texts of a profile, such as names of parameters, values and faults, in the reader's language."""

from __future__ import annotations

from drivers.texts.message import Language, text
from profiles.language.overlay import Language as OverlayLanguage
from profiles.language.overlay import load_overlay
from profiles.language.texts import translations
from profiles.loader import ProfileError, load_profile
from profiles.schema import Profile

#: Of faults that a profile does not name, or that were identified by the drive's own log.
FAULT_UNKNOWN = text("drive.fault-not-in-profile")
FAULT_LOOK_UP = text("drive.fault-look-up")
FAULT_BY_RECORD = text("drive.fault-by-record")


def translated(family: str, language: OverlayLanguage) -> dict[str, str]:
    """Map each English text of a family to its translation, with those of `FAULT_UNKNOWN` etc.

    Raises:
        ProfileError: the profile or its overlay cannot be used.
    """
    ours = {str(each): each.words(language) for each in _OURS}
    return ours | translations(load_profile(family), load_overlay(family, language))


_OURS = (FAULT_UNKNOWN, FAULT_LOOK_UP, FAULT_BY_RECORD)


class ProfileWords:
    """The texts of one family by their English text, which stays where nothing is translated."""

    def __init__(self, family: str, language: Language) -> None:
        self._known = _translated(family) if language == "zh" else {}

    def __call__(self, english: str) -> str:
        """Return the text in the reader's language."""
        return self._known.get(english, english)


#: By family: the profile as it was loaded, and its texts. An edited profile is another object.
_known: dict[str, tuple[Profile, dict[str, str]]] = {}


def _translated(family: str) -> dict[str, str]:
    try:
        profile = load_profile(family)
        if family not in _known or _known[family][0] is not profile:
            _known[family] = profile, translated(family, "zh")
        return _known[family][1]
    except (ProfileError, OSError, UnicodeDecodeError):
        return {}  # of a server that knows other families, or a file that cannot be read
