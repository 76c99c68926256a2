"""How often somebody may try a name and password wrongly before waits begin."""

from __future__ import annotations

import ipaddress

from backend.people.credentials import name_key
from backend.people.errors import TooOften
from backend.people.throttle import Throttle

#: Wrong tries before waits begin: for a name from one address, for a name, for an address.
_PAIR, _NAME, _ADDRESS = 5, 20, 20


class Patience:
    """With wrong tries, counted by name, by address and by both together."""

    def __init__(self) -> None:
        self._throttles = (Throttle(_PAIR), Throttle(_NAME), Throttle(_ADDRESS))

    def require(self, name: str, address: str) -> None:
        """One may be tried now.

        Raises:
            TooOften: not yet.
        """
        wait = max(
            throttle.wait_s(key)
            for throttle, key in zip(self._throttles, _keys(name, address), strict=True)
        )
        if wait > 0:
            raise TooOften("too many wrong tries", wait)

    def tried(self, name: str, address: str) -> None:
        """Count a try as a wrong one, until `succeeded` says otherwise."""
        for throttle, key in zip(self._throttles, _keys(name, address), strict=True):
            # Behind a proxy everybody comes from this machine: one must not lock out all.
            if key != address or not _is_loopback(address):
                throttle.failed(key)

    def succeeded(self, name: str, address: str) -> None:
        """It was right; the wrong tries before are forgotten."""
        for throttle, key in zip(self._throttles, _keys(name, address), strict=True):
            throttle.succeeded(key)


def _keys(name: str, address: str) -> tuple[str, str, str]:
    key = name_key(name)[:120]
    return f"{key} {address}", key, address


def _is_loopback(address: str) -> bool:
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        return False
