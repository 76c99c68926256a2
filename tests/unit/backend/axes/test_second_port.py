"""Another drive behind the second cable is noticed before anything is written through it."""

from __future__ import annotations

from typing import Literal

import pytest

from backend.axes.drive.drive import Drive
from backend.axes.drive.ports import Port
from backend.axes.parameters.set_file import storable
from backend.station.drives.second_port import missing_ports, require_same_drive
from drivers.errors import NotAllowed
from drivers.objects.codec import encode
from profiles import load_profile
from tests.support.memory_link import MemoryLink

PROFILE = load_profile("ds_c")
SHARED = [
    p for p in storable(PROFILE, motor_individual=True) if p.index and p.modbus_register is not None
]


def drive_with(value: int, kind: Literal["canopen", "modbus"]) -> tuple[Port, MemoryLink]:
    memory = MemoryLink({(p.index or 0, p.subindex or 0): encode(p.type, value) for p in SHARED})
    memory.kind = kind
    return Port(memory, 1, PROFILE.link(kind)), memory


async def test_equal_settings_are_the_same_drive() -> None:
    first, _ = drive_with(5, "canopen")
    second, memory = drive_with(5, "modbus")
    await require_same_drive(Drive("z", "Z", PROFILE, [first]), second)
    assert memory.written == []


async def test_one_different_setting_is_another_drive() -> None:
    first, _ = drive_with(5, "canopen")
    second, memory = drive_with(5, "modbus")
    odd = SHARED[0]
    memory.objects[odd.index or 0, odd.subindex or 0] = encode(odd.type, 6)
    with pytest.raises(NotAllowed, match="6 there and 5 here") as refused:
        await require_same_drive(Drive("z", "Z", PROFILE, [first]), second)
    assert refused.value.parameter == odd.key
    assert memory.written == []


def test_a_drive_reached_over_modbus_alone_misses_what_has_no_register() -> None:
    port, _ = drive_with(5, "modbus")
    missing = missing_ports(Drive("z", "Z", PROFILE, [port]))
    assert [found.kind for found in missing] == ["canopen"]
    without = [p for p in PROFILE.parameters if p.modbus_register is None]
    assert missing[0].parameters == len(without) > 0
