"""A motion ends with the right to move of whoever began it: token, session, role, account."""

from __future__ import annotations

import asyncio

import pytest

from backend.foundation.people.identity import Actor, Identity, acting
from backend.foundation.people.rights import Right, Role
from backend.foundation.work.jobs import Job
from drivers.cia402 import Mode, State
from tests.support.guarded import PASSWORD, Caller, GuardedServer, begin_motion


def identity_of(server: GuardedServer, caller: Caller) -> Identity:
    found = server.call(lambda: server.people.identify(caller.cookie, caller.token))
    assert found is not None
    return found


def begin(server: GuardedServer, caller: Caller) -> Job:
    return begin_motion(server, identity_of(server, caller))


def require_ended(server: GuardedServer, job: Job) -> None:
    server.run(asyncio.wait_for(job.wait(), 5.0))
    assert job.state == "cancelled"
    assert server.call(lambda: server.bench.authority.grant_of("x")) is None


def test_a_revoked_token_ends_the_motion(guarded: GuardedServer) -> None:
    script = guarded.token(Role.OPERATOR, Right.LOOK, Right.MOTION)
    job = begin(guarded, script)
    token = identity_of(guarded, script).session
    guarded.log_in(Role.OPERATOR).ok("DELETE", f"/tokens/{token}")
    require_ended(guarded, job)


def test_a_lower_role_ends_the_motion(guarded: GuardedServer) -> None:
    job = begin(guarded, guarded.log_in(Role.OPERATOR))
    account = guarded.people.accounts.directory.find("Olaf")
    assert account is not None
    guarded.run(guarded.people.accounts.set_role(account.id, Role.VIEWER))
    require_ended(guarded, job)


def test_a_role_that_may_still_move_ends_nothing(guarded: GuardedServer) -> None:
    guarded.run(guarded.people.accounts.add("Ada", PASSWORD, Role.ADMINISTRATOR))
    job = begin(guarded, guarded.log_in(Role.ADMINISTRATOR))
    account = guarded.people.accounts.directory.find("Anna")
    assert account is not None
    guarded.run(guarded.people.accounts.set_role(account.id, Role.OPERATOR))
    assert job.state == "running"
    assert guarded.call(lambda: guarded.bench.authority.mover_of("x")) is not None
    guarded.run(guarded.people.accounts.remove(account.id))
    require_ended(guarded, job)


@pytest.mark.long
def test_the_motion_of_another_goes_on(guarded: GuardedServer) -> None:
    job = begin(guarded, guarded.log_in(Role.OPERATOR))
    other = guarded.token(Role.ADMINISTRATOR, Right.MOTION)
    token = identity_of(guarded, other).session
    guarded.log_in(Role.ADMINISTRATOR).ok("DELETE", f"/tokens/{token}")
    assert job.state == "running"
    guarded.run(guarded.bench.jobs.cancel(job))


def test_an_axis_left_enabled_loses_its_power_with_the_token(guarded: GuardedServer) -> None:
    script = guarded.token(Role.OPERATOR, Right.LOOK, Right.MOTION)
    identity, axis = identity_of(guarded, script), guarded.connected.axis

    async def enabling() -> None:
        acting.set(Actor(identity))
        await axis.transition(State.OPERATION_ENABLED, Mode.PV)

    async def off() -> None:
        while await axis.state() is State.OPERATION_ENABLED:  # noqa: ASYNC110 - no event
            await asyncio.sleep(0.02)

    guarded.run(enabling())
    assert guarded.run(axis.state()) is State.OPERATION_ENABLED
    guarded.log_in(Role.OPERATOR).ok("DELETE", f"/tokens/{identity.session}")
    guarded.run(asyncio.wait_for(off(), 5.0))
