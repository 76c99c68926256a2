"""What a bench reports its pages: made once for all that look."""

from __future__ import annotations

from pydantic import BaseModel

from backend.api import convert
from backend.api.live.messages import DrivesChanged, JobChanged, StateChanged, ValuesChanged
from backend.station.bench import Bench
from backend.station.monitor import Snapshot
from backend.work.jobs import Job


def state(bench: Bench, drive: str, snapshot: Snapshot) -> BaseModel | None:
    """An axis, unless its drive has left the bench."""
    connected = bench.connected_drives.get(drive)
    if connected is None:
        return None
    return StateChanged(state=convert.axis_state(bench, connected, snapshot))


def values(bench: Bench, drive: str, keys: frozenset[str]) -> BaseModel | None:
    """What was read of these parameters, unless the drive has left the bench."""
    connected = bench.connected_drives.get(drive)
    if connected is None or not keys:
        return None
    rows = convert.readings(connected.drive, sorted(keys))
    return ValuesChanged.model_construct(drive=drive, values=rows)


def drive_list(bench: Bench, connection: str | None) -> BaseModel:
    """The drives as the holder of this connection sees them; as a stranger without one."""
    connected_drives = bench.connected_drives.values()
    return DrivesChanged(
        drives=[convert.drive_summary(bench, m, connection) for m in connected_drives]
    )


def job_state(job: Job) -> BaseModel:
    """A job as it is now."""
    return JobChanged(job=convert.job(job))
