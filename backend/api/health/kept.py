"""Storing the result of a health check in the database."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

from backend.axes.drive.drive import Drive
from backend.foundation.people.identity import acting_person
from backend.station.bench import Bench
from backend.tools.watching.health.result import HealthResult
from backend.tools.watching.health.settings import HealthSettings
from backend.tools.watching.trend.records import HealthRecords, axis_of


def records_of(bench: Bench) -> HealthRecords:
    """The health records in the database of this station."""
    return HealthRecords(bench.records.store, bench.records.station)


async def keep_health(
    bench: Bench, drive: Drive, settings: HealthSettings, found: HealthResult, files: Sequence[str]
) -> None:
    """Store the rounds of a health check with the SHA-256 of its raw data.

    Raises:
        DatabaseFailed: they were not stored; the raw data were.
    """
    axis = axis_of(drive, bench.records.station)

    def store() -> None:
        digests = {
            name: hashlib.sha256(bench.measurements.read(name)).hexdigest() for name in files
        }
        records_of(bench).add(axis, settings, found.rounds, digests, acting_person())

    await bench.records.store.call(store)
