from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from backend.foundation.people.rights import Right, Role
from tests.support.guarded import Caller, GuardedServer


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[GuardedServer]:
    running = GuardedServer(Path(tmp_path_factory.mktemp("station"))).start()
    running.add_people()
    yield running
    running.stop()


@pytest.fixture
def guarded(tmp_path: Path) -> Iterator[GuardedServer]:
    """A server of one test alone, with people."""
    running = GuardedServer(tmp_path).start()
    running.add_people()
    yield running
    running.stop()


@dataclass
class Cast:
    """Everybody who may come to a station."""

    administrator: Caller
    operator: Caller
    viewer: Caller
    guest: Caller
    invitation: str
    reader: Caller
    nobody: Caller


@pytest.fixture(scope="module")
def cast(server: GuardedServer) -> Cast:
    operator = server.log_in(Role.OPERATOR)
    guest, invitation = server.guest(operator, ["parameters", "measure", "motion"])
    return Cast(
        administrator=server.log_in(Role.ADMINISTRATOR),
        operator=operator,
        viewer=server.log_in(Role.VIEWER),
        guest=guest,
        invitation=invitation,
        reader=server.token(Role.ADMINISTRATOR, Right.LOOK),
        nobody=Caller(server),
    )
