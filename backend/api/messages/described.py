"""The application with an OpenAPI document that describes its errors (RFC 9457)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from fastapi import FastAPI
from pydantic import TypeAdapter
from pydantic.json_schema import JsonSchemaMode

from backend.api.live.messages import FromPage, ToPage
from backend.api.messages.models import Problem

_PLAIN, _PROBLEM = "application/json", "application/problem+json"


_SCHEMAS = "#/components/schemas/{model}"


def refusals(statuses: Iterable[tuple[int, str]]) -> dict[int | str, dict[str, Any]]:
    """Error responses of every route, by status with its description.

    As a schema reference: with the model itself FastAPI would build a validator for every route and
    status at every start, thousands of them, which are never used.
    """
    schema = {"$ref": _SCHEMAS.format(model=Problem.__name__)}
    return {
        status: {"description": text, "content": {_PROBLEM: {"schema": schema}}}
        for status, text in statuses
    }


class DescribedApp(FastAPI):
    """FastAPI application that documents its errors as problem details, not as plain JSON."""

    def openapi(self) -> dict[str, Any]:
        """Return the OpenAPI document."""
        if self.openapi_schema is None:
            document = super().openapi()
            for operations in document["paths"].values():
                for operation in operations.values():
                    _correct(operation["responses"])
            schemas = document["components"]["schemas"]
            _describe_problem(schemas)
            _describe_messages(schemas)
        return super().openapi()


def _describe_problem(schemas: dict[str, Any]) -> None:
    made = Problem.model_json_schema(ref_template=_SCHEMAS)
    parts = made.pop("$defs", {})
    for field in made["properties"].values():
        # Omitted as in FastAPI's own description of optional fields.
        if field.get("default", "") is None:
            del field["default"]
    merged = {**parts, **schemas, Problem.__name__: made}
    schemas.clear()
    schemas.update(sorted(merged.items()))


def _describe_messages(schemas: dict[str, Any]) -> None:
    """Add the messages of the live connection, which no route names: ``FromPage``, ``ToPage``."""
    adapters: tuple[tuple[str, TypeAdapter[Any], JsonSchemaMode], ...] = (
        ("FromPage", TypeAdapter(FromPage), "validation"),
        ("ToPage", TypeAdapter(ToPage), "serialization"),
    )
    for name, adapter, mode in adapters:
        made = adapter.json_schema(ref_template=_SCHEMAS, mode=mode)
        parts = made.pop("$defs")
        schemas.update({each: part for each, part in parts.items() if each not in schemas})
        schemas[name] = made


def _correct(responses: dict[str, Any]) -> None:
    for status, response in responses.items():
        content = response.get("content", {})
        if status >= "400" and _PLAIN in content:
            content[_PROBLEM] = content.pop(_PLAIN)
