"""The live feed for rerun: bounded for each page, oldest dropped and counted."""

from __future__ import annotations

import struct

from backend.station.recording.rerun_feed import MAGIC, MAX_CLIENT_BYTES, FeedClient


def parse(frame: bytes) -> tuple[int, int, list[bytes]]:
    magic, session, count, dropped = struct.unpack_from("<IIII", frame)
    assert magic == MAGIC
    blobs, at = [], 16
    for _ in range(count):
        (length,) = struct.unpack_from("<I", frame, at)
        blobs.append(frame[at + 4 : at + 4 + length])
        at += 4 + length
    assert at == len(frame)
    return session, dropped, blobs


async def test_the_first_blob_comes_first_and_once() -> None:
    client = FeedClient()
    client.begin(3, b"names")
    client.put(b"a")
    client.put(b"b")
    assert parse(await client.pull()) == (3, 0, [b"names", b"a", b"b"])
    client.put(b"c")
    assert parse(await client.pull()) == (3, 0, [b"c"])


async def test_nothing_new_is_an_empty_frame() -> None:
    client = FeedClient()
    client.begin(1, b"names")
    await client.pull()
    assert parse(await client.pull(timeout_s=0.01)) == (1, 0, [])


async def test_a_sleeping_page_costs_bounded_memory_and_the_loss_is_reported() -> None:
    client = FeedClient()
    client.begin(1, b"names")
    for n in range(100):
        client.put(bytes([n]) * (1 << 20))
    assert client.waiting_bytes <= MAX_CLIENT_BYTES
    _, dropped, blobs = parse(await client.pull())
    assert blobs[0] == b"names"
    assert [blob[0] for blob in blobs[1:]] == list(range(84, 100)), "the newest are kept"
    assert dropped == 84
    client.put(b"z")
    assert parse(await client.pull()) == (1, 0, [b"z"]), "reported once"


async def test_a_new_session_leaves_the_old_behind() -> None:
    client = FeedClient()
    client.begin(1, b"old names")
    client.put(b"old")
    client.begin(2, b"names")
    assert parse(await client.pull()) == (2, 0, [b"names"])
