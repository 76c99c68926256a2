"""Nothing of a guest's moves or keeps its power without the button, the grant and the axis."""

from __future__ import annotations

import asyncio

import pytest

from backend.foundation.people.identity import Actor, Identity, acting
from backend.foundation.people.rights import Right, Role
from backend.foundation.work.jobs import Job
from backend.tools.moving.jog.release import END_OF_ENABLING
from drivers.cia402 import Mode, State
from drivers.texts.message import text
from tests.support.guarded import GuardedServer, begin_motion

_ENDED = text("people.end-by-person", person="Olaf")
_RELEASED = END_OF_ENABLING["released"]

MOVES = frozenset({Right.MEASURE, Right.MOTION})


@pytest.fixture
def invitation(guarded: GuardedServer) -> str:
    """Of a guest who has the grant to move x; the button is held for as long as a test lasts."""
    operator = guarded.log_in(Role.OPERATOR)
    _guest, made = guarded.guest(operator, ["parameters", "measure", "motion"])

    def hold() -> None:
        support = guarded.people.support
        support.grant(made, "Olaf", MOVES, 600.0, "x")
        support.press(made, "page on site")
        support._holds[made] = ("page on site", support._ticks() + 600.0)

    guarded.call(hold)
    return made


def identity_of(server: GuardedServer, invitation: str) -> Identity:
    support = server.people.support
    return server.call(lambda: support.identity(support.find(invitation)))


def leave_enabled(server: GuardedServer, identity: Identity, connection: str | None) -> None:
    async def enabling() -> None:
        acting.set(Actor(identity, connection))
        await server.connected.axis.transition(State.OPERATION_ENABLED, Mode.PV)

    server.run(enabling())
    assert server.run(server.connected.axis.state()) is State.OPERATION_ENABLED


def require_power_off(server: GuardedServer) -> None:
    async def off() -> None:
        while await server.connected.axis.state() is State.OPERATION_ENABLED:  # noqa: ASYNC110
            await asyncio.sleep(0.02)

    server.run(asyncio.wait_for(off(), 5.0))


def require_ended(server: GuardedServer, job: Job) -> None:
    server.run(asyncio.wait_for(job.wait(), 5.0))
    assert job.state == "cancelled"
    assert server.call(lambda: server.bench.authority.mover_of("x")) is None


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(
    ("rights", "drive"),
    [(frozenset({Right.PARAMETERS}), "x"), (frozenset({Right.MEASURE}), None), (MOVES, "y")],
    ids=["without moving", "without one of both", "another axis"],
)
def test_a_smaller_grant_in_place_of_the_old_one_ends_the_motion(
    guarded: GuardedServer, invitation: str, rights: frozenset[Right], drive: str | None
) -> None:
    job = begin_motion(guarded, identity_of(guarded, invitation))
    support = guarded.people.support
    guarded.call(lambda: support.grant(invitation, "Olaf", rights, 600.0, drive))
    require_ended(guarded, job)
    assert not guarded.call(lambda: support.enabled(invitation))


def test_a_longer_or_larger_grant_lets_it_go_on(guarded: GuardedServer, invitation: str) -> None:
    job = begin_motion(guarded, identity_of(guarded, invitation))
    support = guarded.people.support
    more = MOVES | {Right.PARAMETERS}
    guarded.call(lambda: support.grant(invitation, "Olaf", more, 1200.0, None))
    guarded.run(asyncio.sleep(0.1))
    assert job.state == "running"
    assert guarded.call(lambda: support.enabled(invitation))
    guarded.run(guarded.bench.jobs.cancel(job))


def test_a_visit_that_ends_in_a_dwell_ends_it(guarded: GuardedServer, invitation: str) -> None:
    job = begin_motion(guarded, identity_of(guarded, invitation))
    guarded.call(lambda: guarded.people.support.revoke(invitation, _ENDED))
    require_ended(guarded, job)


@pytest.mark.long
@pytest.mark.parametrize("connection", [None, "page-of-guest"])
def test_an_axis_that_a_guest_left_enabled_loses_its_power_with_the_button(
    guarded: GuardedServer, invitation: str, connection: str | None
) -> None:
    """Whether or not the guest took control of the axis: nobody else had it."""
    leave_enabled(guarded, identity_of(guarded, invitation), connection)
    support = guarded.people.support
    guarded.call(lambda: support.release(invitation, "page on site", _RELEASED))
    require_power_off(guarded)


def test_an_axis_that_somebody_else_left_enabled_keeps_its_power(
    guarded: GuardedServer, invitation: str
) -> None:
    operator = guarded.log_in(Role.OPERATOR)
    identity = guarded.call(lambda: guarded.people.identify(operator.cookie, None))
    assert identity is not None
    leave_enabled(guarded, identity, None)
    support = guarded.people.support
    guarded.call(lambda: support.release(invitation, "page on site", _RELEASED))
    guarded.run(asyncio.sleep(0.3))
    assert guarded.run(guarded.connected.axis.state()) is State.OPERATION_ENABLED
