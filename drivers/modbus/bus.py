"""Modbus RTU as a kind of bus."""

from __future__ import annotations

from drivers.adapters import require_serial_form
from drivers.bus import BusKind, BusUrl, SerialLine
from drivers.link import Link, LinkTraits
from drivers.texts.message import text

SERIAL_SILENT = text("modbus.check-when-silent")


def _link(url: BusUrl) -> Link:
    from drivers.modbus.line_url import line_settings
    from drivers.modbus.link import modbus_link

    return modbus_link(str(url), line_settings(url))


BUS = BusKind(
    example="modbus:///dev/ttyUSB0?baudrate=115200&parity=N",
    traits=LinkTraits(registers=True, silent=SERIAL_SILENT),
    require_place=require_serial_form,
    link=_link,
    serial_port=lambda place: place,
    serial=SerialLine(
        (115_200, 9600, 19_200, 57_600, 38_400, 230_400, 460_800, 921_600),
        ("N", "E", "O"),
        standard_silence=True,
    ),
)
