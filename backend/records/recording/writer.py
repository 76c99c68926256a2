"""Writing one recording on its own thread; a full queue ends the recording, no block is dropped."""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
import threading
import time
from bisect import bisect_right
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import BinaryIO

from backend.foundation.store.files import StorageFailed
from backend.foundation.store.free_space import RESERVE_BYTES, free_bytes
from backend.records.recording import chunks
from drivers.computer.files import write_parts
from drivers.link import ScopeBlock
from drivers.texts import limits
from drivers.texts.answers import sentence
from profiles.replacing import move_into_place

#: Size of the blocks that may wait for the disk: two minutes at 16 channels × 4 kHz.
MAX_QUEUED_BYTES = 64 * 1024 * 1024
#: Period of flushes to the disk [s]: a power cut loses no more than this.
SYNC_S = 0.5
#: Blocks are collected for this time [s] or up to this size, as waking the thread for each block
#: would cost more than writing it.
GATHER_S, GATHER_BYTES = 0.1, 1024 * 1024
#: Chunks of one write: each has at most five parts, and the system accepts 1024 (IOV_MAX).
_WRITE_ITEMS = 200


_Item = tuple[int, ScopeBlock] | bytes


@dataclass(frozen=True, slots=True)
class Written:
    """Figures of a recording. ``first_s``/``last_s``: sample times on the recording's clock."""

    samples: int = 0
    blocks: int = 0
    bytes: int = 0
    lost: int = 0
    first_s: float | None = None
    last_s: float | None = None
    queued_bytes: int = 0


class RecordingWriter:
    """One open file. All public methods but `close` return at once; the thread writes.

    ``failed`` is called once, on the writer's thread, when the recording ends because of an error:
    disk full, disk removed, or disk too slow. The data written up to then are readable.
    """

    def __init__(
        self,
        path: Path,
        header: Mapping[str, object],
        failed: Callable[[StorageFailed], None],
        *,
        max_queued_bytes: int = MAX_QUEUED_BYTES,
        reserve_bytes: int = RESERVE_BYTES,
        free: Callable[[Path], int] = free_bytes,
    ) -> None:
        self.path = path
        self._failed = failed
        self._limit = max_queued_bytes
        self._enough = min(GATHER_BYTES, max_queued_bytes // 8)
        self._reserve = reserve_bytes
        self._free = free
        self._queue: deque[_Item] = deque()
        self._queued = 0
        self._wake = threading.Condition()
        self._closing: dict[str, object] | None = None
        self._error: StorageFailed | None = None
        self._written = Written()
        self._good = 0
        self._file = self._create(chunks.MAGIC + chunks.json_chunk(chunks.HEADER, header))
        self._thread = threading.Thread(target=self._run, name=f"record-{path.stem}", daemon=True)
        self._thread.start()

    # --- called by the event loop -----------------------------------------------------

    def put(self, stream: int, block: ScopeBlock) -> None:
        """Queue a block. Does nothing after a failure, which ``failed`` has reported."""
        self._add((stream, block), block.samples.nbytes + 64)

    def event(self, content: Mapping[str, object]) -> None:
        """Queue an event."""
        data = chunks.json_chunk(chunks.EVENT, content)
        self._add(data, len(data))

    def written(self) -> Written:
        """Figures up to now."""
        return replace(self._written, queued_bytes=self._queued)

    def close(self, end: Mapping[str, object]) -> Written:
        """Write queued blocks and the end chunk; blocks until they are on the disk.

        Raises:
            StorageFailed: the recording failed, now or before.
        """
        with self._wake:
            self._closing = self._closing or dict(end)
            self._wake.notify()
        self._thread.join()
        if self._error is not None:
            raise self._error
        return self._written

    def _add(self, item: _Item, size: int) -> None:
        with self._wake:
            if self._error is not None or self._closing is not None:
                return
            if self._queued + size > self._limit:
                self._error = StorageFailed(
                    "recording.disk-not-keep-up",
                    value=self._queued,
                    limit=f"{self._limit >> 20} MiB",
                    path=self.path.name,
                    queued_mib=self._queued >> 20,
                )
            else:
                self._queue.append(item)
                self._queued += size
            if self._urgent():
                self._wake.notify()

    def _urgent(self) -> bool:
        """Whether the thread must not wait for more blocks."""
        return self._queued >= self._enough or self._closing is not None or self._error is not None

    # --- the thread -------------------------------------------------------------------

    def _create(self, head: bytes) -> BinaryIO:
        """Create the file with its head atomically, as the server may be killed at any moment."""
        part = self.path.with_name(f".{self.path.name}.{secrets.token_hex(4)}.part")
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._check_space()
            file = part.open("xb", buffering=0)
        except OSError as error:
            raise self._storage(error) from error
        try:
            _write(file, head)
            os.fsync(file.fileno())
            _name_once(part, self.path)
        except OSError as error:
            file.close()
            part.unlink(missing_ok=True)
            raise self._storage(error) from error
        self._good = len(head)
        self._written = Written(bytes=self._good)
        return file

    def _run(self) -> None:
        synced = time.monotonic()
        try:
            while True:
                with self._wake:
                    if not self._urgent():
                        self._wake.wait(GATHER_S)
                    items, self._queue = list(self._queue), deque()
                    closing, error = self._closing, self._error
                    self._queued = 0
                self._append(items)
                if error is not None:
                    raise error
                if closing is not None:
                    self._end(closing)
                    return
                if time.monotonic() - synced >= SYNC_S:
                    os.fsync(self._file.fileno())
                    self._check_space()
                    synced = time.monotonic()
        except OSError as error:
            self._give_up(self._storage(error))
        except StorageFailed as error:
            self._give_up(error)
        finally:
            self._file.close()

    def _append(self, items: list[_Item]) -> None:
        for start in range(0, len(items), _WRITE_ITEMS):
            self._append_together(items[start : start + _WRITE_ITEMS])

    def _append_together(self, items: list[_Item]) -> None:
        """Write several chunks in one call; after an error only completely written ones count."""
        parts: list[chunks.Part] = []
        ends: list[int] = []
        size = 0
        for item in items:
            chunk: list[chunks.Part] = (
                [item] if isinstance(item, bytes) else chunks.samples_parts(*item)
            )
            parts += chunk
            size += sum(map(len, chunk))
            ends.append(size)
        done = 0
        try:
            if parts and (done := write_parts(self._file.fileno(), parts)) < size:
                rest = memoryview(b"".join(parts))
                while done < size:
                    done += self._file.write(rest[done:])
        finally:
            whole = bisect_right(ends, done)
            self._count(items[:whole], ends[whole - 1] if whole else 0)

    def _count(self, items: list[_Item], size: int) -> None:
        now = self._written
        samples, blocks, lost = now.samples, now.blocks, now.lost
        first, last = now.first_s, now.last_s
        for item in items:
            if isinstance(item, bytes):
                continue
            block = item[1]
            rows = len(block.samples)
            samples, blocks, lost = samples + rows, blocks + 1, lost + block.dropped
            if rows:
                end = block.t0_s + block.dt_s * (rows - 1)
                end = float(block.times_s[-1]) if block.times_s is not None else end
                first = block.t0_s if first is None else min(first, block.t0_s)
                last = end if last is None else max(last, end)
        self._good += size
        self._written = Written(samples, blocks, self._good, lost, first, last)

    def _end(self, content: dict[str, object]) -> None:
        summary = end_summary(self._written) | content
        at = self._good
        end = chunks.json_chunk(chunks.END, summary)
        _write(self._file, end + chunks.TRAILER.pack(chunks.TRAILER_MAGIC, at))
        os.fsync(self._file.fileno())

    def _give_up(self, error: StorageFailed) -> None:
        """Truncate the file to its last complete chunk, and add an end chunk where possible."""
        with self._wake:
            self._error = error
            self._queue.clear()
        try:
            os.ftruncate(self._file.fileno(), self._good)
            os.lseek(self._file.fileno(), self._good, os.SEEK_SET)
            self._end({"reason": "failed"} | sentence("problem", error.text))
        except OSError:
            # The end chunk does not fit a full disk or reach a removed one; without it the reader
            # finds the last complete chunk by itself.
            with contextlib.suppress(OSError):
                os.ftruncate(self._file.fileno(), self._good)
        self._failed(error)

    def _check_space(self) -> None:
        free = self._free(self.path.parent)
        if free < self._reserve:
            raise StorageFailed(
                "recording.disk-nearly-full-mib-left",
                value=free,
                limit=limits.stays_free(self._reserve),
                path=self.path.name,
                free_mib=free >> 20,
            )

    def _storage(self, error: OSError) -> StorageFailed:
        return StorageFailed(
            "recording.not-written-free-some",
            value=str(self.path),
            path=self.path.name,
            strerror=str(error.strerror or error),
        )


def end_summary(written: Written) -> dict[str, object]:
    """The figures of the end chunk."""
    return {
        "samples": written.samples,
        "blocks": written.blocks,
        "lost": written.lost,
        "first_s": written.first_s,
        "last_s": written.last_s,
    }


def _name_once(part: Path, path: Path) -> None:
    """Rename a file without replacing an existing one; FAT has no hard links."""
    try:
        os.link(part, path)
    except FileExistsError:
        raise
    except OSError:
        if path.exists():
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST)) from None
        move_into_place(part, path)
    else:
        part.unlink()


def _write(file: BinaryIO, data: bytes) -> None:
    """Write all data; a single unbuffered write may write only a part."""
    view = memoryview(data)
    while view:
        view = view[file.write(view) :]
