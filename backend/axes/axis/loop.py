"""Commands to the loop of a cyclic exchange under a grant: enabling, modes and trajectories."""

from __future__ import annotations

from typing import TYPE_CHECKING

from backend.axes.motion.grant import Grant
from drivers.cia402 import Mode, State
from drivers.errors import NotAllowed
from drivers.link import Coupled, OwnsPowerState, Trajectory

if TYPE_CHECKING:
    from backend.axes.axis.cyclic import CyclicSession
    from backend.axes.drive.drive import Drive


async def drive_to(
    session: CyclicSession, drive: Drive, goal: State, mode: Mode | None, grant: Grant
) -> None:
    """Have the loop change the power state, also to Operation enabled, and choose a mode.

    Raises:
        NotGranted: the grant is not for this axis, or has ended.
        NotAllowed: the exchange does not own the power states.
    """
    drive.require_grant(grant, drive.require("control_word"))
    number = None if mode is None else int(mode)
    await _owner(session, drive).drive_to(session.station(drive), goal, number)


async def give_back_mode(session: CyclicSession, drive: Drive, mode: int, grant: Grant) -> None:
    """Have the loop write the mode that the drive had before the motion, with the power off.

    Raises:
        NotGranted: the grant is not for this axis.
    """
    drive.require_grant(grant, drive.require("mode"), restores=True)
    off = State.SWITCH_ON_DISABLED
    await _owner(session, drive).drive_to(session.station(drive), off, mode)


async def lower(session: CyclicSession, drive: Drive, goal: State) -> None:
    """Have the loop go to a power state without power at the motor; needs no grant.

    Raises:
        ValueError: the motor has power in this state.
    """
    if goal is State.OPERATION_ENABLED:
        raise ValueError("Operation enabled needs a grant")
    await _owner(session, drive).drive_to(session.station(drive), goal)


async def play(session: CyclicSession, drive: Drive, trajectory: Trajectory, grant: Grant) -> int:
    """Play a trajectory of setpoints in the loop; see `drivers.link.Cyclic.play`.

    Raises:
        NotGranted: the grant is not for this axis, or has ended.
    """
    drive.require_grant(grant, drive.require("control_word"))
    return await session.cyclic.play([trajectory])


async def play_pair(
    session: CyclicSession,
    drives: tuple[Drive, Drive],
    pair: tuple[Trajectory, Trajectory],
    coupled: Coupled,
    grants: tuple[Grant, Grant],
) -> int:
    """Play trajectories for two axes of one machine in the loop; see `drivers.link.PlaysPairs`.

    Raises:
        NotGranted: a grant is not for its axis, or has ended.
        NotAllowed: the loop of this bus moves single axes only.
    """
    for drive, grant in zip(drives, grants, strict=True):
        drive.require_grant(grant, drive.require("control_word"))
    if session.cyclic.pairs is None:
        raise NotAllowed("axis.bus-moves-single-axes", url=session.link.url)
    return await session.cyclic.pairs.play_pair(pair, coupled)


def _owner(session: CyclicSession, drive: Drive) -> OwnsPowerState:
    power = session.power()
    if power is None:
        raise NotAllowed("axis.exchange-not-power-states", drive=drive.name)
    return power
