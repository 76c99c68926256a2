"""Why a profile cannot be used, as a message of the catalogue."""

from __future__ import annotations

from typing import TYPE_CHECKING

from drivers.texts.message import Text, joined, text
from drivers.texts.validation import reason_of

if TYPE_CHECKING:
    from profiles.loader import ProfileError, Refused


def profile_error_text(error: ProfileError) -> Text:
    """Return the error in a profile's file and its place; text from libraries is a fact."""
    if not error.refused:
        return Text(error.code, error.params)
    return Text(error.code, {**error.params, "refused": joined(map(_refused, error.refused))})


def _refused(record: Refused) -> Text:
    reason = reason_of(record.error)
    if not record.place:
        return reason
    if not record.label:
        return text("input.refused", place=record.place, reason=reason)
    return text("profile.record", place=record.place, key=record.label, reason=reason)
