"""The latency timer of a serial adapter: what it costs, lowered on request, and restored.

The earlier value is on the disk before anything is changed (``latency-timers.json`` in the state
folder). Unlike the settings of `fixes`, the system keeps this one over a restart.

Reads per second are measured where a bus was open at the adapter. Otherwise they are a bound from
the timer alone: reads that follow one another take at least one timer each (FTDI AN232B-04); the
time on the wire and the drive's time come on top.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path

from backend.foundation.store.files import write_atomically
from drivers.computer.serial_ports.latency_timer import (
    LATENCY_MS,
    InForce,
    LatencyTimer,
    LatencyTimers,
)
from drivers.errors import Busy, DriveError, NotAllowed, OutOfRange
from drivers.texts.message import text

FILE = "latency-timers.json"
LOWERED_MS = 1
"""What the timer is lowered to: USB delivers in frames of 1 ms."""


@dataclass(frozen=True, slots=True)
class Changed:
    """A changed timer: before and after [ms], and the reads per second measured before."""

    device: str
    place: str
    before_ms: int
    after_ms: int
    reads_before: float | None = None


@dataclass(frozen=True, slots=True)
class Timer:
    """The timer of a port now; ``timer`` is None for an adapter without one that is known."""

    timer: LatencyTimer | None
    changed: Changed | None = None


def most_reads(ms: int) -> float:
    """Reads per second that a timer allows: a bound, not a measurement."""
    return 1000.0 / ms


@dataclass(slots=True)
class Adapters:
    """The latency timers of this computer, with the restore list in ``folder``."""

    folder: Path
    timers: LatencyTimers = field(default_factory=LatencyTimers)

    def look(self, device: str) -> Timer:
        """The timer of a serial port, and what was changed of it.

        Raises:
            NotAllowed: the restore list cannot be read.
        """
        timer = self.timers.of(device)
        changed = next((one for one in self._kept() if timer and one.place == timer.place), None)
        return Timer(timer, changed)

    def set(self, device: str, ms: int, reads_before: float | None = None) -> InForce:
        """Set the timer of a port that no program uses.

        The value before the first change is kept for `restore`.

        Raises:
            OutOfRange: not 1 to 255 ms.
            NotAllowed: no such timer, or not permitted; nothing is changed then.
            StorageFailed: the earlier value cannot be kept; nothing is changed.
            Busy: a program has the port open, and the change would interrupt it.
        """
        least, most = LATENCY_MS
        if not least <= ms <= most:
            raise OutOfRange("preflight.latency-range", value=f"{ms} ms", limit=f"{least}…{most}")
        timer = self._require(device)
        kept = self._kept()
        others = [one for one in kept if one.place != timer.place]
        first = next((one for one in kept if one.place == timer.place), None)
        before = first.before_ms if first else timer.ms
        reads = first.reads_before if first else reads_before
        new = Changed(device, timer.place, before, ms, reads)
        self._keep([*others, new] if before != ms else others)
        try:
            return self._write(timer, ms)
        except DriveError:
            self._keep(kept)
            raise

    def restore(self, device: str) -> InForce | None:
        """Restore the value before the first change; None if somebody changed the timer since.

        Raises:
            NotAllowed: nothing to restore, or not permitted; it stays in the list.
            Busy: a program has the port open.
        """
        timer = self._require(device)
        kept = self._kept()
        changed = next((one for one in kept if one.place == timer.place), None)
        if changed is None:
            raise NotAllowed("preflight.latency-not-changed", device=device)
        in_force = None
        if timer.ms == changed.after_ms:
            in_force = self._write(timer, changed.before_ms)
        self._keep([one for one in kept if one is not changed])
        return in_force

    def _require(self, device: str) -> LatencyTimer:
        timer = self.timers.of(device)
        if timer is None:
            raise NotAllowed("preflight.no-latency-timer", device=device)
        return timer

    def _write(self, timer: LatencyTimer, ms: int) -> InForce:
        if timer.instance and self.timers.in_use(timer.device):
            raise Busy("preflight.adapter-in-use", device=timer.device)
        try:
            return self.timers.set(timer, ms)
        except PermissionError as error:
            code = (
                "preflight.latency-as-administrator"
                if timer.instance
                else "preflight.latency-as-root"
            )
            raise NotAllowed(
                "preflight.latency-denied",
                value=f"{ms} ms",
                remedy=text(code, device=timer.device, place=timer.place, ms=ms),
                device=timer.device,
            ) from error
        except OSError as error:
            raise NotAllowed(
                "preflight.latency-failed",
                value=f"{ms} ms",
                device=timer.device,
                strerror=error.strerror or str(error),
            ) from error

    def _kept(self) -> list[Changed]:
        path = self.folder / FILE
        try:
            return [_changed(one) for one in json.loads(path.read_text("utf-8"))]
        except FileNotFoundError:
            return []
        except (OSError, ValueError, TypeError) as error:
            raise NotAllowed(
                "preflight.latency-list-unreadable", value=str(error), path=str(path)
            ) from error

    def _keep(self, changed: list[Changed]) -> None:
        """Write the restore list to the disk, flushed, before anything is changed."""
        listed = json.dumps([asdict(one) for one in changed], indent=1)
        write_atomically(self.folder / FILE, listed.encode())


def _changed(kept: Mapping[str, object]) -> Changed:
    """One entry of the list; ValueError or TypeError where it is not what servodeck writes."""
    one = Changed(**kept)  # type: ignore[arg-type]  # checked below
    LatencyTimer(one.device, one.before_ms, one.place)
    if not LATENCY_MS[0] <= one.before_ms <= LATENCY_MS[1]:
        raise ValueError(f"{one.before_ms} ms")
    return one
