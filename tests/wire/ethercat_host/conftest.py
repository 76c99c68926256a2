"""A virtual segment in a private network, and links to it."""

from __future__ import annotations

import asyncio
import functools
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import asynccontextmanager

import pytest

from drivers.errors import DriveError
from drivers.ethercat.link import EthercatLink
from drivers.link import LinkEvent
from drivers.virtual.wires.ethercat.launch import VirtualSegment
from drivers.virtual.wires.netns import Namespace, unavailable

FACTORY = "tests.wire.ethercat_host.servo_device:make_servo"


class Rig:
    """One private network with a segment of servo drives on ``ec0s``; the host takes ``ec0m``."""

    def __init__(
        self,
        namespace: Namespace,
        drives: tuple[str, ...],
        *,
        lockstep: bool = False,
        raw_frames: bool = True,
    ) -> None:
        """With ``lockstep`` time follows the frames, so that a busy machine is no trouble.

        Without ``raw_frames`` the host is that of Windows and macOS.
        """
        self.namespace = namespace
        self.drives = drives
        self.lockstep = lockstep
        self.raw_frames = raw_frames
        self.segment = self.start()

    def start(self) -> VirtualSegment:
        arguments = ["--factory", FACTORY, "--sdo-ms", "0.3"]
        arguments += ["--lockstep"] if self.lockstep else ["--realtime", "20"]
        for drive in self.drives:
            arguments += ["--drive", drive]
        self.segment = VirtualSegment.start("ec0s", arguments, self.namespace)
        return self.segment

    def again(self) -> None:
        """A fresh segment, whatever became of this one."""
        self.segment.close()
        self.start()
        self.peace()

    def do(self, command: str, **arguments: object) -> object:
        return self.segment.command(command, **arguments)

    def truth(self, slave: int, index: int) -> int:
        """The drive's own value, past the wire."""
        data = bytes.fromhex(str(self.do("read", slave=slave, index=index)))
        return int.from_bytes(data, "little", signed=index in (0x6064, 0x606C, 0x6077))

    def peace(self) -> None:
        """Undo all trouble of an earlier test."""
        self.do("peace")
        self.do("heal")
        self.do("timing", al_s=0.002, sdo_s=0.0003, eeprom_read_s=5e-5)
        for slave in range(len(self.drives)):
            self.do("mute", slave=slave, on=False)
            self.do("die_in_transfer", slave=slave, after_segments=None)
            self.do("power_on", slave=slave)
            self.do("inject", slave=slave, what="calm")
            for state in ("PREOP", "SAFEOP", "OP"):
                self.do("refuse", slave=slave, state=state, code=None)

    @asynccontextmanager
    async def link(self, *, scan: bool = True) -> AsyncIterator[Bus]:
        link = EthercatLink(
            "ec0m",
            url="ethercat://virtual0",
            launcher=self.namespace.command([]),
            lockstep=1.0 if self.lockstep else 0.0,
            raw_frames=self.raw_frames,
        )
        bus = Bus(link)
        await link.open()
        try:
            if scan:
                await link.scan(lambda _share, _text: None)
            yield bus
        finally:
            await link.close()


class Bus:
    """A link and what it showed."""

    def __init__(self, link: EthercatLink) -> None:
        self.link = link
        self.events: list[tuple[float, LinkEvent]] = []
        link.listen(lambda event: self.events.append((time.monotonic(), event)))

    @property
    def texts(self) -> list[str]:
        return [event.text.words() for _, event in self.events]

    async def reported(self, *words: str, within_s: float = 30.0) -> str:
        """Wait for an event with all these words."""
        found: list[str] = []

        def seen() -> bool:
            found[:] = [t for t in self.texts if all(w in t for w in words)]
            return bool(found)

        await until(seen, within_s, f"no event with {words} among {self.texts}")
        return found[0]


async def until(condition: Callable[[], bool], within_s: float, otherwise: str = "") -> float:
    """Poll until it holds; returns how long it took."""
    start = time.monotonic()
    while not condition():
        if time.monotonic() - start > within_s:
            raise AssertionError(otherwise or f"not within {within_s} s")
        await asyncio.sleep(0.005)
    return time.monotonic() - start


def repeated(test: Callable[[Rig], Awaitable[None]]) -> Callable[[Rig], Awaitable[None]]:
    """For what real time decides: a machine that stalls for a moment is no defect of the product.

    A defect fails every time.
    """

    @functools.wraps(test)
    async def patient(rig: Rig) -> None:
        for _ in range(3):
            try:
                await test(rig)
            except (AssertionError, DriveError):
                rig.again()
            else:
                return
        await test(rig)

    return patient


@pytest.fixture(scope="session")
def namespace() -> Iterator[Namespace]:
    reason = unavailable()
    if reason is not None:
        pytest.skip(reason)
    with Namespace.create() as made:
        yield made


@pytest.fixture(scope="module")
def shared_rig(namespace: Namespace, request: pytest.FixtureRequest) -> Iterator[Rig]:
    rig = Rig(
        namespace,
        ("servo", "servo"),
        lockstep=getattr(request.module, "LOCKSTEP", False),
        raw_frames=getattr(request.module, "RAW_FRAMES", True),
    )
    yield rig
    rig.segment.close()


@pytest.fixture
def rig(shared_rig: Rig) -> Rig:
    shared_rig.peace()
    return shared_rig
