"""What is no servo drive is not offered as one, and an unknown drive as no maker's."""

from __future__ import annotations

import pytest

from backend.commands.doctor import _fitting
from backend.commands.scales import _farther
from backend.station.matching import match_profiles
from drivers.link import Found

_UNKNOWN = 0x0BAD


@pytest.mark.parametrize(("device_profile", "drives"), [(402, True), (0, True), (None, True),
                                                        (5001, False), (401, False)])  # fmt: skip
def test_a_terminal_on_the_bus_matches_no_profile(device_profile: int | None, drives: bool) -> None:
    """1000h of CiA 301: 402 for drives, 401 and 5001 for inputs and outputs."""
    found = Found(1, vendor_id=_UNKNOWN, product_code=1, device_profile=device_profile)
    assert bool(match_profiles("ethercat", found)) is drives


def test_the_doctor_takes_an_unknown_drive_up_by_the_standards_objects() -> None:
    unknown = Found(1, vendor_id=_UNKNOWN, product_code=1, device_profile=402)
    fitting = _fitting("ethercat", unknown)
    assert fitting is not None
    assert fitting.drive == "generic402"
    assert _fitting("ethercat", None) is None


@pytest.mark.parametrize(("moved", "most", "next_move"), [
    (500, 4990, 4990), (500, 10_000, 5000), (-500, 4990, -4990),
])  # fmt: skip
def test_the_next_small_move_is_one_that_may_be_made(moved: int, most: int, next_move: int) -> None:
    """A drive that arrives one increment short may move ten times as far as it has come."""
    assert _farther(moved, most) == next_move
