"""The single error hierarchy of servodeck.

::

    DriveError
    ├── LinkTimeout      no answer in time; the outcome of a write is unknown
    │   └── NotAsked     not sent: the drive has not answered since an earlier time-out
    ├── LinkLost         the wire or adapter is gone; the drive cannot be reached
    ├── ProtocolError    an answer came that the protocol does not allow
    ├── Rejected         the drive understood and refused (abort or exception code)
    ├── OutOfRange       the value does not fit the parameter; nothing was sent
    ├── NotAllowed       access, state or permission forbids it; nothing was sent
    │   ├── NotInUse     the entry lies beyond the count that the drive reports
    │   └── MotionHalted the cyclic loop ended the motion by force; ``halt`` states why
    │       └── EnvelopeExceeded  a limit of the envelope was passed
    └── Busy             somebody or something else holds the axis or the bus

Each driver translates third-party exceptions to these once, where it calls the library.
"""

from __future__ import annotations

from enum import Enum

from drivers.halt import ENVELOPE_CAUSES, HaltCause, Halted
from drivers.texts.message import Param, Text, as_text, joined, prose, reason_of, text


class DriveError(Exception):
    """Base of all errors about drives.

    ``text`` states what happened: a catalogue code with its parameters, without words. ``drive``,
    ``parameter``, ``value`` and ``limit`` are facts that a user needs in any language; ``drive`` is
    its name, or a message with its place on the bus where a link does not know the name;
    `advice_text` states what to do next. `message`, `remedy` and `advice` are these in English.
    """

    kind = "drive-error"
    #: Code of the usual remedy for this kind of error where no more specific one is known.
    usual_remedy: str | None = None

    def __init__(
        self,
        code: str | Text,
        /,
        *,
        drive: str | Text | None = None,
        parameter: str | None = None,
        value: object = None,
        limit: str | Text | None = None,
        remedy: str | Text | None = None,
        **params: Param,
    ) -> None:
        super().__init__(code)
        named = {"drive": drive, "parameter": parameter, "value": _fact(value), "limit": limit}
        facts: dict[str, Param] = {name: fact for name, fact in named.items() if fact is not None}
        self.text = as_text(code, facts | params)
        self.drive = drive
        self.parameter = parameter
        self.value = value
        #: Allowed values: a message, or figures, names and forms, which are not translated.
        self.limit_text = prose(limit) if isinstance(limit, str) else limit
        #: What to do about it, where this differs from the catalogue's remedy for the code.
        self.own_remedy = as_text(remedy, self.text.params) if remedy else None

    @property
    def code(self) -> str:
        """Catalogue code of what happened; empty for text from third parties."""
        return self.text.code

    @property
    def limit(self) -> str | None:
        """The allowed values, in English."""
        return None if self.limit_text is None else self.limit_text.words()

    @property
    def message(self) -> str:
        """What happened, in English."""
        return self.text.words()

    @property
    def remedy_text(self) -> Text | None:
        """What to do about it; None if no remedy is known for this particular error."""
        return self.own_remedy or self.text.remedy()

    @property
    def remedy(self) -> str | None:
        """What to do about it, in English."""
        known = self.remedy_text
        return None if known is None else known.words()

    @property
    def advice_text(self) -> Text | None:
        """What to do next: the most specific remedy known."""
        if (known := self.remedy_text) is not None:
            return known
        usual = self.usual_remedy or ("error.within-limit" if self.limit_text else None)
        return None if usual is None else as_text(usual, self.text.params)

    @property
    def advice(self) -> str | None:
        """What to do next, in English."""
        known = self.advice_text
        return None if known is None else known.words()

    def at(self, drive: str | Text | None = None, parameter: str | None = None) -> DriveError:
        """Fill in the drive or parameter if not set by a lower layer; return the error."""
        self.drive = self.drive or drive
        self.parameter = self.parameter or parameter
        return self

    def __str__(self) -> str:
        return self.message


def internal_error(error: Exception) -> Text:
    """Return the message for an error in servodeck itself, with Python's name and text of it."""
    return text("error.internal", kind=type(error).__name__, detail=str(error))


def why_of(error: Exception) -> Text:
    """Return an error as a message: its code for our own, its original text for any other."""
    return error.text if isinstance(error, DriveError) else reason_of(error)


def with_remedy(error: DriveError) -> Text:
    """Return what happened together with its remedy, if one is known."""
    remedy = error.remedy_text
    return error.text if remedy is None else joined((error.text, remedy))


def _fact(value: object) -> Param:
    """Convert a value to a parameter of a message."""
    if value is None or isinstance(value, (str, int, float, Enum, Text)):
        return value
    return str(value)


class LinkTimeout(DriveError):
    """No answer in time. A timed-out write has an unknown outcome and must be read back."""

    kind = "link-timeout"
    usual_remedy = "error.link-timeout"


class NotAsked(LinkTimeout):
    """The request was not sent, as the drive has not answered since an earlier time-out."""


class LinkLost(DriveError):
    """The wire or the adapter is gone."""

    kind = "link-lost"
    usual_remedy = "error.link-lost"


class ProtocolError(DriveError):
    """An answer that the protocol does not allow: wrong CRC, length or toggle bit."""

    kind = "protocol-error"
    usual_remedy = "error.protocol-error"


class Rejected(DriveError):
    """The drive refused. ``abort_code`` is the SDO abort code or Modbus exception code."""

    kind = "rejected"

    def __init__(
        self,
        code: str | Text,
        /,
        *,
        abort_code: int,
        drive: str | Text | None = None,
        parameter: str | None = None,
        value: object = None,
        limit: str | Text | None = None,
        remedy: str | Text | None = None,
        **params: Param,
    ) -> None:
        super().__init__(
            as_text(
                code,
                {"drive": drive, "parameter": parameter, "value": _fact(value), "limit": limit,
                 "abort_code": abort_code, **params},
            ),
            drive=drive, parameter=parameter, value=value, limit=limit, remedy=remedy,
        )  # fmt: skip
        self.abort_code = abort_code


class OutOfRange(DriveError):
    """The value is not valid for this parameter."""

    kind = "out-of-range"


class NotAllowed(DriveError):
    """Read-only, wrong state, missing permission or unmet precondition.

    ``names_faults``: the message already lists the active faults of the drive.
    """

    kind = "not-allowed"
    names_faults = False


class NotInUse(NotAllowed):
    """An entry of a list beyond the count that the drive reports; it holds nothing to read."""

    kind = "not-in-use"


class MotionHalted(NotAllowed):
    """The cyclic loop ended a motion by force. Code that decides by the cause reads ``halt``."""

    def __init__(
        self,
        code: str | Text,
        /,
        *,
        halt: Halted,
        drive: str | Text | None = None,
        remedy: str | Text | None = None,
        **params: Param,
    ) -> None:
        super().__init__(as_text(code, {"drive": drive, **params}), drive=drive, remedy=remedy)
        self.halt = halt


class EnvelopeExceeded(MotionHalted):
    """A limit of the motion envelope was passed, so the axis was braked and disabled."""


def motion_halted(
    where: str | Text,
    halt: Halted,
    *,
    words: Text | str | None = None,
    drive: str | Text | None = None,
    remedy: str | Text | None = None,
) -> MotionHalted:
    """Create the error for a halt of ``where``, the name of a station or a drive.

    ``words`` states the cause in the units of the axis, where these are known.
    """
    kind = EnvelopeExceeded if halt.cause in ENVELOPE_CAUSES else MotionHalted
    return kind(
        "motion.halted",
        where=where,
        cause=words or halt.text,
        halt=halt,
        drive=drive,
        remedy=remedy,
    )


def exceeded(error: DriveError) -> HaltCause | None:
    """Return the envelope limit that ended a motion with this error; None for any other error."""
    return error.halt.cause if isinstance(error, EnvelopeExceeded) else None


class Busy(DriveError):
    """The axis or bus is held by another job, person or transaction."""

    kind = "busy"
