"""A message that the host process would refuse is not sent: it would end the process."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from drivers.errors import ProtocolError
from drivers.ethercat.process import protocol
from drivers.ethercat.process.hostprocess import HostProcess


class Child:
    returncode = None


class Channel:
    def __init__(self) -> None:
        self.sent = 0

    async def send(self, data: bytes) -> None:
        self.sent += len(data)


async def test_a_message_that_is_too_long_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(protocol, "MAX_MESSAGE_BYTES", 1000)
    host = HostProcess("eth9", (), lambda _message: None, lambda _why: None)
    channel = Channel()
    parts: Any = vars(host)
    parts["_process"], parts["_channel"] = Child(), channel
    parts["_ready"] = asyncio.get_running_loop().create_future()
    parts["_ready"].set_result(None)
    with pytest.raises(ProtocolError, match="is too long"):
        await host.call({"op": "play", "values": bytes(1000)}, 0.1)
    assert channel.sent == 0
    assert not parts["_waiting"]
