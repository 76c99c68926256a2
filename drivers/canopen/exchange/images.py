"""Position of each signal in the PDOs, and the axis loop of each station. Pure."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from drivers import cia402
from drivers.canopen.exchange.pdo import PdoPlan
from drivers.halt import Halted
from drivers.motion.playback import AxisLoop
from drivers.objects.codec import decode, encode, size_of
from drivers.texts.message import Text
from profiles.schema import INTEGER_RANGE, DataType

Key = tuple[int, int, int]
"""Station, index, subindex."""

CONTROL_WORD = 0x6040
_RATES = (0x60FF, 0x6071, 0x60B1, 0x60B2)
"""Targets and offsets of velocity and torque."""


@dataclass(frozen=True, slots=True)
class Slot:
    """One signal: its PDO, its byte offset there, and its column among inputs or outputs."""

    cob_id: int
    start: int
    type: DataType
    column: int

    @property
    def size(self) -> int:
        """Size in bytes."""
        return size_of(self.type) or 0


class Images:
    """Inputs of the last cycle and outputs of the next. One thread at a time."""

    def __init__(
        self,
        pdos: Sequence[PdoPlan],
        cycle_s: float,
        report: Callable[[int, Text], None],
        dialects: Mapping[int, cia402.Dialect] | None = None,
    ) -> None:
        self.channels: tuple[str, ...] = ()
        """Names of the inputs, followed by those of the outputs."""
        self.inputs: dict[Key, Slot] = {}
        self.outputs: dict[Key, Slot] = {}
        self.frames: dict[int, bytearray] = {}
        """Contents of each output PDO by its identifier."""
        self.lengths: dict[int, int] = {}
        """Length of each input PDO by its identifier."""
        self.stations = sorted({p.station for p in pdos})
        self.axes: dict[int, AxisLoop] = {}
        self.values: list[int | float] = []
        self._cycle_s = cycle_s
        self._report = report
        self._dialects = dialects or {}
        self._place(pdos)
        for station in self.stations:
            if (station, CONTROL_WORD, 0) in self.outputs:
                self.axes[station] = self._axis(station)

    def _place(self, pdos: Sequence[PdoPlan]) -> None:
        taken: list[str] = []
        given: list[str] = []
        for pdo in pdos:
            names, slots = (taken, self.inputs) if pdo.direction == "tx" else (given, self.outputs)
            for signal, start in pdo.placed():
                slot = Slot(pdo.cob_id, start, signal.address.type, len(names))
                key = (signal.station, signal.address.index or 0, signal.address.subindex)
                slots[key] = slot
                names.append(signal.channel)
            if pdo.direction == "tx":
                self.lengths[pdo.cob_id] = pdo.size
            else:
                self.frames[pdo.cob_id] = bytearray(pdo.size)
        self.channels = (*taken, *given)
        self.values = [0] * len(taken)

    def _axis(self, station: int) -> AxisLoop:
        objects = self._objects(station)
        inputs = {
            index: slot.column
            for (node, index, subindex), slot in self.inputs.items()
            if node == station and subindex == 0
        }
        return AxisLoop(
            station,
            inputs=inputs,
            outputs={index: n for n, index in enumerate(objects)},
            output_count=len(objects),
            cycle_s=self._cycle_s,
            report=self._report,
            dialect=self._dialects.get(station, cia402.Dialect()),
        )

    def _objects(self, station: int) -> list[int]:
        """Return the outputs that the axis may write: integers at subindex 0."""
        return [
            index
            for (node, index, subindex), slot in self.outputs.items()
            if node == station and subindex == 0 and slot.type in INTEGER_RANGE
        ]

    def set_output(self, key: Key, data: bytes) -> None:
        """Change the bytes of an output."""
        slot = self.outputs[key]
        self.frames[slot.cob_id][slot.start : slot.start + slot.size] = data
        axis = self.axes.get(key[0])
        if axis is not None and key[2] == 0 and slot.type in INTEGER_RANGE:
            value = decode(slot.type, data)
            axis.outputs[self._objects(key[0]).index(key[1])] = int(value)

    def sent(self) -> list[int | float]:
        """Return the present values of the output PDOs, in the order of the outputs' names."""
        values: list[int | float] = [0] * len(self.outputs)
        for slot in self.outputs.values():
            frame = self.frames[slot.cob_id]
            value = decode(slot.type, bytes(frame[slot.start : slot.start + slot.size]))
            values[slot.column] = value if not isinstance(value, str) else 0
        return values

    def take(self, arrived: dict[int, bytes]) -> set[int]:
        """Store the input PDOs of one cycle; return the stations that are complete."""
        missing: set[int] = set()
        for (station, _index, _subindex), slot in self.inputs.items():
            data = arrived.get(slot.cob_id)
            if data is None:
                missing.add(station)
            else:
                value = decode(slot.type, data[slot.start : slot.start + slot.size])
                self.values[slot.column] = value if not isinstance(value, str) else 0
        return {s for s in self.stations if s not in missing}

    def pack_axis(self, station: int) -> None:
        """Write the axis outputs into the PDOs."""
        axis = self.axes[station]
        for value, index in zip(axis.outputs, self._objects(station), strict=True):
            slot = self.outputs[station, index, 0]
            self.frames[slot.cob_id][slot.start : slot.start + slot.size] = encode(slot.type, value)

    def neutralise(self, station: int, why: Halted) -> None:
        """End all motion of this station and set harmless outputs.

        Disabled, no speed, no torque; the position setpoint remains, as it only holds the position.
        A new axis loop replaces the old one, so that nothing of its motion remains.
        """
        for key, slot in self.outputs.items():
            if key[0] == station and key[1] == CONTROL_WORD:
                self.set_output(key, encode(slot.type, cia402.SHUTDOWN))
            elif key[0] == station and key[1] in _RATES:
                self.set_output(key, bytes(slot.size))
        old = self.axes.get(station)
        if old is not None:
            fresh = self._axis(station)
            fresh.outputs[:] = old.outputs
            fresh.halted = why
            self.axes[station] = fresh
