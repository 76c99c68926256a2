"""STOP out of every kind of motion on every family, as a table.

    python -m benchmarks.stopping [--family m6l …] [--markdown]

Exits with 1 where a shaft goes on, or where STOP's answer is not what the shaft does.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from benchmarks.stopping.cells import Outcome, cells, run_cell
from benchmarks.stopping.motions import FAMILIES

_NAMES = {"mms7": "MMS7", "m6l": "M6-L", "r6l": "R6L", "ep3e": "EP3E", "ds_c": "DS_C"}


def main() -> int:
    """Run the matrix."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--family", nargs="+", default=list(FAMILIES), choices=FAMILIES)
    parser.add_argument("--markdown", action="store_true", help="as docs/safety.md has it")
    wanted = parser.parse_args()
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


def _line(o: Outcome) -> str:
    stood = "turns on" if o.stood_s is None else f"{o.stood_s:.2f} s"
    mark = "" if o.held else "  <-- finding"
    return (
        f"{_NAMES[o.family]:5} {o.motion:21} {o.trouble:18} {o.verdict:12} stands {stood:9} "
        f"{o.degrees:7.0f}°  answer {o.answer_s:.2f} s  {','.join(o.steps)}{mark}"
    )


def table(found: Sequence[Outcome]) -> str:
    """Markdown: a row for each motion and trouble, a column for each family."""
    families = [f for f in FAMILIES if any(o.family == f for o in found)]
    rows = list(dict.fromkeys((o.motion, o.trouble) for o in found))
    by_cell = {(o.family, o.motion, o.trouble): o for o in found}
    lines = [
        "| motion | trouble | " + " | ".join(_NAMES[f] for f in families) + " |",
        "| --- | --- |" + " --- |" * len(families),
    ]
    for motion, trouble in rows:
        texts = [_cell(by_cell.get((family, motion, trouble))) for family in families]
        lines.append(f"| {motion} | {trouble} | " + " | ".join(texts) + " |")
    return "\n".join(lines)


def _cell(o: Outcome | None) -> str:
    if o is None:
        return "–"
    if o.stood_s is None:
        return f"**{o.verdict}**"
    return f"{o.stood_s:.2f} s, {o.degrees:.0f}°" + (
        "" if o.verdict == "stopped" else f" ({o.verdict})"
    )


if __name__ == "__main__":
    raise SystemExit(main())
