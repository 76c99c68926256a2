"""The marker ``long``: tests that ``make test`` leaves out; ``make test-long`` runs them all.

``@pytest.mark.long`` leaves a test out; with ``keep=2`` its first two cases stay, with
``keep=["ds_c"]`` the cases of these ids. Where tests of a file follow one another, the whole file
is long. ``--long`` says what runs: ``without`` (make test) or ``all``, as when pytest is called by
hand.
"""

from __future__ import annotations

from collections import Counter
from typing import Any

import pytest

MARKER = "long(keep=0): not in `make test` but for its first cases, or those of the ids kept"


def add_option(parser: pytest.Parser) -> None:
    """Add ``--long`` to the command line of pytest."""
    parser.addoption(
        "--long",
        choices=("all", "without"),
        default="all",
        help="whether tests with the marker `long` run; `make test` runs without them",
    )


def long_ones(items: list[pytest.Item]) -> list[pytest.Item]:
    """Those that ``make test`` leaves out, in their order."""
    cases: Counter[str] = Counter()
    found = []
    for item in items:
        marker = item.get_closest_marker("long")
        if marker is None:
            continue
        test, _, case = item.nodeid.partition("[")
        cases[test] += 1
        keep = marker.kwargs.get("keep", 0)
        kept = case[:-1] in keep if isinstance(keep, list) else cases[test] <= keep
        if not kept:
            found.append(item)
    return found


class LongSuite:
    """Plugin: selects tests by ``--long`` and says how many it left out."""

    def __init__(self, which: str) -> None:
        self._which = which
        self._left_out = 0

    def pytest_collection_modifyitems(
        self, config: pytest.Config, items: list[pytest.Item]
    ) -> None:
        """Deselect what ``--long`` leaves out."""
        if self._which == "all":
            return
        left_out = long_ones(items)
        self._left_out = len(left_out)
        config.hook.pytest_deselected(items=left_out)
        long = set(left_out)
        items[:] = [item for item in items if item not in long]

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """A worker of pytest-xdist passes its count on; each worker collects every test."""
        output = getattr(session.config, "workeroutput", None)
        if output is not None:
            output["long_left_out"] = self._left_out

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node: Any) -> None:
        """Take the count of a worker that has ended."""
        self._left_out = getattr(node, "workeroutput", {}).get("long_left_out", self._left_out)

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """One line about the tests that this run has left out."""
        if self._which == "without" and self._left_out:
            terminalreporter.write_line(
                f"{self._left_out} long tests left out; `make test-long` runs them"
            )
