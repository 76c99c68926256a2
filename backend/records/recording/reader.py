"""Reading recordings, complete ones and those truncated by a crash or a full disk."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, BinaryIO, Literal

from backend.records.recording import chunks
from backend.records.recording.chunks import Samples
from drivers.errors import NotAllowed
from drivers.texts.answers import message_in, sentence
from drivers.texts.message import Text, text


class BadRecording(NotAllowed):
    """A file is not a recording, or its beginning is damaged."""

    kind = "bad-recording"


@dataclass(frozen=True, slots=True)
class Channel:
    """One recorded signal. ``name`` is unique in the recording; ``column`` is that of its stream.

    Samples are in ``unit``; multiplied by ``shown_factor`` they are in ``shown_unit``, the unit of
    the scope.
    """

    stream: int
    column: int
    drive: str
    drive_name: str
    key: str
    name: str
    unit: str
    shown_unit: str
    shown_factor: float
    synchronous: bool


@dataclass(frozen=True, slots=True)
class Clock:
    """One instant on the clock of the samples, and in seconds since 1970."""

    sample_s: float
    epoch_s: float

    def epoch(self, t_s: float) -> float:
        """A sample time in seconds since 1970."""
        return self.epoch_s + (t_s - self.sample_s)


@dataclass(frozen=True, slots=True)
class BlockRef:
    """Position of a block of samples in the file, and the time that it covers [s]."""

    offset: int
    stream: int
    rows: int
    t0_s: float
    last_s: float


@dataclass(frozen=True, slots=True)
class Summary:
    """Summary of a recording. ``state``: ``interrupted`` without end chunk (crash, full disk)."""

    header: dict[str, Any]
    clock: Clock
    channels: tuple[Channel, ...]
    state: Literal["complete", "interrupted", "failed"]
    reason: str
    problem: Text | None
    samples: int
    lost: int
    first_s: float | None
    last_s: float | None
    bytes: int

    @property
    def duration_s(self) -> float:
        """Time from the first to the last sample [s]."""
        if self.first_s is None or self.last_s is None:
            return 0.0
        return self.last_s - self.first_s


@dataclass(slots=True)
class _Scan:
    samples: int = 0
    lost: int = 0
    first_s: float | None = None
    last_s: float | None = None
    refs: list[BlockRef] = field(default_factory=list)


class RecordingReader:
    """An open recording, used as a context manager.

    Raises:
        BadRecording: the file is not a recording, or its header is not complete.
        NotAllowed: no such file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._file: BinaryIO = path.open("rb")
        except OSError as error:
            raise NotAllowed("recording.no-recording", value=path.name) from error
        try:
            self.header = self._read_header()
            self.channels = _channels(self.header)
            clock = self.header["clock"]
            self.clock = Clock(float(clock["sample_s"]), float(clock["epoch_s"]))
            _require_usable(self.header, self.clock)
        except (
            KeyError, TypeError, ValueError, AttributeError, OverflowError, RecursionError, OSError,
        ) as error:  # fmt: skip
            self._file.close()
            raise BadRecording(
                "recording.not-recording-beginning-damaged", value=path.name
            ) from error

    def __enter__(self) -> RecordingReader:
        return self

    def __exit__(self, *_exc: object) -> None:
        self._file.close()

    def _read_header(self) -> dict[str, Any]:
        if self._file.read(len(chunks.MAGIC)) != chunks.MAGIC:
            raise ValueError("no magic")
        first = self._chunk()
        if first is None or first[0] != chunks.HEADER:
            raise ValueError("no header")
        self._begin = self._file.tell()
        content: dict[str, Any] = json.loads(first[1])
        return content

    def _chunk(self) -> tuple[int, bytes] | None:
        """The next chunk, or None where the intact part of the file ends."""
        head = chunks.frame_head(self._file.read(chunks.FRAME.size))
        if head is None:
            return None
        kind, length, crc = head
        payload = self._file.read(length)
        if len(payload) < length or not chunks.intact(kind, payload, crc):
            return None
        return kind, payload

    def chunks(self) -> Iterator[tuple[int, bytes]]:
        """Kind and payload of all complete chunks after the header, in the order of writing."""
        self._file.seek(self._begin)
        while (chunk := self._chunk()) is not None:
            position = self._file.tell()
            yield chunk
            self._file.seek(position)

    def blocks(self) -> Iterator[Samples]:
        """All blocks of samples, in the order of writing."""
        for kind, payload in self.chunks():
            if kind == chunks.SAMPLES:
                yield self._samples(payload)

    def block(self, ref: BlockRef) -> Samples:
        """Read one block of samples.

        Raises:
            BadRecording: the file has changed since it was indexed.
        """
        self._file.seek(ref.offset)
        chunk = self._chunk()
        if chunk is None:
            raise BadRecording("recording.changed-read", value=ref.offset, path=self.path.name)
        return self._samples(chunk[1])

    def _samples(self, payload: bytes) -> Samples:
        try:
            return chunks.read_samples(payload)
        except ValueError as error:
            raise BadRecording(
                "recording.not-recording-beginning-damaged", value=self.path.name
            ) from error

    def events(self) -> list[dict[str, Any]]:
        """All events: parameter changes, faults, log lines, the trigger."""
        return [json.loads(p) for kind, p in self.chunks() if kind == chunks.EVENT]

    def index(self) -> list[BlockRef]:
        """Position and time range of each block."""
        return self._scan().refs

    def _scan(self) -> _Scan:
        found = _Scan()
        self._file.seek(self._begin)
        while True:
            offset = self._file.tell()
            chunk = self._chunk()
            if chunk is None:
                return found
            kind, payload = chunk
            if kind != chunks.SAMPLES:
                continue
            block = self._samples(payload)
            head = chunks.block_head(payload)
            if not head.rows:
                continue
            last = float(block.times_s[-1])
            found.refs.append(BlockRef(offset, head.stream, head.rows, head.t0_s, last))
            found.samples += head.rows
            found.lost += head.lost
            found.first_s = head.t0_s if found.first_s is None else min(found.first_s, head.t0_s)
            found.last_s = last if found.last_s is None else max(found.last_s, last)

    def _end(self) -> dict[str, Any] | None:
        """The end chunk, found through the trailer."""
        size = self._file.seek(0, 2)
        if size < chunks.TRAILER.size:
            return None
        self._file.seek(size - chunks.TRAILER.size)
        magic, offset = chunks.TRAILER.unpack(self._file.read(chunks.TRAILER.size))
        if magic != chunks.TRAILER_MAGIC or offset >= size:
            return None
        self._file.seek(offset)
        chunk = self._chunk()
        if chunk is None or chunk[0] != chunks.END:
            return None
        content: dict[str, Any] = json.loads(chunk[1])
        return content

    def summary(self) -> Summary:
        """Summary of the recording; for an interrupted file the samples are counted."""
        end = self._end()
        scan = None if end is not None else self._scan()
        facts: dict[str, Any] = end or {"reason": "interrupted"} | sentence(
            "problem", text("recording.cut-off")
        )
        reason = str(facts.get("reason", ""))
        state: Literal["complete", "interrupted", "failed"] = "complete"
        if end is None:
            state = "interrupted"
        elif facts.get("problem"):
            state = "failed"
        return Summary(
            header=self.header,
            clock=self.clock,
            channels=self.channels,
            state=state,
            reason=reason,
            problem=message_in(facts, "problem"),
            samples=scan.samples if scan else int(facts.get("samples", 0)),
            lost=scan.lost if scan else int(facts.get("lost", 0)),
            first_s=scan.first_s if scan else facts.get("first_s"),
            last_s=scan.last_s if scan else facts.get("last_s"),
            bytes=self.path.stat().st_size,
        )


def _require_usable(header: dict[str, Any], clock: Clock) -> None:
    """Check the parts of a header that lists show.

    Raises:
        ValueError, TypeError, OverflowError, OSError: a part cannot be shown.
    """
    if not math.isfinite(clock.sample_s):
        raise ValueError("no time of the samples")
    for moment in (clock.epoch_s, float(header.get("created", 0.0))):
        # A year is left for the samples and for time zones.
        if not 1 < datetime.fromtimestamp(moment, UTC).year < 9999:
            raise ValueError("no date")
    if not all(isinstance(header.get(name, []), list) for name in ("axes", "tags")):
        raise TypeError("no list")
    if not all(isinstance(axis, dict) for axis in header.get("axes", [])):
        raise TypeError("no axis")
    # Half of a surrogate pair, which JSON may contain and no answer or database can.
    json.dumps(header, ensure_ascii=False).encode()


def _channels(header: dict[str, Any]) -> tuple[Channel, ...]:
    return tuple(
        Channel(
            stream=int(number),
            column=column,
            drive=str(channel["drive"]),
            drive_name=str(channel["drive_name"]),
            key=str(channel["key"]),
            name=str(channel["name"]),
            unit=str(channel["unit"]),
            # Recordings of earlier versions do not contain it.
            shown_unit=str(channel.get("shown_unit", channel["unit"])),
            shown_factor=float(channel.get("shown_factor", 1.0)),
            synchronous=bool(stream["synchronous"]),
        )
        for number, stream in enumerate(header["streams"])
        for column, channel in enumerate(stream["channels"])
    )
