"""Marker file next to the database, which states that this station has accounts.

A database file that was emptied, lost or replaced looks like a station that never had accounts, and
such a station lets anyone who reaches it do everything. The fact is therefore also stored in
``accounts.json`` in the state folder, with the key of the known browsers. A station that finds the
marker without an administrator in its database does not start.
"""

from __future__ import annotations

import json
import secrets
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from backend.foundation.store.files import write_atomically
from drivers.errors import NotAllowed
from drivers.texts.message import text

FILE = "accounts.json"
_KEY_BYTES = 32


class AccountsMissing(NotAllowed):
    """The station has had accounts, but its database has no administrator."""

    kind = "accounts-gone"


@dataclass(frozen=True, slots=True)
class Marker:
    """Since when (UTC) there are accounts (empty if unreadable), and the key of device cookies."""

    since: str
    key: bytes


class AccountsMarker:
    """Marker file of one state folder. All methods block."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / FILE

    @property
    def exists(self) -> bool:
        """Whether the station has ever had accounts; an unreadable marker also counts."""
        return self.path.is_symlink() or self.path.exists()

    def read(self) -> Marker | None:
        """Read the marker; None if there is none. A damaged marker is returned with empty values.

        Raises:
            AccountsMissing: the file cannot be read, so that it is unknown
            whether there are accounts.
        """
        try:
            content = json.loads(self.path.read_bytes())
            return Marker(str(content["since"]), bytes.fromhex(content["device_key"]))
        except FileNotFoundError:
            return Marker("", b"") if self.path.is_symlink() else None
        except (ValueError, KeyError, TypeError):
            return Marker("", b"")
        except OSError as error:
            raise AccountsMissing(
                "people.cannot-read-not-known",
                value=str(self.path),
                path=str(self.path),
                strerror=error.strerror,
            ) from error

    def write(self) -> Marker:
        """Write the marker, unless a valid one exists; a damaged one is replaced.

        Raises:
            StorageFailed: it cannot be written.
        """
        found = self.read()
        if found is not None and len(found.key) == _KEY_BYTES:
            return found
        made = Marker(datetime.now(UTC).isoformat(timespec="seconds"), secrets.token_bytes(32))
        content = {"version": 1, "since": made.since, "device_key": made.key.hex()}
        # Temporary files are readable by their user only, and the renamed file keeps that mode.
        write_atomically(self.path, json.dumps(content, indent=2).encode())
        return made

    def require_accounts(self, database: Path | None, *, set_up: bool) -> None:
        """Check that a station that has had accounts still has an administrator.

        Raises:
            AccountsMissing: it has none; the message states how to recover on purpose.
        """
        found = self.read()
        if found is None or set_up:
            return
        folder = self.path.parent
        since = text("people.since", time=found.since) if found.since else ""
        raise AccountsMissing(
            "people.station-accounts-database-no",
            value=str(database),
            since=since,
            database=str(database),
            folder=str(folder),
        )
