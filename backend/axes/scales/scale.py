"""A scale with its origin. Its texts are made by `what_to_do` and `Scale.why`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from drivers.errors import NotAllowed
from drivers.texts.message import Text, text


class Quantity(StrEnum):
    """The quantity that a scale converts."""

    POSITION = "position"
    VELOCITY = "velocity"
    ACCELERATION = "acceleration"


class Origin(StrEnum):
    """Origin of a scale."""

    MANUAL = "manual"
    """The profile of this family, with its reference to the manual."""
    MAKERS_FILE = "makers_file"
    """The maker's ESI or EDS file that the profile was imported from."""
    DRIVE = "drive"
    """Read from the drive: 60A8h to 60AAh, 608Fh, 6091h, 6092h or the family's own objects."""
    USER = "user"
    """Stated or confirmed by a person for this axis."""
    MEASURED = "measured"
    """Found by comparing 606Ch with 6064h in a small motion."""
    UNKNOWN = "unknown"


class Uncertainty(StrEnum):
    """Why a scale is not certain."""

    NO_RESOLUTION = "no_resolution"
    """Neither 608Fh nor 6092h nor the profile states the increments of a revolution."""
    FEED_OF_ONE = "feed_of_one"
    """6092h is 1, but 608Fh states an encoder of many increments: 6092h was never set."""
    UNIT_AND_FEED = "unit_and_feed"
    """60A8h and 6092h give different numbers of units for a revolution."""
    LINEAR = "linear"
    """The unit is a length, and the travel of a revolution is not known."""
    NOT_STATED = "not_stated"
    """Neither the drive (60A9h, 60AAh) nor a file nor a manual states the unit."""
    UNREADABLE = "unreadable"
    """The stated unit is not a unit of position, speed or acceleration."""
    BEHIND_GEAR = "behind_gear"
    """The unit counts turns, and 6091h holds a gear: which shaft turns is not stated."""
    NEEDS_RESOLUTION = "needs_resolution"
    """The unit counts increments, and the increments of a revolution are not known."""
    FACTOR = "factor"
    """6090h states another encoder than 608Fh, or 6096h or 6097h holds a factor."""


_WHY: Mapping[Uncertainty, str] = {
    Uncertainty.NO_RESOLUTION: "scales.why-no-resolution",
    Uncertainty.FEED_OF_ONE: "scales.why-feed-of-one",
    Uncertainty.UNIT_AND_FEED: "scales.why-unit-and-feed",
    Uncertainty.LINEAR: "scales.why-linear",
    Uncertainty.NOT_STATED: "scales.why-not-stated",
    Uncertainty.UNREADABLE: "scales.why-unreadable",
    Uncertainty.BEHIND_GEAR: "scales.why-behind-gear",
    Uncertainty.NEEDS_RESOLUTION: "scales.why-needs-resolution",
    Uncertainty.FACTOR: "scales.why-factor",
}
#: Names of the quantities, as parts of a sentence.
_NAMES: Mapping[Quantity, str] = {
    Quantity.POSITION: "scales.of-position",
    Quantity.VELOCITY: "scales.of-velocity",
    Quantity.ACCELERATION: "scales.of-acceleration",
}


@dataclass(frozen=True, slots=True)
class Scale:
    """Conversion of one quantity between raw values and engineering units, with its origin.

    ``raw_per_unit``: increments per revolution, or raw per rpm or rpm/s; None where not certain.
    ``raw_unit``: name of one raw step ("inc", "0.1 rpm"), empty where unknown. ``source``: objects,
    file or place in the manual. ``not_used``: why the scales that a person stated do not count.
    """

    quantity: Quantity
    raw_per_unit: float | None
    raw_unit: str
    origin: Origin
    source: str = ""
    uncertainty: Uncertainty | None = None
    not_used: Text | None = None

    @property
    def certain(self) -> bool:
        """Whether values may be converted by it."""
        return self.raw_per_unit is not None

    @property
    def why(self) -> Text | None:
        """Why it is not certain, as a part of a sentence; None where it is certain."""
        if self.uncertainty is None:
            return None
        why = text(_WHY[self.uncertainty])
        if self.not_used is None:
            return why
        return text("scales.why-and-not-used", why=why, not_used=self.not_used)


@dataclass(frozen=True, slots=True)
class Scales:
    """The three scales of one axis."""

    position: Scale
    velocity: Scale
    acceleration: Scale

    @property
    def all(self) -> tuple[Scale, Scale, Scale]:
        """All three, in the order in which they are shown."""
        return self.position, self.velocity, self.acceleration


class ScaleUnknown(NotAllowed):
    """A value in engineering units that cannot be converted, because its scale is not certain."""

    kind = "scale-unknown"

    def __init__(self, drive: str, scale: Scale) -> None:
        self.scale = scale
        super().__init__(
            "scales.not-certain",
            drive=drive,
            quantity=text(_NAMES[scale.quantity]),
            why=scale.why,
            limit=text("limit.certain-scale"),
            remedy=what_to_do(scale),
        )


class ScaleChanged(NotAllowed):
    """The drive has other scales than those by which a motion was planned."""

    kind = "scale-changed"


def what_to_do(scale: Scale) -> Text:
    """Remedy for a scale that is not certain."""
    if scale.uncertainty in (
        Uncertainty.NO_RESOLUTION,
        Uncertainty.FEED_OF_ONE,
        Uncertainty.UNIT_AND_FEED,
    ):
        return text("scales.set-feed-or-teach")
    return text("scales.teach-or-import")
