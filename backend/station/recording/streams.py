"""Description of streams and channels for the header of a recording and for live views."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from backend.axes.scope.units import axis_scale
from backend.station.bench import Bench


def describe_streams(
    bench: Bench, streams: Sequence[tuple[bool, Sequence[tuple[str, str]]]]
) -> list[dict[str, Any]]:
    """The ``streams`` of a header; the channels' names are made unique.

    Samples are in ``unit``; multiplied by ``shown_factor`` they are in ``shown_unit``, the unit of
    the scope. Both units are the same where the axis' gearing is not known.
    """
    names: dict[tuple[str, str], str] = {}
    for _, channels in streams:
        for drive_id, key in channels:
            drive = bench.connected(drive_id).drive
            name = f"{drive.name} {drive.parameter(key).name}"
            names[drive_id, key] = f"{name} {key}" if name in names.values() else name
    return [
        {
            "synchronous": synchronous,
            "channels": [
                _units(bench, drive_id, key)
                | {
                    "drive": drive_id,
                    "drive_name": bench.connected(drive_id).drive.name,
                    "key": key,
                    "name": names[drive_id, key],
                }
                for drive_id, key in channels
            ],
        }
        for synchronous, channels in streams
    ]


def _units(bench: Bench, drive_id: str, key: str) -> dict[str, Any]:
    connected = bench.connected(drive_id)
    parameter = connected.drive.parameter(key)
    own: dict[str, Any] = {"unit": parameter.unit}
    known = connected.axis.known_units
    unit, factor = axis_scale(known, connected.drive, parameter) if known else ("", None)
    if factor is None:
        return own | {"shown_unit": parameter.unit, "shown_factor": 1.0}
    return own | {"shown_unit": unit, "shown_factor": factor}
