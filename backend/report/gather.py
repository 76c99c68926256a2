"""Collection of a report's facts: from the connected drive, its changes, and measurements."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime

import backend
from backend.axes.drive.drive import Drive
from backend.records.handover.conflicts import changed_since
from backend.records.handover.record import HandedOver
from backend.records.library.measurements import (
    BadMeasurement,
    Head,
    MeasurementStore,
    profile_version,
)
from backend.report.changes import Change, net
from backend.report.facts import ChangedSetting, Facts, HandedOverFile, Identity, Measured
from backend.report.tools import result_of, verdict_of
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from backend.station.evaluation import evaluate
from backend.tools.registry import TOOLS
from drivers.errors import DriveError, NotAllowed
from drivers.texts.message import Language, Text, joined, prose, text
from drivers.texts.profile_words import ProfileWords
from profiles.schema import Parameter, Raw

#: Kinds of measurements in the order of the report, which is that of commissioning. Tools that are
#: not named here come last.
_ORDER = tuple(dict.fromkeys((
    "inertia", "sweep-mechanics", "sweep-speed_loop", "sweep-position_loop", "step-speed",
    "step-move", *(tool.kind for tool in TOOLS),
)))  # fmt: skip


@dataclass(frozen=True)
class About:
    """Details of the work that a person enters; free text."""

    person: str = ""
    machine: str = ""
    notes: str = ""


def kind_of(head: Head) -> str:
    """Kind of a measurement in a report, which distinguishes steps of speed from moves."""
    settings = head.meta.get("settings")
    if head.kind == "step" and isinstance(settings, dict):
        return f"step-{settings.get('kind', 'speed')}"
    return head.kind


def belongs(head: Head, drive: Drive) -> bool:
    """Whether a file was measured on this drive; by serial number where both have one."""
    identity, found = head.meta.get("identity"), drive.found
    serial = identity.get("serial") if isinstance(identity, dict) else None
    if head.meta.get("profile") != drive.profile.drive:
        return False
    if serial is not None and found is not None and found.serial is not None:
        return bool(serial == found.serial)
    return head.meta.get("drive_id", drive.id) == drive.id and head.drive == drive.name


def choose(heads: Mapping[str, Head], changed_first: datetime | None) -> list[tuple[str, str]]:
    """The newest file of each kind, each with the newest before the first change ("" for none)."""
    chosen = []
    for kind in _ORDER:
        for files in _alike(kind, heads):
            newest = files[-1][1]
            before = [f for saved, f in files if changed_first and saved < changed_first]
            # Records of a safety function are not compared before and after tuning.
            compares = kind != "safety-check" and before and before[-1] != newest
            chosen.append((newest, before[-1] if compares else ""))
    return chosen


def _alike(kind: str, heads: Mapping[str, Head]) -> list[list[tuple[datetime, str]]]:
    """Files of a kind, sorted by time; grouped by safety function, as each has its own record."""
    groups: dict[str, list[tuple[datetime, str]]] = {}
    for file, head in heads.items():
        if kind_of(head) == kind:
            settings = head.meta.get("settings")
            function = settings.get("function", "") if isinstance(settings, dict) else ""
            groups.setdefault(str(function), []).append((head.saved, file))
    return [sorted(groups[name]) for name in sorted(groups)]


def measured_from(
    store: MeasurementStore, chosen: Iterable[tuple[str, str]]
) -> tuple[tuple[Measured, ...], tuple[Text, ...]]:
    """Evaluate chosen files again; returns messages about those that fail. Takes seconds.

    Raises:
        NotAllowed: there is no file of a name.
    """
    found: list[Measured] = []
    unusable: list[Text] = []
    for newest, earlier in chosen:
        try:
            measured = _measured(store, newest)
        except (BadMeasurement, DriveError) as error:
            unusable.append(_why(newest, error))
            continue
        if earlier:
            try:
                measured = replace(measured, earlier=_measured(store, earlier))
            except (BadMeasurement, DriveError) as error:
                unusable.append(_why(earlier, error))
        found.append(measured)
    return tuple(found), tuple(unusable)


def _why(file: str, error: DriveError) -> Text:
    """The error's text with the name of the file, which it contains already if it is its value."""
    return error.text if error.value == file else joined((prose(file), error.text), ": ")


def _measured(store: MeasurementStore, file: str) -> Measured:
    loaded = store.load(file)
    made = evaluate(loaded)
    settings = loaded.meta.get("settings")
    return Measured(
        file,
        kind_of(loaded.head),
        loaded.head.saved,
        str(loaded.meta.get("program", "")),
        made.differences,
        settings if isinstance(settings, dict) else {},
        result_of(loaded.meta.get("tool"), made.result),
        verdict=verdict_of(loaded.meta.get("verdict")),
    )


# --- the drive -------------------------------------------------------------------------


async def live_facts(
    bench: Bench,
    connected: ConnectedDrive,
    changes: Sequence[Change],
    about: About,
    language: Language,
) -> Facts:
    """All facts but the measurements; parameters that were changed are read from the drive now.

    A drive that does not answer is mentioned in the report and raises no error.
    """
    drive = connected.drive
    settings, trouble = await _changes(drive, changes, language)
    snapshot = connected.monitor.snapshot
    if not snapshot.fresh:
        why = snapshot.problem or text("report.drive-does-not-answer")
        trouble.append(joined((prose(drive.name), why), ": "))
    say = ProfileWords(drive.profile.drive, language)
    trouble += [prose(f"{fault.code} {say(fault.name)}") for fault in snapshot.faults]
    named = {key: say(each.name) for key, each in drive.profile.by_key.items()}
    return Facts(
        identity=_identity(bench, drive),
        made=datetime.now(UTC),
        program=backend.__version__,
        person=about.person,
        machine=about.machine,
        notes=about.notes,
        changes=settings,
        last_change=changes[-1].time if changes else None,
        unsaved=tuple(sorted(f"{key} {named[key]}" for key in drive.unsaved)),
        pending=tuple(sorted(f"{key} {named[key]}" for key in drive.pending)),
        trouble=tuple(trouble),
    )


def _identity(bench: Bench, drive: Drive) -> Identity:
    found = drive.found
    return Identity(
        axis=drive.name,
        drive=drive.profile.title,
        manual=drive.profile.manual,
        profile_version=profile_version(drive.profile),
        vendor_id=found.vendor_id if found else None,
        product_code=found.product_code if found else None,
        revision=found.revision if found else None,
        serial=found.serial if found else None,
        firmware=found.firmware if found else "",
        buses=tuple(f"{bench.buses.url_of(port)} #{port.station}" for port in drive.ports),
    )


async def _changes(
    drive: Drive, changes: Sequence[Change], language: Language
) -> tuple[tuple[ChangedSetting, ...], list[Text]]:
    say = ProfileWords(drive.profile.drive, language)
    rows: list[ChangedSetting] = []
    trouble: list[Text] = []
    for each in net(changes):
        parameter = drive.profile.by_key.get(each.key)
        if parameter is None:
            continue
        now = ""
        if not trouble:
            try:
                raw = await drive.raw(each.key)
                now = "" if raw == each.after else shown(parameter, raw, say)
            except DriveError as error:
                trouble.append(error.text)
        rows.append(
            ChangedSetting(
                each.key,
                say(parameter.name),
                shown(parameter, each.before, say),
                shown(parameter, each.after, say),
                each.time,
                now,
            )
        )
    return tuple(rows), trouble


def shown(parameter: Parameter, raw: int, say: Callable[[str], str] = str) -> str:
    """A raw value in engineering units, or with its text in the manual as ``say`` gives it."""
    if raw in parameter.enum:
        return f"{raw}: {say(parameter.enum[raw])}"
    value = parameter.to_value(raw)
    return f"{value} {parameter.unit}".rstrip()


async def handed_over_facts(
    drive: Drive, made: Sequence[HandedOver], language: Language
) -> tuple[HandedOverFile, ...]:
    """The newest hand-over of each format, compared with the values in the drive now."""
    say = ProfileWords(drive.profile.drive, language)
    newest = {each.format: each for each in made}
    found = []
    for each in sorted(newest.values(), key=lambda one: one.time):
        known = {key: raw for key, raw in each.values.items() if key in drive.profile.by_key}
        keys = [key for key in known if not drive.unreachable_why(drive.parameter(key))]
        readings = await drive.read_many(keys) if keys else {}
        now = {key: reading.raw for key, reading in readings.items()}
        found.append(
            HandedOverFile(
                each.time, each.person, each.format, each.file, each.sha256, each.set_file,
                tuple(
                    (key, say(drive.parameter(key).name), _text_of(drive.parameter(key), raw, say))
                    for key, raw in known.items()
                ),
                tuple(
                    (
                        change.key, say(change.name),
                        _text_of(drive.parameter(change.key), known[change.key], say),
                        _text_of(drive.parameter(change.key), change.controller, say),
                    )
                    for change in changed_since(drive.profile, known, now)
                ),
            )
        )  # fmt: skip
    return tuple(found)


def _text_of(parameter: Parameter, raw: Raw, say: Callable[[str], str]) -> str:
    return shown(parameter, raw, say) if isinstance(raw, int) else str(raw)


# --- files alone -----------------------------------------------------------------------


def facts_of_files(heads: Mapping[str, Head], about: About) -> Facts:
    """Facts of a drive from measurement files alone.

    Raises:
        NotAllowed: the files are of different drives.
    """
    identities = {
        (head.drive, str(head.meta.get("profile")), _serial(head)) for head in heads.values()
    }
    if len(identities) != 1:
        drives = ", ".join(sorted(f"{name} ({serial})" for name, _, serial in identities))
        raise NotAllowed("report.measurements-different-drives", value=drives or "none")
    head = next(iter(heads.values()))
    reported = head.meta.get("identity")
    numbers = reported if isinstance(reported, dict) else {}

    def number(name: str) -> int | None:
        value = numbers.get(name)
        return value if isinstance(value, int) else None

    return Facts(
        identity=Identity(
            axis=head.drive,
            drive=str(head.meta.get("profile_title") or head.meta.get("profile", "")),
            manual=str(head.meta.get("manual", "")),
            profile_version=str(head.meta.get("profile_version", "")),
            vendor_id=number("vendor_id"), product_code=number("product_code"),
            revision=number("revision"), serial=number("serial"),
            firmware=str(numbers.get("firmware") or ""),
        ),
        made=datetime.now(UTC), program=backend.__version__, person=about.person,
        machine=about.machine, notes=about.notes, live=False,
    )  # fmt: skip


def _serial(head: Head) -> str:
    identity = head.meta.get("identity")
    return str(identity.get("serial")) if isinstance(identity, dict) else ""
