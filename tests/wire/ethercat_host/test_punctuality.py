"""Whether process data are allowed follows from counted cycles."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from drivers.computer.timing.lateness import Histogram
from drivers.errors import NotAllowed
from drivers.ethercat.process.punctuality import (
    Check,
    Kept,
    Punctuality,
    require_fine_clock,
    require_punctual,
)
from drivers.ethercat.wire.frames import Request


def of(*values: tuple[float, int]) -> Punctuality:
    """A check with so many cycles of each time in µs."""
    counted = Histogram.empty()
    for value_us, count in values:
        for _ in range(count):
            counted.add(value_us)
    return Punctuality(tuple(counted.counts))


def test_none_missed_of_ten_thousand_is_enough_and_of_a_thousand_is_not() -> None:
    """3/n by the rule of three (Hanley and Lippman-Hand 1983)."""
    assert of((500, 10_000)).allows(1000)
    assert of((500, 10_000)).bound(1000) == pytest.approx(3e-4)
    assert not of((500, 1000)).allows(1000)


def test_a_laptop_that_stalls_now_and_then_keeps_the_longer_cycle_alone() -> None:
    found = of((400, 9_980), (2_500, 20))
    assert found.missed(1000) == 20
    assert not found.allows(1000)
    assert found.missed(4000) == 0
    assert found.allows(4000)
    require_punctual("en7", found, 0.004)
    with pytest.raises(NotAllowed) as refused:
        require_punctual("en7", found, 0.001)
    words = refused.value.message
    assert "20 of 10000 cycles" in words
    assert "edge box" in str(refused.value.remedy)


def test_a_class_that_reaches_beyond_the_cycle_counts_as_missed() -> None:
    # 3162 to 4642 µs: whether before or after 4 ms is not known.
    assert of((3_500, 10)).missed(4000) == 10


class Wire:
    """Answers every frame but the third."""

    def __init__(self) -> None:
        self.asked: list[Request] = []

    def exchange(self, requests: Sequence[Request]) -> list[bytes | None]:
        self.asked += requests
        return [None if len(self.asked) == 3 else b"\x11\0"]


def test_the_check_reads_one_register_per_cycle_and_counts_what_is_lost() -> None:
    wire = Wire()
    check = Check(wire, 1, 0.01)
    results = [check.cycle() for _ in range(10)]
    assert results[:-1] == [None] * 9
    assert results[-1] is not None
    counts = results[-1]["counts"]
    assert sum(counts) == 10
    assert counts[-1] >= 1, "the lost frame"
    assert {(number, access.register) for number, access in wire.asked} == {(1, 0)}


@pytest.mark.parametrize("spoilt", ["", "[]", "{", '{"en7": 1}'])
def test_the_last_check_of_each_adapter_is_kept(tmp_path: Path, spoilt: str) -> None:
    file = tmp_path / "cache" / "punctuality.json"
    file.parent.mkdir()
    file.write_text(spoilt)
    assert Kept("en7", file).read() is None
    found = of((400, 10))
    Kept("en7", file).write(found)
    assert Kept("en7", file).read() == found
    assert Kept("en8", file).read() is None


def test_a_clock_of_sixteen_milliseconds_is_refused() -> None:
    """GetTickCount64 of Windows, as CPython before 3.13 reads it: 15.6 ms."""
    require_fine_clock(lambda: 1e-7)
    with pytest.raises(NotAllowed) as refused:
        require_fine_clock(lambda: 0.015625)
    assert "15.625 ms" in refused.value.message
    assert "3.13" in str(refused.value.remedy)
