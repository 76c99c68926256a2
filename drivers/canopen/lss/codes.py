"""Frames and codes of the layer setting services. Pure.

Source: CiA 305 v3.0 clauses 3 (services), 4 (protocols) and table of bit timings.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

REQUEST, ANSWER = 0x7E5, 0x7E4
"""Identifiers of the master's and the slaves' frames."""
WAITING, CONFIGURATION = 0, 1
"""Modes of the service that switches all slaves."""

SWITCH_ALL = 0x04
NODE_ID, BIT_TIMING, STORE = 0x11, 0x13, 0x17
SELECT = (0x40, 0x41, 0x42, 0x43)
"""Vendor, product, revision and serial number, in this order."""
SELECTED = 0x44
IDENTIFY_UNCONFIGURED, UNCONFIGURED = 0x4C, 0x50
IDENTIFIED, FASTSCAN = 0x4F, 0x51
INQUIRE = (0x5A, 0x5B, 0x5C, 0x5D)
INQUIRE_NODE_ID = 0x5E
RESET_SCAN = 0x80
"""``BitChecked`` of the first frame of a scan."""

NO_NODE_ID = 0xFF
"""Node-ID of a node without one."""
BIT_RATES_KBIT: dict[int, int] = {1000: 0, 800: 1, 500: 2, 250: 3, 125: 4, 50: 6, 20: 7, 10: 8}
"""Bit rate [kbit/s] to its index in table 0."""


class LssIdentity(NamedTuple):
    """The address of a slave: 1018h:01 to 1018h:04."""

    vendor_id: int
    product_code: int
    revision: int
    serial: int


def frame(command: int, *data: int) -> bytes:
    """Return a request with data bytes after its command."""
    return bytes([command, *data]).ljust(8, b"\0")


def with_number(command: int, number: int) -> bytes:
    """Return a request with a 32-bit number."""
    return struct.pack("<BI3x", command, number)


def fastscan(number: int, bit: int, part: int, following: int) -> bytes:
    """Return a request answered by nodes that have the bits of ``number`` from ``bit`` up."""
    return struct.pack("<BIBBB", FASTSCAN, number, bit, part, following)


def number_of(answer: bytes) -> int:
    """Return the 32-bit number of an answer."""
    return int(struct.unpack_from("<I", answer, 1)[0])
