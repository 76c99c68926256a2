"""EEPROM operations of the host process: read, and write what was planned."""

from __future__ import annotations

import time
from collections.abc import Callable

from drivers.errors import Busy, DriveError, LinkLost, NotAllowed
from drivers.ethercat.eeprom.transfer import Report, read_image, write_image
from drivers.ethercat.process.protocol import Message
from drivers.ethercat.process.stations.roster import Roster
from drivers.ethercat.process.stations.station import Station, answers, with_eeprom
from drivers.ethercat.wire.al_status import AlState, state_name
from drivers.ethercat.wire.lanes import Done, Lanes
from drivers.ethercat.wire.steps import Steps

_CALM = (AlState.INIT, AlState.PREOP)


class EepromOperations:
    """Operations on whole EEPROMs. While one is written, no search may access the segment."""

    def __init__(self, roster: Roster, lanes: Lanes, progress: Callable[[Message], Report]) -> None:
        self._roster = roster
        self._lanes = lanes
        self._progress = progress

    def read(self, message: Message, done: Done) -> None:
        """Read the contents as bytes.

        Raises:
            Busy: the cyclic exchange runs, an EEPROM is being written, or firmware is being loaded
                into the station.
        """
        station = self._calm(message)
        steps = read_image(time.monotonic, self._progress(message), message["size"])
        self._lanes.submit(station.number, "register", with_eeprom(station, steps), done)

    def write(self, message: Message, done: Done) -> None:
        """Write the change from the contents ``present`` to ``target``.

        Raises:
            Busy: the cyclic exchange runs, an EEPROM is being written, or firmware is being loaded
                into the station.
        """
        station = self._calm(message)
        steps = _written(station, message["present"], message["target"], self._progress(message))
        held = self._roster.held
        held.add(station.number)

        def ended(result: object, error: DriveError | None) -> None:
            held.discard(station.number)
            if error is None:
                self._roster.new_aliases.add(station.number)
            done(result, error)

        self._lanes.submit(station.number, "register", with_eeprom(station, steps), ended)

    def _calm(self, message: Message) -> Station:
        if self._roster.exchange.loop is not None:
            raise Busy("ethercat.segment-busy")
        station = self._roster.station(message)
        self._roster.require_not_held()
        if station.number in self._roster.loading:
            raise Busy("ethercat.station-being-loaded-firmware", station=station.number)
        return station


def _written(station: Station, present: bytes, target: bytes, report: Report) -> Steps[None]:
    """Write if the state of the drive permits it.

    Raises:
        NotAllowed: the drive is in a state in which its processor may use the EEPROM.
        LinkLost: the station does not answer.
    """
    if not (yield from answers(station, time.monotonic)):
        raise LinkLost("ethercat.station-not-answer-check-supply")
    if station.al_state & 0x0F not in _CALM:
        raise NotAllowed(
            "ethercat.eeprom-state",
            station=station.number,
            state_name=state_name(station.al_state),
        )
    yield from write_image(present, target, time.monotonic, report)
