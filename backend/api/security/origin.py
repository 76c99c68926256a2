"""Check that a request is addressed to us: Host (DNS rebinding), Origin and fetch metadata."""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Iterable
from dataclasses import dataclass

from backend.foundation.people.errors import Forbidden

Headers = list[tuple[bytes, bytes]]
_HOST = re.compile(r"(?P<name>\[[^\[\]@]*\]|[^:\[\]@]*)(:\d{1,5})?")


def header(headers: Iterable[tuple[bytes, bytes]], name: bytes) -> str | None:
    """Return the value of a header, or None.

    Raises:
        Forbidden: it occurs twice, so that a proxy and we might read different values.
    """
    found = [value for key, value in headers if key == name]
    if len(found) > 1:
        raise Forbidden("api-security.header-twice", name=name.decode())
    return found[0].decode("latin-1") if found else None


@dataclass(frozen=True, slots=True)
class Addresses:
    """Names that this server accepts in Host, in lower case, IPv6 in brackets.

    ``behind`` are names of a proxy in front of it, which may use HTTPS where we do not.
    ``own_addresses``: the IP address at which the request arrived is also accepted.
    """

    names: frozenset[str]
    behind: frozenset[str] = frozenset()
    own_addresses: bool = False

    def check(
        self, headers: Headers, *, secure: bool, local_address: str | None, changes: bool
    ) -> None:
        """Check that Host is one of our names, and that a browser's Origin is the same place.

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
        # An IP address is not resolved, so DNS rebinding is impossible.
        try:
            return ipaddress.ip_address(name.strip("[]")) == ipaddress.ip_address(local_address)
        except ValueError:
            return False


def _name(host: str) -> str:
    """Host name without port; the whole text if it is not a name with an optional port."""
    found = _HOST.fullmatch(host)
    return found["name"] if found else host
