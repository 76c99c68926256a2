"""Numbers as they are typed on the command line."""

from __future__ import annotations

import math

from drivers.errors import NotAllowed


def finite(key: str, name: str, text: str) -> float:
    """The number that is meant for a parameter.

    Raises:
        NotAllowed: it is none, or has no end.
    """
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise NotAllowed(
            f"{key} {name}: {text!r} is not a number",
            parameter=key,
            value=text,
            remedy="give a number; hexadecimal with 0x",
        )
    return number
