"""Test of all rules on one slave. It is never enabled, and all changes are restored."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from drivers.conformance import drive_rules, object_rules, sdo_rules, state_rules
from drivers.conformance.rule import (
    Outcome,
    Rule,
    failed,
    hexadecimal,
    not_applicable,
    not_testable,
)
from drivers.conformance.subject import Subject
from drivers.doctor.diagnosis import Fact
from drivers.errors import Busy, LinkTimeout, NotAllowed, NotAsked, ProtocolError, Rejected

RULES: tuple[Rule, ...] = (
    *state_rules.RULES,
    *sdo_rules.RULES,
    *object_rules.RULES,
    *drive_rules.RULES,
)
_POWERED = frozenset({0x27, 0x07, 0x0F})
"""Bits 6Fh of a status word with power: enabled, quick stop, fault reaction (CiA 402-2 8.4.2)."""


@dataclass(frozen=True, slots=True)
class Finding:
    """The outcome of one rule."""

    rule: Rule
    outcome: Outcome


async def check(
    subject: Subject, rules: Sequence[Rule] = RULES, shown: Callable[[int], None] = lambda _n: None
) -> list[Finding]:
    """Test ``rules`` one after the other; ``shown`` is called with the number of those done.

    A drive that may be powered is only read: rules that write are not tested then.

    Raises:
        LinkLost: the bus or the slave is gone.
        LinkTimeout: the slave does not answer at all.
    """
    powered = await _power(subject)
    found = []
    for number, rule in enumerate(rules, start=1):
        found.append(Finding(rule, await _tried(subject, rule, powered)))
        shown(number)
    return found


async def _power(subject: Subject) -> Fact | None:
    """Return the status word if power is or may be on; this also checks that the slave answers."""
    try:
        status = await subject.number(0x6041)
    except (Rejected, ProtocolError):
        return Fact("status_word", "-")
    if status is None or status & 0x6F not in _POWERED:
        return None
    return Fact("status_word", hexadecimal(status, 4))


async def _tried(subject: Subject, rule: Rule, powered: Fact | None) -> Outcome:
    if subject.bus not in rule.buses:
        return not_applicable(Fact("bus", subject.bus))
    if rule.changes and powered is not None:
        return not_testable(powered)
    try:
        return await rule.check(subject)
    except (Busy, NotAllowed, NotAsked) as hindrance:
        return not_testable(Fact("refusal", hindrance.code or hindrance.kind))
    except Rejected as refusal:
        return failed(
            Fact("abort_code", hexadecimal(refusal.abort_code)),
            Fact("object", refusal.parameter or "-"),
        )
    except (LinkTimeout, ProtocolError) as wrong:
        return failed(Fact("answer", wrong.code or wrong.kind))
