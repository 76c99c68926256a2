"""MLink as a kind of bus. The MMS7 default is 2.5 Mbaud, even parity (004:1457-1464)."""

from __future__ import annotations

from drivers.adapters import require_serial_form
from drivers.bus import BusKind, BusUrl, SerialLine
from drivers.link import Link, LinkTraits
from drivers.modbus.bus import SERIAL_SILENT


def _link(url: BusUrl) -> Link:
    from drivers.mlink.link import mlink_link
    from drivers.modbus.line_url import line_settings

    return mlink_link(str(url), line_settings(url))


BUS = BusKind(
    example="mlink:///dev/ttyUSB0?baudrate=2500000&parity=E",
    traits=LinkTraits(silent=SERIAL_SILENT),
    require_place=require_serial_form,
    link=_link,
    serial_port=lambda place: place,
    serial=SerialLine(
        (
            2_500_000, 115_200, 1_000_000, 5_000_000, 921_600, 460_800, 230_400, 57_600, 38_400,
            19_200, 9600,
        ),
        ("E", "N", "O"),
    ),
)  # fmt: skip
