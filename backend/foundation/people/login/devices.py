"""Browsers that have logged in to an account before, known by a signed cookie.

The cookie gives no access. It only separates its owner from strangers, whose tries at the same
name, however many, use up neither its budget nor its turn. (The method is OWASP's "slow down online
guessing attacks with device cookies".) It contains the account's number and is signed with a key
that the station keeps next to its database.
"""

from __future__ import annotations

import hashlib
import hmac
import secrets
from dataclasses import dataclass

LIFETIME_S = 365 * 24 * 3600


@dataclass(frozen=True, slots=True)
class Device:
    """A browser that somebody logged in with. ``id`` is random."""

    id: str
    account: int


class KnownDevices:
    """Signs and checks device cookies; without a ``key``, for this run of the server only."""

    def __init__(self, key: bytes = b"") -> None:
        self._key = key or secrets.token_bytes(32)

    def issue(self, account: int) -> str:
        """Make the cookie for a browser that has just logged in to this account."""
        device = f"{secrets.token_hex(12)}.{account}"
        return f"{device}.{self._sign(device)}"

    def known(self, cookie: str | None) -> Device | None:
        """Browser and account of a cookie; None if there is none or its signature is wrong."""
        device, _, signature = (cookie or "").rpartition(".")
        identity, _, account = device.partition(".")
        if not account.isdecimal() or len(account) > 18 or not account.isascii():
            return None
        if not hmac.compare_digest(signature.encode(), self._sign(device).encode()):
            return None
        return Device(identity, int(account))

    def _sign(self, device: str) -> str:
        return hmac.new(self._key, f"device {device}".encode(), hashlib.sha256).hexdigest()
