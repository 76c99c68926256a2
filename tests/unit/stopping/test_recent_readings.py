"""What STOP knows without asking the drive is what was read a moment ago."""

from __future__ import annotations

import time
from types import SimpleNamespace
from typing import cast

import pytest

from backend.axis.stop import braking
from backend.drive.drive import Drive
from backend.drive.readings import Reading

ENABLED = 0x237


@pytest.mark.parametrize(("age_s", "counts"), [(0.1, True), (3600.0, False), (-3600.0, False)])
def test_a_reading_counts_where_its_age_is_known_and_small(age_s: float, counts: bool) -> None:
    """A clock that was set back makes an old reading lie in the future: its age is not known."""
    reading = Reading("6041:00", ENABLED, ENABLED, time.time() - age_s)
    drive = cast(Drive, SimpleNamespace(readings={"6041:00": reading}))
    assert (braking._seen(drive, "6041:00") == ENABLED) is counts
