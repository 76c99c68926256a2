"""What ends a measurement: something that was asked of the axis, or others."""

from __future__ import annotations

from backend.axis.axis import Axis
from backend.axis.cyclic import CyclicSession
from backend.scales.words import halt_remedy, halt_words
from drivers.cia402 import State
from drivers.errors import DriveError, LinkLost, NotAllowed, motion_halted
from drivers.halt import ENVELOPE_CAUSES, HaltCause, Halted
from drivers.texts.message import text
from drivers.texts.states import state_text

#: Ends that the loop makes by itself for what a tool has asked of the axis. A smaller motion or
#: other gains may mend them; nothing mends any other end but a person.
_OF_THE_MOTION = ENVELOPE_CAUSES | {HaltCause.EXPIRED}
_LOOK = text("measuring.look-why-it-ended")


class Interrupted(NotAllowed):
    """The drive, a switch or a person ended the motion, or did not let it begin.

    No work in progress tries anything else then: an emergency stop that was pressed and is
    released again must not let an axis move by itself (ISO 13850). ``halt`` is how the loop ended
    the motion; None where none had begun.
    """

    halt: Halted | None = None


def interrupted(error: NotAllowed) -> Interrupted:
    """The same, as an end that nothing else may be tried after."""
    return Interrupted(
        error.text,
        drive=error.drive,
        parameter=error.parameter,
        value=error.value,
        limit=error.limit_text,
        remedy=error.remedy_text,
    )


def interrupted_by(axis: Axis, halt: Halted) -> Interrupted:
    """A halt of this axis that nothing else may be tried after."""
    name, words = axis.drive.name, halt_words(halt, axis.known_units)
    error = Interrupted(
        "motion.halted", drive=name, where=name, cause=words, remedy=halt_remedy(halt, _LOOK)
    )
    error.halt = halt
    return error


def require_held(axis: Axis, session: CyclicSession) -> None:
    """Disabled by others after its last sample, it must not be enabled again to go home either."""
    power = session.power()
    halt = None if power is None else power.axis_state(session.station(axis.drive)).halted
    if halt is not None and halt.cause is HaltCause.LEFT_ENABLED:
        raise interrupted_by(axis, halt)


async def require_enabled(axis: Axis) -> None:
    """What is read of a standing axis counts only if its loop has held it all the time.

    Raises:
        Interrupted: it is disabled meanwhile.
    """
    state = await axis.state()
    if state is not State.OPERATION_ENABLED:
        raise interrupted_by(axis, Halted(HaltCause.LEFT_ENABLED, note=state_text(state)))


async def ends_all(axis: Axis, error: DriveError) -> bool:
    """Whether work must end with this error, whatever else it could try."""
    if isinstance(error, Interrupted | LinkLost):
        return True
    return await axis.state() in (State.FAULT, State.FAULT_REACTION)


def raise_if_ended(axis: Axis, session: CyclicSession) -> None:
    """Raise with the reason when the loop has ended the motion by force.

    Raises:
        MotionHalted: by what was asked of the axis; `EnvelopeExceeded` for a limit.
        Interrupted: by something else.
        LinkLost: nothing is exchanged any more.
    """
    power, name = session.power(), axis.drive.name
    halt = None if power is None else power.axis_state(session.station(axis.drive)).halted
    if halt is not None:
        if halt.cause in _OF_THE_MOTION:
            raise motion_halted(
                name,
                halt,
                words=halt_words(halt, axis.known_units),
                drive=name,
                remedy="measuring.check-then-widen",
            )
        raise interrupted_by(axis, halt)
    if not session.running:
        raise LinkLost("measuring.cyclic-exchange-ended-during", drive=name)
