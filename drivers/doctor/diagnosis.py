"""Diagnosis from facts, the most likely cause first: pure.

Weights: 4 for a fact that identifies the cause by itself, 3 for an AL status code that identifies
it, 2 for a difference between actual and expected value, 1 for a fact that makes it more likely.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal

import yaml

from drivers.doctor.evidence import Evidence

CATALOGUE = Path(__file__).with_name("causes.yaml")
_FACTS = Path(__file__).with_name("facts.yaml")
_BUSY_PREFIX = ("1C12", "1C13")


@dataclass(frozen=True, slots=True)
class CauseText:
    """A cause as text, English and Chinese."""

    code: str
    title: str
    zh: str
    remedy: str
    zh_remedy: str
    shows: str
    bus: Literal["ethercat", "canopen"] = "ethercat"


@dataclass(frozen=True, slots=True)
class FactText:
    """Name of a fact; ``digits``: hexadecimal with this number of digits, 0: decimal."""

    en: str
    zh: str
    digits: int = 0

    def notation(self, value: int | str) -> str:
        """Return ``0x001B`` or ``27``; a text is returned unchanged."""
        if isinstance(value, int) and self.digits:
            return f"0x{value:0{self.digits}X}"
        return str(value)


@dataclass(frozen=True, slots=True)
class Fact:
    """A piece of evidence: its name, the actual value and the expected one (None: unknown)."""

    name: str
    actual: int | str
    expected: int | str | None = None

    @property
    def text(self) -> FactText:
        """Name of the fact."""
        return fact_texts()[self.name]

    @property
    def shown(self) -> str:
        """The actual value, in the notation of the manuals."""
        return self.text.notation(self.actual)

    @property
    def shown_expected(self) -> str | None:
        """The expected value, likewise; None if unknown."""
        return None if self.expected is None else self.text.notation(self.expected)


@dataclass(frozen=True, slots=True)
class Cause:
    """A possible cause with the facts that support it; ``weight`` ranks it."""

    code: str
    weight: int
    facts: tuple[Fact, ...]

    @property
    def text(self) -> CauseText:
        """The cause as text."""
        return catalogue()[self.code]


@cache
def fact_texts() -> dict[str, FactText]:
    """Return the names of all facts by code."""
    data = yaml.safe_load(_FACTS.read_text("utf-8"))
    return {name: FactText(**texts) for name, texts in data.items()}


@cache
def catalogue() -> dict[str, CauseText]:
    """Return all causes by code."""
    data = yaml.safe_load(CATALOGUE.read_text("utf-8"))
    return {code: CauseText(code=code, **texts) for code, texts in data.items()}


def diagnose(evidence: Evidence) -> tuple[Cause, ...]:
    """Return the matching causes, the most likely first; never empty."""
    found = ranked(_signs(evidence))
    if found:
        return found
    code = "too_slow" if evidence.timed_out else "unknown"
    return (Cause(code, 0, (Fact("al_status", evidence.al_code),)),)


Sign = tuple[str, int, Fact]
"""A cause, the weight of the fact for it, and the fact."""


def ranked(signs: Iterable[Sign]) -> tuple[Cause, ...]:
    """Return causes ranked by the sum of the weights of their facts, the highest first."""
    weights: dict[str, int] = {}
    facts: dict[str, list[Fact]] = {}
    for code, weight, fact in signs:
        weights[code] = weights.get(code, 0) + weight
        facts.setdefault(code, []).append(fact)
    order = sorted(weights, key=lambda code: -weights[code])
    return tuple(Cause(code, weights[code], tuple(facts[code])) for code in order)


_Rule = Callable[[Evidence], Iterator[Sign]]

AL_CAUSES: dict[int, str] = {
    0x0002: "restart_needed", 0x0003: "modules_differ", 0x0004: "process_data_setup",
    0x0006: "eeprom_damaged", 0x0014: "no_firmware", 0x0015: "mailbox_setup",
    0x0016: "mailbox_setup", 0x0017: "process_data_setup", 0x0018: "no_outputs",
    0x0019: "no_outputs", 0x001A: "sync0_unsteady", 0x001B: "watchdog_expired",
    0x001C: "process_data_setup", 0x001D: "outputs_size", 0x001E: "inputs_size",
    0x001F: "watchdog_refused", 0x0020: "restart_needed", 0x0024: "inputs_size",
    0x0025: "outputs_size", 0x0026: "clock_mode_wrong", 0x0027: "clock_needed",
    0x0028: "clock_mode_wrong", 0x0029: "clock_needed", 0x002A: "restart_needed",
    0x002B: "no_outputs", 0x002C: "sync0_unsteady", 0x002D: "sync0_missing",
    0x002E: "cycle_refused", 0x0030: "clock_mode_wrong", 0x0032: "sync0_unsteady",
    0x0033: "sync0_unsteady", 0x0034: "sync0_unsteady", 0x0035: "cycle_refused",
    0x0036: "cycle_refused", 0x0037: "cycle_refused", 0x0050: "eeprom_busy",
    0x0051: "eeprom_damaged", 0x0052: "power_stage", 0x0060: "restart_needed",
    0x0062: "modules_differ", 0x0063: "supply_low", 0x0064: "supply_high",
    0x0065: "temperature", 0x0066: "temperature",
}  # fmt: skip


def _signs(e: Evidence) -> Iterator[Sign]:
    if not e.answers:
        yield "station_silent", 9, Fact("answers", 0, 1)
        return
    for rule in _RULES:
        yield from rule(e)


def _al_status(e: Evidence) -> Iterator[Sign]:
    if not e.al_code:
        return
    fact = Fact("al_status", e.al_code, 0)
    if e.al_code >= 0x8000:
        yield "makers_code", 3, fact
    elif cause := AL_CAUSES.get(e.al_code):
        yield cause, 3, fact


def _refusals(e: Evidence) -> Iterator[Sign]:
    if not e.refused_key:
        return
    fact = Fact("refused_object", e.refused_key)
    if e.from_file:
        yield "init_command_refused", 5, fact
    elif e.refused_key.startswith(_BUSY_PREFIX):
        yield "assignment_locked", 5, fact
    elif e.refused_key.startswith(("16", "17", "1A", "1B")):
        yield "mapping_locked", 5, fact


def _sizes(e: Evidence) -> Iterator[Sign]:
    for code, number, held, planned in (
        ("outputs_size", 2, e.outputs, e.planned_outputs),
        ("inputs_size", 3, e.inputs, e.planned_inputs),
    ):
        manager = next((m for m in e.managers if m.number == number), None)
        if held is not None and planned is not None and held != planned:
            yield code, 2, Fact(f"assigned_bytes_sm{number}", held, planned)
        if manager is not None and held is not None and manager.enabled and manager.length != held:
            yield code, 2, Fact(f"length_sm{number}", manager.length, held)
    for missing in (index for index in e.mandatory if index not in e.assigned):
        yield "mandatory_missing", 6, Fact("mandatory_pdo", f"{missing:04X}h")


def _clock(e: Evidence) -> Iterator[Sign]:
    planned, activate = e.planned_activate, e.activate
    # A refused object ends the bring-up before the clock is set.
    if planned is not None and activate is not None and not e.refused_key and activate != planned:
        yield "clock_mode_wrong", 2, Fact("register_980", activate, planned)
    if e.sync0_pending and e.al_code in (0, 0x001B, 0x002D):
        yield "sync0_missing", 4, Fact("sync0_begun", 0, 1)
    if e.sm_counters.missed:
        yield "sync0_unsteady", 1, Fact("sm_events_missed", e.sm_counters.missed, 0)
    if e.sm_counters.cycle_too_small:
        yield "cycle_refused", 2, Fact("cycle_exceeded", e.sm_counters.cycle_too_small, 0)
    if (
        e.sync0_ns is not None
        and e.planned_sync0_ns is not None
        and activate
        and e.sync0_ns != e.planned_sync0_ns
    ):
        yield "cycle_refused", 2, Fact("sync0_cycle_ns", e.sync0_ns, e.planned_sync0_ns)


def _watchdog(e: Evidence) -> Iterator[Sign]:
    if e.watchdog_expired and e.al_code in (0, 0x001B):
        yield "watchdog_expired", 1, Fact("watchdog_status", 0, 1)
    planned, held = e.planned_watchdog_ns, e.watchdog_ns
    if planned is not None and held is not None and abs(held - planned) > planned // 10:
        yield "watchdog_refused", 2, Fact("watchdog_ns", held, planned)


def _eeprom_and_identity(e: Evidence) -> Iterator[Sign]:
    if e.eeprom_busy:
        yield "eeprom_busy", 4, Fact("eeprom_busy", 1, 0)
    if e.eeprom_error:
        yield "eeprom_damaged", 4, Fact("eeprom_error", 1, 0)
    for name, held, known in (
        ("vendor", e.vendor, e.known_vendor),
        ("product", e.product, e.known_product),
    ):
        if held is not None and known is not None and held != known:
            yield "other_product", 7, Fact(name, held, known)
    known, held = e.known_revision, e.revision
    refused = bool(e.refused_key) or e.al_code in (0x0004, 0x0017, 0x001D, 0x001E, 0x0024, 0x0025)
    if held is not None and known is not None and held != known and refused:
        yield "other_revision", 6, Fact("revision", held, known)
    if e.alias and e.alias in e.aliases:
        yield "duplicate_alias", 2, Fact("alias", e.alias)


def _surroundings(e: Evidence) -> Iterator[Sign]:
    if e.drive_error:
        yield "drive_fault", 2, Fact("error_code_603F", e.drive_error, 0)
    if e.port_errors:
        yield "cable", 2, Fact("port_errors", e.port_errors, 0)
    if e.lost_links:
        yield "cable", 1, Fact("lost_links", e.lost_links, 0)
    if e.wkc is not None and e.planned_wkc is not None and 0 <= e.wkc < e.planned_wkc:
        yield "no_outputs", 1, Fact("working_counter", e.wkc, e.planned_wkc)


_RULES: tuple[_Rule, ...] = (
    _al_status, _refusals, _sizes, _clock, _watchdog, _eeprom_and_identity, _surroundings,
)  # fmt: skip
