"""Pages learn that a link of a drive came or went, with nothing else that changed."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

from backend.station.buses import Buses
from drivers.link import LinkQuality


class _Link:
    def __init__(self) -> None:
        self.now = LinkQuality(connected=True)

    def quality(self, station: int | None = None) -> LinkQuality:
        assert station == 3
        return self.now


def test_the_list_of_drives_is_sent_when_a_link_comes_or_goes() -> None:
    sent: list[str] = []
    bench: Any = SimpleNamespace(drives_changed=lambda: sent.append("drives"))
    buses, link = Buses(bench, {}), _Link()
    drive: Any = SimpleNamespace(id="x", ports=[SimpleNamespace(link=link, station=3)])
    buses.seen(drive)
    link.now = replace(link.now, transactions=7)
    buses.seen(drive)
    assert sent == [], "counters alone are no news"
    for connected in (False, True):
        link.now = replace(link.now, connected=connected)
        buses.seen(drive)
        buses.seen(drive)
    assert sent == ["drives", "drives"]
