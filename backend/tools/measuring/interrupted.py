"""Classification of the ends of a motion: by what the tool commanded, or by others."""

from __future__ import annotations

from backend.axes.axis.axis import Axis
from backend.axes.axis.cyclic import CyclicSession
from backend.axes.scales.words import halt_remedy, halt_words
from drivers.cia402 import State
from drivers.errors import DriveError, LinkLost, NotAllowed, motion_halted
from drivers.halt import ENVELOPE_CAUSES, HaltCause, Halted
from drivers.texts.message import text
from drivers.texts.states import state_text

#: Ends caused by the commanded motion itself. A smaller motion or other gains may avoid them; any
#: other end requires a person.
_OF_THE_MOTION = ENVELOPE_CAUSES | {HaltCause.EXPIRED}
_LOOK = text("measuring.look-why-it-ended")


class Interrupted(NotAllowed):
    """The drive, a switch or a person ended the motion, or prevented its start.

    Work in progress must not try anything else then: after an emergency stop has been pressed and
    released again, an axis must not move by itself (ISO 13850). ``halt`` is how the loop ended the
    motion; None where none had begun.
    """

    halt: Halted | None = None


def interrupted(error: NotAllowed) -> Interrupted:
    """Convert an error into one after which nothing else may be tried."""
    return Interrupted(
        error.text,
        drive=error.drive,
        parameter=error.parameter,
        value=error.value,
        limit=error.limit_text,
        remedy=error.remedy_text,
    )


def interrupted_by(axis: Axis, halt: Halted) -> Interrupted:
    """Error for a halt of this axis after which nothing else may be tried."""
    name, words = axis.drive.name, halt_words(halt, axis.known_units)
    error = Interrupted(
        "motion.halted", drive=name, where=name, cause=words, remedy=halt_remedy(halt, _LOOK)
    )
    error.halt = halt
    return error


def require_held(axis: Axis, session: CyclicSession) -> None:
    """Check that nobody disabled the axis after its last sample; it must not be enabled again then.

    Raises:
        Interrupted: it was disabled by others.
    """
    power = session.power()
    halt = None if power is None else power.axis_state(session.station(axis.drive)).halted
    if halt is not None and halt.cause is HaltCause.LEFT_ENABLED:
        raise interrupted_by(axis, halt)


async def require_enabled(axis: Axis) -> None:
    """Check that the axis is still enabled, so that readings at standstill are valid.

    Raises:
        Interrupted: it was disabled meanwhile.
    """
    state = await axis.state()
    if state is not State.OPERATION_ENABLED:
        raise interrupted_by(axis, Halted(HaltCause.LEFT_ENABLED, note=state_text(state)))


async def ends_all(axis: Axis, error: DriveError) -> bool:
    """Whether work must end with this error, whatever alternatives remain."""
    if isinstance(error, Interrupted | LinkLost):
        return True
    return await axis.state() in (State.FAULT, State.FAULT_REACTION)


def raise_if_ended(axis: Axis, session: CyclicSession) -> None:
    """Raise the reason if the loop has ended the motion.

    Raises:
        MotionHalted: caused by the commanded motion; `EnvelopeExceeded` for a limit.
        Interrupted: caused by something else.
        LinkLost: the cyclic exchange has ended.
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
