"""Terminals of a drive: their state, function and polarity, and touch probes."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass

from backend.axes.drive.catalog import functions_of
from backend.axes.drive.drive import Drive
from backend.axes.drive.faults import integer
from backend.axes.drive.readings import Reading
from drivers.errors import NotAllowed, OutOfRange, Rejected
from profiles.functions import TerminalBits, TerminalFacts
from profiles.schema import IoTerminal


@dataclass(frozen=True, slots=True)
class TerminalState:
    """Present state of one terminal. None: the drive does not report it.

    ``same_function``: other terminals with the same function.
    """

    terminal: IoTerminal
    on: bool | None
    function: int | None
    function_name: str
    inverted: bool | None
    same_function: tuple[str, ...] = ()


async def read_terminals(drive: Drive) -> list[TerminalState]:
    """All terminals of the profile, read now.

    Raises:
        LinkLost: the bus is gone.
    """
    facts = drive.profile.functions.terminals
    terminals = drive.profile.terminals
    keys = {bits.key for bits in (*facts.states, *facts.polarities)}
    keys |= {t.function_key for t in terminals if t.function_key is not None}
    reachable = [key for key in keys if not drive.unreachable_why(drive.parameter(key))]
    readings = await drive.read_many(reachable)
    found = [_state(terminal, facts, readings) for terminal in terminals]
    return _with_twins(found, facts)


def _state(
    terminal: IoTerminal, facts: TerminalFacts, readings: Mapping[str, Reading]
) -> TerminalState:
    code = integer(readings.get(terminal.function_key or ""))
    name = next((f.name for f in terminal.functions if f.code == code), "")
    return TerminalState(
        terminal=terminal,
        on=_bit(facts.states, terminal.name, readings),
        function=code,
        function_name=name,
        inverted=_bit(facts.polarities, terminal.name, readings),
    )


def _bit(
    places: tuple[TerminalBits, ...], terminal: str, readings: Mapping[str, Reading]
) -> bool | None:
    for place in places:
        if terminal in place.bits:
            raw = integer(readings.get(place.key))
            return None if raw is None else bool(raw >> place.bits[terminal] & 1)
    return None


def _with_twins(states: list[TerminalState], facts: TerminalFacts) -> list[TerminalState]:
    """Mark terminals of one direction with the same function.

    Compared by name, as one code may have different meanings at different terminals (MMS7,
    004:6470).
    """
    unused = {"in": facts.unused_inputs, "out": facts.unused_outputs}
    having: dict[tuple[str, str], list[str]] = defaultdict(list)
    for state in states:
        if state.function_name and state.function not in unused[state.terminal.direction]:
            having[state.terminal.direction, state.function_name].append(state.terminal.name)
    marked: list[TerminalState] = []
    for state in states:
        names = having.get((state.terminal.direction, state.function_name), [])
        others = tuple(name for name in names if name != state.terminal.name)
        used = state.terminal.name in names
        marked.append(
            TerminalState(
                state.terminal,
                state.on,
                state.function,
                state.function_name,
                state.inverted,
                others if used else (),
            )
        )
    return marked


# --- touch probes -----------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class ProbeSettings:
    """Settings of one touch probe. ``source``: value of its source bits in 60B8h."""

    on: bool
    continuous: bool
    rising: bool
    falling: bool
    source: int = 0


def probe_bits(settings: ProbeSettings) -> int:
    """The eight bits of one probe in 60B8h (CiA 402-2, 60B8h)."""
    return (
        settings.on
        | settings.continuous << 1
        | (settings.source & 3) << 2
        | settings.rising << 4
        | settings.falling << 5
    )


async def set_probe(drive: Drive, number: int, settings: ProbeSettings) -> Reading:
    """Set up touch probe 1 or 2; the other one stays as it is.

    It is switched off first, as drives accept settings on the edge of its enable bit (001:710).

    Raises:
        NotAllowed: no such probe.
        OutOfRange: no such source, or no edge chosen.
        Rejected: the drive did not keep the setting.
    """
    probe = functions_of(drive.profile).probe
    if probe is None or not 1 <= number <= len(probe.probes):
        raise NotAllowed(
            "drive.no-touch-probe",
            drive=drive.name,
            profile_title=drive.profile.title,
            number=number,
        )
    sources = probe.probes[number - 1].sources
    if settings.source not in sources:
        raise OutOfRange(
            "drive.touch-probe-no-source",
            drive=drive.name,
            value=settings.source,
            limit=", ".join(f"{code} ({text})" for code, text in sources.items()),
            number=number,
        )
    if settings.on and not (settings.rising or settings.falling):
        raise OutOfRange("drive.touch-probe-no-edge", drive=drive.name, number=number)
    shift = 8 * (number - 1)
    now = await drive.raw(probe.function_key) & 0xFFFF
    others = now & ~(0xFF << shift)
    if now >> shift & 1:
        await drive.write(probe.function_key, _signed(drive, probe.function_key, others))
    raw = _signed(drive, probe.function_key, others | probe_bits(settings) << shift)
    reading = await drive.write(probe.function_key, raw)
    if reading.raw != raw:
        raise Rejected(
            "drive.not-keep-setting-probe",
            abort_code=0,
            drive=drive.name,
            parameter=probe.function_key,
            value=reading.raw,
        )
    return reading


def _signed(drive: Drive, key: str, raw: int) -> int:
    """Raw value as signed number where the profile has INT16 for 60B8h (one maker, 000:3040)."""
    is_signed = drive.parameter(key).type == "INT16" and raw >= 0x8000
    return raw - 0x10000 if is_signed else raw
