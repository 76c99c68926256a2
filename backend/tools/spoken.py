"""Results of tools as plain values, their sentences in the language of whoever reads them."""

from __future__ import annotations

from collections.abc import Mapping

from backend.tools.registry import BY_KIND
from drivers.texts.answers import in_language
from drivers.texts.message import Language


def result_in_language(result: Mapping[str, object], language: Language) -> dict[str, object]:
    """The same result; what has neither code nor message, as in older files, stays as it is."""
    known = BY_KIND.get(str(result.get("tool", "")))
    if known is None:
        return in_language(result, language)
    found = known.result.model_validate(result).in_language(language)
    return dict(found.model_dump(mode="json"))
