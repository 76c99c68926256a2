"""One virtual drive on a bench of the product, in simulated time, without a wire."""

from __future__ import annotations

import asyncio
import math
import tempfile
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx

from backend.api.app import make_app
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from drivers.errors import LinkTimeout
from drivers.link import Address
from drivers.virtual.device import Device
from drivers.virtual.firmware.factory import make_device
from drivers.virtual.firmware.servo import VirtualServo
from drivers.virtual.mechanics import FrictionSpec, MechanicsSpec, MotorSpec
from profiles.loader import load_profile
from profiles.schema import Profile
from tests.virtual.tools.direct import DirectLink

URL = "ethercat://rig"
STATION = 1
_ACCESS_S = 0.5e-3
_TURN_S = 0.01
_TIME_OUT_S = 0.5
TURN_DEG = 360.0


class RigLink(DirectLink):
    """The link of `tests.virtual.tools.direct` with the event loop's own simulated time."""

    url = URL

    def __init__(self, device: Device, profile: Profile) -> None:
        super().__init__(device, profile)
        self.kind = "canopen" if profile.drive == "ds_c" else "ethercat"
        self.mute = False
        """The mailbox takes and answers nothing; process data go on."""
        self.lost_data = False
        self._start_s = 0.0

    async def open(self) -> None:
        self._start_s = asyncio.get_running_loop().time()
        self.device.advance(0)

    async def close(self) -> None:
        await self.stop()

    def catch_up(self) -> None:
        """The drive's time is the loop's."""
        passed = asyncio.get_running_loop().time() - self._start_s
        self.now_ns = max(self.now_ns, round(passed * 1e9))
        self.device.advance(self.now_ns)

    async def _turn(self) -> None:
        if self.mute:
            await asyncio.sleep(_TIME_OUT_S)
            raise LinkTimeout("the mailbox is mute")
        await asyncio.sleep(_ACCESS_S)

    def _access(self) -> None:
        self.catch_up()

    async def read(self, station: int, address: Address) -> bytes:
        await self._turn()
        return await super().read(station, address)

    async def write(self, station: int, address: Address, data: bytes) -> None:
        await self._turn()
        await super().write(station, address, data)

    @property
    def running(self) -> bool:
        return super().running and not self.lost_data

    async def _run(self) -> None:
        per_turn = max(1, round(_TURN_S * 1e9 / self.cycle_ns))
        while not self.lost_data:
            rows = [self._cycle() for _ in range(per_turn)]
            self._deliver(rows, 0)
            ahead_s = self.now_ns / 1e9 - (asyncio.get_running_loop().time() - self._start_s)
            await asyncio.sleep(max(ahead_s, 0.0))

    async def stop(self) -> None:
        was = self._pump is not None
        if was and self._loop is not None and not self.lost_data:
            self._loop.stop("ended")
            await asyncio.sleep(0.05)
        await super().stop()
        if was:
            # The drive sees its process data end, whoever ended them.
            self.device.communication_lost("watchdog")

    def lose_process_data(self) -> None:
        """No frame comes any more; the drive's watchdog sees it at once."""
        self.lost_data = True
        self.device.communication_lost("watchdog")

    def newest(self, channels: list[str], within_s: float) -> dict[str, float]:
        """See `drivers.link.Cyclic.newest`."""
        del within_s
        if not self.running:
            return {}
        values = self._unpack.unpack(self._latched)
        reported = {name: values[place] for place, name in self._columns[1]}
        return {name: reported[name] for name in channels if name in reported}


@dataclass
class Rig:
    """A drive, its bench and the way to ask the server."""

    family: str
    bench: Bench
    connected: ConnectedDrive
    link: RigLink
    device: VirtualServo
    http: httpx.AsyncClient
    kept: list[asyncio.Task[None]] = field(default_factory=list)
    before_trigger: Callable[[], Awaitable[None]] | None = None
    """Waited for between enabling and the trigger of a drive's own identification."""

    def keep(self, work: Coroutine[None, None, None]) -> None:
        """Run next to the test until the bench closes."""
        self.kept.append(asyncio.create_task(work))

    @property
    def shaft_rpm(self) -> float:
        """The shaft's own speed, past every wire."""
        self.link.catch_up()
        return abs(self.device.axis.speed_rad_s) * 30.0 / math.pi

    @property
    def shaft_deg(self) -> float:
        """The shaft's own angle."""
        self.link.catch_up()
        return self.device.axis.angle_rad / (2.0 * math.pi) * TURN_DEG

    def poke(self, key: str, raw: int) -> None:
        """Write past the server, as another tool does."""
        self.link.catch_up()
        parameter = self.device.profile.by_key[key]
        size = {"8": 1, "16": 2, "32": 4}[parameter.type.lstrip("UINT")]
        data = (raw % 256**size).to_bytes(size, "little")
        self.device.write(parameter.index or 0, parameter.subindex or 0, data)

    async def until_rpm(self, rpm: float, limit_s: float = 3.0) -> None:
        """Wait until the shaft turns at this speed at least.

        Raises:
            AssertionError: it does not.
        """
        end = asyncio.get_running_loop().time() + limit_s
        while self.shaft_rpm < rpm:
            assert asyncio.get_running_loop().time() < end, f"only {self.shaft_rpm:.1f} rpm"
            await asyncio.sleep(0.01)


def free_axis(*, brake: bool = False, gravity_nm: float = 0.0) -> MechanicsSpec:
    """A motor with little friction: what coasts does so for seconds."""
    return MechanicsSpec(
        motor=MotorSpec(inertia_kgm2=2e-4, rated_torque_nm=1.27, rated_speed_rpm=3000, brake=brake),
        friction=FrictionSpec(viscous_nms=2e-5, coulomb_nm=0.002, gravity_nm=gravity_nm),
    )


@asynccontextmanager
async def rig(family: str, spec: MechanicsSpec | None = None) -> AsyncIterator[Rig]:
    """A bench with one drive of this family. In a `clock.SimulatedLoop`."""
    profile = load_profile(family)
    device = make_device(family, spec or free_axis())
    assert isinstance(device, VirtualServo)
    link = RigLink(device, profile)
    url = URL if link.kind == "ethercat" else "canopen://rig"
    link.url = url
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(Path(folder), {url: lambda: link})
        connected = await bench.connect(url, STATION, family, "X")
        app: Any = make_app(bench, hosts=frozenset({"test"}))
        transport = httpx.ASGITransport(app)
        root = "http://test/api/v1"
        async with httpx.AsyncClient(transport=transport, base_url=root, timeout=60) as http:
            try:
                made = Rig(family, bench, connected, link, device, http)
                yield made
            finally:
                for task in made.kept:
                    task.cancel()
                link.mute = False
                await bench.close()
