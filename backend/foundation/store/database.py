"""Database: opening, migration, and transactions on worker threads.

SQLite by default (``servodeck.db`` in the state folder: WAL, foreign keys, full synchronisation,
writers one after the other), PostgreSQL by URL. Migrations run when it is opened, in one
transaction under a lock, so that stations that start together do not disturb each other.
"""

from __future__ import annotations

import asyncio
import contextvars
import functools
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import ParamSpec, TypeVar

from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, Engine, create_engine, event, text
from sqlalchemy.engine import URL, make_url
from sqlalchemy.exc import ArgumentError, SQLAlchemyError
from sqlalchemy.orm import Session
from sqlalchemy.pool import ConnectionPoolEntry

from backend.foundation.store import migrate
from backend.foundation.store.files import StorageFailed
from drivers.texts.message import Text
from drivers.texts.message import text as message

P = ParamSpec("P")
T = TypeVar("T")

FILE = "servodeck.db"
#: Key of the migration lock: any number that nothing else on the server uses;
#: the same for all stations.
_MIGRATION_LOCK = 0x5E2D0DEC
_PATIENCE_S = 5
#: For the write lock of SQLite [s]. A process waits for a writer of another process by polling, and
#: may be overtaken each time; on a slow disk that takes a while.
_SQLITE_PATIENCE_S = 15
#: Error codes SQLITE_CORRUPT and SQLITE_NOTADB (sqlite.org/rescode.html).
_DAMAGED = frozenset({11, 26})
#: Locks by file, at which writers of this process queue, so that none is overtaken for long.
_writers: dict[str, threading.Lock] = {}


class DatabaseFailed(StorageFailed):
    """The database cannot be used: disk full, server unreachable, or written by a newer version."""

    kind = "storage-failed"


class Store:
    """The database of one station. It is opened by `open` or on first use.

    ``database`` is an SQLAlchemy URL (``postgresql://…``, ``sqlite:///…``), or None for the file in
    ``folder``. Transactions block and belong on worker threads, where `call` runs them.
    """

    def __init__(self, folder: Path, database: str | None = None) -> None:
        self.folder = folder
        self.url = _url(folder, database)
        self._engine: Engine | None = None
        self._identity: tuple[int, int] | None = None
        #: Whether the folder has ever existed. A database elsewhere is usable
        #: before the folder is made.
        self._had_folder = False
        self._opening = threading.Lock()
        self._pool = ThreadPoolExecutor(max_workers=4, thread_name_prefix="store")

    @property
    def shown(self) -> str:
        """The URL without its password, for display."""
        return self.url.render_as_string(hide_password=True)

    @property
    def sqlite_file(self) -> Path | None:
        """The file of an SQLite database, otherwise None."""
        return Path(self.url.database) if self._is_sqlite and self.url.database else None

    @property
    def _is_sqlite(self) -> bool:
        return self.url.get_backend_name() == "sqlite"

    def open(self) -> Engine:
        """Connect and migrate the tables; does nothing if that was done already. Blocks.

        Raises:
            DatabaseFailed: it cannot be reached, or a newer version has written it.
        """
        with self._opening:
            if self._engine is None:
                engine = self._make_engine()
                try:
                    with self._translated():
                        self._upgrade(engine)
                except BaseException:
                    engine.dispose()
                    raise
                self._engine = engine
                self._identity = self._identify()
                self._had_folder |= self.folder.is_dir()
            return self._engine

    def close(self) -> None:
        """Close the database. It opens again on the next use."""
        with self._opening:
            if self._engine is not None:
                self._engine.dispose()
                self._engine = None

    def missing(self) -> Text | None:
        """Reason why data written now would be lost; None if it would be kept.

        A file that was removed or replaced while it is open still accepts all writes, which are
        lost when the process ends.
        """
        if self._engine is None:
            return None
        if self.folder.is_dir():
            self._had_folder = True
        elif self._had_folder:
            return message("store.folder-gone", folder=str(self.folder))
        if self._identity is not None and self._identify() != self._identity:
            return message("store.database-replaced", database=self.shown)
        return None

    def _identify(self) -> tuple[int, int] | None:
        file = self.sqlite_file
        try:
            known = None if file is None else file.stat()
        except OSError:
            return None
        return None if known is None else (known.st_dev, known.st_ino)

    # --- transactions -----------------------------------------------------------------

    @contextmanager
    def reading(self, *, snapshot: bool = False) -> Iterator[Session]:
        """Transaction that changes nothing; with ``snapshot`` all its queries see the same state.

        Raises:
            DatabaseFailed: see `open`.
        """
        engine = self.open()
        if snapshot and not self._is_sqlite:  # SQLite always reads a snapshot
            engine = engine.execution_options(isolation_level="REPEATABLE READ")
        with self._translated(), Session(engine, expire_on_commit=False) as session:
            yield session

    @contextmanager
    def writing(self) -> Iterator[Session]:
        """Transaction that is committed at the end, or rolled back if an error leaves it.

        On SQLite it holds the write lock from the start, so that it cannot fail half way.

        Raises:
            DatabaseFailed: nothing was changed.
        """
        engine = self.open().execution_options(immediate=True)
        if missing := self.missing():
            raise DatabaseFailed(
                missing,
                value=str(self.folder),
                remedy="store.put-database-back",
            )
        with (
            self._alone(),
            self._translated(),
            Session(engine, expire_on_commit=False) as session,
            session.begin(),
        ):
            yield session

    @contextmanager
    def _alone(self) -> Iterator[None]:
        """Hold the writer lock of this process, if the database accepts only one writer."""
        if not self._is_sqlite:
            yield
            return
        lock = _writers.setdefault(str(Path(self.url.database or "").resolve()), threading.Lock())
        if not lock.acquire(timeout=_SQLITE_PATIENCE_S):
            raise DatabaseFailed(
                "store.database-busy", value=self.shown, sqlite_patience_s=_SQLITE_PATIENCE_S
            )
        try:
            yield
        finally:
            lock.release()

    async def call(self, work: Callable[P, T], /, *arguments: P.args, **named: P.kwargs) -> T:
        """Run blocking work on a thread of the store, in the caller's context (acting person)."""
        context = contextvars.copy_context()
        bound = functools.partial(work, *arguments, **named)
        return await asyncio.get_running_loop().run_in_executor(
            self._pool, functools.partial(context.run, bound)
        )

    # --- opening ----------------------------------------------------------------------

    def _make_engine(self) -> Engine:
        if not self._is_sqlite:
            return create_engine(
                self.url,
                pool_pre_ping=True,
                hide_parameters=True,
                pool_timeout=_PATIENCE_S,
                connect_args={"connect_timeout": _PATIENCE_S},
            )
        file = self.sqlite_file
        if file is not None:
            try:
                file.parent.mkdir(parents=True, exist_ok=True)
                file.touch(mode=0o600)  # the file contains accounts
            except OSError as error:
                raise DatabaseFailed(
                    "store.database-cannot-made",
                    value=str(file),
                    file=str(file),
                    strerror=error.strerror,
                ) from error
        # Error texts, and so logs, must not repeat stored values: password hashes are among them.
        engine = create_engine(
            self.url, hide_parameters=True, connect_args={"timeout": _SQLITE_PATIENCE_S}
        )
        event.listen(engine, "connect", _prepare_sqlite)
        event.listen(engine, "begin", _begin_sqlite)
        return engine

    def _upgrade(self, engine: Engine) -> None:
        script = migrate.script()
        with engine.connect() as connection:
            if self._is_current(connection, script):
                return
        with engine.execution_options(immediate=True).begin() as connection:
            if not self._is_sqlite:
                lock = text("SELECT pg_advisory_xact_lock(:key)")
                connection.execute(lock, {"key": _MIGRATION_LOCK})
            if not self._is_current(connection, script):
                migrate.upgrade(connection)

    def _is_current(self, connection: Connection, script: ScriptDirectory) -> bool:
        have = set(MigrationContext.configure(connection).get_current_heads())
        known = {revision.revision for revision in script.walk_revisions()}
        if have - known:
            raise DatabaseFailed(
                "store.written-newer-servodeck",
                value=self.shown,
                have=", ".join(sorted(have - known)),
            )
        return have == set(script.get_heads())

    @contextmanager
    def _translated(self) -> Iterator[None]:
        try:
            yield
        except SQLAlchemyError as error:
            cause = getattr(error, "orig", None) or error
            first = (str(cause).strip() or type(cause).__name__).splitlines()[0]
            if getattr(cause, "sqlite_errorcode", None) in _DAMAGED:
                raise DatabaseFailed(
                    "store.database-damaged-no-database", value=self.shown, first=first
                ) from error
            raise DatabaseFailed("store.database-failed", value=self.shown, first=first) from error


def _url(folder: Path, database: str | None) -> URL:
    if not database:
        return URL.create("sqlite", database=str(folder / FILE))
    try:
        url = make_url(database)
    except ArgumentError as error:
        raise DatabaseFailed("store.database-address-not-url") from error
    if url.drivername in ("postgresql", "postgres"):
        url = url.set(drivername="postgresql+psycopg")
    if url.drivername not in ("postgresql+psycopg", "sqlite"):
        raise DatabaseFailed(
            "store.servodeck-cannot-use-database", value=url.drivername, limit="sqlite, postgresql"
        )
    if url.drivername == "sqlite" and not url.database:
        raise DatabaseFailed("store.sqlite-database-memory-forget")
    return url


def _prepare_sqlite(connection: object, _record: ConnectionPoolEntry) -> None:
    """Let SQLAlchemy begin transactions explicitly, and make every commit durable on disk."""
    import sqlite3

    if not isinstance(connection, sqlite3.Connection):
        raise TypeError("not an SQLite connection")
    connection.isolation_level = None
    for pragma in ("journal_mode=WAL", "synchronous=FULL", "foreign_keys=ON"):
        connection.execute(f"PRAGMA {pragma}").close()


def _begin_sqlite(connection: Connection) -> None:
    immediate = connection.get_execution_options().get("immediate")
    connection.exec_driver_sql("BEGIN IMMEDIATE" if immediate else "BEGIN")
