"""Some seeds of ``python -m benchmarks.chaos.simulated``."""

from __future__ import annotations

import pytest

from benchmarks.chaos.simulated import run_seed


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("seed", [1, 2])
def test_stop_answers_as_the_shaft_does_and_nothing_turns_unseen(seed: int) -> None:
    assert run_seed(seed).findings == []
