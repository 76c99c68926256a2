"""Budgets of wrong tries of name and password, after which waits begin.

Guessing is slowed down; guesses by others do not lock out a person who knows the password:

- A browser that has logged in to an account before (`devices`) has a budget of its own for that
  account.
- Every other client has a budget for each name from each address. Wrong tries from other addresses
  only reduce it, down to one try at a time: the first try of an address is never refused.
"""

from __future__ import annotations

import hashlib
import ipaddress

from backend.foundation.people.errors import TooOften
from backend.foundation.people.login.credentials import name_key
from backend.foundation.people.login.throttle import Throttle

#: Wrong tries before waits begin: of a name from one address, or from a known browser.
FREE = 5
#: Wrong tries within an hour above which a name or an address counts as under attack, and the free
#: tries that are left then.
CROWDED, FREE_IN_CROWD = 20, 1
#: Prefix length. An IPv6 host can use any number of addresses within its network.
_IPV6_NETWORK = 64


class LoginBudgets:
    """Wrong tries, counted by name, by address and by the pair of both."""

    def __init__(self) -> None:
        self._pairs = Throttle(FREE)
        self._names, self._addresses = Throttle(CROWDED), Throttle(CROWDED)

    def require(self, name: str, address: str, device: str = "") -> None:
        """Check that a try is allowed now; ``device`` is the id of a known browser, or empty.

        Raises:
            TooOften: a wait is still running.
        """
        wait = self._pairs.wait_s(_pair(name, address, device))
        if wait > 0:
            raise TooOften("people.too-many-wrong-tries", wait)

    def tried(self, name: str, address: str, device: str = "") -> None:
        """Count a try as wrong, until `succeeded` is called."""
        if device:
            self._pairs.failed(_pair(name, address, device))
            return
        key, place = _name(name), address_group(address)
        self._names.failed(key)
        # Behind a proxy all clients have this machine's address: one must not slow down all.
        if not _is_loopback(address):
            self._addresses.failed(place)
        crowded = max(self._names.failures(key), self._addresses.failures(place)) > CROWDED
        self._pairs.failed(_pair(name, address), free_tries=FREE_IN_CROWD if crowded else None)

    def wrong_tries_of(self, address: str) -> int:
        """Wrong tries of an address within the last hour; 0 behind a proxy on this machine."""
        return self._addresses.failures(address_group(address))

    def succeeded(self, name: str, address: str, device: str = "") -> None:
        """Reset the counts after a right password."""
        self._pairs.succeeded(_pair(name, address, device))
        if not device:
            self._names.succeeded(_name(name))
            self._addresses.succeeded(address_group(address))


def address_group(address: str) -> str:
    """Group of addresses that one computer may use at will: IPv6 network, or IPv4 address."""
    try:
        known = ipaddress.ip_address(address.partition("%")[0])
    except ValueError:
        return address
    if isinstance(known, ipaddress.IPv6Address):
        if known.ipv4_mapped is not None:
            return str(known.ipv4_mapped)
        if not known.is_loopback:
            return str(ipaddress.ip_network((known, _IPV6_NETWORK), strict=False))
    return str(known)


def _name(name: str) -> str:
    """Hash of the name's lookup key; its length is fixed, however long the name that was sent."""
    return hashlib.sha256(name_key(name).encode()).hexdigest()


def _pair(name: str, address: str, device: str = "") -> str:
    return f"{_name(name)} device {device}" if device else f"{_name(name)} {address_group(address)}"


def _is_loopback(address: str) -> bool:
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        return False
