"""The SYNC loop: one thread, absolute deadlines, samples in and setpoints out."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from drivers.canopen.frames import HEARTBEAT, SYNC, Frame
from drivers.canopen.pdo import PdoPlan
from drivers.canopen.setpoints import Player
from drivers.codec import decode, encode, size_of
from drivers.errors import DriveError, LinkLost, LinkTimeout
from drivers.link import CyclicSignal, Envelope, LinkEvent, ScopeBlock
from profiles.schema import DataType

_CONTROL_WORD = (0x6040, 0)
_DISABLE_OPERATION = b"\x07\x00"
_SHUTDOWN = b"\x06\x00"
_RATES = (0x60FF, 0x6071, 0x60B1, 0x60B2)
"""Targets and offsets of speed and torque."""
_BLOCK_S = 0.025
_HEARTBEAT_S = 0.05
_OPERATIONAL = b"\x05"
_SILENT_S = 0.05
_LATENESS_KEPT = 4096

_Key = tuple[int, int, int]


@dataclass(slots=True)
class _Slot:
    """Where one signal sits in one PDO."""

    cob_id: int
    start: int
    type: DataType
    column: int


@dataclass(slots=True)
class Tables:
    """Where each signal sits, and the bytes that go out next. Guarded by the loop's lock."""

    channels: tuple[str, ...]
    inputs: dict[_Key, _Slot]
    outputs: dict[_Key, _Slot]
    images: dict[int, bytearray]
    lengths: dict[int, int]
    """Length in bytes of each input PDO by its identifier."""

    @classmethod
    def of(cls, pdos: Sequence[PdoPlan]) -> Tables:
        """Tables for a plan; channels in the order of the plan's inputs."""
        tables = cls((), {}, {}, {}, {})
        names: list[str] = []
        for pdo in pdos:
            start = 0
            for signal in pdo.signals:
                slot = _Slot(pdo.cob_id, start, signal.address.type, len(names))
                if pdo.direction == "tx":
                    tables.inputs[_key(signal)] = slot
                    names.append(signal.channel)
                else:
                    tables.outputs[_key(signal)] = slot
                start += size_of(signal.address.type) or 0
            if pdo.direction == "tx":
                tables.lengths[pdo.cob_id] = start
            else:
                tables.images[pdo.cob_id] = bytearray(start)
        tables.channels = tuple(names)
        return tables

    def has_output(self, station: int, index: int, subindex: int) -> bool:
        """Whether this object goes out each cycle."""
        return (station, index, subindex) in self.outputs

    def has_input(self, station: int, index: int) -> bool:
        """Whether this object comes in each cycle."""
        return (station, index, 0) in self.inputs

    def set_output(self, station: int, index: int, subindex: int, data: bytes) -> None:
        """Change the bytes that go out."""
        slot = self.outputs[station, index, subindex]
        self.images[slot.cob_id][slot.start : slot.start + len(data)] = data

    def neutralise(self, station: int, index: int, subindex: int) -> None:
        """Make this output harmless; positions stay, as holding is what a position does."""
        slot = self.outputs[station, index, subindex]
        if index == _CONTROL_WORD[0]:
            self.set_output(station, index, subindex, _SHUTDOWN)
        elif index in _RATES:
            self.set_output(station, index, subindex, bytes(size_of(slot.type) or 0))

    def station_of(self, cob_id: int) -> int:
        """The node behind an identifier of the pre-defined connection set."""
        return cob_id & 0x7F


@dataclass(slots=True)
class _Statistics:
    cycles: int = 0
    skipped: int = 0
    incomplete: int = 0
    lateness_us: list[float] = field(default_factory=list)

    def late(self, microseconds: float) -> None:
        self.lateness_us.append(microseconds)
        if len(self.lateness_us) > 2 * _LATENESS_KEPT:
            del self.lateness_us[:_LATENESS_KEPT]


class SyncLoop:
    """Sends SYNC and output PDOs every ``cycle_s``, gathers input PDOs into blocks.

    Every public method may be called from any thread. ``deliver`` and ``tell`` are called on the
    loop's thread and must not block.
    """

    def __init__(
        self,
        send: Callable[[Frame], None],
        tables: Tables,
        cycle_s: float,
        *,
        deliver: Callable[[ScopeBlock], None],
        tell: Callable[[LinkEvent], None],
        own_id: int,
    ) -> None:
        self.tables = tables
        self.cycle_s = cycle_s
        self._send = send
        self._deliver = deliver
        self._tell = tell
        self._heartbeat = Frame(HEARTBEAT + own_id, _OPERATIONAL)
        self._lock = threading.Condition()
        self._stopping = False
        self._players: list[Player] = []
        self._cycle = 0
        self._sent_cycle = -1
        self._arrived: dict[int, bytes] = {}
        self._last_seen_s: dict[int, float] = {}
        self._latest: dict[_Key, float] = {}
        self._rows: list[list[float]] = []
        self._row_valid: list[bool] = []
        self._block_start_s = 0.0
        self._sequence = 0
        self._dropped = 0
        self._bus_lost = False
        self._statistics = _Statistics()
        self._thread = threading.Thread(target=self._run, name="canopen-sync", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def stop(self) -> None:
        """End the thread at once; `halt_and_wait` first to stop motion."""
        with self._lock:
            self._stopping = True
        self._thread.join()

    def take(self, frame: Frame, now_s: float) -> bool:
        """Take a frame if it is one of the input PDOs."""
        length = self.tables.lengths.get(frame.cob_id)
        if length is None or frame.remote:
            return False
        if len(frame.data) >= length:
            with self._lock:
                self._arrived[frame.cob_id] = frame.data
                self._last_seen_s[self.tables.station_of(frame.cob_id)] = now_s
        return True

    def put(self, station: int, index: int, subindex: int, data: bytes) -> None:
        """Change an output; returns when the frame and the SYNC that makes it valid are sent.

        Raises:
            LinkLost: the bus is gone.
            LinkTimeout: the loop does not run.
        """
        with self._lock:
            if self._bus_lost:
                raise LinkLost("the CAN bus is lost", remedy="wait until the adapter is back")
            self.tables.set_output(station, index, subindex, data)
            wanted = self._cycle + 2
            if not self._lock.wait_for(
                lambda: self._sent_cycle >= wanted or self._bus_lost, 0.5 + 3 * self.cycle_s
            ):
                raise LinkTimeout("the cyclic exchange did not run", remedy="stop and start it")
            if self._bus_lost:
                raise LinkLost("the CAN bus is lost", remedy="wait until the adapter is back")

    def play(self, players: Sequence[Player]) -> int:
        """Begin in the next cycle; players of the same target are replaced."""
        with self._lock:
            new = {(p.trajectory.station, p.trajectory.target) for p in players}
            self._players = [
                p for p in self._players if (p.trajectory.station, p.trajectory.target) not in new
            ]
            self._players += players
            return self._cycle

    def renew(self, station: int) -> None:
        """Extend the life of this station's setpoints."""
        with self._lock:
            for player in self._players:
                if player.trajectory.station == station:
                    player.renew()

    def halt(self, station: int | None, *, disable: bool = False) -> None:
        """Begin to stop one station, or all with None."""
        with self._lock:
            for player in self._players:
                if station is None or player.trajectory.station == station:
                    player.brake(disable_at_end=disable)

    def abandon(self, station: int | None) -> None:
        """A node or the bus is lost: setpoints end without a ramp, as nobody receives it.

        What goes out once it is back cannot move anything: disabled, no speed, no torque.
        """
        with self._lock:
            self._players = [
                p for p in self._players if station is not None and p.trajectory.station != station
            ]
            for node, index, subindex in self.tables.outputs:
                if station is None or node == station:
                    self.tables.neutralise(node, index, subindex)

    def halt_and_wait(self) -> None:
        """Stop everything and wait until it stands, at most 2 s. Blocks."""
        self.halt(None)
        with self._lock:
            self._lock.wait_for(lambda: not self._players or self._bus_lost, 2.0)

    def statistics(self) -> dict[str, float | int | str]:
        """Figures for link quality."""
        with self._lock:
            late = sorted(self._statistics.lateness_us)
            return {
                "cycles": self._statistics.cycles,
                "skipped_cycles": self._statistics.skipped,
                "incomplete_samples": self._statistics.incomplete,
                "sync_late_p50_us": round(late[len(late) // 2], 1) if late else 0.0,
                "sync_late_p99_us": round(late[len(late) * 99 // 100], 1) if late else 0.0,
                "sync_late_max_us": round(late[-1], 1) if late else 0.0,
            }

    def _run(self) -> None:
        due_s = time.monotonic() + self.cycle_s
        heartbeat_due_s = 0.0
        self._block_start_s = due_s
        while True:
            time.sleep(max(due_s - time.monotonic(), 0.0))
            now_s = time.monotonic()
            with self._lock:
                if self._stopping:
                    self._flush()
                    return
                if self._cycle > 0:
                    self._close_sample()
                outgoing = self._next_outputs(now_s)
            if now_s >= heartbeat_due_s:
                heartbeat_due_s = now_s + _HEARTBEAT_S
                outgoing.append(self._heartbeat)
            self._exchange(outgoing)
            with self._lock:
                self._statistics.late(1e6 * (now_s - due_s))
                self._statistics.cycles += 1
                self._sent_cycle = self._cycle
                self._cycle += 1
                self._lock.notify_all()
            due_s += self.cycle_s
            missed = int(max(time.monotonic() - due_s, 0.0) / self.cycle_s)
            if missed:
                self._skip(missed)
                due_s += missed * self.cycle_s

    def _exchange(self, outgoing: Sequence[Frame]) -> None:
        try:
            self._send(Frame(SYNC))
            for frame in outgoing:
                self._send(frame)
        except DriveError as error:
            self.abandon(None)
            with self._lock:
                lost, self._bus_lost = not self._bus_lost, True
                self._lock.notify_all()
            if lost:
                self._tell(LinkEvent("state", None, f"cyclic exchange interrupted: {error}"))
            return
        self._bus_lost = False

    def _skip(self, missed: int) -> None:
        """The computer was late by whole cycles: those samples do not exist."""
        with self._lock:
            self._flush()
            self._dropped += missed
            self._statistics.skipped += missed
            self._cycle += missed
            self._block_start_s += missed * self.cycle_s

    def _close_sample(self) -> None:
        arrived, self._arrived = self._arrived, {}
        row = [float("nan")] * len(self.tables.channels)
        for key, slot in self.tables.inputs.items():
            data = arrived.get(slot.cob_id)
            if data is not None:
                size = size_of(slot.type) or 0
                value = float(decode(slot.type, data[slot.start : slot.start + size]))
                self._latest[key] = value
                row[slot.column] = value
            elif key in self._latest:
                row[slot.column] = self._latest[key]
        complete = len(arrived) == len(self.tables.lengths)
        self._statistics.incomplete += not complete
        self._rows.append(row)
        self._row_valid.append(complete)
        if len(self._rows) * self.cycle_s >= _BLOCK_S:
            self._flush()

    def _flush(self) -> None:
        if not self._rows:
            return
        samples: npt.NDArray[np.float64] = np.array(self._rows, dtype=np.float64)
        block = ScopeBlock(
            sequence=self._sequence,
            t0_s=self._block_start_s,
            dt_s=self.cycle_s,
            channels=self.tables.channels,
            samples=samples.reshape(len(self._rows), len(self.tables.channels)),
            dropped=self._dropped,
            valid=np.array(self._row_valid, dtype=np.bool_),
        )
        self._sequence += 1
        self._dropped = 0
        self._block_start_s += len(self._rows) * self.cycle_s
        self._rows, self._row_valid = [], []
        self._deliver(block)

    def _next_outputs(self, now_s: float) -> list[Frame]:
        for player in list(self._players):
            trajectory = player.trajectory
            station = trajectory.station
            why = self._breach(station, trajectory.envelope, now_s)
            if why and not player.braking:
                player.brake(disable_at_end=True)
                self._tell(LinkEvent("fault", station, f"node {station} is being stopped: {why}"))
            value, offset = player.step()
            target = trajectory.target
            self._put_value(station, target.index or 0, target.subindex, value, target.type)
            if offset is not None and trajectory.offset_target is not None:
                extra = trajectory.offset_target
                self._put_value(station, extra.index or 0, extra.subindex, offset, extra.type)
            if player.finished:
                self._players.remove(player)
                if player.disable_at_end and self.tables.has_output(station, *_CONTROL_WORD):
                    self.tables.set_output(station, *_CONTROL_WORD, _DISABLE_OPERATION)
        return [Frame(cob_id, bytes(image)) for cob_id, image in self.tables.images.items()]

    def _put_value(
        self, station: int, index: int, subindex: int, value: int, data_type: DataType
    ) -> None:
        self.tables.set_output(station, index, subindex, encode(data_type, value))

    def _breach(self, station: int, envelope: Envelope, now_s: float) -> str:
        """Why ``station`` must stop, or empty."""
        seen = self._last_seen_s.get(station)
        if seen is not None and now_s - seen > _SILENT_S + 3 * self.cycle_s:
            return "its cyclic data stopped coming"
        position = self._latest.get((station, 0x6064, 0))
        if position is not None:
            if envelope.position_max is not None and position > envelope.position_max:
                return f"position {position:.0f} above the limit {envelope.position_max:.0f}"
            if envelope.position_min is not None and position < envelope.position_min:
                return f"position {position:.0f} below the limit {envelope.position_min:.0f}"
        for index, limit, name in (
            (0x606C, envelope.speed_max, "speed"),
            (0x6077, envelope.torque_max, "torque"),
            (0x60F4, envelope.following_error_max, "following error"),
        ):
            value = self._latest.get((station, index, 0))
            if limit is not None and value is not None and abs(value) > limit:
                return f"{name} {value:.0f} outside the limit {limit:.0f}"
        return ""


def _key(signal: CyclicSignal) -> _Key:
    return signal.station, signal.address.index or 0, signal.address.subindex
