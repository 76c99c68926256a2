"""Whether a request was meant for us: Host (DNS rebinding), Origin and fetch metadata."""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Iterable
from dataclasses import dataclass

from backend.people.errors import Forbidden

Headers = list[tuple[bytes, bytes]]
_HOST = re.compile(r"(?P<name>\[[^\[\]@]*\]|[^:\[\]@]*)(:\d{1,5})?")


def header(headers: Iterable[tuple[bytes, bytes]], name: bytes) -> str | None:
    """The value of a header, or None.

    Raises:
        Forbidden: it is there twice; who reads which could not be known.
    """
    found = [value for key, value in headers if key == name]
    if len(found) > 1:
        raise Forbidden("api-security.header-twice", name=name.decode())
    return found[0].decode("latin-1") if found else None


@dataclass(frozen=True, slots=True)
class Addresses:
    """The names that this server answers to, in lower case, IPv6 in brackets.

    ``behind`` are names of a proxy in front of it, which may speak HTTPS where we do not.
    ``own_addresses``: also the address that the request came in at, when that is no name.
    """

    names: frozenset[str]
    behind: frozenset[str] = frozenset()
    own_addresses: bool = False

    def check(
        self, headers: Headers, *, secure: bool, local_address: str | None, changes: bool
    ) -> None:
        """Host is ours, and a browser's Origin is the same place.

        Raises:
            Forbidden: it is not.
        """
        host = header(headers, b"host")
        if host is None or not self._is_ours(_name(host).lower(), local_address):
            raise Forbidden(
                "api-security.address-server-not-answers",
                value=host,
                limit=", ".join(sorted(self.names | self.behind)),
            )
        origin = header(headers, b"origin")
        if origin is not None:
            scheme, _, place = origin.partition("://")
            schemes = {"https"} if secure else {"http"}
            if _name(host).lower() in self.behind:
                schemes = {"http", "https"}
            if place != host or scheme not in schemes:
                raise Forbidden("api-security.request-comes-another-page-use-page", value=origin)
        site = header(headers, b"sec-fetch-site")
        if changes and site not in (None, "same-origin", "none"):
            raise Forbidden("api-security.request-comes-another-page", value=site)

    def _is_ours(self, name: str, local_address: str | None) -> bool:
        if name in self.names or name in self.behind:
            return True
        if not self.own_addresses or local_address is None:
            return False
        # An address is no name, so nobody can make it resolve to something else.
        try:
            return ipaddress.ip_address(name.strip("[]")) == ipaddress.ip_address(local_address)
        except ValueError:
            return False


def _name(host: str) -> str:
    """The name of a Host header without its port; the whole where it is no name and port."""
    found = _HOST.fullmatch(host)
    return found["name"] if found else host
