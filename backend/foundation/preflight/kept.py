"""The last measurement of each interface, stored in ``preflight.json``."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from drivers.computer.timing.lateness import Measured, from_json
from profiles.replacing import move_into_place

FILE = "preflight.json"


@dataclass(frozen=True, slots=True)
class Kept:
    """One measurement: ``measured`` by period [µs]; ``ended`` in seconds since 1970."""

    measured: Mapping[int, Measured]
    ended: float


def read(folder: Path) -> dict[str, Kept]:
    """The stored measurements by interface (empty name: measured without one).

    Empty where the file is missing or damaged; it can be measured again.
    """
    try:
        listed = json.loads((folder / FILE).read_text("utf-8"))
        return {
            interface: Kept(
                {run["period_us"]: from_json(json.dumps(run)) for run in one["measured"]},
                float(one["ended"]),
            )
            for interface, one in listed.items()
        }
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}


def keep(folder: Path, interface: str, measured: Mapping[int, Measured]) -> None:
    """Store a measurement in place of the earlier one of its interface.

    Raises:
        OSError: the folder cannot be written.
    """
    known = read(folder) | {interface: Kept(measured, time.time())}
    listed = {
        name: {"ended": one.ended, "measured": [asdict(run) for run in one.measured.values()]}
        for name, one in known.items()
    }
    folder.mkdir(parents=True, exist_ok=True)
    fresh = folder / f".{FILE}.new"
    fresh.write_text(json.dumps(listed), "utf-8")
    move_into_place(fresh, folder / FILE)
