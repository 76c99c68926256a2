"""One description that cannot be read does not cost the dictionary of the drive."""

from __future__ import annotations

import struct

from drivers.ethercat.process.stations.station import Station
from drivers.ethercat.wire.reading import enumerate_objects
from drivers.objects.dictionary import EntryDescription, ObjectInfo
from tests.wire.ethercat_host import scripted
from tests.wire.ethercat_host.scripted import ScriptedSlave

OBJECTS = (0x1000, 0x2000, 0x2001)


def info(opcode: int, data: bytes) -> bytes:
    return scripted.coe(8, struct.pack("<BxH", opcode, 0) + data)


def drive(request: bytes) -> list[bytes]:
    """Describes 2000h in four bytes, and the entry of 2001h in six."""
    opcode = request[2] & 0x7F
    (index,) = struct.unpack_from("<H", request, 6)
    if opcode == 0x01:
        return [info(0x02, struct.pack(f"<H{len(OBJECTS)}H", 1, *OBJECTS))]
    if opcode == 0x03:
        whole = struct.pack("<HHBB", index, 7, 0, 7) + b"name"
        return [info(0x04, whole[:4] if index == 0x2000 else whole)]
    whole = struct.pack("<HBBHHH", index, 0, 0, 7, 32, 7) + b"entry"
    return [info(0x06, whole[:6] if index == 0x2001 else whole)]


def test_the_others_are_listed() -> None:
    slave = ScriptedSlave(drive)
    station = Station(1, mailbox=slave.box())
    found = slave.run(enumerate_objects(station, lambda _number, _total: None))
    objects = [each.index for each in found if isinstance(each, ObjectInfo)]
    entries = [each.index for each in found if isinstance(each, EntryDescription)]
    assert objects == [0x1000, 0x2001]
    assert entries == [0x1000]
