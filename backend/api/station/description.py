"""Routes of description files, profiles, line settings and additional ports."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any

from fastapi import APIRouter, Path, Query, Request, Response

from backend.api.messages import convert
from backend.api.messages.errors import message_of, words_of
from backend.api.messages.models import JobInfo
from backend.api.requests.context import TheBench, TheDrive
from backend.api.requests.named_profile import profile_files, profile_named
from backend.api.station.models import ProfileMatch
from backend.api.station.models_description import (
    PROFILE_NAME,
    DescribedDevice,
    ImportedDescription,
    ImportFinding,
    LineSearchRequest,
    LineSearchResult,
    MissingPort,
    ProfileTexts,
    ReadDictionaryRequest,
)
from backend.foundation.work.jobs import JobResult, Progress
from backend.station.drives.description import BadDescription, drive_task, import_in_process
from backend.station.drives.second_port import missing_ports
from backend.station.line_search import search_line
from drivers.errors import NotAllowed
from drivers.link import Found
from drivers.texts import limits
from drivers.texts.imports import failure_text, message_of_import, summary_text
from drivers.texts.message import Text, text
from drivers.texts.profile_words import translated
from profiles import drive_names
from profiles.importer import ImportFailed, export_eds, export_esi
from profiles.importer.esi.esi import MAX_BYTES
from profiles.importer.process import DevicesTask, FileTask
from profiles.language.overlay import Language
from profiles.loader import user_folder
from profiles.schema import LinkKind

router = APIRouter()

_BODY = {
    "requestBody": {
        "required": True,
        "content": {"application/octet-stream": {"schema": {"type": "string"}}},
    }
}
ProfileName = Annotated[str, Path(pattern=PROFILE_NAME, description="name of the profile")]
FileName = Annotated[str, Query(min_length=1, max_length=200, description="name of the file")]


async def _upload(request: Request, file: str) -> bytes:
    """Read the body, up to the size that the parsers accept.

    Raises:
        BadDescription: it is larger, or empty.
    """
    data = bytearray()
    async for chunk in request.stream():
        data += chunk
        if len(data) > MAX_BYTES:
            raise BadDescription(
                "api-station.larger-mib",
                limit=limits.size(MAX_BYTES),
                file=file,
                max_mib=MAX_BYTES >> 20,
            )
    if not data:
        raise BadDescription("api-station.empty", file=file)
    return bytes(data)


def _require_new(name: str) -> None:
    if name in drive_names():
        raise BadDescription("api-station.profile-already", value=name)


@router.post("/descriptions/devices", openapi_extra=_BODY)
async def described_devices(request: Request, file: FileName) -> list[DescribedDevice]:
    """List the devices of an ESI file; empty for an EDS or DCF file, which has one device."""
    reported = await import_in_process(DevicesTask(await _upload(request, file), file))
    return [DescribedDevice.model_validate(device) for device in reported["devices"]]


@router.post("/descriptions", status_code=202, openapi_extra=_BODY)
async def import_description(
    bench: TheBench,
    request: Request,
    file: FileName,
    profile: Annotated[str | None, Query(pattern=PROFILE_NAME)] = None,
    product_code: Annotated[int | None, Query(ge=0, le=0xFFFFFFFF)] = None,
    revision: Annotated[int | None, Query(ge=0, le=0xFFFFFFFF)] = None,
) -> JobInfo:
    """Make a profile from an ESI, EDS or DCF file; the job's result is ImportedDescription."""
    data = await _upload(request, file)
    if profile is not None:
        _require_new(profile)
    task = FileTask(data, file, user_folder(), profile, product_code, revision)

    async def work(progress: Progress) -> JobResult:
        progress(0.0, text("api-station.reading", file=file))
        made = _imported(await import_in_process(task))
        line = text(
            "journal.description-imported",
            file=file,
            profile=made.profile,
            summary=_summary(made),
        )
        bench.journal.add(line)
        return made.model_dump(mode="json")

    return convert.job(bench.jobs.start("import", text("api-station.import", file=file), work))


@router.post("/descriptions/from-drive", status_code=202)
async def read_dictionary(bench: TheBench, request: ReadDictionaryRequest) -> JobInfo:
    """Make a profile from a drive's own dictionary; the job's result is ImportedDescription."""
    _require_new(request.profile)
    place = text("api-station.station-of-bus", station=request.station, url=request.url)

    async def work(progress: Progress) -> JobResult:
        progress(0.0, text("api-station.looking", place=place))
        seen = await bench.buses.scan(request.url, [request.station], lambda _fraction, _step: None)
        found = next((f for f in seen if f.station == request.station), None)
        if found is None:
            raise NotAllowed("api-station.nothing-answers", place=place)
        link = await bench.buses.open(request.url)
        try:
            task = await drive_task(link, found, request.profile, progress)
        except ImportFailed as error:
            raise BadDescription(
                "api-station.description-of-drive", place=place, cause=failure_text(error)
            ) from error
        progress(0.95, text("api-station.making-profile"))
        made = _imported(await import_in_process(task))
        line = text(
            "journal.dictionary-read", place=place, profile=made.profile, summary=_summary(made)
        )
        bench.journal.add(line)
        return made.model_dump(mode="json")

    return convert.job(
        bench.jobs.start("import", text("api-station.read-dictionary", place=place), work)
    )


@router.get("/profiles/matches")
async def profile_matches(
    kind: Annotated[LinkKind, Query(description="kind of bus")],
    name: Annotated[str, Query(max_length=200)] = "",
    vendor_id: Annotated[int | None, Query(ge=0, le=0xFFFFFFFF)] = None,
    product_code: Annotated[int | None, Query(ge=0, le=0xFFFFFFFF)] = None,
) -> list[ProfileMatch]:
    """List the profiles that match an identity, best first.

    For drives that a scan found before their profile was imported.
    """
    found = Found(0, vendor_id=vendor_id, product_code=product_code, name=name)
    return convert.matches(kind, found)


@router.get("/profiles/{profile}/eds", response_class=Response)
async def export_profile(profile: ProfileName) -> Response:
    """Export a profile's objects as a CANopen EDS file."""
    known = profile_named(profile)
    text = export_eds(known, datetime.now())
    return Response(
        text.encode("utf-8"),
        media_type="text/plain; charset=utf-8",
        headers={"Content-Disposition": f'attachment; filename="{known.drive}.eds"'},
    )


@router.get("/profiles/{profile}/esi", response_class=Response)
async def export_slave_information(profile: ProfileName) -> Response:
    """Export a profile's identity, objects, PDOs and bring-up as an ESI file (ETG.2000)."""
    known = profile_named(profile)
    if known.link("ethercat") is None:
        raise NotAllowed("api-station.no-ethercat-profile", value=profile)
    return Response(
        export_esi(known),
        media_type="application/xml",
        headers={"Content-Disposition": f'attachment; filename="{known.drive}.xml"'},
    )


def _imported(reported: dict[str, Any]) -> ImportedDescription:
    """The result of an import process, with its messages."""
    findings = [
        ImportFinding(
            place=found["place"],
            text=words_of(message := message_of_import(found)),
            text_message=message_of(message),
            outcome=found["outcome"],
        )
        for found in reported.pop("findings")
    ]
    summary = summary_text((each.outcome for each in findings), reported["not_listed"])
    return ImportedDescription(
        **reported,
        summary=words_of(summary),
        summary_message=message_of(summary),
        findings=findings,
    )


def _summary(made: ImportedDescription) -> Text:
    return summary_text((each.outcome for each in made.findings), made.not_listed)


@router.get("/profiles/{profile}/texts")
async def profile_texts(
    profile: ProfileName,
    language: Annotated[Language, Query(description="language of the texts")],
) -> ProfileTexts:
    """Read the texts of a profile in another language, by their English original."""
    with profile_files(profile):
        texts = translated(profile, language)
    return ProfileTexts(profile=profile, language=language, texts=texts)


@router.post("/search-line", status_code=202)
async def search_line_settings(bench: TheBench, request: LineSearchRequest) -> JobInfo:
    """Try baud rates and parities of a serial bus; the job's result is LineSearchResult."""

    async def work(progress: Progress) -> JobResult:
        found = await search_line(bench, request.url, request.stations, progress)
        if found is None:
            return LineSearchResult(url=None, found=[]).model_dump(mode="json")
        kind = found.url.split(":", 1)[0]
        drives = [convert.found_drive(bench, found.url, kind, each) for each in found.drives]
        return LineSearchResult(url=found.url, found=drives).model_dump(mode="json")

    return convert.job(
        bench.jobs.start("search-line", text("api-station.line-settings", url=request.url), work)
    )


@router.get("/drives/{drive_id}/missing-ports")
async def drive_missing_ports(connected: TheDrive) -> list[MissingPort]:
    """List additional ports over which a drive could be reached, and what only they reach."""
    return [
        MissingPort(
            kind=port.kind,
            parameters=port.parameters,
            groups=list(port.groups),
            wiring=port.wiring,
        )
        for port in missing_ports(connected.drive)
    ]
