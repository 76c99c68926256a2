"""The base of every profile record."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class Frozen(BaseModel):
    """Base of every profile record."""

    model_config = ConfigDict(frozen=True, extra="forbid")
