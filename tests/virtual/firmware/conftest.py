"""Fixture for a virtual MMS7 with direct access to its objects."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from drivers.virtual.firmware.families.mms7 import Mms7
from drivers.virtual.firmware.servo import VirtualServo
from drivers.virtual.mechanics import MechanicsSpec

from .servo_bench import Bench, rigid, small_profile


@pytest.fixture
def bench() -> Callable[..., Bench]:
    """Builds a drive on the given mechanics (default: a rigid motor alone)."""

    def build(spec: MechanicsSpec | None = None, **options: Any) -> Bench:
        return Bench(VirtualServo(small_profile(), Mms7(), spec or rigid(), **options))

    return build
