"""What enters the process data keeps its value, also of a drive that states no length."""

from __future__ import annotations

import struct

from drivers.ethercat.exchange.mapping import Entry
from drivers.ethercat.exchange.setup import initial_outputs
from drivers.ethercat.process.stations.station import Station
from tests.wire.ethercat_host import scripted
from tests.wire.ethercat_host.scripted import ScriptedSlave

TORQUE_LIMIT, MODE = Entry(0x6072, 0, 2, "H"), Entry(0x6060, 0, 1, "b")
VALUES = {0x6072: 1000, 0x6060: 8}


def without_length(request: bytes) -> list[bytes]:
    """Answer expedited with four bytes, size not indicated (CiA 301 clause 7.2.4.3.5)."""
    (index,) = struct.unpack_from("<H", request, 3)
    return [scripted.coe(3, struct.pack("<BHBI", 0x42, index, 0, VALUES[index]))]


def test_a_torque_limit_is_kept_where_the_drive_states_no_length() -> None:
    slave = ScriptedSlave(without_length)
    station = Station(1, mailbox=slave.box())
    assert slave.run(initial_outputs(station, (TORQUE_LIMIT, MODE))) == [1000, 8]
    assert not station.notes


def test_what_is_no_value_of_the_type_begins_at_zero_with_a_note() -> None:
    slave = ScriptedSlave(
        lambda _request: [scripted.coe(3, struct.pack("<BHBI", 0x42, 0x6072, 0, 0x10000))]
    )
    station = Station(1, mailbox=slave.box())
    assert slave.run(initial_outputs(station, (TORQUE_LIMIT,))) == [0]
    assert len(station.notes) == 1
