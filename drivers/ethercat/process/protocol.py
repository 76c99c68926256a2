"""Messages between the server and the EtherCAT host process.

A message is a msgpack map preceded by its length (4 bytes, little endian). Requests carry ``id``
and ``op``; replies the same ``id`` with ``result`` or ``error``; ``progress`` may precede the
reply; an ``event`` is sent without a request.
"""

from __future__ import annotations

import struct
from typing import Any, TypedDict

import msgpack  # type: ignore[import-untyped]

from drivers import errors
from drivers.errors import DriveError, Rejected
from drivers.texts.message import Text, Wire

#: Each message has a fixed set of keys, but its values differ by operation: the type check ends
#: here.
Message = dict[str, Any]

_LENGTH = struct.Struct("<I")
MAX_MESSAGE_BYTES = 64 << 20


class WireError(TypedDict):
    """A `DriveError` in the form in which it is sent to the server."""

    kind: str
    text: Wire
    parameter: str | None
    limit: Wire | None
    remedy: Wire | None
    abort_code: int | None


_KINDS: dict[str, type[DriveError]] = {
    kind.kind: kind
    for kind in (
        DriveError, errors.LinkTimeout, errors.LinkLost, errors.ProtocolError,
        errors.OutOfRange, errors.NotAllowed, errors.NotInUse, errors.Busy,
    )
}  # fmt: skip


def pack(message: Message) -> bytes:
    """Return a message preceded by its length."""
    body: bytes = msgpack.packb(message, use_bin_type=True)
    return _LENGTH.pack(len(body)) + body


def require_length(length: int) -> None:
    """Require that the other side accepts a message of this length.

    Raises:
        ProtocolError: it is above `MAX_MESSAGE_BYTES`.
    """
    if length > MAX_MESSAGE_BYTES:
        raise errors.ProtocolError("ethercat.message-bytes-between-our", length_bytes=length)


class Unpacker:
    """Collects bytes and returns complete messages."""

    def __init__(self) -> None:
        self._buffer = bytearray()

    def feed(self, data: bytes) -> list[Message]:
        """Return the messages completed by ``data``.

        Raises:
            ProtocolError: a length above `MAX_MESSAGE_BYTES`.
        """
        self._buffer += data
        found: list[Message] = []
        while len(self._buffer) >= 4:
            (length,) = _LENGTH.unpack_from(self._buffer)
            require_length(length)
            if len(self._buffer) < 4 + length:
                break
            body = bytes(self._buffer[4 : 4 + length])
            found.append(msgpack.unpackb(body, raw=False, strict_map_key=False))
            del self._buffer[: 4 + length]
        return found


def error_to_wire(error: DriveError) -> WireError:
    """Convert the error to a map."""
    return WireError(
        kind=error.kind,
        text=error.text.to_wire(),
        parameter=error.parameter,
        limit=None if error.limit_text is None else error.limit_text.to_wire(),
        remedy=None if error.own_remedy is None else error.own_remedy.to_wire(),
        abort_code=error.abort_code if isinstance(error, Rejected) else None,
    )


def error_from_wire(wire: WireError) -> DriveError:
    """Convert the map to an error of the same class."""
    limit = None if wire["limit"] is None else Text.from_wire(wire["limit"])
    remedy = None if wire["remedy"] is None else Text.from_wire(wire["remedy"])
    if wire["abort_code"] is not None:
        return Rejected(
            Text.from_wire(wire["text"]),
            abort_code=wire["abort_code"],
            parameter=wire["parameter"],
            limit=limit,
            remedy=remedy,
        )
    return _KINDS.get(wire["kind"], DriveError)(
        Text.from_wire(wire["text"]),
        parameter=wire["parameter"],
        limit=limit,
        remedy=remedy,
    )
