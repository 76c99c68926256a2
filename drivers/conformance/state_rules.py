"""EtherCAT state machine: transitions, refusals with their AL status code, acknowledgement.

Sources: ETG.1000.6 clauses 5.3 (AL status codes, table 11) and 6.4 (state machine); ETG.1020 clause
5.3.7.2 (times). No process data are exchanged, and the slave is left in Pre-Op.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable

from drivers.conformance.rule import Outcome, Rule, hexadecimal, judged, not_testable
from drivers.conformance.subject import AlAnswer, AlStates, Subject
from drivers.doctor.diagnosis import Fact

_CLAUSE = "ETG.1000.6 6.4"
_INIT, _PREOP, _OP, _NO_STATE = 1, 2, 8, 5
_ERROR = 0x10
_INVALID_CHANGE, _UNKNOWN_STATE = 0x0011, 0x0012


async def _to_preop(states: AlStates, station: int) -> AlAnswer:
    """Go to Pre-Op without an error, by way of Init from any other state."""
    answer = await states.request(station, _PREOP | _ERROR)
    if answer.state != _PREOP:
        await states.request(station, _INIT | _ERROR)
        answer = await states.request(station, _PREOP)
    return answer


def _shown(answer: AlAnswer, state: int, code: int) -> Outcome:
    return judged(
        (answer.state, answer.code) == (state, code),
        Fact("al_state", hexadecimal(answer.state, 2), hexadecimal(state, 2)),
        Fact("al_status", hexadecimal(answer.code, 4), hexadecimal(code, 4)),
    )


async def _up_and_down(subject: Subject) -> Outcome:
    states = subject.states
    if states is None:
        return not_testable()
    await _to_preop(states, subject.station)
    down = await states.request(subject.station, _INIT)
    up = await states.request(subject.station, _PREOP)
    if down.state != _INIT:
        return _shown(down, _INIT, 0)
    return _shown(up, _PREOP, 0)


async def _refused(subject: Subject, control: int, code: int) -> Outcome:
    """Check for Pre-Op with the error bit and ``code``; then return to Pre-Op without them."""
    states = subject.states
    if states is None:
        return not_testable()
    before = await _to_preop(states, subject.station)
    if before.state != _PREOP:
        return not_testable(Fact("al_state", hexadecimal(before.state, 2), "02h"))
    answer = await states.request(subject.station, control)
    await _to_preop(states, subject.station)
    return _shown(answer, _PREOP | _ERROR, code)


async def _op_from_preop(subject: Subject) -> Outcome:
    return await _refused(subject, _OP, _INVALID_CHANGE)


async def _unknown_state(subject: Subject) -> Outcome:
    return await _refused(subject, _NO_STATE, _UNKNOWN_STATE)


async def _acknowledged(subject: Subject) -> Outcome:
    """Check that the error bit remains until it is acknowledged by bit 4 of the AL control."""
    states = subject.states
    if states is None:
        return not_testable()
    await _to_preop(states, subject.station)
    refused = await states.request(subject.station, _OP)
    if not refused.state & _ERROR:
        await _to_preop(states, subject.station)
        return not_testable(Fact("al_state", hexadecimal(refused.state, 2), "12h"))
    answer = await states.request(subject.station, _PREOP | _ERROR)
    await _to_preop(states, subject.station)
    return _shown(answer, _PREOP, 0)


def _rule(code: str, clause: str, check: Callable[[Subject], Awaitable[Outcome]]) -> Rule:
    return Rule(code, clause, check, ("ethercat",), changes=True)


_CODES = f"{_CLAUSE}, 5.3 table 11"
RULES = (
    _rule("conformance.states-up-and-down", f"{_CLAUSE}; ETG.1020 5.3.7.2", _up_and_down),
    _rule("conformance.states-op-from-preop", _CODES, _op_from_preop),
    _rule("conformance.states-unknown", _CODES, _unknown_state),
    _rule("conformance.states-acknowledged", _CLAUSE, _acknowledged),
)
