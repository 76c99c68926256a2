"""Scales of an axis that a person stated: stored with the axis, valid for its gear settings."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from drivers.texts.message import Text, text


class TaughtDrive(BaseModel):
    """The drive that scales were stated for.

    ``places``: URL without settings of the line, and station, of each of its ports.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    profile: str
    serial: int | None = None
    places: tuple[tuple[str, int], ...] = ()

    def is_same(self, other: TaughtDrive) -> bool:
        """Whether both are the same drive: by serial number where both are known, else by place."""
        if self.profile != other.profile:
            return False
        if self.serial is not None and other.serial is not None:
            return self.serial == other.serial
        return bool(set(self.places) & set(other.places))


class Taught(BaseModel):
    """Scales of one axis, stated by a person or measured in a small motion.

    ``bound_to``: raw values of the drive (gear, feed, resolution, units) for which they hold; with
    other values they are not used. ``drive``: the drive itself; another one does not use
    them. None in files of earlier versions.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    counts_per_rev: float | None = Field(
        default=None, gt=0, description="position increments per motor revolution"
    )
    raw_per_rpm: float | None = Field(default=None, gt=0, description="raw speed of one rpm")
    raw_per_rpm_s: float | None = Field(default=None, gt=0, description="raw ramp of one rpm/s")
    velocity_origin: Literal["user", "measured"] = "user"
    bound_to: dict[str, int] = Field(
        default_factory=dict, description="raw values of the drive that it holds for"
    )
    drive: TaughtDrive | None = None

    def holds(self, raws: Mapping[str, int]) -> bool:
        """Whether the drive still has the values for which these scales were stated."""
        return all(raws.get(key) == raw for key, raw in self.bound_to.items())

    @property
    def not_used(self) -> Text:
        """Why an axis does not use them: they are of another drive. A part of a sentence."""
        of = self.drive
        return text(
            "scales.stated-for-another-drive",
            profile="-" if of is None else of.profile,
            serial="-" if of is None or of.serial is None else str(of.serial),
            place="-" if of is None or not of.places else "{}, {}".format(*of.places[0]),
        )
