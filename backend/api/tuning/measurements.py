"""Routes of stored measurements: list, evaluate again, upload, download, sign, delete."""

from __future__ import annotations

import asyncio
from datetime import UTC, datetime
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from backend.api.messages.disposition import disposition
from backend.api.messages.errors import NotFound, message_of, words_of
from backend.api.requests.context import Me, TheBench
from backend.api.tuning.models import MeasurementContent, MeasurementInfo, SignatureRequest
from backend.records.library.measurements import SUFFIX, BadMeasurement, Head, Measurement
from backend.report.changes import ChangeLog
from backend.station.bench import Bench
from backend.station.evaluation import evaluate
from backend.tools.spoken import result_in_language
from backend.tools.watching.safety_check.evaluate import reevaluate, signed
from backend.tools.watching.safety_check.result import SafetyResult
from drivers.errors import NotAllowed, OutOfRange
from drivers.texts import limits
from drivers.texts.message import language, text

router = APIRouter()
_MAX_BYTES = 64 * 1024 * 1024


def change_log(bench: Bench) -> ChangeLog:
    """The log of changes made by tuning, by drive."""
    return ChangeLog(bench.state_folder / "changes")


def load_measurement(bench: Bench, name: str) -> Measurement:
    """Load a stored measurement.

    Raises:
        NotFound: there is none of this name.
        BadMeasurement: it is not usable.
    """
    try:
        return bench.measurements.load(name)
    except BadMeasurement:
        raise
    except NotAllowed as error:
        raise NotFound(error.text, value=name) from error


def measurement_head(bench: Bench, name: str) -> Head:
    """Read the header of a stored measurement.

    Raises:
        NotFound: there is none of this name.
        BadMeasurement: it is not usable.
    """
    try:
        return bench.measurements.head(name)
    except BadMeasurement:
        raise
    except NotAllowed as error:
        raise NotFound(error.text, value=name) from error


def info_of(name: str, found: Head) -> MeasurementInfo:
    """One row of the list."""
    identity = found.meta.get("identity")
    serial = identity.get("serial") if isinstance(identity, dict) else None
    return MeasurementInfo(
        file=name,
        kind=found.kind,
        drive=found.drive,
        profile=str(found.meta.get("profile", "")),
        serial=serial,
        saved=found.saved.astimezone(UTC),
    )


@router.get("/measurements")
async def list_measurements(bench: TheBench) -> list[MeasurementInfo]:
    """List stored measurements, newest first; unusable ones with their problem."""
    return await asyncio.to_thread(_listed, bench)


def _listed(bench: Bench) -> list[MeasurementInfo]:
    rows = []
    for name in bench.measurements.names():
        try:
            rows.append(info_of(name, bench.measurements.head(name)))
        except NotAllowed as error:
            # Damaged, or copied by hand under a name by which it cannot be opened.
            rows.append(
                MeasurementInfo(
                    file=name, kind="", drive="", profile="", serial=None, saved=None,
                    problem=words_of(error.text), problem_message=message_of(error.text),
                )
            )  # fmt: skip
    return rows


@router.get("/measurements/{name}")
async def read_measurement(bench: TheBench, name: str) -> MeasurementContent:
    """Read a measurement, evaluated again from its raw data and compared with its first result."""
    found = await asyncio.to_thread(load_measurement, bench, name)
    made = await asyncio.to_thread(evaluate, found)
    settings = found.meta.get("settings")
    return MeasurementContent(
        info=info_of(name, found.head),
        settings=settings if isinstance(settings, dict) else {},
        result=result_in_language(made.result, language()),
        agrees=made.agrees,
        differences=list(made.differences),
        program=str(found.meta.get("program", "")),
        profile_version=str(found.meta.get("profile_version", "")),
    )


@router.get("/measurements/{name}/file", response_class=Response)
async def download_measurement(bench: TheBench, name: str) -> Response:
    """Download the file with its raw signals, even if it is damaged."""
    try:
        data = await asyncio.to_thread(bench.measurements.read, name)
    except NotAllowed as error:
        raise NotFound(error.text, value=name) from error
    return Response(
        data,
        media_type="application/octet-stream",
        headers=disposition("attachment", name),
    )


@router.post("/measurements", status_code=201)
async def upload_measurement(
    bench: TheBench, request: Request, name: Annotated[str, Query(max_length=100)]
) -> MeasurementInfo:
    """Store a file from another computer; the body is the file."""
    data = await request.body()
    if len(data) > _MAX_BYTES:
        raise OutOfRange(
            "api-tuning.too-large", value=len(data), limit=limits.size(_MAX_BYTES), name=name
        )
    whole = name.removesuffix(SUFFIX) + SUFFIX
    stored = await asyncio.to_thread(bench.measurements.store, whole, data)
    return info_of(stored, await asyncio.to_thread(bench.measurements.head, stored))


@router.post("/measurements/{name}/signature")
async def sign_measurement(
    bench: TheBench, me: Me, name: str, request: SignatureRequest
) -> SafetyResult:
    """Sign the record of a safety function; possible once. The signature certifies nothing.

    A person who is logged in signs by that name; ``person`` is used on stations without accounts.
    """
    person = (request.person if me.kind == "local" else me.person).strip()
    if not person:
        raise NotAllowed("safety-check.signer-needs-name", parameter="person")
    when = datetime.now(UTC).isoformat(timespec="seconds")
    found = await asyncio.to_thread(load_measurement, bench, name)
    try:
        signature = signed(found.arrays, found.meta, person, when, request.notes)
    except ValueError as error:
        raise NotAllowed("safety-check.nothing-to-sign", value=name, name=name) from error
    result = reevaluate(found.arrays, {**found.meta, "signature": signature})
    await asyncio.to_thread(
        bench.measurements.sign, name, signature, result.model_dump(mode="json")
    )
    line = text(
        "journal.record-signed",
        drive=found.head.drive,
        name=name,
        person=person,
        sha256=str(signature["sha256"]),
    )
    bench.journal.add(line)
    return result.model_copy(update={"measurements": (name,)})


@router.delete("/measurements/{name}", status_code=204)
async def delete_measurement(bench: TheBench, name: str) -> None:
    """Delete a file, even if it is damaged."""
    try:
        bench.measurements.delete(name)
    except NotAllowed as error:
        raise NotFound(error.text, value=name) from error
