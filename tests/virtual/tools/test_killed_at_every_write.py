"""What a tool changes is on the restore list on the disk at each of its writes: every tool.

A process that is killed (SIGKILL) leaves the drive and the disk as they are in that moment. So
instead of killing each tool at each moment, each tool runs once, and after each of its writes the
drive is compared with the disk: a value that is not as before the tool stands there with the value
of before.
"""

from __future__ import annotations

import contextlib
import json
from pathlib import Path
from typing import Any

import pytest

from backend.axes.axis.cyclic_mode import keeping_mode
from backend.commands.base.restoring import recall
from backend.commands.base.state import STATE_FOLDER_VARIABLE
from backend.tools.registry import BY_KIND, TOOLS
from backend.tools.tuning.sweep import profile_speed
from drivers.cia402 import Mode
from drivers.link import Address
from tests.support.granted import set_mode
from tests.virtual.tools.direct import STATION, DirectBench, direct
from tests.virtual.tools.rig import WIDE
from tests.virtual.tools.set_ups.load_side import DRIVE as LOAD_SIDE_DRIVE
from tests.virtual.tools.test_scales_of_every_tool import begun, spec_of

URL = "ethercat://eth0"
#: A tool ends with its n-th motion: what follows repeats what was written before it.
MOTIONS = 2
#: What begins and ends with a motion itself: control word, targets and offsets (CiA 402-2).
COMMANDS = {0x6040, 0x607A, 0x60FF, 0x6071, 0x60B0, 0x60B1, 0x60B2}
MODE = (0x6060, 0)
#: Tools that need another drive than `r6l`: one with a second position.
DRIVES = {"load-side": LOAD_SIDE_DRIVE}
#: Tools without a motion of one axis: the cycle reads alone, a gantry has two drives.
ELSEWHERE = {"cycle", "gantry"}


class EnoughMotions(Exception):
    """The tool has moved as often as is looked at."""


class Watch:
    """The drive against the disk, after each write."""

    def __init__(self, b: DirectBench, folder: Path) -> None:
        self.b, self.folder = b, folder
        self.before: dict[tuple[int, int], int] = {MODE: self._value(MODE)}
        self.changed: set[str] = set()
        self.missing: list[str] = []
        self.motions = 0
        self._write, self._play = b.link.write, b.link.play
        b.link.write = self.write  # type: ignore[method-assign]
        b.link.play = self.play  # type: ignore[method-assign]

    def _value(self, place: tuple[int, int]) -> int:
        return int.from_bytes(self.b.link.device.read(*place), "little")

    async def write(self, station: int, address: Address, data: bytes) -> None:
        place = address.index or 0, address.subindex
        if place[0] not in COMMANDS:
            self.before.setdefault(place, self._value(place))
        await self._write(station, address, data)
        self.look()

    async def play(self, trajectories: Any) -> int:
        self.look()
        self.motions += 1
        if self.motions > MOTIONS:
            raise EnoughMotions
        return await self._play(trajectories)

    def look(self) -> None:
        """Note what differs from before and is not on the disk."""
        noted = {
            each["key"]: each["raw"]
            for file in (self.folder / "restore").glob("*.json")
            for each in json.loads(file.read_text())["values"]
        }
        for place, before in self.before.items():
            if self._value(place) == before:
                continue
            key = f"{place[0]:04X}:{place[1]:02X}"
            self.changed.add(key)
            signed = before - (1 << 8 * len(self.b.link.device.read(*place)))
            if noted.get(key) not in (before, signed):
                self.missing.append(f"{key} was {before}, on the disk {noted.get(key)}")


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("kind", [tool.kind for tool in TOOLS if tool.kind not in ELSEWHERE])
async def test_what_a_tool_changes_is_on_the_disk_at_each_write(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(STATE_FOLDER_VARIABLE, str(tmp_path))
    tool = BY_KIND[kind]
    async with direct(spec_of(), drive=DRIVES.get(kind, "r6l")) as b:
        b.link.url = URL
        recall(b.axis.drive, URL, STATION)
        await set_mode(b.axis, Mode.HM)  # one that a measurement has to restore
        watch = Watch(b, tmp_path)
        # As the server and the command line do around each tool.
        around = (
            profile_speed.prepared(b.axis, b.session, WIDE, True)
            if tool.closes_loops
            else keeping_mode(b.axis, b.session)
        )
        with contextlib.suppress(EnoughMotions):
            async with around:
                await begun(tool, b)
        assert watch.motions > 0
        assert "6060:00" in watch.changed
        assert not watch.missing
        assert not list((tmp_path / "restore").glob("*.json")), "all of it is restored"
