"""A drive that never stops sending mails of its own does not hold a request for ever."""

from __future__ import annotations

import struct

import pytest

from drivers.errors import LinkTimeout
from drivers.ethercat.wire import coe
from drivers.ethercat.wire.steps import Read, Write
from tests.wire.ethercat_host import scripted
from tests.wire.ethercat_host.scripted import ScriptedSlave

EMERGENCY = scripted.coe(1, struct.pack("<HB5x", 0x8110, 1))
OTHER_ANSWER = scripted.coe(3, bytes([0x43]) + struct.pack("<HBI", 0x2000, 1, 7))


class Flood(ScriptedSlave):
    """Its mailbox is filled again with the same mail as soon as it was read."""

    mail = b""

    def frame(self, step: Read | Write) -> bytes | None:
        if not self.waiting:
            self.queue(self.mail)
        return super().frame(step)


@pytest.mark.parametrize("mail", [EMERGENCY, OTHER_ANSWER])
def test_a_request_among_mails_without_end_times_out(mail: bytes) -> None:
    slave = Flood(lambda _request: [])
    slave.mail = mail
    box = slave.box(timeout_s=1.0)
    with pytest.raises(LinkTimeout):
        slave.run(coe.upload(box, 0x1000, 0))
    assert 1.0 < slave.now < 2.0


def test_an_answer_behind_emergencies_is_found_after_a_stall() -> None:
    """The computer stood still past the time-out; the answer was there all the time."""
    answer = scripted.coe(3, bytes([0x43]) + struct.pack("<HBI", 0x1000, 0, 402))

    def react(_request: bytes) -> list[bytes]:
        slave.now += 5.0
        return [EMERGENCY, EMERGENCY, answer]

    slave = ScriptedSlave(react)
    assert slave.run(coe.upload(slave.box(timeout_s=1.0), 0x1000, 0)) == struct.pack("<I", 402)
    assert len(slave.emergencies) == 2
