"""The base of every profile record."""

from __future__ import annotations

from collections.abc import Mapping

from pydantic import BaseModel, ConfigDict


class BadRecord(ValueError):
    """A record contradicts itself: a code of the catalogue, and facts."""

    def __init__(self, code: str, /, **params: str | float) -> None:
        super().__init__(code, params)
        self.code = code
        self.params: Mapping[str, str | float] = params

    def __str__(self) -> str:
        facts = ", ".join(f"{name}={fact}" for name, fact in self.params.items())
        return f"{self.code} ({facts})"


class Frozen(BaseModel):
    """Base of every profile record."""

    model_config = ConfigDict(frozen=True, extra="forbid")
