"""Why a profile cannot be used, as a message of the catalogue."""

from __future__ import annotations

from typing import TYPE_CHECKING

from drivers.texts.message import Text

if TYPE_CHECKING:
    from profiles.loader import ProfileError


def profile_error_text(error: ProfileError) -> Text:
    """Return the error in a profile's file and its place; text from libraries is a fact."""
    return Text(error.code, error.params)
