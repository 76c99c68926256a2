"""How often somebody may try a name and password wrongly before waits begin.

Whoever guesses is slowed; whoever knows the password is not kept out by those who guess:

- A browser that has logged in to an account before (`backend.people.login.devices`) has a budget
  of its own for that account.
- Everybody else has one for each name from each address. What other addresses did wrong only
  makes it smaller, down to one try at a time: the first try of an address is never refused.
"""

from __future__ import annotations

import hashlib
import ipaddress

from backend.people.credentials import name_key
from backend.people.errors import TooOften
from backend.people.throttle import Throttle

#: Wrong tries before waits begin: of a name from one address, or from a known browser.
FREE = 5
#: The same once a name, or an address, has been tried wrongly this often within an hour.
CROWDED, FREE_IN_CROWD = 20, 1
#: An IPv6 host has as many addresses as it likes within its network.
_IPV6_NETWORK = 64


class LoginBudgets:
    """With wrong tries, counted by name, by address and by both together."""

    def __init__(self) -> None:
        self._pairs = Throttle(FREE)
        self._names, self._addresses = Throttle(CROWDED), Throttle(CROWDED)

    def require(self, name: str, address: str, device: str = "") -> None:
        """One may be tried now; ``device`` is the browser known for this account, if it is one.

        Raises:
            TooOften: not yet.
        """
        wait = self._pairs.wait_s(_pair(name, address, device))
        if wait > 0:
            raise TooOften("people.too-many-wrong-tries", wait)

    def tried(self, name: str, address: str, device: str = "") -> None:
        """Count a try as a wrong one, until `succeeded` says otherwise."""
        if device:
            self._pairs.failed(_pair(name, address, device))
            return
        key, place = _name(name), address_group(address)
        self._names.failed(key)
        # Behind a proxy everybody comes from this machine: one must not make it hard for all.
        if not _is_loopback(address):
            self._addresses.failed(place)
        crowded = max(self._names.failures(key), self._addresses.failures(place)) > CROWDED
        self._pairs.failed(_pair(name, address), free_tries=FREE_IN_CROWD if crowded else None)

    def wrong_tries_of(self, address: str) -> int:
        """Wrong tries of an address within the last hour; 0 behind a proxy on this machine."""
        return self._addresses.failures(address_group(address))

    def succeeded(self, name: str, address: str, device: str = "") -> None:
        """It was right; the wrong tries before are forgotten."""
        self._pairs.succeeded(_pair(name, address, device))
        if not device:
            self._names.succeeded(_name(name))
            self._addresses.succeeded(address_group(address))


def address_group(address: str) -> str:
    """Addresses that one computer may have at will are one: an IPv6 network, an IPv4 address."""
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
    """As it is looked up; of a fixed length, however long a name somebody sends."""
    return hashlib.sha256(name_key(name).encode()).hexdigest()


def _pair(name: str, address: str, device: str = "") -> str:
    return f"{_name(name)} device {device}" if device else f"{_name(name)} {address_group(address)}"


def _is_loopback(address: str) -> bool:
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        return False
