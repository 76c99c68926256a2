"""Unfiltered requests to the AL state machine."""

from __future__ import annotations

import pytest

from drivers.errors import LinkLost
from drivers.ethercat.process.stations.requested import request
from drivers.ethercat.process.stations.station import Station
from drivers.ethercat.wire.steps import Read, Write
from tests.wire.ethercat_host.by_hand import ByHand


class Slave(ByHand):
    """A slave in PREOP that takes what it is asked for, until it does not answer any more."""

    def __init__(self, *, there: bool) -> None:
        self.now, self.there, self.state = 0.0, there, 2

    def frame(self, step: Read | Write) -> bytes | None:
        self.now += 50e-6
        if not self.there:
            return b"" if isinstance(step, Read) and step.may_be_empty else None
        if isinstance(step, Write):
            self.state = step.data[0]
            return b""
        return bytes([self.state, 0, 0, 0, 0, 0])


def test_what_was_known_before_is_not_taken_for_an_answer() -> None:
    slave = Slave(there=False)
    station = Station(1, al_state=2)
    with pytest.raises(LinkLost):
        slave.run(request(station, 0x07, lambda: slave.now))


def test_the_state_it_answers_with_is_returned() -> None:
    slave = Slave(there=True)
    assert slave.run(request(Station(1, al_state=2), 0x01, lambda: slave.now)) == [1, 0]
