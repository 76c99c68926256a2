"""A serial number that was never written is none: all such drives would be the same one."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import pytest

from drivers.canopen.sdo.scanning import identify
from drivers.ethercat.wire import sii
from drivers.mlink.link import MlinkLayout

NEVER_WRITTEN = [0, 0xFFFFFFFF]


class Channel:
    node = 5

    def __init__(self, serial: int) -> None:
        self._serial = serial

    def read(self, index: int, subindex: int, _timeout_s: float) -> bytes:
        return (self._serial if (index, subindex) == (0x1018, 4) else 7).to_bytes(4, "little")


@pytest.mark.parametrize("serial", [*NEVER_WRITTEN, 4711])
def test_of_a_canopen_node(serial: int) -> None:
    channel: Any = Channel(serial)
    found = identify(channel, [bytes.fromhex("4300100092010200")], 0.1)
    assert found.serial == (serial if serial == 4711 else None)


@pytest.mark.parametrize("serial", [*NEVER_WRITTEN, 4711])
def test_over_mlink(serial: int) -> None:
    found = MlinkLayout().describe(1, (0, 0, 1, 2, 3, serial, 1))
    assert found.serial == (serial if serial == 4711 else None)


@pytest.mark.parametrize("serial", [*NEVER_WRITTEN, 4711])
def test_in_an_eeprom(serial: int, monkeypatch: pytest.MonkeyPatch) -> None:
    def read(word: int, count: int, _clock: object) -> Generator[Any, Any, bytes]:
        yield from ()
        data = serial.to_bytes(4, "little") if word == sii.SERIAL_WORD else b""
        return data.ljust(2 * count, b"\0")

    monkeypatch.setattr(sii, "read", read)
    with pytest.raises(StopIteration) as ended:
        next(sii.identity(lambda: 0.0))
    assert ended.value.value[0] == (serial if serial == 4711 else None)
