"""Entering OP where process data or SYNC0 stayed away for a moment (ETG.1020 table 2)."""

from __future__ import annotations

import pytest

from drivers.errors import NotAllowed
from drivers.ethercat.exchange.exchange import enter_op
from drivers.ethercat.process.stations.station import (
    AL_CONTROL,
    AL_STATUS,
    STATE_TIMEOUT_S,
    Station,
)
from drivers.ethercat.wire.al_status import ERROR_BIT, AlState
from drivers.ethercat.wire.steps import Read, Write
from tests.wire.ethercat_host.by_hand import ByHand

WATCHDOG, NO_SYNC0, BAD_OUTPUTS = 0x001B, 0x002D, 0x001D


class Slave(ByHand):
    """In SAFEOP; it refuses OP with ``code`` so many times. Its time passes in pauses."""

    def __init__(self, code: int, times: int) -> None:
        self.now = 0.0
        self.asked = 0
        self._code, self._times = code, times
        self._state, self._reported = int(AlState.SAFEOP), 0

    def frame(self, step: Read | Write) -> bytes:
        if isinstance(step, Read):
            assert step.register == AL_STATUS
            return bytes([self._state, 0, 0, 0]) + self._reported.to_bytes(2, "little")
        assert step.register == AL_CONTROL
        self._go(step.data[0])
        return b""

    def _go(self, wanted: int) -> None:
        if self._state & ERROR_BIT:
            assert wanted & ERROR_BIT, "the error is acknowledged first"
        self._state, self._reported = wanted & 0x0F, 0
        if self._state == AlState.OP:
            self.asked += 1
            if self.asked <= self._times:
                self._state, self._reported = AlState.SAFEOP | ERROR_BIT, self._code


def enter(slave: Slave) -> None:
    slave.run(enter_op(Station(2), STATE_TIMEOUT_S[AlState.OP]))


@pytest.mark.parametrize("code", [WATCHDOG, NO_SYNC0])
def test_op_is_asked_for_again_where_a_computer_stood_still(code: int) -> None:
    slave = Slave(code, 3)
    enter(slave)
    assert slave.asked == 4
    assert slave.now >= 0.6, "it is given time in between"


@pytest.mark.parametrize("code", [WATCHDOG, NO_SYNC0])
def test_what_stays_away_is_reported(code: int) -> None:
    slave = Slave(code, 100)
    with pytest.raises(NotAllowed, match="station 2 refuses OP"):
        enter(slave)
    assert slave.asked == 5


def test_any_other_refusal_ends_it_at_once() -> None:
    slave = Slave(BAD_OUTPUTS, 100)
    with pytest.raises(NotAllowed, match="invalid output configuration"):
        enter(slave)
    assert slave.asked == 1
