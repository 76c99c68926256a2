"""Check on the host whether a value may be written to a parameter."""

from __future__ import annotations

from drivers.errors import DriveError, NotAllowed, OutOfRange
from drivers.objects.codec import encode
from drivers.texts.message import Text, joined, profile_text, text
from profiles.schema import Parameter, Raw


def checked(drive: str, family: str, parameter: Parameter, raw: Raw) -> Raw:
    """Check a raw value and return it as it will be written.

    ``drive`` is the drive's name, ``family`` that of its profile.

    Raises:
        NotAllowed: the parameter is read-only.
        OutOfRange: wrong type, outside the limits, or not one of the enumerated values.
    """
    name = profile_text(family, parameter.name)
    label = text("drive.label", drive=drive, parameter=parameter.key, name=name)
    if parameter.access == "ro":
        raise NotAllowed("drive.read", drive=drive, parameter=parameter.key, value=raw, label=label)
    if isinstance(raw, str) != (parameter.type in ("STRING", "OCTETS")):
        raise OutOfRange(
            "drive.not",
            drive=drive,
            parameter=parameter.key,
            value=raw,
            label=label,
            type=parameter.type,
        )
    if isinstance(raw, str):
        _encodes(drive, family, parameter, raw)
        return raw
    low, high = parameter.raw_limits
    if (low is not None and raw < low) or (high is not None and raw > high):
        limits = text("limit.from-to", low=_shown(parameter, low), high=_shown(parameter, high))
        raise OutOfRange(
            "drive.outside",
            drive=drive,
            parameter=parameter.key,
            value=raw,
            limit=limits,
            label=label,
            shown=_shown(parameter, raw),
        )
    _encodes(drive, family, parameter, raw)
    if parameter.enum and not parameter.bits and int(raw) not in parameter.enum:
        choices = joined(
            (
                text("limit.choice", number=code, meaning=profile_text(family, meaning))
                for code, meaning in parameter.enum.items()
            ),
            ", ",
        )
        raise OutOfRange(
            "drive.none-values",
            drive=drive,
            parameter=parameter.key,
            value=raw,
            limit=choices,
            label=label,
        )
    return raw


def named(
    drive: str, family: str, error: DriveError, parameter: Parameter, value: Raw | None = None
) -> DriveError:
    """The same error with drive and parameter named in its text."""
    # A link names the node; the person knows the drive by its name in the axis list. An error that
    # was raised for this drive already has the name in its text.
    anonymous, error.drive = error.drive != drive, drive
    error.at(parameter=parameter.key)
    if value is not None and error.value is None:
        error.value = value
    if anonymous:
        error.text = text(
            "drive.of-parameter",
            drive=drive,
            parameter=parameter.key,
            name=profile_text(family, parameter.name),
            cause=error.text,
        )
    return error


def _encodes(drive: str, family: str, parameter: Parameter, raw: Raw) -> None:
    try:
        encode(parameter.type, raw)
    except OutOfRange as error:
        raise named(drive, family, error, parameter) from error


def _shown(parameter: Parameter, raw: Raw | None) -> str | Text:
    if raw is None:
        return text("limit.no-limit")
    try:
        value = parameter.to_value(raw)
    except OverflowError:
        return text("limit.number-too-large")
    unit = f" {parameter.unit}" if parameter.unit else ""
    return f"{value}{unit}" if value == raw else text("limit.raw", value=f"{value}{unit}", raw=raw)
