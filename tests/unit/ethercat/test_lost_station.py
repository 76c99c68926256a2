"""The doctor on a station that stopped answering."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from drivers.errors import LinkLost
from drivers.ethercat.link import EthercatLink
from drivers.ethercat.process.operations import Operations
from drivers.ethercat.process.stations.station import Station


class Host:
    """Answers as the host process of a segment whose second station was lost."""

    running = True

    def __init__(self) -> None:
        ring: Any = SimpleNamespace(host_lives_until=lambda *_what: None)
        self.operations = Operations("eth9", ring, lambda _message: None)

    async def call(self, message: dict[str, Any], _timeout_s: float, _progress: object) -> Any:
        if message["op"] == "counters":
            return self.operations._survey([Station(1), Station(2, lost=True)])
        assert message["op"] == "examine"
        if message["station"] == 2:
            raise LinkLost("ethercat.station-not-answer", station=2, other_station="")
        return {"station": 1, "answers": True, "al": 8, "al_code": 0}


async def test_a_lost_station_is_examined_like_one_that_was_never_found() -> None:
    link = EthercatLink("eth9")
    link._host = Host()  # type: ignore[assignment]
    found = await link.examination(2)
    assert not found.reached
    assert [cause.code for cause in found.causes] == ["station_silent"]
    assert (await link.examination(1)).reached
