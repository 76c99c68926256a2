"""One running recording: subscriptions to its channels, trigger and writer."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from backend import __version__
from backend.axes.scope.hub import Subscription
from backend.foundation.store.files import StorageFailed
from backend.records.recording.writer import RecordingWriter, Written
from backend.station.bench import Bench
from backend.station.recording import facts
from backend.station.recording.streams import describe_streams
from drivers.errors import NotAllowed, OutOfRange, with_remedy
from drivers.link import ScopeBlock
from drivers.texts.message import Text, text

FORMAT = 1
#: Time limit for reading settings [s], so that a slow drive does not prevent a recording.
PARAMETERS_TIMEOUT_S = 5.0
#: Time without samples after which a stream is reported [s].
SILENT_S = 2.0
#: Memory for samples before the trigger.
MAX_PRE_BYTES = 256 * 1024 * 1024

Phase = Literal["preparing", "waiting", "recording", "ended"]


@dataclass(frozen=True, slots=True)
class Trigger:
    """Condition that begins a waiting recording. ``mask``: bits that ``change`` compares."""

    kind: Literal["rising", "falling", "change", "fault"]
    drive: str
    key: str = ""
    level: float = 0.0
    mask: int | None = None


@dataclass(frozen=True, slots=True)
class Settings:
    """Settings of a recording. ``duration_s`` counts from the beginning, or from the trigger."""

    name: str
    channels: tuple[tuple[str, str], ...]
    period_s: float = 0.0
    duration_s: float | None = None
    pre_s: float = 0.0
    trigger: Trigger | None = None
    notes: str = ""
    tags: tuple[str, ...] = ()
    person: str = ""


EndReason = Literal["stopped", "its time is over", "failed", "servodeck was ended"]
"""Why a recording ended; stored in its file."""


@dataclass(eq=False, slots=True)
class _Stream:
    number: int
    subscription: Subscription
    channels: tuple[tuple[str, str], ...]
    heard: float
    first: bool = True
    silent: bool = False
    last: float | None = None


class Recorder:
    """A recording from `start` to `stop`. All methods run on the event loop."""

    def __init__(
        self,
        bench: Bench,
        path: Path,
        settings: Settings,
        ended: Callable[[Recorder], None],
        make_writer: Callable[..., RecordingWriter] = RecordingWriter,
    ) -> None:
        self.path = path
        self.settings = settings
        self.phase: Phase = "preparing"
        self.problem: Text | None = None
        self.ended_by: EndReason = "stopped"
        self.began = time.time()
        self._bench = bench
        self._ended = ended
        self._make_writer = make_writer
        self._writer: RecordingWriter | None = None
        self._streams: list[_Stream] = []
        self._held: deque[tuple[float, int, ScopeBlock]] = deque()
        self._held_bytes = 0
        self._lost = 0
        self._timer: asyncio.TimerHandle | None = None
        self._tasks: set[asyncio.Task[None]] = set()
        self._check()

    @property
    def name(self) -> str:
        """File name."""
        return self.path.name

    def written(self) -> Written:
        """Figures of the file up to now."""
        return self._writer.written() if self._writer is not None else Written()

    @property
    def lost(self) -> int:
        """Number of samples that the bus or the sampler lost before they reached the recorder."""
        return self._lost

    def synchronous(self) -> frozenset[tuple[str, str]]:
        """Channels that are sampled in every cycle of their bus."""
        return frozenset(c for s in self._streams if s.subscription.synchronous for c in s.channels)

    # --- beginning --------------------------------------------------------------------

    def _check(self) -> None:
        settings = self.settings
        if not settings.channels:
            raise OutOfRange("recording.choose-least-signal-record")
        if len(set(settings.channels)) != len(settings.channels):
            raise OutOfRange("recording.signal-twice")
        if settings.pre_s and settings.trigger is None:
            raise OutOfRange("recording.time-before-trigger-no", value=settings.pre_s)
        trigger = settings.trigger
        watched = None if trigger is None else (trigger.drive, trigger.key)
        if trigger and trigger.kind != "fault" and watched not in settings.channels:
            raise NotAllowed(
                "recording.trigger-looks-signal-not", drive=trigger.drive, parameter=trigger.key
            )

    async def start(self) -> None:
        """Read the settings that are not known, subscribe, and open the file.

        Raises:
            NotAllowed: no such drive or key.
            StorageFailed: the file cannot be written.
        """
        columns: dict[str, list[str]] = {}
        for drive, key in self.settings.channels:
            columns.setdefault(drive, []).append(
                self._bench.connected(drive).drive.parameter(key).key
            )
        axes = [await self._axis(drive) for drive in columns]
        try:
            self._subscribe(columns)
            self._writer = await asyncio.to_thread(
                self._make_writer, self.path, self._header(axes), self._failed_soon()
            )
        except BaseException:
            await self._leave()
            self.phase = "ended"
            raise
        self.phase = "waiting"
        if self.settings.trigger is None:
            self._begin("started")
        self._watch()

    async def _axis(self, drive: str) -> dict[str, Any]:
        connected = self._bench.connected(drive)
        rows = await facts.parameters(connected, fresh=False, timeout_s=PARAMETERS_TIMEOUT_S)
        await facts.gearing(connected)
        return facts.identity(self._bench, connected) | {"parameters": rows}

    def _subscribe(self, columns: Mapping[str, Sequence[str]]) -> None:
        for drive, keys in columns.items():
            for stream, places in self._bench.scope.subscribe(drive, keys, self.settings.period_s):
                mine = _Stream(
                    number=len(self._streams),
                    subscription=stream,
                    channels=tuple((drive, keys[place]) for place in places),
                    heard=time.monotonic(),
                )
                stream.sink = partial(self._take, mine)
                self._streams.append(mine)

    def _header(self, axes: list[dict[str, Any]]) -> dict[str, object]:
        settings = self.settings
        trigger = settings.trigger
        return {
            "format": FORMAT,
            "servodeck": __version__,
            "created": time.time(),
            "clock": {"sample_s": time.monotonic(), "epoch_s": time.time()},
            "person": settings.person,
            "notes": settings.notes,
            "tags": list(settings.tags),
            "period_s": settings.period_s,
            "pre_s": settings.pre_s,
            "trigger": None
            if trigger is None
            else {n: getattr(trigger, n) for n in ("kind", "drive", "key", "level", "mask")},
            "axes": axes,
            "streams": describe_streams(
                self._bench, [(s.subscription.synchronous, s.channels) for s in self._streams]
            ),
        }

    # --- samples ----------------------------------------------------------------------

    def _take(self, stream: _Stream, block: ScopeBlock) -> None:
        """Take a block as soon as the bus has delivered it."""
        stream.heard = time.monotonic()
        if stream.silent:
            stream.silent = False
            self.event("samples", f"{stream.channels[0][0]} delivers samples again")
        if stream.first:
            # Samples lost before the recording began do not count.
            block = replace(block, dropped=0)
        elif block.dropped:
            self._lost += block.dropped
            self.event("lost", f"{block.dropped} samples were lost before they came here", "error")
        stream.first = False
        if self.phase == "recording" and self._writer is not None:
            self._writer.put(stream.number, block)
            return
        if self.phase in ("preparing", "waiting"):
            self._forget_old()
            self._held.append((stream.heard, stream.number, block))
            self._held_bytes += block.samples.nbytes
            if self.phase == "waiting" and self._fires(stream, block):
                self._begin("triggered")

    def _forget_old(self) -> None:
        """Drop blocks older than the time before the trigger; without a trigger keep all."""
        if self.settings.trigger is None:
            return
        oldest = time.monotonic() - self.settings.pre_s
        while self._held and (self._held[0][0] < oldest or self._held_bytes > MAX_PRE_BYTES):
            self._held_bytes -= self._held.popleft()[2].samples.nbytes

    def _fires(self, stream: _Stream, block: ScopeBlock) -> bool:
        trigger = self.settings.trigger
        if trigger is None or trigger.kind == "fault":
            return False
        if (trigger.drive, trigger.key) not in stream.channels:
            return False
        column = stream.channels.index((trigger.drive, trigger.key))
        values = block.samples[:, column]
        if block.valid is not None:
            values = values[block.valid]
        values = values[np.isfinite(values)]
        if not len(values):
            return False
        before, stream.last = stream.last, float(values[-1])
        if before is not None:
            values = np.concatenate([[before], values])
        return fires(trigger, values)

    def fault(self, drive: str, text: str) -> None:
        """Record a new fault of a drive as an event; it may be the trigger."""
        self.event("fault", text, "error", drive=drive)
        trigger = self.settings.trigger
        fits = trigger is not None and trigger.kind == "fault" and trigger.drive in ("", drive)
        if self.phase == "waiting" and fits:
            self._begin("triggered")

    def event(self, kind: str, text: str, level: str = "info", *, drive: str = "") -> None:
        """Write an event with the present time into the recording."""
        if self._writer is not None and self.phase in ("waiting", "recording"):
            now = time.monotonic()
            self._writer.event(
                {"kind": kind, "t_s": now, "level": level, "drive": drive, "text": text}
            )

    def concerns(self, drive: str | None) -> bool:
        """Whether one of its channels belongs to this drive; True for None."""
        return drive is None or any(d == drive for d, _ in self.settings.channels)

    def records(self, drive: str, key: str) -> bool:
        """Whether this is one of its channels."""
        return (drive, key) in self.settings.channels

    def _begin(self, why: str) -> None:
        self.phase = "recording"
        self.event(why, f"recording {why}")
        writer = self._writer
        while self._held and writer is not None:
            _, number, block = self._held.popleft()
            writer.put(number, block)
        self._held_bytes = 0
        if self.settings.duration_s is not None:
            loop = asyncio.get_running_loop()
            self._timer = loop.call_later(
                self.settings.duration_s, lambda: self._spawn(self.stop("its time is over"))
            )

    def trigger_now(self) -> None:
        """Begin without waiting for the trigger any longer.

        Raises:
            NotAllowed: the recording does not wait for a trigger.
        """
        if self.phase != "waiting":
            raise NotAllowed("recording.not-wait-trigger", value=self.phase, name=self.name)
        self._begin("triggered")

    # --- end --------------------------------------------------------------------------

    async def stop(self, reason: EndReason) -> None:
        """End the recording. Further calls do nothing; a failure is reported in ``problem``."""
        if self.phase == "ended":
            return
        empty = self.phase != "recording"
        self.phase = "ended"
        self.ended_by = reason
        if self._timer is not None:
            self._timer.cancel()
        await self._leave()
        if self._writer is not None:
            with contextlib.suppress(StorageFailed):  # `_failed` shows it
                await asyncio.to_thread(self._writer.close, {"reason": reason, "problem": ""})
            if empty and self.problem is None:
                # The trigger never came, so there is nothing to keep.
                await asyncio.to_thread(self.path.unlink, missing_ok=True)
                self.problem = text("recording.trigger-did-not-come")
        self._ended(self)

    async def _leave(self) -> None:
        for stream in self._streams:
            stream.subscription.sink = _nowhere
            await self._bench.scope.unsubscribe(stream.subscription)
        self._streams = []

    def _failed_soon(self) -> Callable[[StorageFailed], None]:
        loop = asyncio.get_running_loop()

        def reported(error: StorageFailed) -> None:
            with contextlib.suppress(RuntimeError):  # the loop is closed: nobody left to notify
                loop.call_soon_threadsafe(self._failed, error)

        return reported

    def _failed(self, error: StorageFailed) -> None:
        self.problem = error.text
        self._bench.journal.add(
            text("journal.recording-failed", name=self.name, cause=with_remedy(error)),
            level="error",
        )
        self._spawn(self.stop("failed"))

    def _watch(self) -> None:
        if self.phase == "ended":
            return
        now = time.monotonic()
        for stream in self._streams:
            quiet = SILENT_S + 2 * self.settings.period_s
            if not stream.silent and now - stream.heard > quiet:
                stream.silent = True
                drive = stream.channels[0][0]
                line = text("journal.no-samples", drive=drive, name=self.name)
                self.event("silent", line.words(), "warning", drive=drive)
                self._bench.journal.add(line, level="warning", drive=drive)
        asyncio.get_running_loop().call_later(0.5, self._watch)

    def _spawn(self, work: Any) -> None:
        task: asyncio.Task[None] = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)


def fires(trigger: Trigger, values: npt.NDArray[np.float64]) -> bool:
    """Whether values [n], the first being the last one of the block before, meet the trigger."""
    if len(values) < 2:
        return False
    before, after = values[:-1], values[1:]
    match trigger.kind:
        case "rising":
            return bool(np.any((before < trigger.level) & (after >= trigger.level)))
        case "falling":
            return bool(np.any((before > trigger.level) & (after <= trigger.level)))
        case "change" if trigger.mask is not None:
            bits = values.astype(np.int64) & trigger.mask
            return bool(np.any(bits[1:] != bits[:-1]))
        case "change":
            return bool(np.any(before != after))
    return False


def _nowhere(_block: ScopeBlock) -> None:
    """Sink for blocks between the end of a recording and the end of its subscription."""
