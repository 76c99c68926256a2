"""Modbus lines with foreign drives and gateways, on a port of this test with a clock of its own."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest

from drivers.errors import DriveError, LinkTimeout, Rejected
from drivers.link import Address
from drivers.modbus.framing import EXCEPTION_TEXTS, exception_response, read_response
from drivers.modbus.layout import TableLayout
from drivers.modbus.line import Line
from drivers.modbus.link import RegisterLink
from drivers.modbus.port import LineSettings

#: Answers a request, or None for silence.
Slave = Callable[[bytes], bytes | None]


class Port:
    """A port whose slave answers at once; waiting takes no real time."""

    def __init__(self, slave: Slave) -> None:
        self.slave = slave
        self.now_s = 0.0
        self.sent: list[bytes] = []
        self._waiting = b""

    def read(self, timeout_s: float) -> bytes:
        data, self._waiting = self._waiting, b""
        if not data:
            self.now_s += max(timeout_s, 0.0)
        return data

    def write(self, data: bytes) -> None:
        self.sent.append(data)
        self.now_s += 0.0001
        self._waiting += self.slave(data) or b""

    def close(self) -> None:
        self._waiting = b""

    def line(self, settings: LineSettings, **more: object) -> Line:
        return Line(
            settings,
            clock=lambda: self.now_s,
            sleep=lambda _s: None,
            opener=lambda _settings: self,
            **more,  # type: ignore[arg-type]
        )


def values(request: bytes) -> bytes:
    count = request[5]
    return read_response(request[0], [7] * count)


def test_a_drive_that_is_silent_for_long_with_a_short_time_limit() -> None:
    """After 125 time-outs within two seconds, an access waited for ever instead of failing."""
    port = Port(lambda _request: None)
    line = port.line(LineSettings("/dev/ttyS0", timeout_s=0.004))
    line.open()
    for _ in range(400):
        with pytest.raises(LinkTimeout):
            line.read(1, 0, 1)
        with pytest.raises(LinkTimeout):
            line.read(1, 9, 1)
    port.sent.clear()
    with pytest.raises(LinkTimeout):
        line.write(1, 0x3100, (2,), at_any_rate=True)
    assert port.sent[-1][:6] == bytes.fromhex("010631000002")
    port.now_s += 3.0
    port.slave = values
    assert line.read(1, 0, 1) == b"\0\x07"


@pytest.mark.parametrize("code", [10, 11])
async def test_a_gateway_without_a_way_to_the_drive_splits_no_block(code: int) -> None:
    """Each value was asked for alone, and for ever after, also when the drive was back."""
    port = Port(lambda request: exception_response(request[0], request[1], code))
    link = RegisterLink("modbus:///dev/ttyS0", LineSettings("/dev/ttyS0"), TableLayout(), port.line)
    await link.open()
    try:
        addresses = [Address(None, 0, "UINT16", register=n) for n in range(8)]
        got = await link.read_many(1, addresses)
        assert all(isinstance(each, Rejected) and each.abort_code == code for each in got)
        assert len(port.sent) <= 3
        port.slave = values
        port.sent.clear()
        assert await link.read_many(1, addresses) == [b"\x07\0"] * 8
        assert len(port.sent) == 1
    finally:
        await link.close()


async def test_a_refused_register_still_splits_its_block() -> None:
    def one_missing(request: bytes) -> bytes:
        start, count = request[3], request[5]
        if start <= 3 < start + count:
            return exception_response(request[0], request[1], 2)
        return values(request)

    port = Port(one_missing)
    link = RegisterLink("modbus:///dev/ttyS0", LineSettings("/dev/ttyS0"), TableLayout(), port.line)
    await link.open()
    try:
        addresses = [Address(None, 0, "UINT16", register=n) for n in range(8)]
        got = await link.read_many(1, addresses)
        assert [isinstance(each, DriveError) for each in got] == [n == 3 for n in range(8)]
    finally:
        await link.close()


@pytest.mark.parametrize("code", [*EXCEPTION_TEXTS, 0x55])
def test_a_refusal_is_in_the_readers_language(code: int) -> None:
    port = Port(lambda request: exception_response(request[0], request[1], code))
    line = port.line(LineSettings("/dev/ttyS0"))
    line.open()
    with pytest.raises(Rejected) as refused:
        line.read(1, 0, 1)
    assert not re.search("[a-z]{5}", refused.value.text.words("zh").replace("Modbus", ""))
    assert refused.value.remedy_text is not None
    assert not re.search("[a-z]{3}", refused.value.remedy_text.words("zh"))
    assert refused.value.message.startswith("station 1: the ")


def test_an_echo_alone_is_said_in_the_readers_language() -> None:
    port = Port(lambda request: request)
    line = port.line(LineSettings("/dev/ttyS0"))
    line.open()
    with pytest.raises(LinkTimeout, match=r"ms \(only the adapter's echo") as silent:
        line.read(1, 0, 1)
    assert not re.search("[a-z]{3}", silent.value.text.words("zh"))
