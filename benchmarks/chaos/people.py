"""People at pages: each a websocket and an HTTP client that do random things."""

from __future__ import annotations

import asyncio
import contextlib
import json
import random
import time
from dataclasses import dataclass, field
from typing import Any

import httpx
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import WebSocketException

from benchmarks.chaos.judge import Claim, Judge
from benchmarks.chaos.station import PASSWORD, TrialStation

#: 200 ms without renewal, 300 rpm at 3000 rpm/s, and the lead of a moving target.
JOG_BRAKE_S, JOB_BRAKE_S, SILENT_S = 1.0, 1.5, 2.0
#: On a machine that has no time for it a write is noted this late.
_NOTED_S = 5.0
#: In the place of an axis that is off the bench.
_GONE = "gone"
JOG = {"speed": 300.0, "acceleration": 3000.0, "torque_limit": 200.0}


@dataclass
class Tally:
    """What was done and came of it, for the audit."""

    done: dict[str, int] = field(default_factory=dict)
    writes: list[tuple[str, str, int]] = field(default_factory=list)
    #: Writes that a killed server answered, but may not have had the time to note.
    uncertain: list[tuple[str, str, int]] = field(default_factory=list)
    _times: list[float] = field(default_factory=list)

    def count(self, what: str, status: int) -> None:
        key = f"{what} {status}"
        self.done[key] = self.done.get(key, 0) + 1

    def wrote(self, axis: str, key: str, raw: int) -> None:
        """A write was answered as done."""
        self.writes.append((axis, key, raw))
        self._times.append(time.monotonic())

    def killed(self) -> None:
        """The server is killed now: an answer waits a second for the disk, and no longer."""
        since = time.monotonic() - _NOTED_S
        self.uncertain += [w for w, at in zip(self.writes, self._times, strict=True) if at > since]


class Person:
    """One person with a page. ``mute`` pages stay open and say nothing."""

    def __init__(self, name: str, station: TrialStation, judge: Judge, source: random.Random,
                 tally: Tally, say: Any) -> None:  # fmt: skip
        self.name, self.station, self.judge = name, station, judge
        self.random, self.tally, self.say = source, tally, say
        self.socket: ClientConnection | None = None
        self.http: httpx.AsyncClient | None = None
        self.connection = ""
        self.mute = False
        self.drives: list[str] = []
        self.jogs: dict[int, Claim] = {}
        self._tasks: list[asyncio.Task[None]] = []
        self._stop_sent = 0.0

    # --- the page ---------------------------------------------------------------------

    async def arrive(self) -> None:
        """Log in and open the page."""
        await self.leave()
        self.mute = False
        self.http = httpx.AsyncClient(base_url=f"{self.station.root}/api/v1", timeout=30)
        if not await self.log_in(self.http):
            return
        session = (await self.http.get("/session")).json()
        self.http.headers["X-Servodeck-CSRF"] = session["csrf"] or "-"
        cookie = "; ".join(f"{k}={v}" for k, v in self.http.cookies.items())
        self.socket = await connect(
            f"{self.station.root.replace('http', 'ws')}/api/v1/live",
            max_size=None,
            additional_headers={"Cookie": cookie},
            close_timeout=0.2,
            ping_interval=None,
        )
        hello = json.loads(await self.socket.recv())
        self.connection = hello["connection"]
        self.http.headers["X-Servodeck-Connection"] = self.connection
        self._tasks = [
            asyncio.create_task(self._hear(self.socket)),
            asyncio.create_task(self._live()),
        ]
        listed = await self.http.get("/drives")
        known = {row["name"]: row["id"] for row in listed.json()}
        specs = self.station.specs
        for axis, spec in enumerate(specs):
            if spec.name in known:
                self.judge.ids[axis].add(known[spec.name])
        # With one off the bench the others keep their places.
        self.drives = [known.get(spec.name, _GONE) for spec in specs]

    async def log_in(self, http: httpx.AsyncClient) -> bool:
        """The cookie; False where it is not given at present."""
        answer = await http.post("/session", json={"name": self.name, "password": PASSWORD})
        if answer.status_code == 429:
            return False
        answer.raise_for_status()
        return True

    async def leave(self, how: str = "close") -> None:
        """The page goes: closed, or its line cut without a word."""
        self._gone()
        socket, self.socket = self.socket, None
        if socket is not None:
            if how == "cut":
                socket.transport.abort()
            else:
                with contextlib.suppress(WebSocketException, OSError, TimeoutError):
                    await socket.close()
        tasks, self._tasks = self._tasks, []
        for task in tasks:
            task.cancel()
        if tasks:
            await asyncio.wait(tasks)
        http, self.http = self.http, None
        if http is not None:
            await http.aclose()

    def fall_silent(self) -> None:
        """The page stays open and says nothing any more."""
        self.mute = True
        self._gone(SILENT_S)

    def _gone(self, after_s: float = 0.0) -> None:
        self.jogs.clear()
        self.judge.end_claims(person=self.name, at=time.monotonic() + after_s)

    async def _live(self) -> None:
        """A sign of life, as a page gives it, unless it fell silent."""
        while True:
            await self.send(type="ping", n=1)
            await asyncio.sleep(0.5)

    async def _hear(self, socket: ClientConnection) -> None:
        with contextlib.suppress(WebSocketException, OSError):
            async for text in socket:
                if isinstance(text, str):
                    self._heard(json.loads(text))

    def _heard(self, message: dict[str, Any]) -> None:
        problem = message.get("problem") or (message.get("job") or {}).get("problem")
        if problem and problem["status"] == 500 and problem["type"] == "urn:servodeck:internal":
            self.judge.violated(
                f"{message['type']}: internal error: {problem['detail']}", problem["detail"][:60]
            )
        if message["type"] == "stop_result":
            self._stop_answered(message["result"], self._stop_sent)
        if message["type"] == "job" and message["job"]["state"] != "running":
            with self.judge._lock:
                for claim in self.judge.claims:
                    if claim.job == message["job"]["id"]:
                        claim.end(time.monotonic())

    async def send(self, **message: object) -> None:
        if self.socket is None or self.mute:
            return
        with contextlib.suppress(WebSocketException, OSError):
            await self.socket.send(json.dumps(message))

    async def ask(
        self, method: str, path: str, what: str = "", **options: Any
    ) -> httpx.Response | None:
        if self.http is None:
            return None
        try:
            answer = await self.http.request(method, path, **options)
        except httpx.HTTPError as error:
            quiet = (
                self.station.down_since is not None or time.monotonic() < self.judge.pause_polling
            )
            if not quiet and isinstance(error, httpx.ReadTimeout):
                self.judge.violated(f"{method} {path}: no answer in 30 s", f"hung {path}")
            return None
        self.judge.answered(method, path, answer.status_code, answer.text)
        self.tally.count(what or f"{method} {path}", answer.status_code)
        return answer

    # --- what people do ---------------------------------------------------------------

    async def act(self) -> None:
        """One random thing."""
        if self.socket is None or not self.drives or _GONE in self.drives:
            with contextlib.suppress(httpx.HTTPError, WebSocketException, OSError, TimeoutError):
                await self.arrive()
            return
        axis = self.random.randrange(len(self.drives))
        actions = [
            (6, self.jog), (4, self.move), (2, self.enable), (2, self.home), (3, self.write),
            (2, self.stop), (1, self.lease), (2, self.scope), (1, self.scan), (1, self.save),
            (2, self.read_all), (1, self.record), (2, self.cyclic), (1, self.measure),
            (1, self.reset), (1, self.generate), (1, self.load_set), (1, self.nonsense),
            (1, self.cancel), (1, self.reload), (1, self.look), (1, self.remove_and_add),
            (1, self.invite), (2, self.energise),
        ]  # fmt: skip
        action = self.random.choices([a for _, a in actions], [w for w, _ in actions])[0]
        self.say(f"{self.name}: {action.__name__} {self.station.specs[axis].name}")
        await action(axis)

    async def jog(self, axis: int) -> None:
        """Hold the button, well, badly, or let the line die while holding it."""
        if not self.drives:
            return  # a guest who was not let in
        drive, travel = self.drives[axis], self.random.choice([0.5, 3.0, 8.0])
        claim = self.judge.claim(axis, "jog", self.name, JOG_BRAKE_S, travel)
        await self.send(
            type="jog_start",
            drive=drive,
            direction=self.random.choice([-1, 1]),
            travel_limit=travel,
            **JOG,
        )
        end = time.monotonic() + self.random.uniform(0.2, 2.0)
        how = self.random.choice(["release", "release", "forget", "late", "stop", "cut"])
        while time.monotonic() < end and self.socket is not None:
            await self.send(type="jog_renew", drive=drive)
            await asyncio.sleep(0.4 if how == "late" and self.random.random() < 0.05 else 0.04)
        if how == "release":
            await self.send(type="jog_stop", drive=drive)
        elif how == "stop":
            await self.stop(axis)
        elif how == "cut":
            await self.leave("cut")
        claim.end(time.monotonic() + 0.2)

    async def _job(self, axis: int, kind: str, body: dict[str, Any], travel: float,
                   brake_s: float = JOB_BRAKE_S) -> None:  # fmt: skip
        claim = self.judge.claim(axis, kind, self.name, brake_s, travel)
        answer = await self.ask("POST", f"/drives/{self.drives[axis]}/jobs/{kind}", kind, json=body)
        if answer is None:
            return
        if answer.status_code != 202:
            claim.end(time.monotonic())
            return
        claim.job = answer.json()["id"]
        again = await self.ask("GET", f"/jobs/{claim.job}", "job")
        if again is not None and again.is_success and again.json()["state"] != "running":
            claim.end(time.monotonic())

    async def move(self, axis: int) -> None:
        target = self.random.choice([-2.0, -0.5, 0.5, 2.0, 2.0, 9.0])
        body = {"mode": "PP", "target": target, "relative": True, "speed": 300,
                "acceleration": 3000, "deceleration": 3000, "travel_limit": 3, "torque_limit": 200,
                "timeout_s": 10}  # fmt: skip
        if self.random.random() < 0.2:
            # Legal only with consent, which is not given where nothing in the drive watches.
            body |= {"mode": "PV", "target": 200, "timeout_s": 0.5}
        await self._job(axis, "move", body, 3.0)

    async def enable(self, axis: int) -> None:
        goal = self.random.choice(
            ["Operation enabled", "Operation enabled", "Switched on", "Switch on disabled"]
        )
        claim = self.judge.claim(axis, "transition", self.name, JOB_BRAKE_S)
        await self.ask(
            "POST",
            f"/drives/{self.drives[axis]}/transition",
            "transition",
            json={"goal": goal, "mode": self.random.choice([1, 1, 3, 8])},
        )
        claim.end(time.monotonic())

    async def home(self, axis: int) -> None:
        body = {"method": self.random.choice([35, 33, 34, 1, 99]), "speed_switch": 60,
                "speed_zero": 20, "acceleration": 1000, "travel_limit": 2, "torque_limit": 100,
                "timeout_s": 4}  # fmt: skip
        await self._job(axis, "home", body, 3.0, 2.0)

    async def measure(self, axis: int) -> None:
        limits = {"travel_limit": 3, "speed_limit": 300, "torque_limit": 60, "time_limit_s": 20}
        kind = self.random.choice(["sweep", "inertia", "step", "autotune"])
        await self._job(axis, kind, limits, 4.0, 2.5)

    async def generate(self, axis: int) -> None:
        body = {"mode": "CSP", "shape": "sine", "amplitude": 0.5, "duration_s": 2,
                "frequency_hz": 1, "travel_limit": 1, "speed_limit": 600,
                "torque_limit": 200}  # fmt: skip
        await self._job(axis, "generate", body, 1.0)

    async def write(self, axis: int) -> None:
        spec, drive = self.station.specs[axis], self.drives[axis]
        raw = self.random.randint(spec.low, spec.high)
        if self.random.random() < 0.3:
            raw = self.random.choice([-(2**40), 10**9, 2**70])
        answer = await self.ask(
            "PUT", f"/drives/{drive}/parameters/{spec.setting}", "write", json={"raw": raw}
        )
        if answer is not None and answer.is_success:
            # What was read back: somebody else's write may have come between.
            self.tally.wrote(spec.name, spec.setting, answer.json()["raw"])
            if not spec.low <= raw <= spec.high:
                self.judge.violated(f"{raw} was taken for {spec.setting}")

    async def stop(self, axis: int) -> None:
        sent = time.monotonic()
        which = self.drives[axis] if self.random.random() < 0.5 else None
        if self.random.random() < 0.5:
            self._stop_sent = sent
            await self.send(type="stop", drive=which)
            if self.mute or self.socket is None:
                return
            # The answer to a ping comes after the stop: it was carried out then.
            await asyncio.sleep(0.3)
            return
        answer = await self.ask("POST", "/stop", "stop", json={"drive": which})
        if answer is None or not answer.is_success:
            return
        self._stop_answered(answer.json(), sent)

    def _stop_answered(self, result: dict[str, Any], sent: float) -> None:
        for number, drive in enumerate(self.drives):
            if drive in result["stopped"]:
                # STOP's answer is by the measured speed: it stands now.
                self.judge.end_claims(axis=number, before=sent, stands=True)
        self.judge.stop_answered(result["axes"], sent)

    async def lease(self, axis: int) -> None:
        drive = self.drives[axis]
        kind = self.random.choice(["take", "give", "give", "ask", "override"])
        if kind in ("take", "give"):
            await self.send(type="lease", drive=drive, take=kind == "take")
        elif kind == "ask":
            await self.send(type="lease_ask", drive=drive)
        else:
            await self.send(type="lease_override", drive=drive)

    async def scope(self, axis: int) -> None:
        number = self.random.randint(1, 3)
        if self.random.random() < 0.3:
            await self.send(type="scope_stop", subscription=number)
            return
        keys = self.random.sample(["6064:00", "606C:00", "6041:00", "6077:00"], 2)
        channels = [{"drive": self.drives[axis], "key": key} for key in keys]
        await self.send(type="scope_start", subscription=number, channels=channels)

    async def scan(self, axis: int) -> None:
        body = {"url": self.station.url_of(axis), "stations": [1, 2, 3]}
        await self.ask("POST", "/scan", "scan", json=body)

    async def save(self, axis: int) -> None:
        name = f"set {self.random.randint(1, 3)}"
        await self.ask(
            "POST",
            f"/drives/{self.drives[axis]}/sets",
            "save set",
            json={"file": name, "overwrite": True},
        )
        if self.random.random() < 0.3:
            await self.ask("POST", f"/drives/{self.drives[axis]}/procedures/save", "procedure save",
                           json={"confirmed": True})  # fmt: skip

    async def load_set(self, axis: int) -> None:
        name = f"set {self.random.randint(1, 3)}"
        await self.ask("POST", f"/drives/{self.drives[axis]}/jobs/load_set", "load set",
                       json={"file": name, "keys": [self.station.specs[axis].setting],
                             "accept_other_identity": True})  # fmt: skip

    async def read_all(self, axis: int) -> None:
        await self.ask("POST", f"/drives/{self.drives[axis]}/jobs/read_all", "read all", json={})

    async def record(self, axis: int) -> None:
        channels = [{"drive": self.drives[axis], "key": "6064:00"}]
        answer = await self.ask(
            "POST", "/recordings", "record", json={"channels": channels, "duration_s": 5}
        )
        if answer is not None and answer.is_success and self.random.random() < 0.5:
            await asyncio.sleep(0.5)
            await self.ask("POST", f"/recordings/{answer.json()['name']}/stop", "end recording")

    async def cyclic(self, axis: int) -> None:
        url = self.station.url_of(axis)
        if self.random.random() < 0.7:
            body = {"url": url, "cycle_us": 2000}
            await self.ask("POST", "/buses/cyclic", "cyclic", json=body)
        else:
            await self.ask("DELETE", "/buses/cyclic", "end cyclic", params={"url": url})

    async def reset(self, axis: int) -> None:
        await self.ask("POST", f"/drives/{self.drives[axis]}/fault-reset", "fault reset", json={})

    async def nonsense(self, axis: int) -> None:
        await self.send(type="jog_start", drive="nobody", direction=7)
        await self.ask(
            "POST", f"/drives/{self.drives[axis]}/jobs/move", "nonsense", json={"mode": 1}
        )

    async def energise(self, axis: int) -> None:
        """What enables or moves an axis, as parameters: refused, in whatever order."""
        spec, drive = self.station.specs[axis], self.drives[axis]
        values = {key: {"raw": raw} for key, raw in spec.energising}
        if self.random.random() < 0.5:
            for key, value in values.items():
                answer = await self.ask(
                    "PUT", f"/drives/{drive}/parameters/{key}", "energise", json=value
                )
                if answer is not None and answer.is_success:
                    self.judge.violated(f"{spec.name}: {key} was written as a parameter")
            return
        answer = await self.ask(
            "PUT", f"/drives/{drive}/parameters", "energise all", json={"values": values}
        )
        written = (
            []
            if answer is None or not answer.is_success
            else [row["key"] for row in answer.json() if row["ok"]]
        )
        if written:
            self.judge.violated(f"{spec.name}: {written} were written as parameters")

    async def cancel(self, _axis: int) -> None:
        answer = await self.ask("GET", "/jobs", "jobs")
        if answer is None or not answer.is_success:
            return
        running = [job["id"] for job in answer.json() if job["state"] == "running"]
        if running:
            await self.ask("DELETE", f"/jobs/{self.random.choice(running)}", "cancel")

    async def reload(self, _axis: int) -> None:
        await self.leave()

    async def look(self, axis: int) -> None:
        for path in ("/log", "/audit", "/recordings", "/buses", "/sets", "/people",
                     f"/drives/{self.drives[axis]}/parameters",
                     f"/drives/{self.drives[axis]}/functions",
                     f"/drives/{self.drives[axis]}/faults"):  # fmt: skip
            await self.ask("GET", path, "look")

    async def invite(self, axis: int) -> None:
        """A guest jogs while the enabling button is held here, and goes again."""
        rights = ["motion"]
        body = {"guest": f"Guest of {self.name}", "allowed": rights}
        answer = await self.ask("POST", "/invitations", "invite", json=body)
        if answer is None or not answer.is_success:
            return
        made = answer.json()
        number = made["invitation"]["id"]
        guest = Guest(self, made["link"].removeprefix("/guest/"), made["invitation"]["code"])
        try:
            await guest.arrive()
            await self.ask("PUT", f"/invitations/{number}/grant", "grant",
                           json={"rights": rights, "minutes": 1})  # fmt: skip
            await self.send(type="enable_press", invitation=number)
            jogging = asyncio.create_task(guest.jog(axis))
            end = time.monotonic() + self.random.uniform(0.2, 1.5)
            while time.monotonic() < end:
                await self.send(type="enable_renew", invitation=number)
                await asyncio.sleep(0.04)
            if self.random.random() < 0.3:
                # The line of who moves hangs, while the button on site is held on.
                guest.mute = True
                self.judge.end_claims(person=guest.name, at=time.monotonic() + 0.2)
                for _ in range(25):
                    await self.send(type="enable_renew", invitation=number)
                    await asyncio.sleep(0.04)
            if self.random.random() < 0.7:
                await self.send(type="enable_release", invitation=number)
            # Else it is forgotten: 200 ms without a sign of life are the same.
            self.judge.end_claims(person=guest.name, at=time.monotonic() + 0.2)
            await jogging
            await self.ask("DELETE", f"/invitations/{number}", "end invitation")
        finally:
            await guest.leave()

    async def remove_and_add(self, axis: int) -> None:
        """Take an axis off the bench while others work with it, and add it again."""
        self.judge.troubled = max(self.judge.troubled, time.monotonic())
        answer = await self.ask("DELETE", f"/drives/{self.drives[axis]}", "remove")
        if answer is not None and answer.is_success:
            self.judge.end_claims(axis=axis, before=time.monotonic())
            body = self.station.connecting(axis)
            for _ in range(60):
                again = await self.ask("POST", "/drives", "add", json=body)
                if again is None or again.is_success or self.station.down_since:
                    break
                await asyncio.sleep(0.5)


class Guest(Person):
    """Somebody from elsewhere, by invitation."""

    def __init__(self, host: Person, link: str, code: str) -> None:
        super().__init__(
            f"Guest of {host.name}", host.station, host.judge, host.random, host.tally, host.say
        )
        self._invited = {"link": link, "code": code}

    async def log_in(self, http: httpx.AsyncClient) -> bool:
        """By the link and the code."""
        answer = await http.post("/guests", json=self._invited)
        return answer.is_success
