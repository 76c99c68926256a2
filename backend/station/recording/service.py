"""Recordings of a server: running ones, stored ones, and fault capture."""

from __future__ import annotations

import asyncio
import time
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from backend.axes.drive.readings import Reading
from backend.foundation.store.files import StorageFailed
from backend.foundation.store.free_space import free_bytes
from backend.foundation.work.child import run_child
from backend.foundation.work.jobs import Job, JobResult, Progress
from backend.foundation.work.journal import Entry
from backend.records.recording.library import RecordingLibrary
from backend.station.bench import Bench
from backend.station.recording.capture import FaultCapture
from backend.station.recording.changed_settings import ChangedSettings
from backend.station.recording.recorder import EndReason, Recorder, Settings
from drivers.errors import Busy, NotAllowed
from drivers.texts.message import Text, text

#: Largest number of running recordings; each has a file and a thread.
MAX_RUNNING = 8
_ENDS: dict[EndReason, Text] = {
    "stopped": text("journal.stopped"),
    "its time is over": text("journal.time-is-over"),
    "failed": text("journal.failed"),
    "servodeck was ended": text("journal.servodeck-ended"),
}


class Recordings:
    """Recordings of one bench. Call `open` in the running event loop."""

    def __init__(self, bench: Bench, folder: Path) -> None:
        self.bench = bench
        self.library = RecordingLibrary(folder)
        self.running: dict[str, Recorder] = {}
        self.ended: dict[str, Recorder] = {}
        self.capture: FaultCapture | None = None
        self._changed = ChangedSettings(bench)
        self._exporting: dict[tuple[str, str], Job] = {}

    def open(self) -> None:
        """Arm the fault capture and listen to journal and readings."""
        self.capture = FaultCapture(self.bench, self.library.folder / "bundles", self._fault)
        self.bench.journal.listen(self._logged)
        self.bench.on_readings.append(self._readings)

    async def close(self) -> None:
        """End all running recordings and the fault capture."""
        await asyncio.gather(*(r.stop("servodeck was ended") for r in self.running.values()))
        if self.capture is not None:
            await self.capture.close()
        if self._readings in self.bench.on_readings:
            self.bench.on_readings.remove(self._readings)

    # --- running ones -----------------------------------------------------------------

    async def start(self, settings: Settings) -> Recorder:
        """Begin a recording, or begin to wait for its trigger.

        Raises:
            NotAllowed: no such drive or key, or an invalid name.
            Busy: too many recordings run.
            StorageFailed: not enough disk space.
        """
        if len(self.running) >= MAX_RUNNING:
            raise Busy(
                "recording.recordings-run-already", limit=str(MAX_RUNNING), max_running=MAX_RUNNING
            )
        settings = self._canonical(settings)
        stamp = datetime.now(UTC).strftime("%Y-%m-%d %H-%M-%S")
        name = self.library.free_name(settings.name or f"recording {stamp}")
        recorder = Recorder(self.bench, self.library.path(name), settings, self._ended)
        self.running[name] = recorder
        self._changed.begin()
        try:
            await self._prune()
            await recorder.start()
        except BaseException:
            self.running.pop(name, None)
            raise
        waiting = recorder.phase == "waiting"
        line = text(
            "journal.recording-waits" if waiting else "journal.recording-started", name=name
        )
        self.bench.journal.add(line, person=settings.person)
        return recorder

    def _canonical(self, settings: Settings) -> Settings:
        """The same settings with the profile's keys in place of makers' numbers."""

        def key(drive: str, given: str) -> str:
            return self.bench.connected(drive).drive.parameter(given).key

        trigger = settings.trigger
        if trigger is not None and trigger.kind != "fault":
            trigger = replace(trigger, key=key(trigger.drive, trigger.key))
        elif trigger is not None and trigger.drive:
            self.bench.connected(trigger.drive)
        channels = tuple((drive, key(drive, given)) for drive, given in settings.channels)
        return replace(settings, channels=channels, trigger=trigger)

    async def stop(self, name: str, reason: EndReason = "stopped") -> Recorder:
        """End a recording.

        Raises:
            NotAllowed: none of this name runs.
        """
        recorder = self.active(name)
        await recorder.stop(reason)
        return recorder

    def active(self, name: str) -> Recorder:
        """A running recording.

        Raises:
            NotAllowed: none of this name runs.
        """
        file = self.library.path(name).name
        recorder = self.running.get(file)
        if recorder is None:
            raise NotAllowed("recording.no-recording-runs", value=file)
        return recorder

    def _ended(self, recorder: Recorder) -> None:
        self.running.pop(recorder.name, None)
        self.ended[recorder.name] = recorder
        while len(self.ended) > 20:
            del self.ended[next(iter(self.ended))]
        written = recorder.written()
        line = text(
            "journal.recording-ended-lost" if recorder.lost else "journal.recording-ended",
            name=recorder.name,
            reason=_ENDS[recorder.ended_by],
            samples=written.samples,
            lost=recorder.lost,
        )
        self.bench.journal.add(line, level="warning" if recorder.lost else "info")

    async def _prune(self) -> None:
        gone = await asyncio.to_thread(self.library.prune, list(self.running))
        for name in gone:
            self.bench.journal.add(text("journal.recording-pruned", name=name))

    # --- events ------------------------------------------------------------------------

    def _fault(self, drive: str, text: str) -> None:
        for recorder in list(self.running.values()):
            if recorder.concerns(drive):
                recorder.fault(drive, text)

    def _logged(self, entry: Entry) -> None:
        for recorder in list(self.running.values()):
            if recorder.concerns(entry.drive):
                recorder.event("log", entry.text, entry.level, drive=entry.drive or "")

    def _readings(self, drive: str, readings: list[Reading]) -> None:
        """Record a setting that changed as an event of the running recordings."""
        if not self.running:
            self._changed.forget()
            return
        for key, change in self._changed.among(drive, readings):
            for recorder in list(self.running.values()):
                if recorder.concerns(drive) and not recorder.records(drive, key):
                    recorder.event("parameter", change.words(), drive=drive)

    # --- stored ones ------------------------------------------------------------------

    def require_ended(self, name: str) -> Path:
        """The file of a recording that does not run.

        Raises:
            Busy: it runs.
            NotAllowed: there is none.
        """
        path = self.library.existing(name)
        if path.name in self.running:
            raise Busy("recording.being-recorded", value=path.name)
        return path

    async def delete(self, name: str) -> None:
        """Delete a recording.

        Raises:
            Busy: it runs or is being exported. NotAllowed: there is none.
        """
        path = self.require_ended(name)
        if any(
            file == path.name and j.state == "running" for (file, _), j in self._exporting.items()
        ):
            raise Busy("recording.being-exported", value=path.name)
        await asyncio.to_thread(self.library.delete, name)
        self.bench.journal.add(text("journal.recording-deleted", name=path.name))

    def export(self, name: str, kind: str) -> Job:
        """Export a recording in a separate process; the job's result contains the file name.

        Raises:
            Busy: the recording still runs.
            NotAllowed: there is no such recording or format.
        """
        source = self.require_ended(name)
        target = self.library.export_path(name, kind)
        place = (source.name, kind)
        old = self._exporting.get(place)
        if old is not None and old.state == "running":
            return old

        async def work(progress: Progress) -> JobResult:
            progress(0.0, text("recording.writing", target=target.name))
            await run_export(source, target, kind, progress)
            return {"file": target.name, "bytes": target.stat().st_size}

        job = self.bench.jobs.start(
            "export", text("recording.export", source=source.name, kind=kind.upper()), work
        )
        self._exporting[place] = job
        return job

    def free(self) -> int:
        """Free bytes of the disk with the recordings."""
        folder = self.library.folder
        while not folder.exists():
            folder = folder.parent
        return free_bytes(folder)


async def run_export(source: Path, target: Path, kind: str, progress: Progress) -> None:
    """Run the export process and report its progress; the process ends with the task.

    Raises:
        StorageFailed: it failed; the message contains the last line of its output.
    """
    began = time.monotonic()

    def written(line: bytes) -> None:
        fraction = float(line)
        left = (time.monotonic() - began) * (1 - fraction) / max(fraction, 0.01)
        progress(fraction, text("recording.writing-about-left", target=target.name, left_s=left))

    answer = await run_child(
        "backend.records.recording.export", str(source), str(target), kind, on_line=written
    )
    if answer.exit_code != 0:
        raise StorageFailed("recording.not-written", value=target.name, last=answer.last_line)
