"""Messages about scales: the meaning of raw position, speed and acceleration of an axis."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from backend.api.messages.models import Message
from backend.axes.scales.scale import Origin, Quantity, Uncertainty


class ScaleInfo(Message):
    """One scale with its origin."""

    quantity: Quantity
    unit: str = Field(description="rev, rpm or rpm/s")
    raw_unit: str = Field(description="what one raw step is called; empty where unknown")
    raw_per_unit: float | None = Field(description="null where the scale is not certain")
    is_time: bool = Field(description="a ramp given as a time in ms, which no factor converts")
    origin: Origin
    source: str = Field(description="objects, file or the manual's place")
    uncertainty: Uncertainty | None = Field(description="why it is not certain")
    why: str = Field(description="the same as text, or empty")
    remedy: str = Field(description="how it becomes certain, or empty")


class SmallMovesInfo(Message):
    """Small moves by increments since this axis was connected."""

    moved: int = Field(description="increments of the last one")
    raw_per_inc_s: float | None = Field(
        description="what 606Ch showed in it, per increment per second; null where not found"
    )
    next_most: int = Field(description="increments that the next one may have")


class ScalesInfo(Message):
    """The scales of an axis."""

    certain: bool = Field(description="position and speed are: the axis may be moved by unit")
    scales: list[ScaleInfo]
    taught: bool = Field(description="a person has said something of them, and it holds now")
    kept: bool = Field(description="a person has said something of them, whether it holds or not")
    cyclic: bool = Field(description="a small move by increments is possible on this bus")
    small_moves: SmallMovesInfo | None


class ScalesUpdate(Message):
    """Scales from a data sheet; values that are left out stay as they were stated before."""

    counts_per_rev: float | None = Field(default=None, gt=0, le=1e12)
    raw_per_rpm: float | None = Field(default=None, gt=0, le=1e12)
    raw_per_rpm_s: float | None = Field(default=None, gt=0, le=1e12)


class TurnedUpdate(Message):
    """Rotation of the shaft in the last small move, as observed by a person."""

    turned_rev: float = Field(ge=-1e6, le=1e6)


class SmallMoveRequest(Message):
    """A small move by increments; the axis moves."""

    increments: int = Field(ge=-(2**30), le=2**30)
    torque_limit: float = Field(default=20.0, ge=1, le=50, description="% of rated")
    cycle_ms: float = Field(default=1.0, ge=0.25, le=20)


class SmallMoveResult(Message):
    """Result of a small move."""

    kind: Literal["small_move"] = "small_move"
    moved_increments: int
    raw_per_inc_s: float | None
    next_most: int
