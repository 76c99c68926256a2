"""Whether a value may be written to a parameter, judged before a byte leaves."""

from __future__ import annotations

from drivers.codec import encode
from drivers.errors import DriveError, NotAllowed, OutOfRange
from profiles.schema import Parameter, Raw


def checked(drive: str, parameter: Parameter, raw: Raw) -> Raw:
    """A raw value as it will be written to this parameter of the drive of this name.

    Raises:
        NotAllowed: read-only.
        OutOfRange: wrong type, outside the limits, or not one of the enumerated values.
    """
    label = f"{drive}: {parameter.key} {parameter.name}"
    if parameter.access == "ro":
        raise NotAllowed(
            f"{label} is read-only",
            drive=drive,
            parameter=parameter.key,
            value=raw,
            remedy="it only shows what the drive measures or has worked out; change the setting "
            "that it follows from",
        )
    if isinstance(raw, str) != (parameter.type in ("STRING", "OCTETS")):
        raise OutOfRange(
            f"{label}: {raw!r} is not a {parameter.type}",
            drive=drive,
            parameter=parameter.key,
            value=raw,
            remedy=f"give a value of type {parameter.type}",
        )
    if isinstance(raw, str):
        _encodes(drive, parameter, raw)
        return raw
    low, high = parameter.raw_limits
    if (low is not None and raw < low) or (high is not None and raw > high):
        limits = f"{_shown(parameter, low)} to {_shown(parameter, high)}"
        raise OutOfRange(
            f"{label}: {_shown(parameter, raw)} is outside {limits}",
            drive=drive,
            parameter=parameter.key,
            value=raw,
            limit=limits,
            remedy=f"choose a value from {limits}",
        )
    _encodes(drive, parameter, raw)
    if parameter.enum and not parameter.bits and int(raw) not in parameter.enum:
        choices = ", ".join(f"{code} ({text})" for code, text in parameter.enum.items())
        raise OutOfRange(
            f"{label}: {raw} is none of its values: {choices}",
            drive=drive,
            parameter=parameter.key,
            value=raw,
            limit=choices,
            remedy="choose one of the listed values",
        )
    return raw


def named(
    drive: str, error: DriveError, parameter: Parameter, value: Raw | None = None
) -> DriveError:
    """The same error, naming drive and parameter in its text."""
    # A link names the node; the person knows the drive by the name on the bench. What was raised
    # for this drive already has its name in the text.
    anonymous, error.drive = error.drive != drive, drive
    error.at(parameter=parameter.key)
    if value is not None and error.value is None:
        error.value = value
    prefix = f"{drive}: {parameter.key} {parameter.name}: "
    if anonymous:
        error.message = prefix + error.message
        error.args = (error.message,)
    return error


def _encodes(drive: str, parameter: Parameter, raw: Raw) -> None:
    try:
        encode(parameter.type, raw)
    except OutOfRange as error:
        raise named(drive, error, parameter) from error


def _shown(parameter: Parameter, raw: Raw | None) -> str:
    if raw is None:
        return "no limit"
    try:
        value = parameter.to_value(raw)
    except OverflowError:
        return "a number beyond all measure"
    unit = f" {parameter.unit}" if parameter.unit else ""
    return f"{value}{unit}" if value == raw else f"{value}{unit} (raw {raw})"
