"""Trouble that needs a moment: something must be under way for it to hurt."""

from __future__ import annotations

import asyncio
import random
from collections.abc import Awaitable, Callable
from typing import Any

from benchmarks.chaos.people import Person
from benchmarks.chaos.station import TrialStation

#: So long is waited for somebody to measure or to move.
_WAIT_S = 4.0


class AimedTroubles:
    """Kinds of trouble that strike at a job, by what a page would see of it."""

    def __init__(
        self, station: TrialStation, people: list[Person], source: random.Random, say: Any
    ) -> None:
        self.station, self.people, self.random, self._say = station, people, source, say

    def kinds(self) -> list[Callable[[float], Awaitable[None]]]:
        """All of them."""
        every: list[Callable[[float], Awaitable[None]]] = [
            self.control_lost_and_regained,
            self.control_ends_in_a_job,
            self.cancel_by_a_cut,
            self.load_while_faulted,
            self.disk_full_in_a_job,
            self.mute_one,
        ]
        return every

    def _someone(self) -> Person | None:
        here = [p for p in self.people if p.socket is not None and p.drives and not p.mute]
        return self.random.choice(here) if here else None

    def _others(self, person: Person) -> list[Person]:
        return [p for p in self.people if p is not person and p.socket is not None]

    async def _job(self, person: Person) -> dict[str, Any] | None:
        """A motion that runs; begins one where nobody else does."""
        axis = self.random.randrange(len(person.drives))
        begin = self.random.choice([person.measure, person.measure, person.move, person.home])
        await begin(axis)
        end = asyncio.get_running_loop().time() + _WAIT_S
        while asyncio.get_running_loop().time() < end:
            answer = await person.ask("GET", "/jobs", "jobs")
            rows = answer.json() if answer is not None and answer.is_success else []
            running = [j for j in rows if j["state"] == "running" and j["drive"]]
            if running:
                return dict(self.random.choice(running))
            await asyncio.sleep(0.1)
        return None

    async def control_lost_and_regained(self, seconds: float) -> None:
        """Control passes to and fro while a job of the first runs on."""
        person = self._someone()
        if person is None or (job := await self._job(person)) is None:
            return
        drive = job["drive"]
        for other in self._others(person)[:1]:
            await person.send(type="lease", drive=drive, take=True)
            await person.send(type="lease_hand", drive=drive, to=other.connection)
            await asyncio.sleep(min(seconds, 1.0))
            await person.send(type="lease_ask", drive=drive)
            await other.send(type="lease_answer", drive=drive, give=self.random.random() < 0.7)
            await asyncio.sleep(0.2)
            await person.send(type="lease", drive=drive, take=True)

    async def control_ends_in_a_job(self, seconds: float) -> None:
        """Control was handed over for a second, and its time ends in the middle of a motion."""
        person = self._someone()
        if person is None:
            return
        for other in self._others(person)[:1]:
            for drive in person.drives:
                await person.send(type="lease", drive=drive, take=True)
                await person.send(type="lease_hand", drive=drive, to=other.connection, time_s=1.0)
            await self._job(other)
            await asyncio.sleep(max(seconds, 1.2))
            for drive in person.drives:
                await person.send(type="lease", drive=drive, take=False)
                await other.send(type="lease", drive=drive, take=False)

    async def cancel_by_a_cut(self, seconds: float) -> None:
        """The line of whoever measures is cut, and the drives' cable with it."""
        person = self._someone()
        if person is None or await self._job(person) is None:
            return
        await asyncio.sleep(self.random.uniform(0.0, 1.5))
        await person.leave("cut")
        if self.random.random() < 0.5:
            axis = self.random.randrange(len(self.station.specs))
            await self._cable(self.station.url_of(axis), min(seconds, 1.0))

    async def _cable(self, wire: str, seconds: float) -> None:
        station = self.station
        if station.bus == "ethercat":
            await asyncio.to_thread(station.trouble, "cut", cable=0)
            await asyncio.sleep(seconds)
            await asyncio.to_thread(station.trouble, "heal")
            return
        await asyncio.to_thread(station.trouble, "pull", wire=wire)
        await asyncio.sleep(seconds)
        await asyncio.to_thread(station.trouble, "heal", wire=wire)

    async def load_while_faulted(self, _seconds: float) -> None:
        """Parameters come out of a file into a drive that has a fault."""
        person = self._someone()
        if person is None:
            return
        axis = self.random.randrange(len(person.drives))
        ethercat = self.station.bus == "ethercat"
        where: dict[str, object] = (
            {"slave": axis} if ethercat else {"axis": self.station.specs[axis].name}
        )
        await person.save(axis)
        await asyncio.to_thread(self.station.trouble, "inject", what="overload", **where)
        for number in (1, 2, 3):
            keys = [self.station.specs[axis].setting]
            body = {"file": f"set {number}", "keys": keys, "accept_other_identity": True}
            await person.ask(
                "POST", f"/drives/{person.drives[axis]}/jobs/load_set", "load set", json=body
            )
        await person.reset(axis)

    async def disk_full_in_a_job(self, seconds: float) -> None:
        """There is room for a measurement to begin, and none for what it found."""
        person = self._someone()
        if person is None or await self._job(person) is None:
            return
        self.station.limit_files(self.random.choice([0, 4096]))
        await asyncio.sleep(max(seconds, 2.0))
        if self.station.down_since is None:
            self.station.limit_files(None)

    async def mute_one(self, seconds: float) -> None:
        """Of several drives on one line one says nothing."""
        number = self.random.randrange(len(self.station.specs))
        where: dict[str, object] = (
            {"slave": number}
            if self.station.bus == "ethercat"
            else {"wire": self.station.url_of(number), "station": self.station.place_of(number)}
        )
        await asyncio.to_thread(self.station.trouble, "mute", on=True, **where)
        await asyncio.sleep(seconds)
        await asyncio.to_thread(self.station.trouble, "mute", on=False, **where)
