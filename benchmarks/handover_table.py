"""Hand-over: every drive family in every controller's format, accepted by its reader and replayed.

Needs the tests next to it. Prints the table of docs/handover.md; it aims at every value taken.
"""

from __future__ import annotations

from typing import get_args

from backend.records.handover.files import Format
from tests.support.controllers.acceptance import outcome, table
from tests.support.handed_over import EVERY


def main() -> None:
    """Print how many values each controller took of each family, and how they were replayed."""
    forms: tuple[Format, ...] = get_args(Format)
    print(table([outcome(family, form) for family in EVERY for form in forms]))


if __name__ == "__main__":
    main()
