"""The documentation page "My drive does not reach OP", generated from the catalogue of causes.

``python -m drivers.doctor.page`` writes it; a test compares it.
"""

from __future__ import annotations

from pathlib import Path

from drivers.doctor.can_diagnosis import EMERGENCY_CAUSES
from drivers.doctor.diagnosis import AL_CAUSES, catalogue

PAGE = Path(__file__).resolve().parents[2] / "docs" / "not-operational.md"
_HEAD = """# My drive does not reach OP

*This page is written by `python -m drivers.doctor.page` from the causes that the doctor can find.*

`servodeck doctor ethercat://eth0` or `servodeck doctor canopen://socketcan/can0` takes every drive
of the bus to Operational (nothing is enabled, nothing moves) and states why one refuses: the
likeliest cause first, each with the facts that speak for it. On the page *Connect*, *Why not in
Operational?* reads the same of a bus that is open, without changing a state.

Both read of an EtherCAT station AL status, sync managers, watchdog, distributed clock, EEPROM
state, port counters, the assigned process data, 1C32h, 603Fh and 1018h; of a CANopen node error
frames of the bus, boot-up, heartbeat, emergencies, its PDO identifiers and those of the other
nodes, 1000h, 1005h, 1018h, 603Fh and 6041h.

`servodeck doctor BUS_URL --station 1 --try` goes on where a setting of this program may be the
cause: the assignment or contents of the process data, the refused command of the maker's file, the
clock, the watchdog of the file, or the cycle. Of the clock it tries another AssignActivate, none at
all, and another shift or cycle of SYNC0. It changes one setting at a time, at most four, and takes
the drive up again. Each is undone before the next, also the one that works: what it names is then
set in the profile by hand. It opens the bus itself, so no server may hold it. The sizes of the
mailbox are those of the drive's EEPROM, and the watchdog that stops the axis when this computer
dies is never made longer: neither is tried.

On the page *Connect*, *Settings to try* below the causes does the same for a connected drive,
while no exchange runs and no drive of the bus is enabled. A setting that reached Operational can
be kept until the drive is connected again, and undone. No parameter of the drive is written.

The frames of the last minute are behind *Frames of the last minute* on the same page, and by
`servodeck bus record BUS_URL --out FILE.pcapng`; every support bundle has them.

"""
_COLUMNS = ["| cause | what it looks like | what to do |", "| --- | --- | --- |"]


def text() -> str:
    """Return the whole page."""
    codes = [
        f"| `0x{code:04X}` | {catalogue()[cause].title} |"
        for code, cause in sorted(AL_CAUSES.items())
    ]
    emergencies = [
        f"| `{code:04X}h` | {catalogue()[cause].title} |"
        for code, cause in sorted(EMERGENCY_CAUSES.items())
    ]
    parts = [
        "## EtherCAT", "", *_COLUMNS, *_rows("ethercat"), "",
        "## EtherCAT by AL status code", "", "| code | cause |", "| --- | --- |", *codes, "",
        "## CANopen", "", *_COLUMNS, *_rows("canopen"), "",
        "## CANopen by emergency code of the network", "",
        "| code | cause |", "| --- | --- |", *emergencies, "",
    ]  # fmt: skip
    return _HEAD + "\n".join(parts)


def _rows(bus: str) -> list[str]:
    found = [cause for cause in catalogue().values() if cause.bus == bus]
    return [f"| {cause.title} | {cause.shows} | {cause.remedy} |" for cause in found]


if __name__ == "__main__":
    PAGE.write_text(text(), "utf-8")
