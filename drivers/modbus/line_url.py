"""Options of the URLs of serial lines.

``baudrate``, ``parity`` (N, E, O), ``stopbits`` (1, 2), ``timeout_ms``, ``silence_us`` (pause
before each request), ``retries`` (of reads).
"""

from __future__ import annotations

import re
from dataclasses import replace

from drivers.bus import BusUrl
from drivers.errors import OutOfRange
from drivers.modbus.port import STANDARD_SILENCE_S, LineSettings, Parity
from drivers.urls import bus_kind
from profiles.schema import LinkKind


def line_settings(url: BusUrl) -> LineSettings:
    """Return the settings in the URL of a serial line, with the defaults of its kind.

    Modbus uses the pause of the standard (3.5 characters, 1.75 ms above 19200 baud: MODBUS over
    Serial Line V1.02, clause 2.5.1.1). MLink uses 3.5 characters at every rate, because 1.75 ms are
    400 characters at 2.5 Mbaud.

    Raises:
        OutOfRange: an option that does not exist or has an invalid value.
    """
    usual = bus_kind(url.scheme).serial
    assert usual is not None, "a kind of bus with a serial line says how it is usually set"
    settings = LineSettings(
        url.place, baudrate=usual.baudrates[0], parity=_parity(url.scheme, usual.parities[0])
    )
    silence_s: float | None = None
    for name, text in url.options:
        if name == "baudrate":
            settings = replace(settings, baudrate=_number(url.scheme, name, text, 300, 12_000_000))
        elif name == "parity":
            settings = replace(settings, parity=_parity(url.scheme, text))
        elif name == "stopbits":
            settings = replace(
                settings, stopbits=2 if _number(url.scheme, name, text, 1, 2) == 2 else 1
            )
        elif name == "timeout_ms":
            settings = replace(
                settings, timeout_s=_number(url.scheme, name, text, 1, 60_000) / 1000
            )
        elif name == "retries":
            settings = replace(settings, retries=_number(url.scheme, name, text, 0, 10))
        elif name == "silence_us":
            silence_s = _number(url.scheme, name, text, 0, 1_000_000) / 1e6
        else:
            raise OutOfRange(
                "modbus.urls-no-option",
                value=name,
                limit="baudrate, parity, stopbits, timeout_ms, silence_us, retries",
                remedy=bus_kind(url.scheme).like,
                scheme=url.scheme,
            )
    if silence_s is None and usual.standard_silence and settings.baudrate > 19_200:
        silence_s = STANDARD_SILENCE_S
    return replace(settings, silence_s=silence_s)


def _number(scheme: LinkKind, name: str, text: str, low: int, high: int) -> int:
    if not re.fullmatch(r"\d{1,9}", text) or not low <= int(text) <= high:
        raise OutOfRange(
            "modbus.must-whole-number",
            value=text,
            limit=f"{low}…{high}",
            remedy=bus_kind(scheme).like,
            name=name,
            low=low,
            high=high,
        )
    return int(text)


def _parity(scheme: LinkKind, text: str) -> Parity:
    for parity in ("N", "E", "O"):
        if text.upper() == parity:
            return parity
    raise OutOfRange(
        "modbus.parity-must-none-even", value=text, limit="N, E, O", remedy=bus_kind(scheme).like
    )
