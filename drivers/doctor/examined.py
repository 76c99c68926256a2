"""Interface of every bus that supports the doctor: causes for one station, the likeliest first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from drivers.doctor.diagnosis import Cause
from drivers.errors import DriveError


@dataclass(frozen=True, slots=True)
class Examination:
    """One station; ``reached``: it is in Operational, and then there is no cause."""

    station: int
    reached: bool
    causes: tuple[Cause, ...] = ()


class Examines(Protocol):
    """A link whose stations the doctor can examine."""

    async def stations_known(self) -> Sequence[int]:
        """Return the stations that were found, received or queried."""

    async def examination(self, station: int, refusal: DriveError | None = None) -> Examination:
        """Return why a station is not in Operational; does not change the state of a drive.

        ``refusal`` is the error raised by a start of the exchange.
        """
