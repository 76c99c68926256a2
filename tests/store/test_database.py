"""Opening, migrating and sharing the database; the same on SQLite and PostgreSQL."""

from __future__ import annotations

import threading
from collections.abc import Callable
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from sqlalchemy import select, text
from sqlalchemy.exc import DBAPIError

import backend.foundation.people.tables
import backend.foundation.store.audit_tables
import backend.foundation.store.library_tables  # noqa: F401 - registers its tables
from backend.foundation.store.base import Base
from backend.foundation.store.database import DatabaseFailed, Store
from backend.foundation.store.library_tables import Item


@pytest.mark.long(keep=1)
def test_migrations_and_models_agree(store: Store) -> None:
    with store.open().connect() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": True})
        assert compare_metadata(context, Base.metadata) == []


def test_stations_that_start_together_migrate_once(make_store: Callable[[], Store]) -> None:
    stores = [make_store() for _ in range(4)]
    failures: list[Exception] = []

    def start(store: Store) -> None:
        try:
            store.open()
        except Exception as error:
            failures.append(error)

    threads = [threading.Thread(target=start, args=(store,)) for store in stores]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert failures == []
    with stores[0].reading() as session:
        assert session.execute(text("SELECT count(*) FROM audit_head")).scalar_one() == 1


def test_a_database_of_a_newer_version_is_left_alone(make_store: Callable[[], Store]) -> None:
    first = make_store()
    with first.writing() as session:
        session.execute(text("INSERT INTO alembic_version VALUES ('library_9999')"))
    with pytest.raises(DatabaseFailed, match=r"newer servodeck.*library_9999"):
        make_store().open()


def test_an_error_undoes_the_whole_transaction(store: Store) -> None:
    def break_off() -> None:
        with store.writing() as session:
            session.add(Item(kind="set", name="x", changed=datetime.now(UTC)))
            session.flush()
            raise RuntimeError("on purpose")

    with pytest.raises(RuntimeError, match="on purpose"):
        break_off()
    with store.reading() as session:
        assert session.scalars(select(Item)).all() == []


def test_times_come_back_as_utc(store: Store) -> None:
    moment = datetime(2026, 11, 21, 10, 0, 0, 123456, timezone(timedelta(hours=8)))
    with store.writing() as session:
        session.add(Item(kind="set", name="x", changed=moment))
    with store.reading() as session:
        found = session.scalars(select(Item)).one().changed
    assert found == moment
    assert found.tzinfo is UTC
    with pytest.raises(DatabaseFailed, match="no time zone"), store.writing() as session:
        session.add(Item(kind="set", name="y", changed=datetime(2026, 1, 1)))


def test_the_database_refuses_to_change_the_audit(store: Store) -> None:
    insert = "INSERT INTO audit_entry VALUES (1, 't', 's', 'p', 'k', 'a', 'x', '{}', '0', '1')"
    with store.writing() as session:
        session.execute(text(insert))
    for change in ("UPDATE audit_entry SET person = 'somebody else'", "DELETE FROM audit_entry"):
        with pytest.raises(DatabaseFailed, match="append-only"), store.writing() as session:
            session.execute(text(change))


def test_foreign_keys_hold(store: Store) -> None:
    with pytest.raises(DatabaseFailed) as caught, store.writing() as session:
        session.execute(text("INSERT INTO library_tag VALUES (99, 'nobody')"))
    assert isinstance(caught.value.__cause__, DBAPIError)


async def test_work_runs_on_a_thread_with_the_caller_s_context(store: Store) -> None:
    assert await store.call(threading.current_thread) is not threading.main_thread()


def test_the_password_is_not_shown(tmp_path: Path) -> None:
    store = Store(tmp_path, "postgresql://someone:secret@127.0.0.1:1/none")
    with pytest.raises(DatabaseFailed) as caught:
        store.open()
    assert "secret" not in str(caught.value) + str(caught.value.value)
    assert "127.0.0.1" in str(caught.value)


@pytest.mark.parametrize("url", ["sqlite://", "mysql://host/x", "not a url"])
def test_other_addresses_are_refused(url: str, tmp_path: Path) -> None:
    with pytest.raises(DatabaseFailed):
        Store(tmp_path, url)


def test_sqlite_keeps_what_was_committed(tmp_path: Path) -> None:
    store = Store(tmp_path)
    with store.reading() as session:
        pragma = {
            name: session.execute(text(f"PRAGMA {name}")).scalar_one()
            for name in ("journal_mode", "synchronous", "foreign_keys")
        }
    store.close()
    assert pragma == {"journal_mode": "wal", "synchronous": 2, "foreign_keys": 1}
    assert (tmp_path / "servodeck.db").is_file()


def test_a_state_folder_is_gone_only_after_it_was_there(database: str, tmp_path: Path) -> None:
    folder = tmp_path / "state"
    store = Store(folder, database)
    try:
        with store.writing() as session:  # the database lies elsewhere: the folder is made later
            session.execute(text("SELECT 1"))
        assert store.missing() is None
        folder.mkdir()
        assert store.missing() is None
        folder.rmdir()
        for _ in range(2):  # as well after it was opened again
            assert "no longer exists" in str(store.missing())
            with pytest.raises(DatabaseFailed, match="no longer exists"), store.writing():
                pass
            store.close()
            store.open()
    finally:
        store.close()
