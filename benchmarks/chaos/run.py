"""Episodes of trouble, each with a quiet end, and the verdict."""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import random
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

import httpx
import numpy as np
from websockets.exceptions import WebSocketException

from benchmarks.chaos.judge import P99_S, Judge
from benchmarks.chaos.people import Person, Tally
from benchmarks.chaos.station import BUSES, TrialStation, specs_of, starved_s
from benchmarks.chaos.trouble import Troubles
from benchmarks.chaos.trouble_more import AimedTroubles

#: Everything answers again within this time after the last trouble (docs/safety.md).
RECOVERED_S = 30.0
#: Everybody gone for this long: nothing moves, nothing is enabled.
QUIET_S = 12.0
_WATCHED = {
    "mms7": (0x6060, 0x6072, 0x6081, 0x6083, 0x6084, 0x60E0, 0x60E1),
    "m6l": (0x6060, 0x6072, 0x6081, 0x6083, 0x6084, 0x60E0, 0x60E1),
    "r6l": (0x6060, 0x6072, 0x6081, 0x6083, 0x6084, 0x60E0, 0x60E1),
    "ep3e": (0x6060, 0x6072, 0x6081, 0x6083, 0x6084, 0x60E0, 0x60E1),
    "ds_c": (0x6081, 0x6083, 0x6084),
}


class Trial:
    """One bus and one seed."""

    def __init__(self, bus: str, seed: int, seconds: float, folder: Path, log: Any) -> None:
        self.bus, self.seed, self.seconds, self.folder = bus, seed, seconds, folder
        self._began, self._out = time.monotonic(), log
        self.random = random.Random(f"{bus} {seed}")
        self.station = TrialStation(folder, bus, specs_of(bus, seed))
        self.judge = Judge(self.station, self.say)
        self.tally = Tally()
        self.people = [
            Person(name, self.station, self.judge, random.Random(f"{bus} {seed} {name}"),
                   self.tally, self.say)
            for name in ("Anna", "Olaf", "Petra")
        ]  # fmt: skip
        aimed = AimedTroubles(self.station, self.people, self.random, self.say)
        self.troubles = Troubles(self.station, self.judge, self.random, self.say, self.tally, aimed)
        self.figures: list[dict[str, Any]] = []

    def say(self, text: str) -> None:
        print(f"{time.monotonic() - self._began:8.3f} {text}", file=self._out, flush=True)

    async def run(self) -> None:
        """All of it; what is found is in the judge's record."""
        await asyncio.to_thread(self.station.start)
        try:
            await self._set_up()
            self.judge.start()
            end = time.monotonic() + self.seconds
            while time.monotonic() < end:
                await self._episode()
            await self._finish()
        finally:
            self.judge.close()
            for person in self.people:
                await person.leave()
            await asyncio.to_thread(self.station.stop)
            self.judge.read_log()

    async def _set_up(self) -> None:
        anna = self.people[0]
        await anna.arrive()
        for number in range(len(self.station.specs)):
            answer = await anna.ask("POST", "/drives", json=self.station.connecting(number))
            assert answer is not None
            assert answer.is_success, answer.text
        await anna.arrive()
        for axis, drive in enumerate(anna.drives):
            where = (
                {"slave": axis}
                if self.bus == "ethercat"
                else {"axis": self.station.specs[axis].name}
            )
            await asyncio.to_thread(
                self.station.trouble, "inject", what="turn_to_rev", value=3.0, **where
            )
            answer = await anna.ask("GET", f"/drives/{drive}/state")
            truth = self.station.truth(axis)
            assert answer is not None
            assert truth is not None
            shown = answer.json()["position"]
            assert shown is not None, answer.text
            self.judge.counts[axis] = abs(truth.position / shown) if abs(shown) > 0.5 else 10000.0
            self.say(
                f"{self.station.specs[axis].name}: {self.judge.counts[axis]:.0f} counts per rev"
            )
        await anna.leave()

    # --- an episode -------------------------------------------------------------------

    async def _episode(self) -> None:
        self.troubles.server_was_killed = False
        self.troubles.cycled.clear()
        before = await asyncio.to_thread(self._values)
        known = len(self.judge.record.violations)
        length = self.random.uniform(4.0, 12.0)
        self.say(f"--- an episode of {length:.1f} s")
        trouble = asyncio.create_task(self._trouble(length))
        people = [asyncio.create_task(self._person(p, length)) for p in self.people]
        await asyncio.wait([trouble, *people])
        for task in (trouble, *people):
            if task.exception() is not None:
                raise task.exception()  # type: ignore[misc]
        await self._quiet(before)
        if len(self.judge.record.violations) > known:
            await self._print_log()

    async def _print_log(self) -> None:
        """What the server itself reports of it."""
        anna = self.people[0]
        with contextlib.suppress(httpx.HTTPError, WebSocketException, OSError):
            await anna.arrive()
            answer = await anna.ask("GET", "/log")
            for entry in [] if answer is None else reversed(answer.json()[:60]):
                self.say(f"    {entry['time'][11:23]} {entry['drive'] or ''}: {entry['text']}")
            await anna.leave()

    async def _trouble(self, length: float) -> None:
        for _ in range(self.random.choice([0, 1, 1, 2, 3])):
            await asyncio.sleep(self.random.uniform(0.1, length / 2))
            await self.troubles.make(self.random.choice([0.05, 0.2, 0.5, 1.0, 2.0, 4.0]))

    async def _person(self, person: Person, length: float) -> None:
        end = time.monotonic() + length
        while time.monotonic() < end:
            with contextlib.suppress(WebSocketException, OSError, httpx.HTTPError):
                await person.act()
            await asyncio.sleep(person.random.choice([0.0, 0.05, 0.3, 1.0]))
        how = person.random.choice(["close", "cut", "silent", "stop"])
        self.say(f"{person.name} goes: {how}")
        if how == "silent":
            person.fall_silent()
        elif how == "stop":
            await person.ask("POST", "/stop", "stop", json={})
            await person.leave()
        else:
            await person.leave(how)

    async def _quiet(self, before: dict[int, dict[int, bytes]]) -> None:
        """Everybody is gone: what must be so now."""
        self.judge.end_claims(at=time.monotonic() + 2.0)
        self.say("quiet")
        await asyncio.to_thread(self._await_calm)
        for person in self.people:
            await person.leave()
        await self._recovered()
        if not self.troubles.server_was_killed:
            await asyncio.to_thread(self._compare, before)
        await asyncio.to_thread(self._tidy)
        self.judge.read_log()
        self.judge.forget_claims()
        if self.station.process is not None and self.station.process.poll() is None:
            self.figures.append(await asyncio.to_thread(self._settled_figures))

    def _settled_figures(self) -> dict[str, Any]:
        """Once the pages that have just gone are gone for the server, too."""
        figures = self.station.figures()
        for _ in range(20):
            if not any(name.startswith(("live-", "hear-", "reread-")) for name in figures["tasks"]):
                break
            time.sleep(0.25)
            figures = self.station.figures()
        return figures

    def _await_calm(self) -> None:
        """Standing and without power in time; where the server died, only standing."""
        deadline = time.monotonic() + QUIET_S
        while time.monotonic() < deadline:
            truths = [self.station.truth(axis) for axis in range(len(self.station.specs))]
            moving = [self.judge.moves(axis) for axis in range(len(truths))]
            on = [t is not None and t.enabled for t in truths]
            if not any(moving) and not any(on):
                return
            time.sleep(0.1)
        for axis, spec in enumerate(self.station.specs):
            if moving[axis] and not self.troubles.server_was_killed:
                self.judge.violated(f"{spec.name} still moves {QUIET_S:.0f} s after all have gone")
            if on[axis] and not self.troubles.server_was_killed:
                self.judge.violated(f"{spec.name} is enabled and nobody is here")

    async def _recovered(self) -> None:
        """Every drive answers again; the bench is as it was."""
        anna = self.people[0]
        began, starved = time.monotonic(), starved_s()
        missing = ""
        # A machine that keeps processes waiting gets as much more time.
        while time.monotonic() - began < RECOVERED_S + starved_s() - starved:
            try:
                await anna.arrive()
                missing = await self._missing(anna)
            except (httpx.HTTPError, WebSocketException, OSError) as error:
                missing = f"no page: {type(error).__name__}: {error}"
            if not missing:
                break
            await asyncio.sleep(0.5)
        if missing:
            self.judge.violated(f"not recovered after {RECOVERED_S:.0f} s: {missing}")
        answer = await anna.ask("GET", "/jobs")
        if answer is not None and answer.is_success:
            self._judge_jobs(answer.json())

    async def _missing(self, anna: Person) -> str:
        for number, spec in enumerate(self.station.specs):
            listed = await anna.ask("GET", "/drives")
            rows = {} if listed is None else {row["name"]: row["id"] for row in listed.json()}
            if spec.name not in rows:
                answer = await anna.ask("POST", "/drives", json=self.station.connecting(number))
                return f"{spec.name} is not on the bench: {'' if answer is None else answer.text}"
            answer = await anna.ask("GET", f"/drives/{rows[spec.name]}/state")
            if answer is None or not answer.is_success or not answer.json()["fresh"]:
                return f"{spec.name}: {'' if answer is None else answer.text[:300]}"
        answer = await anna.ask("GET", "/jobs")
        running = [] if answer is None else [j for j in answer.json() if j["state"] == "running"]
        if running:
            return "jobs run on: " + ", ".join(j["title"] for j in running)
        return ""

    def _judge_jobs(self, jobs: list[dict[str, Any]]) -> None:
        for job in jobs:
            problem = job["problem"]
            if problem and problem["type"] == "urn:servodeck:internal":
                self.judge.violated(f"{job['title']}: {problem['detail']}", problem["detail"][:60])
        reported = [j["problem"]["detail"] for j in jobs if j["problem"]]
        # What an earlier server was killed with is restored when the axis is at standstill, and
        # reported.
        reported += [str(j["result"]) for j in jobs if j["kind"] == "put-back" and j["result"]]
        self._reported = " ".join(reported)

    def _values(self) -> dict[int, dict[int, bytes]]:
        found: dict[int, dict[int, bytes]] = {}
        for axis, spec in enumerate(self.station.specs):
            found[axis] = {}
            for index in _WATCHED[spec.family]:
                with contextlib.suppress(Exception):
                    found[axis][index] = self.station.object(axis, index)
        return found

    def _compare(self, before: dict[int, dict[int, bytes]]) -> None:
        """What motions changed is as it was, or was named."""
        now = self._values()
        for axis, spec in enumerate(self.station.specs):
            if axis in self.troubles.cycled:
                continue
            for index, value in before[axis].items():
                after = now[axis].get(index)
                if index == 0x6060 and self._mode_was_chosen:
                    continue
                if after != value and f"{index:04X}:00" not in self._reported:
                    self.judge.violated(
                        f"{spec.name}: {index:04X} was {value.hex()} and is "
                        f"{'' if after is None else after.hex()}, and nothing says so",
                        f"restore {axis} {index}",
                    )

    @property
    def _mode_was_chosen(self) -> bool:
        """A transition may choose a mode for good."""
        return any(key.startswith(("transition", "cyclic")) for key in self.tally.done)

    def _tidy(self) -> None:
        """Faults reset, nothing enabled, exchange ended: the next episode begins clean."""
        asyncio.run(self._tidied())

    async def _tidied(self) -> None:
        person = Person("Anna", self.station, self.judge, random.Random(0), Tally(), self.say)
        await person.arrive()
        for url in self.station.urls:
            await person.ask("DELETE", "/buses/cyclic", params={"url": url})
        for drive in person.drives:
            await person.ask("POST", f"/drives/{drive}/fault-reset", json={})
            await person.ask(
                "POST", f"/drives/{drive}/transition", json={"goal": "Switch on disabled"}
            )
        await person.leave()
        self.judge.forget_claims()

    # --- the verdict ------------------------------------------------------------------

    async def _finish(self) -> None:
        await self._judge_audit()
        self._judge_leaks()
        status = await asyncio.to_thread(self.station.end_server)
        if status != 0:
            self.judge.violated(f"the server ends with status {status}")
        await asyncio.to_thread(self.station.start_server)
        await self._recovered()
        for name in ("bench.json",):
            path = self.folder / "state" / name
            try:
                json.loads(path.read_text())
            except (OSError, ValueError) as error:
                self.judge.violated(f"{name} after a restart: {error}")

    async def _judge_audit(self) -> None:
        anna = self.people[0]
        await anna.arrive()
        answer = await anna.ask("GET", "/audit/verify")
        if answer is None or not answer.json()["ok"]:
            self.judge.violated(
                f"the audit does not verify: {'' if answer is None else answer.text}"
            )
        answer = await anna.ask("GET", "/audit/export", params={"format": "jsonl"})
        if answer is None or not answer.is_success:
            self.judge.violated("the audit cannot be exported")
            return
        have: Counter[tuple[str, str, int]] = Counter()
        for line in answer.text.splitlines():
            body = json.loads(json.loads(line)["body"])
            if body["kind"] == "write" and isinstance(body["new"], int):
                have[body["axis"], body["target"], body["new"]] += 1
        wanted = Counter(self.tally.writes) - Counter(self.tally.uncertain)
        if lacking := dict(wanted - have):
            self.judge.violated(f"writes that the audit does not have: {lacking}")

    def _judge_leaks(self) -> None:
        if len(self.figures) < 3:
            return
        first, last = self.figures[1], self.figures[-1]
        for name in ("tasks", "threads"):
            more = list(last[name])
            for each in first[name]:
                if each in more:
                    more.remove(each)
            if len(last[name]) > len(first[name]) + 2:
                self.judge.violated(f"more {name} than at first: {more}")
        if last["files"] > first["files"] + 6:
            self.judge.violated(f"file descriptors: {first['files']} at first, now {last['files']}")
        growth = last["mib"] - first["mib"]
        if growth > 60.0:
            self.judge.violated(f"memory grew by {growth:.0f} MiB")

    def report(self) -> str:
        """One line, then the violations."""
        times = np.array(self.judge.record.times_s or [0.0])
        p99 = float(np.percentile(times, 99))
        found = self.judge.record.violations
        what = " ".join(f"{k}:{v}" for k, v in sorted(self.tally.done.items()))
        ends = [
            (f["files"], len(f["tasks"]), len(f["threads"]), round(f["mib"])) for f in self.figures
        ]
        note = "" if p99 < P99_S else "  (aim 50 ms: see whether the machine had time)"
        return "\n".join(
            [
                f"{self.bus} seed {self.seed}: {len(found)} violations; answers p99 "
                f"{p99 * 1e3:.0f} ms, worst {times.max() * 1e3:.0f} ms{note}",
                f"  files, tasks, threads, MiB: {ends[:2]} … {ends[-1:]}",
                f"  {what}",
                *(f"  - {text}" for text in found),
            ]
        )


def main() -> int:
    """Run the trial; the exit status shows whether something was violated."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.chaos")
    parser.add_argument("--seconds", type=float, default=120.0, help="for each bus")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--on", choices=[*BUSES, "all"], default="all")
    parser.add_argument("--log", type=Path, help="what happened, line by line; default: stderr")
    parser.add_argument("--folder", type=Path, help="kept for looking at it; default: temporary")
    options = parser.parse_args()
    violations = 0
    with contextlib.ExitStack() as stack:
        log = stack.enter_context(options.log.open("w")) if options.log else sys.stderr
        folder = options.folder or Path(stack.enter_context(tempfile.TemporaryDirectory()))
        for bus in BUSES if options.on == "all" else [options.on]:
            trial = Trial(bus, options.seed, options.seconds, folder / bus, log)
            asyncio.run(trial.run())
            print(trial.report(), flush=True)
            violations += len(trial.judge.record.violations)
    return 1 if violations else 0
