"""Trouble of every kind, each with its end."""

from __future__ import annotations

import asyncio
import os
import random
import signal
import time
from collections.abc import Awaitable, Callable
from typing import Any

from benchmarks.chaos.judge import Judge
from benchmarks.chaos.people import Tally
from benchmarks.chaos.station import TrialStation
from benchmarks.chaos.trouble_more import AimedTroubles

Trouble = Callable[[float], Awaitable[None]]


class Troubles:
    """Makes trouble for some seconds and undoes it."""

    def __init__(
        self,
        station: TrialStation,
        judge: Judge,
        source: random.Random,
        say: Any,
        tally: Tally,
        aimed: AimedTroubles,
    ) -> None:
        self._tally, self._aimed = tally, aimed
        self.station, self.judge, self.random, self._say = station, judge, source, say
        self.server_was_killed = False
        self.cycled: set[int] = set()

    def kinds(self) -> list[Trouble]:
        """What this bus can suffer."""
        every: list[Trouble] = [
            self.pull, self.blip, self.mute, self.power_cycle, self.fault, self.stop_server,
            self.kill_server, self.full_disk, self.clock, self.stop_drives,
        ]  # fmt: skip
        every += self._aimed.kinds()
        if self.station.bus == "ethercat":
            every += [
                self.lose, self.counter, self.late, self.slow_sdo, self.stop_host,
                self.kill_host, self.kill_segment, self.power_twice, self.cycle_in_exchange,
            ]  # fmt: skip
        return every

    async def make(self, seconds: float) -> None:
        """One random trouble of that length."""
        trouble = self.random.choice(self.kinds())
        name = getattr(trouble, "__name__", "?")
        self._say(f"trouble: {name} for {seconds:.2f} s")
        # Until it is over the reason does not grow old.
        self.judge.troubled = float("inf")
        try:
            await trouble(seconds)
        finally:
            self.judge.troubled = time.monotonic()
        self._say(f"trouble: {name} is over")

    def _axis(self) -> int:
        return self.random.randrange(len(self.station.specs))

    async def _send(self, do: str, **arguments: object) -> None:
        await asyncio.to_thread(self.station.trouble, do, **arguments)

    @property
    def _ethercat(self) -> bool:
        return self.station.bus == "ethercat"

    async def pull(self, seconds: float) -> None:
        if self._ethercat:
            await self._send("cut", cable=self._axis())
            await asyncio.sleep(seconds)
            await self._send("heal")
            return
        wire = self.station.url_of(self._axis())
        await self._send("pull", wire=wire)
        await asyncio.sleep(seconds)
        await self._send("heal", wire=wire)

    async def blip(self, _seconds: float) -> None:
        """A cable that is loose: many short breaks."""
        for _ in range(self.random.randint(2, 6)):
            await self.pull(self.random.uniform(0.02, 0.3))
            await asyncio.sleep(self.random.uniform(0.02, 0.3))

    async def mute(self, seconds: float) -> None:
        axis = self._axis()
        where: dict[str, object] = (
            {"slave": axis} if self._ethercat else {"wire": self.station.url_of(axis)}
        )
        await self._send("mute", on=True, **where)
        await asyncio.sleep(seconds)
        await self._send("mute", on=False, **where)

    async def power_cycle(self, seconds: float) -> None:
        axis = self._axis()
        self.cycled.add(axis)
        self.judge.unclear[axis] = "its supply was off"
        if self._ethercat:
            await self._send("power_cycle", slave=axis, off_s=seconds)
        else:
            await self._send("power_cycle", axis=self.station.specs[axis].name, off_s=seconds)
        await asyncio.sleep(seconds)

    async def power_twice(self, seconds: float) -> None:
        """Off again in the middle of its return."""
        await self.power_cycle(0.3)
        await asyncio.sleep(self.random.uniform(0.1, 1.0))
        await self.power_cycle(min(seconds, 1.0))

    async def cycle_in_exchange(self, seconds: float) -> None:
        """Process data of all drives are exchanged, and the supply of one of them fails."""
        for person in self._aimed.people:
            if person.socket is not None and person.drives:
                await person.ask(
                    "POST",
                    "/buses/cyclic",
                    "cyclic",
                    json={"url": self.station.urls[0], "cycle_us": 2000},
                )
                break
        await self.power_cycle(seconds)

    async def fault(self, _seconds: float) -> None:
        axis = self._axis()
        where: dict[str, object] = (
            {"slave": axis} if self._ethercat else {"axis": self.station.specs[axis].name}
        )
        await self._send("inject", what="overload", **where)

    async def lose(self, seconds: float) -> None:
        await self._send(
            "lose",
            chance=self.random.choice([0.01, 0.1, 0.6, 1.0]),
            cyclic=self.random.random() < 0.5,
            direction=self.random.choice(["in", "out"]),
        )
        await asyncio.sleep(seconds)
        await self._send("peace")

    async def counter(self, seconds: float) -> None:
        await self._send("counter", by=-1, chance=self.random.choice([0.05, 0.5, 1.0]))
        await asyncio.sleep(seconds)
        await self._send("peace")

    async def late(self, seconds: float) -> None:
        await self._send("late", by_s=0.02, chance=0.1)
        await asyncio.sleep(seconds)
        await self._send("peace")

    async def slow_sdo(self, seconds: float) -> None:
        await self._send("timing", sdo_s=0.08, al_s=0.1)
        await asyncio.sleep(seconds)
        await self._send("timing", sdo_s=0.001, al_s=0.002)

    async def _stopped(self, process: int | None, seconds: float) -> None:
        if process is None:
            return
        try:
            os.kill(process, signal.SIGSTOP)
        except ProcessLookupError:
            return
        await asyncio.sleep(seconds)
        try:
            os.kill(process, signal.SIGCONT)
        except ProcessLookupError:
            return

    async def stop_server(self, seconds: float) -> None:
        process = self.station.process
        if process is None:
            return
        self.judge.pause_polling = time.monotonic() + min(seconds, 3.0) + 2.0
        self.judge.lag(seconds)
        await self._stopped(process.pid, min(seconds, 3.0))

    async def stop_drives(self, seconds: float) -> None:
        """The drives stand still in time; for the server they are mute."""
        self.judge.blind = time.monotonic() + min(seconds, 2.0) + 2.0
        await self._stopped(self.station.virtual_process(), min(seconds, 2.0))

    async def stop_host(self, seconds: float) -> None:
        await self._stopped(self.station.host_process(), min(seconds, 3.0))

    async def kill_host(self, _seconds: float) -> None:
        process = self.station.host_process()
        if process is not None:
            os.kill(process, signal.SIGKILL)

    async def kill_segment(self, seconds: float) -> None:
        for axis in range(len(self.station.specs)):
            self.judge.unclear[axis] = "its process was killed"
            self.cycled.add(axis)
        await asyncio.to_thread(self.station.segment.kill)
        await asyncio.sleep(seconds)
        await asyncio.to_thread(self.station.locked, self.station.restart_segment)

    async def kill_server(self, _seconds: float) -> None:
        self.server_was_killed = True
        self._tally.killed()
        self.judge.end_claims()
        for axis in range(len(self.station.specs)):
            # A move to a target goes on to its target in the drive.
            self.judge.unclear.setdefault(axis, "the server was killed")
        await asyncio.to_thread(self.station.kill_server)
        await asyncio.sleep(0.5)
        await asyncio.to_thread(self.station.start_server)

    async def full_disk(self, seconds: float) -> None:
        self.station.limit_files(self.random.choice([0, 4096, 100_000]))
        await asyncio.sleep(seconds)
        self.station.limit_files(None)

    async def clock(self, seconds: float) -> None:
        """Set, for a while; sessions may end by it, grants and hand-overs not."""
        by_s = self.random.choice([-86400.0, -60.0, 60.0, 86400.0])
        if self.station.down_since is None:
            await asyncio.to_thread(self.station.tell_server, do="jump", by_s=by_s)
            await asyncio.sleep(max(seconds, 0.5))
            if self.station.down_since is None:
                await asyncio.to_thread(self.station.tell_server, do="jump", by_s=-by_s)
