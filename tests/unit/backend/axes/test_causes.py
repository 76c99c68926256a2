"""Why an axis is not enabled, beyond its status word."""

from __future__ import annotations

import pytest

from backend.axes.axis.causes import hints
from backend.axes.drive.drive import Drive
from backend.axes.drive.ports import Port
from profiles.functions import Functions, TerminalBits, TerminalFacts
from profiles.schema import IoFunction, IoTerminal, Parameter, Profile, Quirk, Signal
from tests.support.memory_link import MemoryLink
from tests.unit.backend.conftest import SPEC, changed


def _drive(profile: Profile, link: MemoryLink, *quirks: Quirk) -> Drive:
    stop = IoFunction(code=11, name="emergency stop")
    terminal = IoTerminal(
        name="DI3", direction="in", function_key="2002:05", functions=(stop,), source="t"
    )
    keys = (("60FD:00", "UINT32"), ("2002:05", "UINT16"), ("6061:00", "INT8"))
    extra = tuple(
        Parameter.model_validate(
            {"key": key, "name": key, "group": "I/O", "type": kind, "source": "t"}
        )
        for key, kind in keys
    )
    full = changed(
        profile,
        parameters=(*profile.parameters, *extra),
        terminals=(terminal,),
        functions=Functions(
            terminals=TerminalFacts(states=(TerminalBits(key="60FD:00", bits={"DI3": 18}),))
        ),
        signals=(
            *profile.signals,
            Signal(role="digital_inputs", key="60FD:00"),
            Signal(role="mode_display", key="6061:00"),
        ),
        quirks=quirks,
    )
    return Drive("x", "X axis", full, [Port(link, 1, SPEC)])


def _inputs(link: MemoryLink, raw: int, mode: int = 1) -> None:
    link.objects |= {
        (0x60FD, 0): raw.to_bytes(4, "little"),
        (0x2002, 5): (11).to_bytes(2, "little"),
        (0x6061, 0): bytes([mode]),
    }


async def _hints(drive: Drive) -> list[str]:
    return [cause.words() for cause in await hints(drive)]


async def test_an_active_stop_input_is_named(profile: Profile, link: MemoryLink) -> None:
    _inputs(link, 1 << 18)
    assert await _hints(_drive(profile, link)) == ["input DI3 (emergency stop) is active"]


@pytest.mark.parametrize(
    ("bit", "swapped", "words"),
    [
        (0, False, "the negative limit switch is active"),
        (1, False, "the positive limit switch is active"),
        # R6L: bit 0 is the forward limit (002:13914).
        (0, True, "the positive limit switch is active"),
    ],
)
async def test_limit_switches_are_named(
    profile: Profile, link: MemoryLink, bit: int, swapped: bool, words: str
) -> None:
    _inputs(link, 1 << bit)
    quirks = [Quirk(kind="limit_bits_swapped", key="60FD:00", help="", source="t")]
    assert await _hints(_drive(profile, link, *quirks[: int(swapped)])) == [words]


async def test_a_missing_mode_is_named(profile: Profile, link: MemoryLink) -> None:
    quirk = Quirk(kind="mode_before_enable", key="6061:00", help="", source="t")
    _inputs(link, 0, mode=0)
    assert await _hints(_drive(profile, link, quirk)) == ["no mode of operation is set"]
    assert await hints(_drive(profile, link)) == []


async def test_what_cannot_be_read_is_no_reason(profile: Profile, link: MemoryLink) -> None:
    assert await hints(_drive(profile, link)) == []
