"""Search and identification of nodes. Runs on a worker thread."""

from __future__ import annotations

import time
from collections.abc import Sequence

from drivers.canopen.sdo.channel import SdoChannel
from drivers.errors import DriveError, LinkLost
from drivers.link import Found
from drivers.objects.codec import serial_or_none, text_of
from drivers.texts.message import Text, text

_WINDOW_S = 0.12
_SERVO = 402


def probe(channels: Sequence[SdoChannel]) -> dict[int, list[bytes]]:
    """Request the device type from all these nodes at once; return answers by responding node.

    Raises:
        LinkLost: the adapter is gone.
    """
    begun: list[SdoChannel] = []
    answers: dict[int, list[bytes]] = {}
    try:
        for channel in channels:
            channel.begin_probe()
            begun.append(channel)
        time.sleep(_WINDOW_S)
    finally:
        for channel in begun:
            answers[channel.node] = channel.end_probe()
    return {node: got for node, got in answers.items() if got}


def identify(channel: SdoChannel, answers: Sequence[bytes], timeout_s: float) -> Found:
    """Read the identity of a node that answered; missing objects stay None or empty."""
    notes: list[Text] = []
    if len(answers) > 1:
        notes.append(text("canopen.note-same-number", node_count=len(answers), node=channel.node))
    device_type = _device_type(channel, answers[0], timeout_s)
    if device_type is not None and device_type & 0xFFFF != _SERVO:
        notes.append(text("canopen.note-no-drive", device_profile=device_type & 0xFFFF))

    def number(index: int, subindex: int) -> int | None:
        data = _read(channel, index, subindex, timeout_s)
        return None if data is None else int.from_bytes(data, "little")

    def shown(index: int) -> str:
        data = _read(channel, index, 0, timeout_s) or b""
        return readable(data)

    return Found(
        station=channel.node,
        # Vendor 0 does not exist: the drive states none.
        vendor_id=number(0x1018, 1) or None,
        product_code=number(0x1018, 2),
        revision=number(0x1018, 3),
        serial=serial_or_none(number(0x1018, 4)),
        name=shown(0x1008),
        hardware=shown(0x1009),
        firmware=shown(0x100A),
        notes=tuple(notes),
        device_profile=None if device_type is None else device_type & 0xFFFF,
    )


def _device_type(channel: SdoChannel, answer: bytes, timeout_s: float) -> int | None:
    """Return the device type in the answer to the probe, or None if it was refused."""
    if answer[0] & 0xE0 != 0x40:
        return None
    if answer[0] & 0x02:
        return int.from_bytes(answer[4:8], "little")
    # A node may send even four bytes in segments (CiA 301 clause 7.2.4.3.5): then this is a length.
    data = _read(channel, 0x1000, 0, timeout_s)
    return None if data is None else int.from_bytes(data, "little")


def _read(channel: SdoChannel, index: int, subindex: int, timeout_s: float) -> bytes | None:
    try:
        return channel.read(index, subindex, timeout_s)
    except LinkLost:
        raise
    except DriveError:
        return None


def readable(data: bytes) -> str:
    """Return text as sent, or the number if a drive stores versions as numbers (DS_C, 003:421)."""
    if 0 < len(data) <= 4 and not all(0x20 <= byte < 0x7F for byte in data):
        return str(int.from_bytes(data, "little"))
    return text_of(data)
