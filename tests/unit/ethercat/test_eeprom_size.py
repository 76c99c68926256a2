"""The size of a damaged EEPROM as a person states it."""

from __future__ import annotations

from typing import Any

import pytest

from drivers.errors import OutOfRange
from drivers.ethercat.eeprom.access import EepromAccess
from drivers.ethercat.eeprom.image import MOST_BYTES


@pytest.mark.parametrize("size", [-128, 0, 1, 129, 200, MOST_BYTES + 128])
async def test_an_impossible_size_is_refused_before_anything_is_read(size: int) -> None:
    """An odd one was read for ever, and none at all made an empty file."""
    asked: list[Any] = []

    async def call(message: dict[str, Any], _timeout_s: float, _progress: object) -> bytes:
        asked.append(message)
        return b""

    async def read(_station: int, _address: object) -> bytes:
        return b""

    access = EepromAccess(call, read)
    with pytest.raises(OutOfRange):
        await access.read(1, lambda _share, _step: None, size)
    assert not asked
