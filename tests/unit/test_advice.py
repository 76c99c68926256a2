"""Every error that a person sees says what to do next."""

from __future__ import annotations

import pytest

from backend.api.messages.errors import problem_of
from drivers.errors import (
    DriveError,
    LinkLost,
    LinkTimeout,
    NotAllowed,
    NotAsked,
    OutOfRange,
    ProtocolError,
)


@pytest.mark.parametrize("kind", [LinkTimeout, NotAsked, LinkLost, ProtocolError])
def test_a_line_in_trouble_has_its_usual_remedy(kind: type[DriveError]) -> None:
    remedy = problem_of(kind("nothing came", drive="X")).remedy
    assert remedy is not None
    assert "check" in remedy


def test_the_nearest_remedy_is_reported() -> None:
    error = LinkTimeout("nothing came", remedy="switch it on")
    assert problem_of(error).remedy == "switch it on"


def test_what_has_a_limit_points_to_it() -> None:
    assert (
        problem_of(OutOfRange("too much", limit="0…5")).remedy == "choose a value within the limit"
    )
    assert problem_of(NotAllowed("it is not so")).remedy is None
