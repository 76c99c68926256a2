"""Which tests `make test` leaves out."""

from __future__ import annotations

import pytest

from tests.support.long_suite import MARKER, LongSuite, add_option

pytest_plugins = ["pytester"]

FILE = """
import pytest

@pytest.mark.long
def test_long(): pass

@pytest.mark.long(keep=2)
@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_first(n): pass

@pytest.mark.long(keep=["b", "c-[d]"])
@pytest.mark.parametrize("case", ["a", "b", "c-[d]"])
def test_named(case): pass

class TestClass:
    @pytest.mark.long(keep=1)
    @pytest.mark.parametrize("n", [1, 2])
    def test_first(self, n): pass

def test_short(): pass
"""
SHORT = {"test_first[1]", "test_first[2]", "test_named[b]", "test_named[c-[d]]", "test_short",
         "TestClass::test_first[1]"}  # fmt: skip
LONG = {"test_long", "test_first[3]", "test_first[4]", "test_named[a]", "TestClass::test_first[2]"}


class Seen:
    """Plugin: which tests ran."""

    def __init__(self, which: str) -> None:
        self.tests: list[str] = []
        self._which = which

    def pytest_addoption(self, parser: pytest.Parser) -> None:
        add_option(parser)

    def pytest_configure(self, config: pytest.Config) -> None:
        config.addinivalue_line("markers", MARKER)
        config.pluginmanager.register(LongSuite(self._which))

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.when == "call":
            self.tests.append(report.nodeid.partition("::")[2])


@pytest.mark.parametrize(("which", "expected"), [("without", SHORT), ("all", SHORT | LONG)])
def test_each_suite_runs_its_tests(
    pytester: pytest.Pytester, which: str, expected: set[str]
) -> None:
    pytester.makepyfile(test_all=FILE)
    seen = Seen(which)
    result = pytester.inline_run("-q", "-p", "no:cacheprovider", "-p", "no:asyncio", plugins=[seen])
    assert result.ret == 0
    assert sorted(seen.tests) == sorted(expected)
