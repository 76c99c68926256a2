"""FoE bytes against ETG.1000.6 clause 5.8."""

from __future__ import annotations

import struct

import pytest

from drivers.errors import Rejected
from drivers.ethercat.foe import write_file
from tests.wire.ethercat_host.scripted import ScriptedSlave


@pytest.mark.parametrize("length", [0, 10, 116, 117, 232])
def test_a_file_arrives_whole_and_a_short_packet_ends_it(length: int) -> None:
    data = bytes(n % 251 for n in range(length))
    busy = {"once": True}

    def react(request: bytes) -> list[bytes]:
        if request[0] == 2:
            return [struct.pack("<BxI", 4, 0)]
        number = struct.unpack_from("<I", request, 2)[0]
        if number == 1 and busy.pop("once", False):
            return [struct.pack("<BxHH", 6, 1, 2)]
        return [struct.pack("<BxI", 4, number)]

    slave = ScriptedSlave(react)
    progress: list[int] = []
    slave.run(write_file(slave.box(), "fw.bin", data, password=0x1234, on_progress=progress.append))
    assert slave.requests[0] == struct.pack("<BxI", 2, 0x1234) + b"fw.bin"
    packets = {struct.unpack_from("<I", r, 2)[0]: r[6:] for r in slave.requests[1:]}
    assert b"".join(packets[n] for n in sorted(packets)) == data
    assert len(packets[max(packets)]) < 128 - 12, "the last packet is short"
    assert progress[-1] == length


def test_a_refusal_comes_in_words() -> None:
    slave = ScriptedSlave(lambda _: [struct.pack("<BxI", 5, 0x8008) + b"use BOOT"])
    with pytest.raises(Rejected, match=r"only possible in the BOOT state: use BOOT \(FoE 0x8008\)"):
        slave.run(write_file(slave.box(), "fw.bin", b"x", password=0, on_progress=lambda _: None))
