"""A listener that fails costs neither the process that moves axes nor the other listeners."""

from __future__ import annotations

import asyncio
from typing import Any

from drivers.errors import Busy
from drivers.ethercat.link import EthercatLink
from drivers.ethercat.process import protocol
from drivers.link import LinkEvent
from drivers.texts.message import text


class Child:
    """The running child process."""

    returncode = None

    def __init__(self) -> None:
        self.killed = False

    def kill(self) -> None:
        self.killed = True


class Channel:
    """Messages of the child, then nothing any more."""

    def __init__(self, *messages: dict[str, Any]) -> None:
        self._data = [protocol.pack(message) for message in messages]

    async def receive(self) -> bytes:
        if self._data:
            return self._data.pop(0)
        await asyncio.Event().wait()
        return b""


async def test_a_listener_that_has_no_room_for_work_does_not_end_the_process() -> None:
    """A drive with a loose plug returned five times: the fifth reading of it was refused."""
    link = EthercatLink("eth9")
    seen: list[LinkEvent] = []

    def refuses(_event: LinkEvent) -> None:
        raise Busy("work.run-already-of-kind", drive="one", limit="4")

    link.listen(refuses)
    link.listen(seen.append)
    child = Child()
    link._host._process = child  # type: ignore[assignment]
    answer: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
    link._host._waiting[7] = (answer, None)
    back = text("event.station-answers-again", station=1).to_wire()
    event = {"event": "link", "kind": "back", "station": 1, "text": back, "code": None}
    channel: Any = Channel(event, {"id": 7, "result": 42})
    reported: list[dict[str, Any]] = []
    loop = asyncio.get_running_loop()
    loop.set_exception_handler(lambda _loop, context: reported.append(context))
    reading = asyncio.create_task(link._host._read(channel))
    async with asyncio.timeout(5):
        assert await answer == 42
    reading.cancel()
    assert not child.killed
    assert [each.kind for each in seen] == ["back"]
    assert [type(each["exception"]) for each in reported] == [Busy]
