"""Data about the axes that is stored with samples: identity, parameters, links, faults."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

from backend.axes.axis.fault_history import PastFault, history_of, read_history
from backend.axes.drive.drive import Drive
from backend.axes.drive.readings import Reading
from backend.axes.parameters import set_file as parameter_set
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from drivers.errors import DriveError
from drivers.link import LinkQuality
from drivers.texts.answers import sentence, sentences
from drivers.texts.message import text
from drivers.texts.states import state_text

#: Time limit [s], so that a drive without answer does not delay the samples of the others.
GEARING_TIMEOUT_S = 2.0


def _figures(now: LinkQuality) -> dict[str, object]:
    """Counters of a link as plain values."""
    return asdict(replace(now, state=None)) | sentence("state", now.state)


def identity(bench: Bench, connected: ConnectedDrive) -> dict[str, Any]:
    """Identity of the axis."""
    drive = connected.drive
    found = drive.found
    return {
        "drive": drive.id,
        "name": drive.name,
        "profile": drive.profile.drive,
        "title": drive.profile.title,
        "serial": found.serial if found else None,
        "firmware": found.firmware if found else "",
        "ports": [{"url": bench.buses.url_of(p), "station": p.station} for p in drive.ports],
        "notes": drive.notes,
    }


async def parameters(
    connected: ConnectedDrive, *, fresh: bool, timeout_s: float
) -> list[dict[str, Any]]:
    """Settings of the drive, each with the time of its reading, or the reason why there is none.

    ``fresh`` reads all of them now, otherwise only those that were never read. After ``timeout_s``
    [s] the values known by then are used.
    """
    drive = connected.drive
    wanted = [
        p.key
        for p in parameter_set.storable(drive.profile, motor_individual=True)
        if not drive.unreachable_why(p)
    ]
    missing = [key for key in wanted if fresh or key not in drive.readings]
    with contextlib.suppress(DriveError, TimeoutError):
        async with asyncio.timeout(timeout_s):
            await drive.read_many(missing)
    return [_row(connected, drive.readings.get(key), key) for key in wanted]


def _row(connected: ConnectedDrive, reading: Reading | None, key: str) -> dict[str, Any]:
    parameter = connected.drive.parameter(key)
    row: dict[str, Any] = {"key": key, "name": parameter.name, "unit": parameter.unit}
    if reading is None:
        row |= {"raw": None, "value": None, "time": None}
        return row | sentence("error", text("bundle.not-read"))
    raw, value = _plain(reading.raw), _plain(reading.value)
    row |= {"raw": raw, "value": value, "time": reading.time}
    return row | sentence("error", reading.problem)


async def gearing(connected: ConnectedDrive) -> None:
    """Read the units of the axis, where its drive answers in time.

    Without them the drive's own units are shown.
    """
    with contextlib.suppress(DriveError, TimeoutError):
        async with asyncio.timeout(GEARING_TIMEOUT_S):
            await connected.axis.units()


async def past_faults(connected: ConnectedDrive, *, timeout_s: float) -> dict[str, Any]:
    """The drive's fault history, as far as no write is needed: ``records``, or ``why`` not.

    A history whose records are selected by a write is not read, as nobody requested a write.
    """
    drive, history = connected.drive, history_of(connected.drive)
    if history is None or history.kind == "unreadable":
        return {"records": [], **sentence("why", text("bundle.no-record"))}
    if history.kind == "selected":
        why = text("bundle.record-by-write", key=history.select_key)
        return {"records": [], **sentence("why", why)}
    try:
        async with asyncio.timeout(timeout_s):
            found = await read_history(connected.axis)
    except DriveError as error:
        return {"records": [], **sentence("why", error.text)}
    except TimeoutError:
        why = text("bundle.no-answer-in-time", timeout_s=timeout_s)
        return {"records": [], **sentence("why", why)}
    return {"records": [_past(drive, each) for each in found], **sentence("why", None)}


def _past(drive: Drive, past: PastFault) -> dict[str, Any]:
    return {
        **sentence("name", past.name),
        "code": past.code_text,
        "title": past.fault.name if past.fault else "",
        **sentence("error", past.problem),
        "values": [
            {
                "key": r.key,
                "name": drive.parameter(r.key).name,
                "unit": drive.parameter(r.key).unit,
                "value": _plain(r.value),
            }
            | sentence("error", r.problem)
            for r in past.values
        ],
    }


def _plain(value: object) -> object:
    return value.hex() if isinstance(value, bytes) else value


def state(connected: ConnectedDrive) -> dict[str, Any]:
    """The monitor's last snapshot."""
    snapshot = connected.monitor.snapshot
    content = asdict(snapshot)
    content |= sentence("state", state_text(snapshot.state))
    content |= sentences("blocked_by", snapshot.blocked_by)
    content |= sentence("problem", snapshot.problem)
    content["faults"] = [
        {
            "code": f.code,
            "name": f.name,
            "kind": f.kind,
            "causes": list(f.causes),
            "remedies": list(f.remedies),
            "source": f.source,
        }
        for f in snapshot.faults
    ]
    return content


def links(bench: Bench, connected_drives: Sequence[ConnectedDrive]) -> list[dict[str, Any]]:
    """Counters of every port."""
    return [
        {
            "drive": connected.drive.id,
            "url": bench.buses.url_of(port),
            "station": port.station,
            **_figures(port.link.quality(port.station)),
        }
        for connected in connected_drives
        for port in connected.drive.ports
    ]
