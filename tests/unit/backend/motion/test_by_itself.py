"""Who is named for what nobody did: no one."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from backend.foundation.people.identity import LOCAL, Actor, acting, acting_person, by_itself
from backend.station.bench import Bench
from drivers.link import LinkEvent, Unsubscribe
from drivers.texts.message import text
from tests.support.memory_link import MemoryLink


class Telling(MemoryLink):
    """A bus that says something by itself."""

    def __init__(self) -> None:
        super().__init__({})
        self.listeners: list[Callable[[LinkEvent], None]] = []

    def listen(self, listener: Callable[[LinkEvent], None]) -> Unsubscribe:
        self.listeners.append(listener)
        return super().listen(listener)


def test_work_that_outlives_a_request_is_nobodys() -> None:
    token = acting.set(Actor(LOCAL))
    try:
        assert by_itself().run(acting_person) == ""
        assert acting_person() == "local user"
    finally:
        acting.reset(token)


async def test_a_drive_that_falls_silent_later_is_not_reported_of_who_connected_it(
    tmp_path: Path,
) -> None:
    link = Telling()
    bench = Bench(tmp_path, {"mlink://virtual0": lambda: link})
    token = acting.set(Actor(LOCAL))
    try:
        await bench.connect("mlink://virtual0", 1, "mms7", "X")
        for listener in link.listeners:
            listener(LinkEvent("lost", 1, text("event.station-lost", station=1, name="M")))
    finally:
        acting.reset(token)
        await bench.close()
    reported = {entry.text.split(" ")[0]: entry.person for entry in bench.journal.entries()}
    assert reported["connected"] == "local user"
    assert reported["mlink://virtual0:"] == ""
