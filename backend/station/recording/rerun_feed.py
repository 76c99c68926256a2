"""Live samples for rerun's viewer: encoded once, pulled by every page, with bounded queues."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import struct
import time
from collections import deque
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from backend.axes.drive.readings import Reading
from backend.axes.scope.hub import Subscription
from backend.foundation.work.journal import Entry
from backend.records.recording.reader import Channel
from backend.station.bench import Bench
from backend.station.recording.changed_settings import ChangedSettings
from backend.station.recording.streams import describe_streams
from drivers.errors import DriveError
from drivers.link import ScopeBlock

if TYPE_CHECKING:
    import rerun as rr

    from backend.records.recording.rerun_layout import Plot

#: Period of the chunks [s]: shorter ones load the viewer, longer ones look jerky.
PERIOD_S = 0.05
#: Data that waits for a page which does not pull; the oldest is dropped first.
MAX_CLIENT_BYTES = 16 * 1024 * 1024
#: Largest number of blocks that wait for the encoder.
MAX_BLOCKS = 4000
#: Period of polled drives [s]: 50 requests a second leave bus time to others.
POLL_S = 0.02
MAGIC = 0x44464552
_HEAD = struct.Struct("<IIII")
_LENGTH = struct.Struct("<I")

ROLES = (
    "position_actual",
    "position_demand",
    "velocity_actual",
    "velocity_demand",
    "torque_actual",
    "following_error",
    "status_word",
)


@dataclass(eq=False, slots=True)
class FeedClient:
    """Queue of one page. ``dropped``: number of blobs lost since its last pull."""

    first: bytes = b""
    queue: deque[bytes] = field(default_factory=deque)
    waiting_bytes: int = 0
    dropped: int = 0
    session: int = 0
    ready: asyncio.Event = field(default_factory=asyncio.Event)

    def begin(self, session: int, first: bytes) -> None:
        """Begin a new recording and drop what still waits of the old one."""
        self.session, self.first = session, first
        self.queue.clear()
        self.waiting_bytes = 0
        self.ready.set()

    def put(self, blob: bytes) -> None:
        """Queue a blob; the oldest are dropped above `MAX_CLIENT_BYTES`."""
        self.queue.append(blob)
        self.waiting_bytes += len(blob)
        while self.waiting_bytes > MAX_CLIENT_BYTES:
            self.waiting_bytes -= len(self.queue.popleft())
            self.dropped += 1
        self.ready.set()

    async def pull(self, timeout_s: float = 1.0) -> bytes:
        """All waiting blobs as one frame; an empty frame after ``timeout_s`` [s] without any."""
        if not self.first and not self.queue:
            self.ready.clear()
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(timeout_s):
                    await self.ready.wait()
        blobs = ([self.first] if self.first else []) + list(self.queue)
        head = _HEAD.pack(MAGIC, self.session, len(blobs), self.dropped)
        self.first, self.waiting_bytes, self.dropped = b"", 0, 0
        self.queue.clear()
        return head + b"".join(_LENGTH.pack(len(blob)) + blob for blob in blobs)


class RerunFeed:
    """Live feed of all drives of the bench; it runs while a page shows it."""

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self.clients: set[FeedClient] = set()
        self._numbers = itertools.count(1)
        self._session = 0
        self._first = b""
        self._streams: list[Subscription] = []
        self._blocks: deque[tuple[int, ScopeBlock]] = deque(maxlen=MAX_BLOCKS)
        self._events: deque[Entry] = deque(maxlen=200)
        self._task: asyncio.Task[None] | None = None
        self._changed = False
        self._settings = ChangedSettings(bench)
        bench.on_drives.append(self._drives)
        bench.on_readings.append(self._readings)
        bench.journal.listen(self._logged)

    def join(self) -> FeedClient:
        """Add a page, and start the feed with the first one."""
        client = FeedClient()
        if not self.clients:
            self._settings.begin()
        self.clients.add(client)
        if self._first:
            client.begin(self._session, self._first)
        if self._task is None or self._task.done():
            self._task = asyncio.create_task(self._run(), name="rerun-feed")
        return client

    async def leave(self, client: FeedClient) -> None:
        """Remove a page; the feed ends with the last one."""
        self.clients.discard(client)
        if not self.clients:
            await self.close()

    async def close(self) -> None:
        """End the feed."""
        task, self._task = self._task, None
        if task is not None:
            task.cancel()
            await asyncio.wait([task])

    def _drives(self) -> None:
        self._changed = True

    def _logged(self, entry: Entry) -> None:
        if self.clients:
            self._events.append(entry)

    def _readings(self, drive: str, readings: list[Reading]) -> None:
        """Add a line to the text log for each setting that changed."""
        if not self.clients:
            self._settings.forget()
            return
        for _, changed in self._settings.among(drive, readings):
            self._events.append(Entry(time.time(), "info", drive, "", changed))

    # --- the feed ---------------------------------------------------------------------

    async def _run(self) -> None:
        from backend.records.recording import rerun_layout  # takes most of a second the first time

        try:
            while True:
                self._changed = False
                channels = self._subscribe()
                signature = self._signature()
                plots = rerun_layout.plots(channels)
                recording, stream = await asyncio.to_thread(self._open, plots)
                for client in self.clients:
                    client.begin(self._session, self._first)
                while not (self._changed and self._signature() != signature):
                    await asyncio.sleep(PERIOD_S)
                    blocks, events = list(self._blocks), list(self._events)
                    self._blocks.clear()
                    self._events.clear()
                    blob = await asyncio.to_thread(
                        _encode, recording, stream, plots, blocks, events
                    )
                    if blob:
                        for client in self.clients:
                            client.put(blob)
                await self._unsubscribe()
        finally:
            self._first = b""
            await self._unsubscribe()

    def _wanted(self) -> dict[str, list[str]]:
        return {
            drive: [key for role in ROLES if (key := connected.drive.key(role))]
            for drive, connected in self._bench.connected_drives.items()
        }

    def _signature(self) -> object:
        """Value that changes when the plots must be laid out again."""
        sessions = {d: id(m.axis.session) for d, m in self._bench.connected_drives.items()}
        names = {d: m.drive.name for d, m in self._bench.connected_drives.items()}
        return self._wanted(), sessions, names

    def _subscribe(self) -> list[Channel]:
        described: list[tuple[bool, list[tuple[str, str]]]] = []
        for drive, keys in self._wanted().items():
            if not keys:
                continue
            try:
                streams = self._bench.scope.subscribe(drive, keys, POLL_S)
            except DriveError:
                continue  # a signal that no port carries; the page shows the other axes
            for stream, places in streams:
                stream.sink = partial(self._take, len(self._streams))
                self._streams.append(stream)
                described.append((stream.synchronous, [(drive, keys[place]) for place in places]))
        return [
            Channel(
                stream=number, column=column, synchronous=bool(stream["synchronous"]), **channel
            )
            for number, stream in enumerate(describe_streams(self._bench, described))
            for column, channel in enumerate(stream["channels"])
        ]

    def _take(self, number: int, block: ScopeBlock) -> None:
        self._blocks.append((number, block))

    async def _unsubscribe(self) -> None:
        streams, self._streams = self._streams, []
        for stream in streams:
            await self._bench.scope.unsubscribe(stream)
        self._blocks.clear()

    def _open(self, plots: list[Plot]) -> tuple[rr.RecordingStream, rr.BinaryStream]:
        import rerun as rr

        from backend.records.recording import rerun_layout

        self._session = next(self._numbers)
        recording = rr.RecordingStream(
            rerun_layout.APPLICATION, recording_id=f"live-{time.time_ns()}"
        )
        stream = rr.binary_stream(recording)
        rr.send_blueprint(rerun_layout.blueprint(plots, follow=True), recording=recording)
        rerun_layout.send_names(recording, plots)
        self._first = stream.read() or b""
        return recording, stream


def _encode(
    recording: rr.RecordingStream,
    stream: rr.BinaryStream,
    plots: list[Plot],
    blocks: list[tuple[int, ScopeBlock]],
    events: list[Entry],
) -> bytes:
    """Encode one chunk for each plot with all samples since the last call."""
    from backend.records.recording import rerun_layout

    offset_ns = time.time_ns() - time.monotonic_ns()
    for number in dict.fromkeys(n for n, _ in blocks):
        mine = [block for n, block in blocks if n == number]
        values = np.concatenate([block.samples for block in mine])
        times = np.concatenate(
            [
                block.times_s
                if block.times_s is not None
                else block.t0_s + block.dt_s * np.arange(len(block.samples))
                for block in mine
            ]
        )
        epoch_ns = np.rint(times * 1e9).astype(np.int64) + offset_ns
        for plot in plots:
            if plot.stream == number:
                columns = values[:, list(plot.columns)]
                rerun_layout.send_samples(recording, plot, epoch_ns, columns)
    for entry in events:
        rerun_layout.send_event(recording, int(entry.time * 1e9), entry.text, entry.level)
    return stream.read() or b""
