"""Messages about the bench, made once for all pages that watch."""

from __future__ import annotations

from backend.api.live.messages import DrivesChanged, JobChanged, StateChanged, ToPage, ValuesChanged
from backend.api.messages import convert
from backend.foundation.work.jobs import Job
from backend.station.bench import Bench
from backend.station.drives.monitor import Snapshot


def state(bench: Bench, drive: str, snapshot: Snapshot) -> ToPage | None:
    """State of an axis; None if its drive has left the bench."""
    connected = bench.connected_drives.get(drive)
    if connected is None:
        return None
    return StateChanged(state=convert.axis_state(bench, connected, snapshot))


def values(bench: Bench, drive: str, keys: frozenset[str]) -> ToPage | None:
    """Last readings of these parameters; None if the drive has left the bench."""
    connected = bench.connected_drives.get(drive)
    if connected is None or not keys:
        return None
    rows = convert.readings(connected.drive, sorted(keys))
    return ValuesChanged.model_construct(drive=drive, values=rows)


def drive_list(bench: Bench, connection: str | None) -> ToPage:
    """The drives as seen from this connection; without one, as seen without control."""
    connected_drives = bench.connected_drives.values()
    return DrivesChanged(
        drives=[convert.drive_summary(bench, m, connection) for m in connected_drives]
    )


def job_state(job: Job) -> ToPage:
    """Current state of a job."""
    return JobChanged(job=convert.job(job))
