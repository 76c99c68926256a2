"""Results of tools as plain values, with their texts in the language of the reader."""

from __future__ import annotations

from collections.abc import Mapping

from backend.tools.registry import BY_KIND
from drivers.texts.answers import in_language
from drivers.texts.message import Language


def result_in_language(result: Mapping[str, object], language: Language) -> dict[str, object]:
    """The result in a language; texts without code or message, as in older files, are unchanged."""
    known = BY_KIND.get(str(result.get("tool", "")))
    if known is None:
        return in_language(result, language)
    found = known.result.model_validate(result).in_language(language)
    return dict(found.model_dump(mode="json"))
