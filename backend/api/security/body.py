"""Limits on the size and duration of request bodies, independent of the route."""

from __future__ import annotations

import asyncio
import json
import re
from collections.abc import Iterable

from starlette.types import Message, Receive

#: Time limits [s]: for bodies of up to 1 MiB, and for files.
BODY_S = 15.0
FILE_S = 120.0
_SMALL = 1 << 20


class BodyRefused(Exception):
    """Raised in the application while it reads the body; the gate then makes the answer."""

    def __init__(self, status: int) -> None:
        super().__init__(f"body refused ({status})")
        self.status = status


def framing(headers: Iterable[tuple[bytes, bytes]]) -> tuple[str | None, bool]:
    """Return Content-Length as sent, and whether the body is chunked.

    Raises:
        BodyRefused: both headers, or one of them twice. A proxy in front could end the
        body at another place than we do, and treat the rest as another request (RFC
        9112 clauses 6.3 and 11.2).
    """
    lengths = [value for key, value in headers if key == b"content-length"]
    codings = [value for key, value in headers if key == b"transfer-encoding"]
    if len(lengths) + len(codings) > 1:
        raise BodyRefused(400)
    return (lengths[0].decode("latin-1") if lengths else None), bool(codings)


def is_json(headers: Iterable[tuple[bytes, bytes]]) -> bool:
    """Whether a request says that its body is JSON."""
    return any(key == b"content-type" and b"json" in value.lower() for key, value in headers)


#: In JSON, a character beyond U+FFFF is written as two of these; a single one is not a character.
_HALF = re.compile(rb"\\u[dD][89a-fA-F]")


def has_half_characters(body: bytes) -> bool:
    """Whether one of the strings in a JSON text contains half of a surrogate pair.

    Python reads it, but no file, database or answer can contain it, so it is refused before it is
    stored. For text that is not JSON the answer is False; its route refuses it.
    """
    if not _HALF.search(body):
        return False
    try:
        content = json.loads(body)
    except (ValueError, RecursionError):
        return False
    left = [content]
    while left:
        each = left.pop()
        if isinstance(each, str):
            if any("\ud800" <= sign <= "\udfff" for sign in each):
                return True
        elif isinstance(each, dict):
            left += [*each.keys(), *each.values()]
        elif isinstance(each, list):
            left += each
    return False


class MeasuredBody:
    """Receiving side of a request, with size limit and deadline. ``refused``: status, or 0.

    A body that may be a file is checked for half characters only where it is sent as JSON.
    """

    def __init__(
        self,
        receive: Receive,
        limit_bytes: int,
        declared: str | None,
        chunked: bool,
        *,
        is_json: bool = False,
    ) -> None:
        self._receive = receive
        self._limit = limit_bytes
        self._seen = 0
        self._kept: list[bytes] | None = [] if is_json or limit_bytes <= _SMALL else None
        self._ended = declared in (None, "0") and not chunked
        wait = BODY_S if limit_bytes <= _SMALL else FILE_S
        self._deadline = asyncio.get_running_loop().time() + wait
        self.refused = 0
        if declared is not None and (not declared.isdigit() or int(declared) > limit_bytes):
            self.refused = 413 if declared.isdigit() else 400

    def require_accepted(self) -> None:
        """Check that the body has not been refused so far.

        Raises:
            BodyRefused: it has.
        """
        if self.refused:
            raise BodyRefused(self.refused)

    async def receive(self) -> Message:
        """Return the next message for the application.

        Raises:
            BodyRefused: too large (413), too slow (408), or with half a character (422).
        """
        if self._ended:
            return await self._receive()
        try:
            async with asyncio.timeout_at(self._deadline):
                message = await self._receive()
        except TimeoutError:
            self.refused = 408
            raise BodyRefused(408) from None
        if message["type"] == "http.request":
            part = message.get("body", b"")
            self._seen += len(part)
            self._ended = not message.get("more_body", False)
            if self._kept is not None:
                self._kept.append(part)
        else:
            self._ended = True
        if self._seen > self._limit:
            self.refused = 413
            raise BodyRefused(413)
        if self._ended and self._kept and has_half_characters(b"".join(self._kept)):
            self.refused = 422
            raise BodyRefused(422)
        return message
