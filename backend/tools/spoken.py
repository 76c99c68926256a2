"""Results of tools as plain values, their sentences in the language of whoever reads them."""

from __future__ import annotations

from collections.abc import Mapping

from backend.tools.registry import BY_KIND
from drivers.texts.answers import in_language
from drivers.texts.message import Language


def result_in_language(result: Mapping[str, object], language: Language) -> dict[str, object]:
    """The same result; what has neither code nor message, as in older files, stays as it is."""
    return _tools_in_language(in_language(result, language), language)


def _tools_in_language(result: dict[str, object], language: Language) -> dict[str, object]:
    """With the sentences of results that are models: they know which codes they stand for."""
    known = BY_KIND.get(str(result.get("tool", "")))
    if known is not None:
        found = known.result.model_validate(result).in_language(language)
        return dict(found.model_dump(mode="json"))
    return {
        name: _tools_in_language(value, language) if isinstance(value, dict) else value
        for name, value in result.items()
    }
