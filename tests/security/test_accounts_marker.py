"""A station that has had accounts does not become one without them; one server per folder."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest

from backend.commands.server.serve import Serving, accounts_needed
from backend.foundation.people.login.marker import FILE, AccountsMarker, AccountsMissing
from backend.foundation.people.rights import Role
from backend.foundation.people.station import People
from backend.foundation.store.database import DatabaseFailed
from drivers.errors import NotAllowed
from tests.support.guarded import CHEAP, PASSWORD

DATABASE = "servodeck.db"


def emptied(folder: Path) -> None:
    _side_files(folder)
    (folder / DATABASE).write_bytes(b"")


def removed(folder: Path) -> None:
    _side_files(folder)
    (folder / DATABASE).unlink()


def replaced(folder: Path) -> None:
    """By the database of a station that never had accounts."""
    other = folder.with_name("other")
    fresh = People(other, accounts_needed=True, passwords=CHEAP)
    fresh.accounts._store.open()
    fresh.close()
    _side_files(folder)
    (other / DATABASE).replace(folder / DATABASE)


def _side_files(folder: Path) -> None:
    for end in ("-wal", "-shm"):
        (folder / f"{DATABASE}{end}").unlink(missing_ok=True)


@contextmanager
def opened(folder: Path) -> Iterator[People]:
    people = People(folder, accounts_needed=True, passwords=CHEAP)
    try:
        yield people
    finally:
        people.close()


@pytest.fixture
async def station(tmp_path: Path) -> Path:
    folder = tmp_path / "station"
    folder.mkdir()
    with opened(folder) as people:
        await people.open()
        await people.accounts.add("Anna", PASSWORD, Role.ADMINISTRATOR)
    return folder


@pytest.mark.long(keep=2)
@pytest.mark.parametrize("loss", [emptied, removed, replaced])
@pytest.mark.parametrize("accounts", [None, True])
async def test_without_its_accounts_it_does_not_start(
    station: Path, loss: Callable[[Path], None], accounts: bool | None
) -> None:
    serving = Serving(accounts=accounts)
    assert await accounts_needed(station, serving) is True
    loss(station)
    with pytest.raises(AccountsMissing, match="emptied, lost or replaced") as refused:
        await accounts_needed(station, serving)
    remedy = refused.value.remedy or ""
    assert "servodeck restore" in remedy
    assert "servodeck people add NAME --role administrator" in remedy
    with opened(station) as people, pytest.raises(AccountsMissing):
        await people.open()


@pytest.mark.parametrize("damage", [b"", b"{", b'{"version": 1}', b"\xff\xfe", b"[]"])
async def test_a_damaged_note_is_a_note(station: Path, damage: bytes) -> None:
    removed(station)
    (station / FILE).write_bytes(damage)
    with pytest.raises(AccountsMissing):
        await accounts_needed(station, Serving())


@pytest.mark.long
async def test_recovery_is_on_purpose(station: Path) -> None:
    """What the message names, in the terminal of the machine; afterwards all is as before."""
    removed(station)
    done = subprocess.run(  # noqa: ASYNC221 - nothing else runs
        [sys.executable, "-m", "backend", "people", "add", "Berta", "--role", "administrator",
         "--config", str(station)],
        env={"SERVODECK_PASSWORD": PASSWORD, "PATH": ""}, capture_output=True, text=True,
        timeout=100, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert await accounts_needed(station, Serving()) is True
    with opened(station) as people:
        await people.open()
        assert [a.name for a in people.accounts.directory.all()] == ["Berta"]


async def test_an_account_that_is_none_of_an_administrator_is_no_recovery(station: Path) -> None:
    removed(station)
    with opened(station) as people:
        await people.open(recovering=True)
        await people.accounts.add("Vera", PASSWORD, Role.VIEWER)
        await people.mark()
    with pytest.raises(AccountsMissing):
        await accounts_needed(station, Serving())


async def test_a_station_from_before_gets_its_note(station: Path) -> None:
    (station / FILE).unlink()
    assert await accounts_needed(station, Serving()) is True
    content = json.loads((station / FILE).read_text())
    assert content["since"]
    assert (station / FILE).stat().st_mode & 0o077 == 0, "it holds a key"
    removed(station)
    with pytest.raises(AccountsMissing):
        await accounts_needed(station, Serving())


async def test_a_station_without_accounts_has_no_note(tmp_path: Path) -> None:
    assert await accounts_needed(tmp_path, Serving()) is False
    with opened(tmp_path) as people:
        await people.open()
        await people.accounts.add("Vera", PASSWORD, Role.VIEWER)
        await people.mark()
    assert not AccountsMarker(tmp_path).exists
    assert await accounts_needed(tmp_path, Serving(accounts=True)) is True
    assert await accounts_needed(tmp_path, Serving()) is False


async def test_single_user_is_said_on_purpose_and_on_loopback_only(station: Path) -> None:
    removed(station)
    assert await accounts_needed(station, Serving(accounts=False)) is False
    with pytest.raises(NotAllowed):
        await accounts_needed(station, Serving(host="0.0.0.0", accounts=False))


async def test_a_damaged_database_claims_only_what_is_known(station: Path) -> None:
    _side_files(station)
    (station / DATABASE).write_bytes(b"this is no database" * 100)
    with pytest.raises(DatabaseFailed) as failed:
        await accounts_needed(station, Serving())
    reported = f"{failed.value.message} {failed.value.remedy}"
    assert "damaged" in reported
    assert "restore a backup" in reported
    assert "unharmed" not in reported
    assert "PostgreSQL" not in reported


def serve(folder: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "backend", "serve", "--port", "0", "--config", str(folder)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.mark.long
@pytest.mark.timeout(400)  # four starts of the whole program
def test_a_second_server_on_a_folder_does_not_start(tmp_path: Path) -> None:
    """Also where the first one has just made the folder; and not for longer than the first runs."""
    folder = tmp_path / "state"
    link = tmp_path / "link"
    first = serve(folder)
    assert first.stdout is not None
    try:
        assert re.search(r"http://localhost:\d+/", first.stdout.readline())
        link.symlink_to(folder)
        for path in (folder, link):
            second = serve(path)
            _, reported = second.communicate(timeout=100)
            assert second.returncode == 1
            assert "another servodeck uses the state folder" in reported
            assert "--config" in reported
    finally:
        first.send_signal(signal.SIGKILL)
        first.communicate()
    third = serve(folder)
    assert third.stdout is not None
    try:
        found = re.search(r"http://localhost:(\d+)/", third.stdout.readline())
        assert found
        assert httpx.get(f"http://127.0.0.1:{found[1]}/api/v1/health").status_code == 200
    finally:
        third.send_signal(signal.SIGINT)
        third.communicate(timeout=60)
