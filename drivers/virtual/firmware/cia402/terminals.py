"""Terminals of a family as data: functions, polarities, forcing, and their bits in 60FDh.

Codes are those of the manuals' tables: 000:3257-3290, 002:8989-9350, 003:495-540, 001:950-1000. The
virtual machine's switches have normally open contacts and are wired to the input with their
function; if none has it, the drive does not receive the switch.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from drivers.virtual.firmware.cia402.base import Wiring
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.objects.dictionary import Cell, ObjectDictionary

InputUse = Literal[
    "negative_limit", "positive_limit", "home", "reset", "emergency", "probe1", "probe2", "gain",
    "fault", "jog_forward", "jog_backward",
]  # fmt: skip
OutputUse = Literal[
    "ready", "running", "fault", "no_fault", "warning", "zero_speed", "in_position", "homed",
    "brake", "target", "off", "on", "bus",
]  # fmt: skip
SWITCHES: dict[InputUse, int] = {
    "negative_limit": k.SIG_NEGATIVE,
    "positive_limit": k.SIG_POSITIVE,
    "home": k.SIG_HOME,
}


@dataclass(frozen=True, slots=True)
class Logic:
    """Location of a polarity setting: a bit of a parameter, or a whole parameter with a value."""

    key: str
    bit: int | None = None
    inverted_raw: int = 1

    def inverted(self, od: ObjectDictionary) -> bool:
        """Return whether the level is inverted."""
        raw = int(od.number(self.key))
        return bool(raw >> self.bit & 1) if self.bit is not None else raw == self.inverted_raw


@dataclass(frozen=True, slots=True)
class Input:
    """One input. ``fixed`` is its use if no parameter selects one."""

    name: str
    bit: int | None
    function_key: str | None = None
    logic: Logic | None = None
    fixed: InputUse | None = None
    virtual: tuple[str, int] | None = None
    """A parameter's bit that switches it on in addition to its terminal."""


@dataclass(frozen=True, slots=True)
class Output:
    """One output with its bit in 60FEh."""

    name: str
    bit: int | None
    function_key: str | None = None
    logic: Logic | None = None
    fixed: OutputUse | None = None


@dataclass(frozen=True, slots=True)
class TerminalTable:
    """Terminals of one family. ``inputs_key`` and ``outputs_key`` show their levels as bits."""

    inputs: tuple[Input, ...]
    outputs: tuple[Output, ...]
    input_uses: dict[int, InputUse] = field(default_factory=dict)
    output_uses: dict[int, OutputUse] = field(default_factory=dict)
    inputs_key: str | None = None
    outputs_key: str | None = None
    bus_outputs_need_function: bool = False
    """Only outputs with the function "bus" follow 60FEh."""
    bus_outputs_need_cycles: bool = False
    masks_outputs: bool = True
    keep_key: str | None = None
    """State of its outputs when process data end: a set bit switches the output off."""
    probe_bits: tuple[int, int] | None = None

    def use_of(self, terminal: Input, od: ObjectDictionary) -> InputUse | None:
        """Return the present function of an input."""
        if terminal.function_key is None:
            return terminal.fixed
        return self.input_uses.get(int(od.number(terminal.function_key)))

    def output_use(self, terminal: Output, od: ObjectDictionary) -> OutputUse | None:
        """Return the present function of an output."""
        if terminal.function_key is None:
            return terminal.fixed
        return self.output_uses.get(int(od.number(terminal.function_key)))

    def wiring(self, od: ObjectDictionary) -> Wiring:
        """Return how the machine's switches are connected to the loops."""
        forced = k.SIG_NEGATIVE | k.SIG_POSITIVE | k.SIG_HOME
        forced_on = inverted = 0
        for terminal in self.inputs:
            signal = SWITCHES.get(self.use_of(terminal, od) or "gain")
            if signal is None:
                continue
            if is_virtually_on(terminal, od):
                forced_on |= signal
                continue
            forced &= ~signal
            if terminal.logic is not None and terminal.logic.inverted(od):
                inverted |= signal
        return Wiring(forced=forced | forced_on, forced_on=forced_on, inverted=inverted)


def is_virtually_on(terminal: Input, od: ObjectDictionary) -> bool:
    """Return whether a parameter switches the input on."""
    if terminal.virtual is None:
        return False
    key, bit = terminal.virtual
    return bool(int(od.number(key)) >> bit & 1)


class InputPin:
    """One input of a drive, with its parameters looked up once, as it is read in every cycle."""

    __slots__ = ("_fixed", "_function", "_inverted_raw", "_logic", "_logic_bit", "_uses",
                 "_virtual", "_virtual_bit", "bit")  # fmt: skip

    def __init__(self, terminal: Input, table: TerminalTable, od: ObjectDictionary) -> None:
        self.bit = terminal.bit
        key, logic, virtual = terminal.function_key, terminal.logic, terminal.virtual
        self._function: Cell | None = None if key is None else od.cell(key)
        self._fixed = terminal.fixed
        self._uses = table.input_uses
        self._logic: Cell | None = None if logic is None else od.cell(logic.key)
        self._logic_bit = None if logic is None else logic.bit
        self._inverted_raw = 1 if logic is None else logic.inverted_raw
        self._virtual: Cell | None = None if virtual is None else od.cell(virtual[0])
        self._virtual_bit = 0 if virtual is None else virtual[1]

    @property
    def use(self) -> InputUse | None:
        """Present function of the input."""
        if self._function is None:
            return self._fixed
        return self._uses.get(int(self._function.active))

    def level(self, external: bool, pressed: int) -> bool:
        """Return the logic level after polarity and forcing. ``pressed``: active switches."""
        if self._virtual is not None and int(self._virtual.active) >> self._virtual_bit & 1:
            return True
        on = external
        if not on and pressed:
            use = self.use
            on = use is not None and pressed & SWITCHES.get(use, 0) != 0
        if self._logic is None:
            return on
        raw, bit = int(self._logic.active), self._logic_bit
        return on != (bool(raw >> bit & 1) if bit is not None else raw == self._inverted_raw)
