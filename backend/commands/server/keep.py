"""``servodeck backup``, ``restore``, ``audit …`` and ``library …``: stored data of a station."""

from __future__ import annotations

import getpass
import json
import sys
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Annotated, Literal

import typer

from backend.axes.parameters import set_file as parameter_set
from backend.commands.base.options import Json
from backend.commands.base.printing import note, print_text
from backend.commands.base.session import reporting_errors
from backend.commands.base.state import chosen_folder, state_folder
from backend.foundation.people.identity import LOCAL, Actor, acting
from backend.foundation.work.journal import Journal
from backend.records.audit.chain import Anchor
from backend.records.audit.export_check import check_lines
from backend.records.audit.trail import Filter
from backend.records.library.backup.backup import make_backup
from backend.records.library.backup.restore import restore as restore_archive
from backend.records.library.entries import KINDS, Kind, Query
from backend.station.records import Records
from drivers.errors import NotAllowed

audit = typer.Typer(help="Check and export the audit trail.", no_args_is_help=True)
library = typer.Typer(help="Search, export and import the library.", no_args_is_help=True)

Config = Annotated[Path | None, typer.Option(help="state folder of the station")]
Database = Annotated[
    str | None,
    typer.Option(
        envvar="SERVODECK_DATABASE",
        help="library and audit, such as postgresql://user:password@host/name; "
        "by default a file in the state folder",
    ),
]
BlobPlace = Annotated[
    str | None,
    typer.Option(
        "--blobs",
        envvar="SERVODECK_BLOBS",
        help="large contents: a folder or s3://bucket/prefix; by default in the state folder",
    ),
]
Out = Annotated[Path | None, typer.Option(help="file to write; by default the terminal")]


def station_records(config: Path | None, database: str | None, blobs: str | None = None) -> Records:
    """The records of the station of this folder, with the terminal's user as the acting person."""
    who = replace(LOCAL, person=f"{getpass.getuser()} (terminal)")
    acting.set(Actor(who))
    return Records(state_folder(config), Journal(), database, blobs)


def _existing(config: Path | None, database: str | None, blobs: str | None = None) -> Records:
    """The records of a station, where its database exists.

    Raises:
        NotAllowed: there is no database in this folder.
    """
    records = station_records(config, database, blobs)
    file = records.store.sqlite_file
    if file is not None and not file.exists():
        raise NotAllowed("command.no-database", value=str(file), file=str(file))
    return records


# --- backup ------------------------------------------------------------------------------


@reporting_errors
def backup(
    archive: Annotated[Path, typer.Argument(help="zip file to write")],
    config: Config = None,
    database: Database = None,
    recordings: Annotated[bool, typer.Option(help="recordings too")] = True,
    overwrite: Annotated[bool, typer.Option(help="replace an existing file")] = False,
) -> None:
    """Save everything that the station keeps. The server may run meanwhile."""
    store = _existing(config, database).store
    parts = make_backup(store, archive, recordings=recordings, overwrite=overwrite)
    store.close()
    size = sum(part.bytes for part in parts.values())
    print_text("printed.backup-made", file=str(archive), files=len(parts), size=size)


@reporting_errors
def restore(
    archive: Annotated[Path, typer.Argument(help="zip file of `servodeck backup`")],
    config: Config = None,
    database: Database = None,
    replace_: Annotated[
        bool,
        typer.Option("--replace", help="the present state folder is kept under another name"),
    ] = False,
) -> None:
    """Put a backup in place, after checking it as a whole. End the server first."""
    folder = chosen_folder(config)
    done = restore_archive(archive, folder, database=database, replace=replace_)
    print_text(
        "printed.backup-restored", folder=str(folder), files=done.parts, entries=done.audit_entries
    )
    if done.copied_rows:
        print_text("printed.rows-in-database", rows=done.copied_rows)
    if done.aside is not None:
        print_text("printed.before-is-in", folder=str(done.aside))


# --- audit -------------------------------------------------------------------------------


@audit.command("verify")
@reporting_errors
def verify(
    config: Config = None,
    database: Database = None,
    anchor: Annotated[str, typer.Option(help="NUMBER:HASH noted earlier")] = "",
    file: Annotated[
        Path | None, typer.Option(help="check an export (JSON lines) instead of the database")
    ] = None,
) -> None:
    """Check the whole chain; the exit code is 1 where it is broken."""
    known = _anchor(anchor)
    if file is not None:
        # What is not UTF-8 is replaced, so that its entry counts as changed.
        with file.open(encoding="utf-8", errors="replace") as lines:
            verdict = check_lines(lines, known)
    else:
        records = _existing(config, database)
        verdict = records.trail.verify(known)
        records.store.close()
    if not verdict.ok:
        note("printed.audit-broken", entry=verdict.broken, why=str(verdict.why))
        raise typer.Exit(1)
    print_text("printed.audit-whole", entries=verdict.entries)
    print_text("printed.anchor", head=str(verdict.head))


def _anchor(text: str) -> Anchor | None:
    if not text:
        return None
    number, _, digest = text.partition(":")
    if not (number.isascii() and number.isdigit() and len(number) < 19) or len(digest) != 64:
        raise NotAllowed("command.no-anchor", value=text, limit="NUMBER:HASH")
    return Anchor(int(number), digest.lower())


@audit.command("export")
@reporting_errors
def export(
    config: Config = None,
    database: Database = None,
    out: Out = None,
    form: Annotated[Literal["csv", "jsonl"], typer.Option("--format")] = "csv",
    kind: Annotated[list[str] | None, typer.Option(help="such as write or login")] = None,
    person: Annotated[str, typer.Option()] = "",
    axis: Annotated[str, typer.Option(help="its name")] = "",
    since: Annotated[datetime | None, typer.Option(help="local time")] = None,
    until: Annotated[datetime | None, typer.Option(help="local time")] = None,
) -> None:
    """Write entries as a table, or as JSON lines with their hashes."""
    records = _existing(config, database)
    wanted = Filter(
        kinds=tuple(kind or ()),
        person=person,
        axis=axis,
        since=since.astimezone() if since else None,
        until=until.astimezone() if until else None,
    )
    lines = records.trail.export(wanted, form)
    if out is None:
        sys.stdout.writelines(lines)
    else:
        with out.open("w", encoding="utf-8", newline="") as file:
            file.writelines(lines)
    records.store.close()


# --- library -----------------------------------------------------------------------------


@library.command("list")
@reporting_errors
def list_(
    words: Annotated[list[str] | None, typer.Argument(help="all must occur")] = None,
    config: Config = None,
    database: Database = None,
    kind: Annotated[str, typer.Option(help=", ".join(KINDS))] = "",
    tag: Annotated[str, typer.Option()] = "",
    as_json: Json = False,
) -> None:
    """Search the library."""
    records = _existing(config, database)
    records.sets.take_in()
    records.index.refresh()
    query = Query(words=" ".join(words or ()), kinds=_kinds(kind), tag=tag, limit=1000)
    entries, total = records.library.search(query)
    records.store.close()
    if as_json:
        rows = [
            {
                "id": e.id, "kind": e.kind, "station": e.station, "name": e.name,
                "tags": list(e.tags), "notes": e.notes, "changed": e.changed.isoformat(),
                "versions": e.versions, "axis": e.latest.axis.name,
                "profile": e.latest.axis.profile, "serial": e.latest.axis.serial,
            }
            for e in entries
        ]  # fmt: skip
        print(json.dumps(rows, indent=1, ensure_ascii=False))
        return
    for e in entries:
        tags = f"  [{', '.join(e.tags)}]" if e.tags else ""
        print(f"{e.kind:<12} {e.name}  v{e.latest.number}  {e.latest.axis.name}{tags}")
    if total > len(entries):
        print_text("printed.more-entries", count=total - len(entries))


def _kinds(name: str) -> tuple[Kind, ...]:
    if name and name not in KINDS:
        raise NotAllowed("command.no-kind", value=name, limit=", ".join(KINDS))
    return tuple(kind for kind in KINDS if kind == name)


@library.command("export")
@reporting_errors
def export_set(
    name: str,
    config: Config = None,
    database: Database = None,
    blobs: BlobPlace = None,
    version: Annotated[int | None, typer.Option(help="the latest by default")] = None,
    out: Out = None,
) -> None:
    """Write a parameter set's file."""
    records = _existing(config, database, blobs)
    data = records.sets.read(name, version)
    records.store.close()
    if out is None:
        sys.stdout.buffer.write(data)
    else:
        out.write_bytes(data)


@library.command("import")
@reporting_errors
def import_sets(
    files: list[Path],
    config: Config = None,
    database: Database = None,
    blobs: BlobPlace = None,
    tag: Annotated[list[str] | None, typer.Option(help="to put on them")] = None,
) -> None:
    """Take parameter-set files into the library; a known name gets a new version."""
    records = station_records(config, database, blobs)
    for file in files:
        data = file.read_bytes()
        parameter_set.parse(data, file.name)
        stored = records.sets.store(file.name, data, overwrite=True, tags=tag or ())
        print_text(
            "printed.stored-version", name=stored, version=records.sets.entry(stored).versions
        )
    records.audit.close()
    records.store.close()


@library.command("purge")
@reporting_errors
def purge(
    config: Config = None,
    database: Database = None,
    blobs: BlobPlace = None,
    days: Annotated[float, typer.Option(min=0, help="archived longer ago than this")] = 30.0,
) -> None:
    """Delete for good what was archived, and contents that nothing names any more."""
    records = _existing(config, database, blobs)
    gone = records.library.purge(datetime.now(UTC) - timedelta(days=days))
    records.audit.close()
    records.store.close()
    for entry in gone:
        print_text(
            "printed.versions-deleted", kind=entry.kind, name=entry.name, count=entry.versions
        )
    print_text("printed.deleted", count=len(gone))
