"""rerun through our own origin: the viewer's files, their policy, and the live feed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import ClientConnection, connect

from tests.support.station import HANG_S, Station, until
from tests.unit.recording.test_feed import parse


@pytest.fixture
def feed(station: Station, x: str) -> Iterator[ClientConnection]:
    with connect(f"ws://127.0.0.1:{station.port}/rerun/feed", max_size=None) as socket:
        yield socket


def pull(feed: ClientConnection) -> tuple[int, int, list[bytes]]:
    feed.send("pull")
    frame = feed.recv(timeout=20)
    assert isinstance(frame, bytes)
    return parse(frame)


def entities(path: Path) -> dict[str, int]:
    from rerun.chunk import RrdReader

    rows: dict[str, int] = {}
    for chunk in RrdReader(path).stream().to_chunks():
        if "time" in chunk.timeline_names:
            entity = chunk.entity_path.strip("/")
            rows[entity] = rows.get(entity, 0) + chunk.num_rows
    return rows


def words(path: Path) -> list[str]:
    from rerun.chunk import RrdReader

    found: list[str] = []
    for chunk in RrdReader(path).stream().to_chunks():
        batch = chunk.to_record_batch()
        for name in batch.schema.names:
            if name.endswith("TextLog:text"):
                found += [str(cell) for cell in batch.column(name).to_pylist()]
    return found


@pytest.mark.long
def test_feed_is_what_reruns_own_reader_reads(
    station: Station, x: str, feed: ClientConnection, tmp_path: Path
) -> None:
    blobs: list[bytes] = []
    station.ok(station.http.get(f"/drives/{x}/parameters/6083:00"))
    until(lambda: blobs.extend(pull(feed)[2]) or len(blobs) > 5, HANG_S, "samples come")
    station.ok(station.http.put(f"/drives/{x}/parameters/6083:00", json={"value": 2345}))
    enough = len(blobs) + 8
    until(lambda: blobs.extend(pull(feed)[2]) or len(blobs) > enough, HANG_S, "more of them")
    log: list[str] = []
    seen: dict[str, int] = {}
    for number, blob in enumerate(blobs):
        assert blob.startswith(b"RRF2"), "each is a stream of its own, so that any may be dropped"
        path = tmp_path / f"{number}.rrd"
        path.write_bytes(blob)
        if number == 0:
            from rerun.chunk import RrdReader

            assert len(RrdReader(path).blueprints()) == 1, "the arrangement comes first"
            continue
        log += words(path)
        for entity, rows in entities(path).items():
            seen[entity] = seen.get(entity, 0) + rows
    assert {"x/rev", "x/rpm"} <= set(seen), seen
    assert seen["x/rev"] > 5
    assert any("is now 2345" in text for text in log), log


def test_feed_begins_anew_when_the_bench_changes(station: Station, feed: ClientConnection) -> None:
    session, _, blobs = pull(feed)
    until(lambda: blobs or blobs.extend(pull(feed)[2]) or blobs, HANG_S)
    session = pull(feed)[0]
    other = station.add(2, name="Y")
    try:
        until(lambda: pull(feed)[0] != session, HANG_S, "a new session with both drives")
    finally:
        station.ok(station.http.delete(f"/drives/{other}"))


def test_feed_costs_nothing_when_nobody_looks(station: Station, x: str) -> None:
    def transactions() -> int:
        return int(station.ok(station.http.get(f"/drives/{x}"))["quality"]["transactions"])

    with connect(f"ws://127.0.0.1:{station.port}/rerun/feed", max_size=None) as socket:
        until(lambda: len(pull(socket)[2]) > 0, HANG_S)
        before = transactions()
        until(lambda: transactions() > before + 20, HANG_S, "the feed polls")

    def quiet() -> bool:
        import time

        before = transactions()
        time.sleep(0.5)
        return transactions() - before < 20

    until(quiet, HANG_S, "the polling ends with the last page")


def test_foreign_pages_get_no_feed(station: Station) -> None:
    with (
        pytest.raises(InvalidStatus),
        connect(f"ws://127.0.0.1:{station.port}/rerun/feed", origin="http://evil.example"),
    ):
        pass


@pytest.mark.long
def test_viewer_comes_from_here_and_only_it_may_compile(station: Station) -> None:
    page = httpx.get(f"{station.url}/rerun/")
    assert "'wasm-unsafe-eval'" in page.headers["content-security-policy"]
    assert "connect-src 'self'" in page.headers["content-security-policy"]
    assert "https://" not in page.text
    assert "wasm-unsafe-eval" not in httpx.get(station.url).headers["content-security-policy"]
    for part, kind in (("viewer.js", "text/javascript"), ("viewer.css", "text/css")):
        answer = httpx.get(f"{station.url}/rerun/{part}")
        assert answer.headers["content-type"].startswith(kind)
    assert httpx.get(f"{station.url}/rerun/viewer.html").status_code == 404
    version = page.text.split('data-version="')[1].split('"')[0]
    for name, begin in (("re_viewer.js", b"let wasm_bindgen"), ("re_viewer_bg.wasm", b"\0asm")):
        answer = httpx.get(f"{station.url}/rerun/{version}/{name}", timeout=60)
        assert answer.status_code == 200, answer.text
        assert answer.headers["content-encoding"] == "gzip"
        assert "immutable" in answer.headers["cache-control"]
        assert answer.content.startswith(begin)
        assert len(answer.content) == int(answer.headers["rerun-final-length"])
    assert httpx.get(f"{station.url}/rerun/{version}/index.html").status_code == 404
    assert httpx.get(f"{station.url}/rerun/0.1.0/re_viewer.js").status_code == 404
