"""Route to the doctor: why stations of a bus are not in Operational."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query
from pydantic import BaseModel

from backend.api.context import TheBench
from backend.api.errors import NotFound
from drivers.doctor.diagnosis import Cause
from drivers.errors import NotAllowed

router = APIRouter()


class DoctorFact(BaseModel):
    """A piece of evidence as it is and as it should be (null: nobody says)."""

    name: str
    actual: int | str
    expected: int | str | None


class DoctorCause(BaseModel):
    """A possible cause; the texts in English and Chinese."""

    code: str
    weight: int
    title: str
    title_zh: str
    remedy: str
    remedy_zh: str
    facts: list[DoctorFact]


class StationDiagnosis(BaseModel):
    """One station; without causes where it is in Operational."""

    station: int
    reached: bool
    refusal: str | None = None
    causes: list[DoctorCause]


@router.get("/buses/doctor")
async def bus_doctor(
    bench: TheBench,
    url: Annotated[str, Query()],
    station: Annotated[int | None, Query(ge=1)] = None,
) -> list[StationDiagnosis]:
    """What keeps the stations of an opened EtherCAT or CANopen bus from Operational.

    The likeliest cause first. Reads registers and objects as they are now; changes no state.
    """
    link = bench.buses.opened.get(url)
    if link is None:
        raise NotFound("api-station.no-opened-bus", value=url)
    doctor = link.doctor
    if doctor is None:
        raise NotAllowed("api-station.doctor-knows-not", value=url)
    seen = [station] if station is not None else sorted(await doctor.stations_known())
    found = []
    for number in seen:
        examined = await doctor.examination(number)
        found.append(
            StationDiagnosis(
                station=number,
                reached=examined.reached,
                causes=[_cause(each) for each in examined.causes],
            )
        )
    return found


def _cause(cause: Cause) -> DoctorCause:
    text = cause.text
    return DoctorCause(
        code=cause.code,
        weight=cause.weight,
        title=text.title,
        title_zh=text.zh,
        remedy=text.remedy,
        remedy_zh=text.zh_remedy,
        facts=[DoctorFact(name=f.name, actual=f.actual, expected=f.expected) for f in cause.facts],
    )
