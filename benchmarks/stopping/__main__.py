"""STOP out of every kind of motion on every family, as a table.

    python -m benchmarks.stopping [--vertical] [--family m6l …] [--markdown]

With ``--vertical`` a load that gravity pulls, with a holding brake (`vertical`).
Exits with 1 where a shaft goes on, or where STOP's answer is not what the shaft does.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from typing import TypeVar

from benchmarks.stopping.cells import Outcome, cells, run_cell
from benchmarks.stopping.motions import FAMILIES
from benchmarks.stopping.vertical import Sinking, run_vertical, vertical_cells

_Cell = TypeVar("_Cell", Outcome, Sinking)
_NAMES = {"mms7": "MMS7", "m6l": "M6-L", "r6l": "R6L", "ep3e": "EP3E", "ds_c": "DS_C"}


def main() -> int:
    """Run the matrix."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--family", nargs="+", default=list(FAMILIES), choices=FAMILIES)
    parser.add_argument("--markdown", action="store_true", help="as docs/safety.md has it")
    parser.add_argument("--vertical", action="store_true", help="under gravity, with a brake")
    wanted = parser.parse_args()
    if wanted.vertical:
        return _vertical(tuple(wanted.family), markdown=wanted.markdown)
    found = []
    for cell in cells(tuple(wanted.family)):
        try:
            outcome = run_cell(*cell)
        except AssertionError as error:
            print(cell, error)
            continue
        found.append(outcome)
        if not wanted.markdown:
            print(_line(outcome), flush=True)
    if wanted.markdown:
        print(table(found))
    bad = [each for each in found if not each.held]
    print(f"\n{len(found)} cells, {len(bad)} findings")
    return 1 if bad else 0


def _vertical(families: tuple[str, ...], *, markdown: bool) -> int:
    found = []
    for cell in vertical_cells(families):
        try:
            found.append(one := run_vertical(*cell))
        except AssertionError as error:
            print(cell, error)
            continue
        if not markdown:
            mark = "" if one.held else "  <-- finding"
            print(
                f"{_NAMES[one.family]:5} {one.motion:19} {one.trouble:18} {_sinking(one)}{mark}",
                flush=True,
            )
    if markdown:
        print(_markdown(found, families, _sinking))
    bad = [each for each in found if not each.held]
    print(f"\n{len(found)} cells, {len(bad)} findings")
    return 1 if bad else 0


def _sinking(o: Sinking) -> str:
    if o.stood_s is None:
        return f"**{o.verdict}, falls**"
    lead = "stays on" if o.lead_s is None else f"{o.lead_s * 1e3:.0f} ms"
    sank = f"sinks {o.sank_deg:.2f}°"
    return f"{o.stood_s:.2f} s, {sank if o.held else f'**{sank}**'}, {lead}"


def _line(o: Outcome) -> str:
    stood = "turns on" if o.stood_s is None else f"{o.stood_s:.2f} s"
    mark = "" if o.held else "  <-- finding"
    return (
        f"{_NAMES[o.family]:5} {o.motion:21} {o.trouble:18} {o.verdict:12} stands {stood:9} "
        f"{o.degrees:7.0f}°  answer {o.answer_s:.2f} s  {','.join(o.steps)}{mark}"
    )


def table(found: Sequence[Outcome]) -> str:
    """Markdown: a row for each motion and trouble, a column for each family."""
    return _markdown(found, FAMILIES, _cell)


def _markdown(
    found: Sequence[_Cell], families: Sequence[str], words: Callable[[_Cell], str]
) -> str:
    families = [f for f in families if any(o.family == f for o in found)]
    rows = list(dict.fromkeys((o.motion, o.trouble) for o in found))
    by_cell = {(o.family, o.motion, o.trouble): o for o in found}
    lines = [
        "| motion | trouble | " + " | ".join(_NAMES[f] for f in families) + " |",
        "| --- | --- |" + " --- |" * len(families),
    ]
    for motion, trouble in rows:
        cells = [by_cell.get((family, motion, trouble)) for family in families]
        texts = ["–" if cell is None else words(cell) for cell in cells]
        lines.append(f"| {motion} | {trouble} | " + " | ".join(texts) + " |")
    return "\n".join(lines)


def _cell(o: Outcome) -> str:
    if o.stood_s is None:
        return f"**{o.verdict}**"
    return f"{o.stood_s:.2f} s, {o.degrees:.0f}°" + (
        "" if o.verdict == "stopped" else f" ({o.verdict})"
    )


if __name__ == "__main__":
    raise SystemExit(main())
