"""A profile that a request names and that does not exist: 404 with the reason, never 500."""

from __future__ import annotations

import pytest

from backend.api.messages.errors import NotFound, problem_of
from backend.api.requests.named_profile import profile_named


def test_a_profile_that_does_not_exist_is_not_found() -> None:
    assert profile_named("mms7").by_key
    with pytest.raises(NotFound) as error:
        profile_named("nothing")
    problem = problem_of(error.value)
    assert (problem.status, problem.value) == (404, "nothing")
    assert problem.remedy
