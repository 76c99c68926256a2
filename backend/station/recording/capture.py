"""Fault capture: the last seconds of every axis, stored in a support bundle on a fault."""

from __future__ import annotations

import asyncio
import contextlib
import re
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

from backend import __version__
from backend.axes.axis.cyclic import INPUT_ROLES, OUTPUT_ROLES
from backend.axes.drive.readings import Reading
from backend.axes.scope.hub import Subscription
from backend.foundation.store.files import StorageFailed, checked_name
from backend.foundation.store.free_space import RESERVE_BYTES, free_bytes
from backend.records.recording.bundle import build_apart
from backend.records.recording.evidence import Evidence, Value
from backend.records.recording.flight import flights
from backend.station.bench import Bench
from backend.station.drives.monitor import Snapshot
from backend.station.recording import facts
from backend.station.recording.streams import describe_streams
from drivers.errors import DriveError, NotAllowed, why_of
from drivers.link import ScopeBlock
from drivers.texts import limits
from drivers.texts.message import Text, joined, profile_text, text

SUFFIX = ".zip"
#: Time stored before and after the fault [s].
BEFORE_S, AFTER_S = 10.0, 2.0
#: Limits of the ring buffers; the oldest entries are dropped first.
MAX_BLOCK_BYTES = 128 * 1024 * 1024
MAX_VALUES = 200_000
LOG_ENTRIES = 500
#: A recurring fault makes one bundle within this time [s].
PAUSE_S = 30.0
KEEP_BUNDLES = 50
#: Period of retries for a bundle that could not be written [s].
AGAIN_S = 20.0
#: Time limit for reading a drive [s]; one with a fault may be slow, and known values are used then.
READ_TIMEOUT_S = 10.0

OnFault = Callable[[str, str], None]


@dataclass(eq=False, slots=True)
class _Tap:
    """Subscription of the ring buffer to the cyclic stream of one drive."""

    subscription: Subscription
    channels: tuple[tuple[str, str], ...]


class FaultCapture:
    """Ring buffers of the last seconds, without bus load: only values read anyway are stored.

    Process data are stored for every cycle; on polled buses every value that the monitor, a page
    or a tool reads is stored with its time.
    """

    def __init__(self, bench: Bench, folder: Path, on_fault: OnFault) -> None:
        self.folder = folder
        self.armed = True
        self._bench = bench
        self._on_fault = on_fault
        self._taps: dict[str, _Tap] = {}
        self._blocks: deque[tuple[float, _Tap, ScopeBlock]] = deque()
        self._block_bytes = 0
        self._values: deque[Value] = deque(maxlen=MAX_VALUES)
        self._faults: dict[str, frozenset[str]] = {}
        self._pending: list[Text] = []
        self._reported: dict[tuple[str, str], float] = {}
        self._task: asyncio.Task[None] | None = None
        self._held: asyncio.Task[None] | None = None
        bench.on_snapshot.append(self._snapshot)
        bench.on_readings.append(self._readings)
        bench.on_drives.append(self._drives)

    async def close(self) -> None:
        """End the subscriptions; a bundle in progress is finished first, within a time limit."""
        self._bench.on_snapshot.remove(self._snapshot)
        self._bench.on_readings.remove(self._readings)
        self._bench.on_drives.remove(self._drives)
        if self._task is not None:
            await asyncio.wait([self._task], timeout=READ_TIMEOUT_S)
        if self._held is not None:
            self._held.cancel()
        for drive in list(self._taps):
            self._untap(drive)

    # --- ring buffers -----------------------------------------------------------------

    def _drives(self) -> None:
        """Follow the cyclic exchanges as they start and end."""
        for drive in [d for d in self._taps if not self._cyclic_keys(d)]:
            self._untap(drive)
        for drive in self._bench.connected_drives:
            keys = self._cyclic_keys(drive)
            old = self._taps.get(drive)
            if old is not None and [k for _, k in old.channels] != keys:
                self._untap(drive)
            if keys and drive not in self._taps:
                ((stream, _),) = self._bench.scope.subscribe(drive, keys, 0.0)
                tap = _Tap(stream, tuple((drive, key) for key in keys))
                stream.sink = partial(self._take, tap)
                self._taps[drive] = tap

    def _cyclic_keys(self, drive_id: str) -> list[str]:
        connected = self._bench.connected_drives.get(drive_id)
        session = connected.axis.session if connected is not None else None
        if connected is None or session is None:
            return []
        keys = [connected.drive.key(role) for role in (*INPUT_ROLES, *OUTPUT_ROLES)]
        return [key for key in keys if key and session.carries(connected.drive, key)]

    def _untap(self, drive: str) -> None:
        tap = self._taps.pop(drive)
        if tap.subscription.leave is not None:
            tap.subscription.leave()

    def _take(self, tap: _Tap, block: ScopeBlock) -> None:
        self._blocks.append((time.monotonic(), tap, block))
        self._block_bytes += block.samples.nbytes
        self._forget_old()

    def _forget_old(self) -> None:
        """Drop old entries, also of an exchange that has ended."""
        oldest = time.monotonic() - BEFORE_S - AFTER_S
        while self._blocks and (self._blocks[0][0] < oldest or self._block_bytes > MAX_BLOCK_BYTES):
            self._block_bytes -= self._blocks.popleft()[2].samples.nbytes
        oldest = time.time() - BEFORE_S - AFTER_S
        while self._values and self._values[0].time < oldest:
            self._values.popleft()

    def _readings(self, drive: str, readings: list[Reading]) -> None:
        now = time.time()
        for reading in readings:
            # `mark_saved` and similar calls repeat old readings, which are not stored again.
            if reading.time is None or now - reading.time > 1.0:
                continue
            value = reading.value.hex() if isinstance(reading.value, bytes) else reading.value
            self._values.append(Value(reading.time, drive, reading.key, value))
        self._forget_old()

    # --- faults -----------------------------------------------------------------------

    def _snapshot(self, drive: str, snapshot: Snapshot) -> None:
        if not snapshot.fresh:
            return
        now = {f.code: f for f in snapshot.faults if f.kind == "fault"}
        before = self._faults.get(drive)
        self._faults[drive] = frozenset(now)
        # A fault present when the drive is connected has no recorded history.
        new = [f for code, f in now.items() if before is not None and code not in before]
        if not new:
            return
        connected = self._bench.connected_drives.get(drive)
        self._on_fault(drive, ", ".join(f"{f.code} {f.name}" for f in new))
        if connected is None or not self.armed:
            return
        at = time.monotonic()
        if all(at - self._reported.get((drive, f.code), -PAUSE_S) < PAUSE_S for f in new):
            return
        self._reported |= {(drive, f.code): at for f in new}
        family = connected.drive.profile.drive
        faults = joined(
            (text("bundle.one-fault", code=f.code, name=profile_text(family, f.name)) for f in new),
            ", ",
        )
        self._pending.append(text("bundle.fault-of", axis=connected.drive.name, faults=faults))
        if self._task is None or self._task.done():
            self._task = asyncio.create_task(self._freeze(time.time()), name="fault-capture")

    async def _freeze(self, when: float) -> None:
        """Write a bundle `AFTER_S` after the fault; repeat where further faults came meanwhile."""
        while self._pending:
            await asyncio.sleep(AFTER_S)
            reason = joined(self._pending)
            self._pending.clear()
            await self._keep(reason, when)
            when = time.time()

    async def _keep(self, reason: Text, when: float) -> None:
        evidence = await self._evidence(reason, when)
        try:
            name = await self._write(evidence)
        except (DriveError, OSError) as error:
            line = text("journal.no-bundle", reason=reason, cause=why_of(error))
            self._bench.journal.add(line, level="error")
            self._hold(evidence)
            return
        line = text("journal.seconds-kept", reason=reason, name=name)
        self._bench.journal.add(line, level="warning")

    def _hold(self, evidence: Evidence) -> None:
        """Keep a bundle that could not be written in memory until it can be written.

        Only the first one is kept, to limit memory; later ones are in the log only.
        """
        if self._held is not None and not self._held.done():
            return
        self._bench.journal.add(
            text("journal.seconds-in-memory", reason=evidence.reason),
            level="warning",
        )
        self._held = asyncio.create_task(self._until_written(evidence), name="fault-held")

    async def _until_written(self, evidence: Evidence) -> None:
        while True:
            await asyncio.sleep(AGAIN_S)
            with contextlib.suppress(DriveError, OSError):
                name = await self._write(evidence)
                line = text("journal.memory-kept", reason=evidence.reason, name=name)
                self._bench.journal.add(line, level="warning")
                return

    # --- bundles ----------------------------------------------------------------------

    async def bundle(self, reason: Text, *, when: float | None = None) -> str:
        """Make a support bundle now; return its file name.

        Raises:
            StorageFailed: not enough disk space.
        """
        return await self._write(await self._evidence(reason, when or time.time()))

    async def _write(self, evidence: Evidence) -> str:
        self.folder.mkdir(parents=True, exist_ok=True)
        free = free_bytes(self.folder)
        if free < RESERVE_BYTES:
            raise StorageFailed(
                "recording.disk-nearly-full-mib",
                value=free,
                limit=limits.stays_free(RESERVE_BYTES),
                free_mib=free >> 20,
            )
        path = self._path_for(evidence.reason.words(), evidence.time)
        await build_apart(evidence, path)
        for old in self.names()[KEEP_BUNDLES:]:
            self.path(old).unlink(missing_ok=True)
        return path.name

    async def _evidence(self, reason: Text, when: float) -> Evidence:
        # The ring buffers continue to run: copy them before the slow reading of parameters.
        self._forget_old()
        blocks, values = [(tap, b) for _, tap, b in self._blocks], list(self._values)
        connected_drives = list(self._bench.connected_drives.values())
        states = [facts.state(connected) for connected in connected_drives]
        frames = await flights(self._bench.buses.opened)
        clock = {"sample_s": time.monotonic(), "epoch_s": time.time()}
        rows, pasts = await asyncio.gather(
            asyncio.gather(
                *(
                    facts.parameters(m, fresh=True, timeout_s=READ_TIMEOUT_S)
                    for m in connected_drives
                )
            ),
            asyncio.gather(
                *(facts.past_faults(m, timeout_s=READ_TIMEOUT_S) for m in connected_drives)
            ),
        )
        taps = [t for t in dict.fromkeys(tap for tap, _ in blocks) if self._known(t)]
        return Evidence(
            reason=reason,
            time=when,
            version=__version__,
            axes=[
                facts.identity(self._bench, connected)
                | {"state": state, "parameters": parameters, "past_faults": past}
                for connected, state, parameters, past in zip(
                    connected_drives, states, rows, pasts, strict=True
                )
            ],
            links=facts.links(self._bench, connected_drives),
            log=self._bench.journal.entries()[:LOG_ENTRIES],
            history=values,
            streams=describe_streams(self._bench, [(True, tap.channels) for tap in taps]),
            blocks=[(taps.index(tap), block) for tap, block in blocks if tap in taps],
            clock=clock,
            frames=frames,
            names=self._names(values),
        )

    def _names(self, values: list[Value]) -> dict[tuple[str, str], Text]:
        """Names and units of the values, for reading the bundle without the station."""
        names = {}
        for drive_id, key in {(v.drive, v.key) for v in values}:
            if (connected := self._bench.connected_drives.get(drive_id)) is not None:
                parameter = connected.drive.parameter(key)
                family = connected.drive.profile.drive
                axis, name = connected.drive.name, profile_text(family, parameter.name)
                names[drive_id, key] = (
                    text("bundle.quantity-unit", axis=axis, name=name, unit=parameter.unit)
                    if parameter.unit
                    else text("bundle.quantity", axis=axis, name=name)
                )
        return names

    def _known(self, tap: _Tap) -> bool:
        return all(drive in self._bench.connected_drives for drive, _ in tap.channels)

    def _path_for(self, reason: str, when: float) -> Path:
        stamp = datetime.fromtimestamp(when, UTC).strftime("%Y-%m-%d %H-%M-%S")
        words = re.sub(r"[^\w.\-]+", " ", reason, flags=re.ASCII).strip()[:50].strip(" .")
        stem, number = f"{stamp} {words}".strip(), 2
        path = self.folder / checked_name(stem, SUFFIX)
        while path.exists():
            path = self.folder / checked_name(f"{stem} {number}", SUFFIX)
            number += 1
        return path

    def names(self) -> list[str]:
        """File names of the bundles, newest first."""
        found = sorted(self.folder.glob(f"*{SUFFIX}"), key=lambda p: -p.stat().st_mtime)
        return [path.name for path in found if not path.name.startswith(".")]

    def path(self, name: str) -> Path:
        """The file of a bundle.

        Raises:
            NotAllowed: there is none of this name.
        """
        path = self.folder / checked_name(name, SUFFIX)
        if not path.is_file():
            raise NotAllowed("recording.no-support-bundle", value=path.name)
        return path
