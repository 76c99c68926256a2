"""What every bus that knows the doctor offers: causes of one station, the likeliest first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from drivers.doctor.diagnosis import Cause
from drivers.errors import DriveError


@dataclass(frozen=True, slots=True)
class Examination:
    """One station: ``reached`` says that it is in Operational; then there is no cause."""

    station: int
    reached: bool
    causes: tuple[Cause, ...] = ()


class Examines(Protocol):
    """A link whose stations the doctor can examine."""

    async def stations_known(self) -> Sequence[int]:
        """Stations that were found, heard or asked."""

    async def examination(self, station: int, refusal: DriveError | None = None) -> Examination:
        """Why a station is not in Operational; changes no state of a drive.

        ``refusal`` is what a start of the exchange raised.
        """
