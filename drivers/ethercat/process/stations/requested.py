"""Unfiltered requests to the AL state machine, to test how a slave responds to them.

Source: ETG.1000.6 clause 6.4 (state machine), ETG.1000.4 clause 6 (registers).
"""

from __future__ import annotations

import struct
from collections.abc import Awaitable, Callable
from typing import Any

from drivers.conformance.subject import AlAnswer
from drivers.errors import LinkLost, NotAllowed
from drivers.ethercat.process.stations.station import (
    AL_CONTROL,
    STATE_TIMEOUT_S,
    Station,
    al_status,
)
from drivers.ethercat.wire.al_status import ERROR_BIT, AlState
from drivers.ethercat.wire.steps import Pause, Steps, Write
from drivers.link import Progress

_UNKNOWN_S = 1.0
"""Time-out of a request for an unknown state [s]."""
_WAIT_STEP_S = 0.002
_ANSWER_S = 30.0

Call = Callable[[dict[str, Any], float, Progress | None], Awaitable[Any]]
"""Sends a message to the host, with its time-out [s] and progress."""


class AlRequests:
    """The server's side; see `drivers.conformance.subject.AlStates`."""

    def __init__(self, call: Call) -> None:
        self._call = call

    async def request(self, station: int, control: int) -> AlAnswer:
        """Write ``control`` to 120h and wait for the slave's response."""
        message = {"op": "al_request", "station": station, "control": control}
        return AlAnswer(*await self._call(message, _ANSWER_S, None))


def refuse_op(station: Station, control: int) -> None:
    """Allow a request for Op only from Pre-Op, where a slave without process data must refuse it.

    Raises:
        NotAllowed: Op is requested of a slave that is not in Pre-Op.
    """
    if control & 0x0F == AlState.OP and station.al_state & 0x0F != AlState.PREOP:
        raise NotAllowed("ethercat.op-needs-cyclic-data")


def request(station: Station, control: int, clock: Callable[[], float]) -> Steps[list[int]]:
    """Write 120h; return 130h and 134h after the state or error bit responds, or the time-out.

    Raises:
        LinkLost: the slave answers nothing at all.
    """
    wanted = control & 0x0F
    known = wanted in set(AlState)
    deadline = clock() + (STATE_TIMEOUT_S[AlState(wanted)] if known else _UNKNOWN_S)
    yield Write(AL_CONTROL, struct.pack("<H", control))
    answered = False
    while clock() < deadline:
        yield Pause(_WAIT_STEP_S)
        if not (yield from al_status(station)):
            continue
        answered = True
        if station.al_state == wanted or (station.al_state & ERROR_BIT and station.al_code):
            break
    if not answered:
        raise LinkLost("ethercat.station-not-answer-check-drive", station=station.number)
    return [station.al_state, station.al_code]
