"""The application with a description that says what errors look like (RFC 9457)."""

from __future__ import annotations

from typing import Any

from fastapi import FastAPI

_PLAIN, _PROBLEM = "application/json", "application/problem+json"


class DescribedApp(FastAPI):
    """FastAPI documents every answer as plain JSON; ours that refuse are problem details."""

    def openapi(self) -> dict[str, Any]:
        """The OpenAPI document."""
        if self.openapi_schema is None:
            document = super().openapi()
            for operations in document["paths"].values():
                for operation in operations.values():
                    _correct(operation["responses"])
        return super().openapi()


def _correct(responses: dict[str, Any]) -> None:
    for status, response in responses.items():
        content = response.get("content", {})
        if status >= "400" and _PLAIN in content:
            content[_PROBLEM] = content.pop(_PLAIN)
