"""The page of the rules of conformance lists those that there are."""

from __future__ import annotations

from pathlib import Path

from drivers.conformance.check import RULES

PAGE = Path(__file__).parents[2] / "docs/conformance.md"


def test_the_page_lists_every_rule_with_its_clause() -> None:
    rows = [line for line in PAGE.read_text("utf-8").splitlines() if line.startswith("| `")]
    found = [tuple(cell.strip() for cell in row.strip("|").split("|"))[:3] for row in rows]
    assert found == [
        (f"`{r.code.removeprefix('conformance.')}`", r.title.words("en"), r.clause) for r in RULES
    ]
