"""Questions about one stored response that come together share its evaluation."""

from __future__ import annotations

import asyncio
import threading
from pathlib import Path

import pytest

from backend.api.tuning import design as routes_design
from backend.records.library.measurements import BadMeasurement


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> tuple[list[int], threading.Event]:
    """Evaluations that began, and what lets them end."""
    begun: list[int] = []
    let_go = threading.Event()

    def evaluated(_file: Path, changed_ns: int) -> str:
        begun.append(changed_ns)
        assert let_go.wait(20)
        if changed_ns < 0:
            raise BadMeasurement("damaged")
        return f"result {changed_ns}"

    monkeypatch.setattr(routes_design, "_evaluated", evaluated)
    return begun, let_go


async def test_they_wait_for_the_one_that_runs(
    asked: tuple[list[int], threading.Event],
) -> None:
    begun, let_go = asked
    file = Path("response.sdmeas")
    questions = [asyncio.create_task(routes_design._evaluated_once(file, 1)) for _ in range(4)]
    changed = asyncio.create_task(routes_design._evaluated_once(file, 2))
    await asyncio.sleep(0.05)
    # One whose page is gone takes nothing from the others.
    questions[0].cancel()
    let_go.set()
    assert await asyncio.gather(*questions[1:], changed) == ["result 1"] * 3 + ["result 2"]
    assert sorted(begun) == [1, 2]
    assert routes_design._running == {}


async def test_a_failure_is_commanded_to_all_and_tried_anew(
    asked: tuple[list[int], threading.Event],
) -> None:
    begun, let_go = asked
    let_go.set()
    for _ in range(2):
        both = (routes_design._evaluated_once(Path("damaged.sdmeas"), -1) for _ in range(2))
        reported = await asyncio.gather(*both, return_exceptions=True)
        assert [type(each) for each in reported] == [BadMeasurement, BadMeasurement]
    assert begun == [-1, -1]
