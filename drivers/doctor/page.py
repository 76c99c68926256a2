"""The documentation's page "My drive does not reach OP", from the catalogue of causes.

``python -m drivers.doctor.page`` writes it; a test compares it.
"""

from __future__ import annotations

from pathlib import Path

from drivers.doctor.diagnosis import AL_CAUSES, catalogue

PAGE = Path(__file__).resolve().parents[2] / "docs" / "not-operational.md"
_HEAD = """# My drive does not reach OP

*This page is written by `python -m drivers.doctor.page` from the causes that the doctor knows.*

`servodeck doctor ethercat://eth0` takes every drive of the segment to Operational (nothing is
enabled, nothing moves) and says why one refuses: the likeliest cause first, each with the facts
that speak for it. On the page *Connect*, *Why not in Operational?* reads the same of a segment
that is open, without changing a state. Both read AL status, sync managers, watchdog, distributed
clock, EEPROM state, port counters, the assigned process data, 1C32h, 603Fh and 1018h.

The frames of the last minute are behind *Frames of the last minute* on the same page, and by
`servodeck bus record BUS_URL --out FILE.pcapng`; every support bundle has them.

| cause | what it looks like | what to do |
| --- | --- | --- |
"""


def text() -> str:
    """The whole page."""
    rows = [f"| {c.title} | {c.shows} | {c.remedy} |" for c in catalogue().values()]
    codes = [
        f"| `0x{code:04X}` | {catalogue()[cause].title} |"
        for code, cause in sorted(AL_CAUSES.items())
    ]
    table = ["", "## By AL status code", "", "| code | cause |", "| --- | --- |", *codes, ""]
    return _HEAD + "\n".join([*rows, *table])


if __name__ == "__main__":
    PAGE.write_text(text(), "utf-8")
