"""A log-in that is being checked while an administrator changes the account."""

from __future__ import annotations

import asyncio
import threading
from pathlib import Path
from unittest.mock import AsyncMock

import pytest
from argon2 import PasswordHasher

from backend.foundation.people.accounts import Accounts
from backend.foundation.people.errors import NotLoggedIn
from backend.foundation.people.login.passwords import Passwords
from backend.foundation.people.rights import Role
from backend.foundation.store.database import Store

OLD, NEW = "eleven blue horses", "twelve green horses"


class _SlowPasswords(Passwords):
    """A check that ends when the test says so."""

    def __init__(self) -> None:
        super().__init__(PasswordHasher(time_cost=1, memory_cost=8, parallelism=1))
        self.begun, self.going_on = threading.Event(), threading.Event()

    def verify(self, kept: str, password: str) -> bool:
        self.begun.set()
        assert self.going_on.wait(10)
        return super().verify(kept, password)


@pytest.mark.parametrize("change", ["password", "removed"])
async def test_the_old_password_begins_no_session_after_the_change(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: str
) -> None:
    store, passwords = Store(tmp_path), _SlowPasswords()
    accounts = Accounts(store, passwords)
    try:
        await accounts.open()
        await accounts.add("Anna", NEW, Role.ADMINISTRATOR)
        account = await accounts.add("Ben", OLD, Role.OPERATOR)
        log_in = asyncio.create_task(accounts.log_in("Ben", OLD, "192.0.2.1", "a browser"))
        await asyncio.to_thread(passwords.begun.wait, 10)
        if change == "removed":
            await accounts.remove(account.id)
        else:
            # Hashed before the check began, whose turn comes after that of the hash.
            hashed = passwords.hash(NEW)
            monkeypatch.setattr(accounts, "_hash", AsyncMock(return_value=hashed))
            await accounts.set_password(account.id, NEW)
        passwords.going_on.set()
        with pytest.raises(NotLoggedIn):
            await log_in
        assert accounts.directory.sessions(account.id) == []
    finally:
        passwords.going_on.set()
        store.close()
