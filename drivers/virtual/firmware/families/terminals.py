"""Terminals of each family as data: functions, polarities, forcing, and their bits in 60FDh.

Codes are those of the manuals' tables: 000:3257-3290, 002:8989-9350, 003:495-540, 001:950-1000.
The virtual machine's switches have normally open contacts and are wired to whichever input has
their function; where none has it, the drive does not see the switch.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from drivers.virtual.firmware.dictionary import ObjectDictionary
from drivers.virtual.firmware.families.base import Wiring
from drivers.virtual.firmware.kernel import layout as k

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
    """Where a polarity stands: a bit of a parameter, or a whole parameter with a value."""

    key: str
    bit: int | None = None
    inverted_raw: int = 1

    def inverted(self, od: ObjectDictionary) -> bool:
        """Whether the level is turned round."""
        raw = int(od.number(self.key))
        return bool(raw >> self.bit & 1) if self.bit is not None else raw == self.inverted_raw


@dataclass(frozen=True, slots=True)
class Input:
    """One input. ``fixed`` is its use where no parameter chooses one."""

    name: str
    bit: int | None
    function_key: str | None = None
    logic: Logic | None = None
    fixed: InputUse | None = None
    virtual: tuple[str, int] | None = None
    """A parameter's bit that switches it on besides its terminal."""


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
    """What its outputs do when process data end: a set bit switches the output off."""
    probe_bits: tuple[int, int] | None = None

    def use_of(self, terminal: Input, od: ObjectDictionary) -> InputUse | None:
        """What an input does now."""
        if terminal.function_key is None:
            return terminal.fixed
        return self.input_uses.get(int(od.number(terminal.function_key)))

    def output_use(self, terminal: Output, od: ObjectDictionary) -> OutputUse | None:
        """What an output shows now."""
        if terminal.function_key is None:
            return terminal.fixed
        return self.output_uses.get(int(od.number(terminal.function_key)))

    def wiring(self, od: ObjectDictionary) -> Wiring:
        """How the machine's switches reach the loops."""
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
    """Switched on by a parameter."""
    if terminal.virtual is None:
        return False
    key, bit = terminal.virtual
    return bool(int(od.number(key)) >> bit & 1)


M6L = TerminalTable(
    inputs=tuple(
        Input(
            f"DI{n + 1}", 16 + n, f"2003:{n + 1:02X}", Logic("2003:0E", n), virtual=("2003:0F", n)
        )
        for n in range(9)
    ),
    outputs=tuple(
        Output(f"DO{n + 1}", 16 + n, f"2003:{0x10 + n:02X}", Logic("2003:16", n)) for n in range(5)
    ),
    input_uses={
        2: "reset",
        3: "gain",
        17: "jog_forward",
        18: "jog_backward",
        32: "home",
        34: "emergency",
        35: "positive_limit",
        36: "negative_limit",
        38: "fault",
        49: "probe1",
        50: "probe2",
    },
    output_uses={
        0: "ready",
        1: "running",
        4: "zero_speed",
        5: "fault",
        6: "warning",
        11: "in_position",
        18: "brake",
        28: "bus",
    },
    inputs_key="200B:0D",
    outputs_key="200B:0E",
    bus_outputs_need_function=True,
    bus_outputs_need_cycles=True,
    keep_key="2014:1C",
    probe_bits=(26, 27),
)

R6L = TerminalTable(
    inputs=tuple(
        Input(f"DI{n + 1}", 16 + n, f"2002:{2 * n + 1:02X}", Logic(f"2002:{2 * n + 2:02X}"))
        for n in range(8)
    ),
    outputs=tuple(
        Output(f"DO{n + 1}", 16 + n, f"2002:{0x21 + 2 * n:02X}", Logic(f"2002:{0x22 + 2 * n:02X}"))
        for n in range(4)
    ),
    input_uses={
        2: "reset",
        5: "positive_limit",
        6: "negative_limit",
        7: "gain",
        11: "emergency",
        23: "home",
        30: "probe1",
        31: "probe2",
        39: "jog_forward",
        40: "jog_backward",
    },
    output_uses={0: "brake", 1: "fault", 2: "in_position", 6: "homed", 31: "bus"},
    inputs_key="200D:14",
    outputs_key="200D:15",
    bus_outputs_need_function=True,  # the note at 002:14003
)

#: The parameters that select the functions stand before the excerpt: EMG on DI1, POT on DI2, NOT
#: on DI3 and HOME on DI4 are this virtual drive's own wiring; HDI1 and HDI2 as printed (001:752).
EP3E = TerminalTable(
    inputs=(
        Input("DI1", 19, fixed="emergency"),
        Input("DI2", 20, fixed="positive_limit"),
        Input("DI3", 21, fixed="negative_limit"),
        Input("DI4", 22, fixed="home"),
        Input("DI5", 23),
        Input("HDI1", 30, fixed="probe1"),
        Input("HDI2", 31, fixed="probe2"),
    ),
    outputs=(
        Output("DO1", 16, fixed="ready"),
        Output("DO2", 17, fixed="no_fault"),
        Output("DO3", 18, fixed="bus"),
        Output("DO4", 19, fixed="bus"),
        Output("DO5", 20, fixed="brake"),
    ),
    bus_outputs_need_function=True,
    masks_outputs=False,  # no mask for DO1 to DO5, only their function (001:988)
)

DS_C = TerminalTable(
    inputs=tuple(Input(f"DI{n}", None, f"2400:{2 + n:02X}", Logic("2400:01", n)) for n in range(5)),
    outputs=tuple(
        Output(f"DO{n}", n, f"2400:{0x0D + n:02X}", Logic("2400:0C", n)) for n in range(3)
    ),
    input_uses={1: "home", 2: "positive_limit", 3: "negative_limit", 6: "emergency"},
    output_uses={1: "fault", 2: "running", 3: "homed", 4: "in_position", 6: "brake"},
    inputs_key="2100:00",
    outputs_key="2101:00",
)

TABLES: dict[str, TerminalTable] = {"m6l": M6L, "r6l": R6L, "ep3e": EP3E, "ds_c": DS_C}
