"""A listener that fails keeps neither the bus nor the other listeners from going on.

For EtherCAT see `tests/unit/ethercat/test_failing_listener.py`.
"""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from drivers.canopen.link import CanopenLink
from drivers.errors import Busy
from drivers.link import LinkEvent
from drivers.modbus.layout import TableLayout
from drivers.modbus.link import RegisterLink
from drivers.modbus.port import LineSettings
from drivers.texts.message import text


def refuses(_event: LinkEvent) -> None:
    raise Busy("work.run-already-of-kind", drive="one", limit="4")


@pytest.fixture
async def reported() -> list[dict[str, Any]]:
    """What is reported to the event loop as failed."""
    found: list[dict[str, Any]] = []
    asyncio.get_running_loop().set_exception_handler(lambda _loop, context: found.append(context))
    return found


async def test_a_node_that_is_lost_is_told_to_those_behind_a_listener_that_fails(
    reported: list[dict[str, Any]],
) -> None:
    link = CanopenLink("canopen://virtual/failing-listener")
    link._loop = asyncio.get_running_loop()
    seen: list[LinkEvent] = []
    link.listen(refuses)
    link.listen(seen.append)
    link._event(LinkEvent("boot", 5, text("event.own-number-started", node=5)))
    await asyncio.sleep(0)
    assert [event.kind for event in seen] == ["boot"]
    assert [type(each["exception"]) for each in reported] == [Busy]


async def test_an_adapter_that_was_pulled_out_is_opened_again_behind_a_listener_that_fails(
    reported: list[dict[str, Any]],
) -> None:
    """The watch that opens it again began after the listeners, so it did not begin."""
    link = RegisterLink("modbus:///dev/ttyUSB0", LineSettings("/dev/ttyUSB0"), TableLayout())
    open_thread: Any = object()
    link._thread = open_thread
    seen: list[LinkEvent] = []
    link.listen(refuses)
    link.listen(seen.append)
    link._notify(False, text("canopen.bus-lost"))
    assert [event.kind for event in seen] == ["lost"]
    assert [type(each["exception"]) for each in reported] == [Busy]
    watcher = link._watcher
    assert watcher is not None
    watcher.cancel()
