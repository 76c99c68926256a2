"""Jobs on parameters: read many, load a set with verified writes, save a set."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

from backend.axes.drive.drive import Drive
from backend.axes.drive.identity import confirm_identity
from backend.axes.drive.readings import Reading
from backend.axes.motion.grant import NotGranted
from backend.axes.parameters import set_file as parameter_set
from backend.axes.parameters.set_file import ParameterSet
from backend.foundation.work.jobs import JobResult
from backend.records.library import SetStore
from backend.records.library.identity import differences
from drivers.errors import DriveError, LinkLost, LinkTimeout, NotAllowed, with_remedy
from drivers.link import Progress
from drivers.texts.answers import sentence
from drivers.texts.message import Text, text
from profiles.schema import Raw

#: Tag of the sets that are stored before something is loaded.
UNDO = "undo"
#: Number of missing settings that are named in a message.
_NAMED = 5


def readable_keys(drive: Drive) -> list[str]:
    """Keys of all parameters that can be read over the connected ports."""
    return [
        p.key for p in drive.profile.parameters if p.access != "wo" and not drive.unreachable_why(p)
    ]


async def read_all(drive: Drive, keys: Sequence[str] | None, progress: Progress) -> JobResult:
    """Read ``keys``, or all that can be read; values are published as they arrive.

    Raises:
        LinkLost: the link to the bus is lost.
    """
    wanted = readable_keys(drive) if keys is None else list(keys)
    readings = await drive.read_many(wanted, progress)
    failed = {k: r.problem for k, r in readings.items() if r.problem is not None and not r.unused}
    return {
        "read": sum(r.problem is None for r in readings.values()),
        "failed": {key: why.words() for key, why in failed.items()},
        "failed_messages": {key: why.to_wire() for key, why in failed.items()},
    }


async def read_settings(
    drive: Drive, *, motor_individual: bool, progress: Progress | None = None
) -> dict[str, Reading]:
    """Read everything that belongs in a parameter set.

    Raises:
        LinkTimeout: no parameter could be read.
        LinkLost: the link to the bus is lost.
    """
    wanted = parameter_set.storable(drive.profile, motor_individual=motor_individual)
    keys = [p.key for p in wanted if not drive.unreachable_why(p)]
    readings = await drive.read_many(keys, progress)
    if all(r.raw is None for r in readings.values()):
        raise LinkTimeout("set.no-parameter-read-nothing", drive=drive.name)
    return readings


def without(keys: Sequence[str]) -> Text | None:
    """Text on the settings that a set lacks, for the end of a sentence; None if complete."""
    if not keys:
        return None
    named = ", ".join(keys[:_NAMED]) + (" …" if len(keys) > _NAMED else "")
    return text("set.without", count=len(keys), keys=named)


async def save_set(
    drive: Drive,
    library: SetStore,
    name: str,
    *,
    author: str,
    notes: str,
    motor_individual: bool,
    overwrite: bool,
    progress: Progress | None = None,
) -> str:
    """Read the drive's settings and store them; returns the file name.

    Raises:
        NotAllowed: the name is in use.
        StorageFailed: the file cannot be stored.
        LinkLost: the link to the bus is lost.
    """
    readings = await read_settings(drive, motor_individual=motor_individual, progress=progress)
    data = parameter_set.dump(
        drive, readings.values(), author=author, notes=notes, saved=datetime.now(UTC)
    )
    return await asyncio.to_thread(library.store, name, data, overwrite=overwrite)


@dataclass(frozen=True, slots=True)
class Written:
    """One row of the report on loading a set; raw values."""

    key: str
    before: Raw | None
    wanted: Raw
    after: Raw | None
    ok: bool
    problem: Text | None = None

    def answer(self) -> dict[str, object]:
        """The row as part of the job's result."""
        row: dict[str, object] = {
            "key": self.key,
            "before": self.before,
            "wanted": self.wanted,
            "after": self.after,
            "ok": self.ok,
        }
        return row | sentence("problem", self.problem)


async def load_set(
    drive: Drive,
    content: ParameterSet,
    keys: Sequence[str],
    progress: Progress,
    *,
    library: SetStore,
    accept_other_identity: bool,
    accept_motor_individual: bool = False,
) -> JobResult:
    """Write the chosen rows one by one, each read back, after storing the present values.

    All rows and the identity of the drive are checked before the first one is written.

    Raises:
        NotAllowed: another family's or drive's file without consent, or a chosen row that cannot
            be written; nothing was written.
        LinkLost: the set was written in part; states how far, and the stored previous values.
    """
    await confirm_identity(drive)
    other = _check_identity(drive, content, accept_other_identity)
    if other and not accept_motor_individual:
        _refuse_motor_individual(drive, keys)
    rows = {row.key: row for row in content.rows}
    chosen: list[tuple[str, Raw]] = []
    for key in keys:
        row = rows.get(key)
        if row is None or row.raw is None:
            raise NotAllowed("set.file-no-usable-value", drive=drive.name, parameter=key)
        chosen.append((key, drive.check(drive.parameter(key), row.raw)))
    progress(0.0, text("set.storing-present-values"))
    backup = await _back_up(drive, library, [key for key, _ in chosen])
    report: list[Written] = []
    for number, (key, raw) in enumerate(chosen):
        progress(number / max(1, len(chosen)), text("set.writing", key=key))
        try:
            report.append(await _write_verified(drive, key, raw))
        except LinkLost as error:
            # Part of the set is in force now: state which part, and how to undo it.
            error.text = text(
                "set.written-in-part",
                cause=error.text,
                written=number,
                rows=len(chosen),
                key=key,
                backup=backup,
            )
            raise
    return {
        "written": sum(row.ok for row in report),
        "failed": sum(not row.ok for row in report),
        "backup": backup,
        "rows": [row.answer() for row in report],
    }


def _check_identity(drive: Drive, content: ParameterSet, accepted: bool) -> bool:
    """Whether it is another drive's file, which the person has accepted.

    Raises:
        NotAllowed: another family's file, or another drive's without consent.
    """
    if content.profile != drive.profile.drive:
        raise NotAllowed(
            "set.file-drive-nothing-written",
            drive=drive.name,
            value=content.profile,
            limit=drive.profile.drive,
        )
    other = [difference for difference in differences(content, drive) if difference.other_drive]
    if other and not accepted:
        raise NotAllowed(
            "set.file-another-drive-nothing",
            drive=drive.name,
            value=other[0].theirs,
            limit=other[0].ours,
            other=other[0].text,
        )
    return bool(other)


def _refuse_motor_individual(drive: Drive, keys: Sequence[str]) -> None:
    """Refuse values of one motor (commutation offset, encoder bias, address), unsafe on another.

    Raises:
        NotAllowed: one of the keys is such a value; nothing was written.
    """
    for key in keys:
        parameter = drive.parameter(key)
        if parameter.motor_individual:
            raise NotAllowed(
                "set.belongs-motor-file-saved",
                drive=drive.name,
                parameter=parameter.key,
                key=parameter.name,
            )


async def _back_up(drive: Drive, library: SetStore, keys: Sequence[str]) -> str:
    """Store the present values of these parameters as a set, for undo; returns its name."""
    readings = await drive.read_many(keys)
    now = datetime.now(UTC)
    data = parameter_set.dump(
        drive, readings.values(), author="servodeck", notes="before loading a set", saved=now
    )
    stamp = now.strftime("%Y-%m-%d %H.%M.%S.%f")[:-3]
    name = f"before load {drive.id} {stamp}"
    return await asyncio.to_thread(library.store, name, data, tags=(UNDO,))


async def _write_verified(drive: Drive, key: str, raw: Raw) -> Written:
    before = drive.readings[key].raw if key in drive.readings else None
    try:
        after = (await drive.write(key, raw)).raw
    except LinkLost:
        raise
    except DriveError as error:
        problem = with_remedy(error) if isinstance(error, NotGranted) else error.text
        return Written(key, before, raw, None, ok=False, problem=problem)
    if after != raw:
        kept = text("set.keeps-other-value", after=after, raw=raw)
        return Written(key, before, raw, after, ok=False, problem=kept)
    return Written(key, before, raw, after, ok=True)
