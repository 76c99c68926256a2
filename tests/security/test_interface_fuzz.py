"""Random requests that the OpenAPI document allows: no 500, and only answers it describes."""

from __future__ import annotations

from typing import Any

import pytest
import requests
import schemathesis
from hypothesis import HealthCheck, Phase, given, seed, settings
from schemathesis.checks import CHECKS, load_all_checks
from schemathesis.core.failures import FailureGroup

from backend.api.security.rights import ROUTES
from backend.foundation.people.rights import Right, Role
from tests.support.guarded import Caller, GuardedServer

load_all_checks()
WANTED = [
    "not_a_server_error",
    "status_code_conformance",
    "content_type_conformance",
    "response_schema_conformance",
]
#: Per operation; the seed makes a failure the same on every machine.
EXAMPLES = 8
#: Would take away what the other requests are made with, or looks outside this machine.
LEFT_OUT = {"DELETE /api/v1/session"}


def line() -> requests.Session:
    """One connection for all requests of a test; the machine's proxies are none of its business."""
    session = requests.Session()
    session.trust_env = False
    return session


@pytest.mark.long
def test_the_interface_keeps_to_its_description(server: GuardedServer) -> None:
    session = line()
    schema = schemathesis.openapi.from_dict(server.interface)
    caller = server.token(Role.ADMINISTRATOR, *Right)
    checks = CHECKS.get_by_names(WANTED)
    wrong: dict[str, str] = {}
    for result in schema.get_all_operations():
        operation = result.ok()
        label = operation.label
        if label in LEFT_OUT:
            continue

        @seed(8)
        @settings(
            max_examples=EXAMPLES,
            deadline=None,
            database=None,
            derandomize=False,
            phases=[Phase.generate],
            suppress_health_check=list(HealthCheck),
        )
        @given(case=operation.as_strategy())
        def ask(case: schemathesis.Case) -> None:
            if case.path_parameters and "drive_id" in case.path_parameters:
                case.path_parameters["drive_id"] = "x"
            response = case.call(
                base_url=server.url, session=session, headers=dict(caller.http.headers), timeout=30
            )
            case.validate_response(response, checks=checks)

        try:
            ask()
        except (Exception, FailureGroup) as error:
            wrong[label] = str(error)[:700]
    session.close()
    assert wrong == {}, "\n\n".join(f"{label}: {text}" for label, text in wrong.items())


@pytest.mark.long
def test_fuzzing_finds_no_way_in_for_a_viewer(server: GuardedServer) -> None:
    """What a viewer may not is refused whatever the body holds, before it is looked at."""
    schema = schemathesis.openapi.from_dict(server.interface)
    viewer = server.log_in(Role.VIEWER)
    before = len(server.servo.written)
    passed: list[str] = []
    session = line()
    for result in schema.get_all_operations():
        operation = result.ok()
        need = ROUTES[operation.label]
        if isinstance(need.right, Right) and need.right is not Right.LOOK:
            others = tried(operation, viewer, session) - {403}
            passed += [f"{operation.label}: {status}" for status in others]
    session.close()
    assert passed == []
    assert len(server.servo.written) == before


def tried(operation: Any, viewer: Caller, session: requests.Session) -> set[int]:
    """Statuses of two made-up requests."""
    seen = set()

    @seed(8)
    @settings(
        max_examples=2,
        deadline=None,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(case=operation.as_strategy())
    def ask(case: schemathesis.Case) -> None:
        headers, cookies = dict(viewer.http.headers), {"servodeck": viewer.cookie}
        response = case.call(
            base_url=viewer.server.url,
            session=session,
            headers=headers,
            cookies=cookies,
            timeout=30,
        )
        seen.add(response.status_code)

    ask()
    return seen
