"""Reasons why pydantic refuses a value, as messages of the catalogue.

pydantic's own sentences are English for every reader. Its errors have a type and a context
(https://docs.pydantic.dev/latest/errors/validation_errors/): the type becomes a code of the room
``input``, the context its facts. A type that is not listed keeps pydantic's sentence.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from drivers.texts.message import Param, Text, Unsuitable, prose, text
from profiles.record import BadRecord


class _Reason(NamedTuple):
    """A code, and for each of its facts the name of the context's entry."""

    code: str
    facts: Mapping[str, str]


def _reason(code: str, **facts: str) -> _Reason:
    return _Reason(code, facts)


_REASONS = {
    "missing": _reason("input.missing"),
    "extra_forbidden": _reason("input.extra"),
    "none_required": _reason("input.none"),
    "greater_than": _reason("input.greater-than", bound="gt"),
    "greater_than_equal": _reason("input.greater-than-equal", bound="ge"),
    "less_than": _reason("input.less-than", bound="lt"),
    "less_than_equal": _reason("input.less-than-equal", bound="le"),
    "multiple_of": _reason("input.multiple-of", step="multiple_of"),
    "finite_number": _reason("input.finite"),
    "int_type": _reason("input.integer"),
    "int_parsing": _reason("input.integer"),
    "int_parsing_size": _reason("input.integer-size"),
    "int_from_float": _reason("input.integer-fraction"),
    "float_type": _reason("input.number"),
    "float_parsing": _reason("input.number"),
    "bool_type": _reason("input.boolean"),
    "bool_parsing": _reason("input.boolean"),
    "string_type": _reason("input.string"),
    "string_unicode": _reason("input.string-unicode"),
    "string_too_short": _reason("input.string-short", bound="min_length"),
    "string_too_long": _reason("input.string-long", bound="max_length"),
    "string_pattern_mismatch": _reason("input.string-pattern", pattern="pattern"),
    "literal_error": _reason("input.one-of", allowed="expected"),
    "enum": _reason("input.one-of", allowed="expected"),
    "list_type": _reason("input.list"),
    "tuple_type": _reason("input.list"),
    "set_type": _reason("input.list"),
    "too_short": _reason("input.few", bound="min_length", count="actual_length"),
    "too_long": _reason("input.many", bound="max_length", count="actual_length"),
    "dict_type": _reason("input.object"),
    "model_type": _reason("input.object"),
    "model_attributes_type": _reason("input.object"),
    "union_tag_not_found": _reason("input.kind-missing", field="discriminator"),
    "union_tag_invalid": _reason(
        "input.kind-unknown", field="discriminator", value="tag", allowed="expected_tags"
    ),
    "datetime_type": _reason("input.time"),
    "datetime_parsing": _reason("input.time"),
    "datetime_from_date_parsing": _reason("input.time"),
    "datetime_object_invalid": _reason("input.time"),
    "timezone_aware": _reason("input.time-zone"),
    "json_invalid": _reason("input.json", cause="error"),
}


def refusal_of(error: Mapping[str, Any]) -> Text:
    """Return the place of an entry of ``ValidationError.errors()``, and its reason."""
    place = ".".join(str(part) for part in error["loc"])
    reason = reason_of(error)
    return text("input.refused", place=place, reason=reason) if place else reason


def reason_of(error: Mapping[str, Any]) -> Text:
    """Return the reason of an entry of ``ValidationError.errors()``."""
    context: Mapping[str, object] = error.get("ctx", {})
    cause = context.get("error")
    if isinstance(cause, Unsuitable):  # of a validator of our own
        return cause.why
    if isinstance(cause, BadRecord):
        return Text(cause.code, cause.params)
    reason = _REASONS.get(error["type"])
    if reason is None or not set(reason.facts.values()) <= context.keys():
        return prose(error["msg"])
    return Text(
        reason.code, {name: _fact(name, context[key]) for name, key in reason.facts.items()}
    )


def _fact(name: str, value: object) -> Param:
    """A limit as pydantic writes it, 1 also where the field is a float; values with commas only."""
    if isinstance(value, float) and value.is_integer() and abs(value) < 2**53:
        return int(value)
    if isinstance(value, int | float):
        return value
    first, _, last = str(value).rpartition(" or ")  # pydantic joins the last two by this word
    return f"{first}, {last}" if name == "allowed" and first else str(value)
