"""The one error tree of servodeck.

::

    DriveError
    ├── LinkTimeout      no answer in time; the outcome of a write is unknown
    │   └── NotAsked     not sent at all: the drive had left what came before unanswered
    ├── LinkLost         the wire or adapter is gone; nothing reaches the drive
    ├── ProtocolError    an answer came that the protocol does not allow
    ├── Rejected         the drive understood and refused (abort or exception code)
    ├── OutOfRange       the value does not fit the parameter; nothing was sent
    ├── NotAllowed       access, state or permission forbids it; nothing was sent
    │   ├── NotInUse     the drive's own count leaves this entry out
    │   └── MotionHalted the cyclic loop ended the motion by force; ``halt`` says why
    │       └── EnvelopeExceeded  a limit of the envelope was passed
    └── Busy             somebody or something else holds the axis or the bus

Third-party exceptions are translated to these once, at the driver's edge.
"""

from __future__ import annotations

from drivers.halt import ENVELOPE_CAUSES, HaltCause, Halted


class DriveError(Exception):
    """Base of all errors about drives.

    Attributes name what a user needs: which drive, which parameter, which value, which limit
    and what to do next (``remedy``). All are optional and already part of the message.
    """

    kind = "drive-error"
    #: What helps against this kind of error where `remedy` says nothing nearer.
    usual_remedy: str | None = None

    def __init__(
        self,
        message: str,
        *,
        drive: str | None = None,
        parameter: str | None = None,
        value: object = None,
        limit: str | None = None,
        remedy: str | None = None,
    ) -> None:
        super().__init__(message)
        self.message = message
        self.drive = drive
        self.parameter = parameter
        self.value = value
        self.limit = limit
        self.remedy = remedy

    @property
    def advice(self) -> str | None:
        """What to do next: the nearest remedy that is known."""
        if self.remedy or self.usual_remedy:
            return self.remedy or self.usual_remedy
        return "choose a value within the limit" if self.limit else None

    def at(self, drive: str | None = None, parameter: str | None = None) -> DriveError:
        """The same error with the drive or parameter filled in where it was not known below."""
        self.drive = self.drive or drive
        self.parameter = self.parameter or parameter
        return self


class LinkTimeout(DriveError):
    """No answer in time. A timed-out write has an unknown outcome and must be read back."""

    kind = "link-timeout"
    usual_remedy = "check supply and cable, then try again; read back what was being written"


class NotAsked(LinkTimeout):
    """Nothing was asked, as the drive has not answered since an earlier time-out."""


class LinkLost(DriveError):
    """The wire or the adapter is gone."""

    kind = "link-lost"
    usual_remedy = (
        "check the cable and the adapter or interface; the link is taken up again by itself"
    )


class ProtocolError(DriveError):
    """An answer that the protocol does not allow: bad CRC, wrong length, wrong toggle bit."""

    kind = "protocol-error"
    usual_remedy = "try again; if it stays, check shield, termination and the line's settings"


class Rejected(DriveError):
    """The drive refused. ``code`` is the SDO abort code or Modbus exception code."""

    kind = "rejected"

    def __init__(
        self,
        message: str,
        *,
        code: int,
        drive: str | None = None,
        parameter: str | None = None,
        value: object = None,
        limit: str | None = None,
        remedy: str | None = None,
    ) -> None:
        super().__init__(
            message, drive=drive, parameter=parameter, value=value, limit=limit, remedy=remedy
        )
        self.code = code


class OutOfRange(DriveError):
    """The value cannot be a value of this parameter."""

    kind = "out-of-range"


class NotAllowed(DriveError):
    """Read-only, wrong state, missing permission or unmet precondition.

    ``names_faults``: the message already names the faults that the drive has.
    """

    kind = "not-allowed"
    names_faults = False


class NotInUse(NotAllowed):
    """An entry of a list beyond the count that the drive tells: there is nothing to be read."""

    kind = "not-in-use"


class MotionHalted(NotAllowed):
    """The cyclic loop ended a motion by force. ``halt`` is the cause, to decide by."""

    def __init__(
        self, message: str, *, halt: Halted, drive: str | None = None, remedy: str | None = None
    ) -> None:
        super().__init__(message, drive=drive, remedy=remedy)
        self.halt = halt


class EnvelopeExceeded(MotionHalted):
    """A limit of the motion envelope was passed, so the axis was braked and disabled."""


def motion_halted(
    where: str,
    halt: Halted,
    *,
    words: str | None = None,
    drive: str | None = None,
    remedy: str | None = None,
) -> MotionHalted:
    """The error for a halt of ``where``, a station or a drive by name.

    ``words`` are those in the units of the axis, where they are known.
    """
    kind = EnvelopeExceeded if halt.cause in ENVELOPE_CAUSES else MotionHalted
    return kind(f"{where}: {words or halt.words}", halt=halt, drive=drive, remedy=remedy)


def exceeded(error: DriveError) -> HaltCause | None:
    """The limit of the envelope that ended a motion with this error; None for any other error."""
    return error.halt.cause if isinstance(error, EnvelopeExceeded) else None


class Busy(DriveError):
    """Held by another job, person or transaction."""

    kind = "busy"
