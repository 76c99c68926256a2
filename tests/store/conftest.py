from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from backend.foundation.store.database import Store
from tests.support.postgres import Postgres, binaries

NO_POSTGRES = "PostgreSQL is not installed (apt-get install postgresql): only SQLite is tested"


@pytest.fixture(scope="session")
def postgres() -> Iterator[Postgres]:
    found = binaries()
    if found is None:
        pytest.skip(NO_POSTGRES)
    running = Postgres(found)
    yield running
    running.remove()


@pytest.fixture(params=["sqlite", "postgresql"])
def database(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """URL of an empty database, of either kind."""
    if request.param == "sqlite":
        return f"sqlite:///{tmp_path / 'test.db'}"
    server: Postgres = request.getfixturevalue("postgres")
    return server.new_database()


@pytest.fixture
def make_store(database: str, tmp_path: Path) -> Iterator[Callable[[], Store]]:
    """Makes stations of one database."""
    made: list[Store] = []

    def make() -> Store:
        made.append(Store(tmp_path, database))
        return made[-1]

    yield make
    for store in made:
        store.close()


@pytest.fixture
def store(make_store: Callable[[], Store]) -> Store:
    return make_store()
