"""Chaos in simulated time: axes of mixed families at once, judged by the shafts.

    python -m benchmarks.chaos.simulated [--seeds 200] [--first 1]

Several drives of random families, each on a line of its own, are moved at random by the server
and by other tools past it, by their own inputs and by hand; mailboxes fall mute, 605Ah is
tampered with, STOP is pressed at any moment, of one axis or of all. What must hold:

- STOP's answer equals the shaft: who is said to stand stands, and goes on standing; who is said
  to move moves; "unreachable" is a drive whose mailbox is mute.
- No axis turns without a grant: an axis that the server moves has one, and one that is moved past
  it has none; after STOP nothing moves again by itself, and an axis that turns although nobody here
  moves it is reported within a second of turning, and no other is.

The bytes of a bus are not in it: the link hands objects to the virtual drive. They are in
``python -m benchmarks.chaos``.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import random
from collections.abc import AsyncIterator

from benchmarks.stopping.clock import run_simulated
from benchmarks.stopping.motions import FAMILIES, MOTIONS
from benchmarks.stopping.rig import Rig, rig

#: A second, and the time between two looks of a page at a drive that is slow to answer.
REPORTED_S = 1.0 + 0.1
_STANDS_RPM, _TURNS_RPM = 3.0, 12.0
_EPISODES = 4
#: Motions of the server's own jobs, which hold a grant; all others come from past it.
_SERVERS = frozenset({"jog", "jog by process data"})


class Mix:
    """One seed."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(f"mix {seed}")
        self.findings: list[str] = []
        self.episodes = 0

    def found(self, bench: Rig, text: str) -> None:
        """Note a finding."""
        self.findings.append(f"{bench.family}: {text}")

    async def run(self) -> None:
        """Some axes at once, each through some episodes."""
        families = self.random.choices(FAMILIES, k=self.random.randint(2, 3))
        async with contextlib.AsyncExitStack() as stack:
            benches = []
            for family in families:
                bench = await stack.enter_async_context(rig(family))
                # The tables of two databases cannot be brought up to date at once in a process.
                await asyncio.to_thread(bench.bench.records.store.open)
                benches.append(bench)
            for bench in benches:
                # A page looks at it.
                bench.connected.monitor.watchers.add("page")
                bench.connected.monitor.hurry()
            await asyncio.sleep(0.3)
            await asyncio.gather(*(self._axis(bench) for bench in benches))

    async def _axis(self, bench: Rig) -> None:
        choices = [name for name, (_, having) in MOTIONS.items() if bench.family in having]
        for _ in range(_EPISODES):
            self.episodes += 1
            await asyncio.sleep(self.random.uniform(0.0, 0.3))
            async with self._watched(bench):
                if self.random.random() < 0.15:
                    await self._by_hand(bench)
                    continue
                if not await self._episode(bench, self.random.choice(choices)):
                    return

    async def _episode(self, bench: Rig, motion: str) -> bool:
        """Whether the axis can be used for another."""
        try:
            await MOTIONS[motion][0](bench)
        except AssertionError:
            return False  # what happened to it before does not let it begin
        if motion not in _SERVERS and self.random.random() < 0.4:
            await self._must_be_reported(bench, motion)
        tampered = bench.family != "ds_c" and motion in ("profile velocity", "jog", "homing")
        if tampered and self.random.random() < 0.3:
            bench.poke("605A:00", 0)
            await asyncio.sleep(self.random.choice([0.0, 0.3, 1.5]))
        bench.link.mute = self.random.random() < 0.15
        if motion == "jog by process data" and self.random.random() < 0.3:
            bench.link.lose_process_data()
        await asyncio.sleep(self.random.choice([0.0, 0.01, 0.1, 0.5]))
        self._judge_grant(bench, motion)
        verdict = await self._stop(bench, motion)
        return verdict == "stopped" and not bench.link.lost_data and await self._tidy(bench)

    def _judge_grant(self, bench: Rig, motion: str) -> None:
        """Of an axis that turns at this moment, before STOP is pressed."""
        if bench.link.mute or bench.link.lost_data or bench.shaft_rpm < _TURNS_RPM:
            return  # a motion that has lost its drive ends its grant, and the drive goes on
        grant = bench.bench.authority.grant_of(bench.connected.drive.id)
        if (grant is not None) is not (motion in _SERVERS):
            self.found(bench, f"{motion}: turns {'with' if grant else 'without'} a grant")

    async def _stop(self, bench: Rig, motion: str) -> str:
        body = {} if self.random.random() < 0.5 else {"drive": bench.connected.drive.id}
        presses = [
            asyncio.create_task(bench.http.post("/stop", json=body))
            for _ in range(self.random.choice([1, 1, 2, 3]))
        ]
        answers = [answer.json() for answer in await asyncio.gather(*presses)]
        rpm, verdict = bench.shaft_rpm, str(answers[0]["axes"][0]["verdict"])
        if any(each["axes"][0]["verdict"] != verdict for each in answers):
            self.found(bench, f"{motion}: two verdicts of one STOP")
        if verdict == "unreachable":
            if not bench.link.mute:
                self.found(bench, f"{motion}: said to be unreachable, and it answers")
            return verdict
        if (verdict == "stopped") is not (rpm <= _STANDS_RPM):
            later = []
            for _ in range(5):
                await asyncio.sleep(0.02)
                later.append(f"{bench.shaft_rpm:.1f}")
            self.found(
                bench,
                f"{motion}: {verdict!r} is said of a shaft at {rpm:.1f} rpm, then "
                f"{', '.join(later)}; {answers[0]['axes'][0]}",
            )
        if verdict == "stopped":
            await asyncio.sleep(0.8)
            if bench.shaft_rpm > _STANDS_RPM:
                self.found(bench, f"{motion}: turns again after STOP, {bench.shaft_rpm:.1f} rpm")
        return verdict

    async def _must_be_reported(self, bench: Rig, motion: str) -> None:
        loop = asyncio.get_running_loop()
        end = loop.time() + REPORTED_S
        while bench.connected.monitor.snapshot.turning is None:
            if bench.shaft_rpm < _TURNS_RPM:
                return
            if loop.time() > end:
                self.found(bench, f"{motion}: turns without a grant and is not reported")
                return
            await asyncio.sleep(0.02)

    async def _by_hand(self, bench: Rig) -> None:
        """Somebody turns the shaft of a disabled axis: reported, and not as an enabled one."""
        for n in range(60):
            bench.link.catch_up()
            bench.device.inject("turn_to_rev", bench.shaft_deg / 360.0 + 0.04)
            await asyncio.sleep(0.02)
            found = bench.connected.monitor.snapshot.turning
            if found is not None:
                if found.kind.value != "disabled":
                    self.found(bench, f"turned by hand, reported as {found.kind.value}")
                break
            if n == 59:
                self.found(bench, "turned by hand for 1.2 s and not reported")
        await asyncio.sleep(1.0)

    @contextlib.asynccontextmanager
    async def _watched(self, bench: Rig) -> AsyncIterator[None]:
        """Nothing is reported about an axis that a job moves, or that stands."""
        over = asyncio.Event()

        async def look() -> None:
            stood_s = wrong_s = 0.0
            while not over.is_set():
                await asyncio.sleep(0.05)
                stood_s = 0.0 if bench.shaft_rpm > 1.0 else stood_s + 0.05
                reported = bench.connected.monitor.snapshot.turning
                job = bench.bench.jobs.moving(bench.connected.drive.id)
                wrong = reported is not None and (stood_s > 1.0 or job is not None)
                wrong_s = wrong_s + 0.05 if wrong else 0.0
                # What was read before a job began is shown until the next poll.
                if reported is not None and wrong_s > 0.3:
                    self.found(bench, f"reported to turn at {reported.speed:.0f}, without a reason")
                    return

        looking = asyncio.create_task(look())
        try:
            yield
        finally:
            over.set()
            await looking

    async def _tidy(self, bench: Rig) -> bool:
        """As somebody leaves an axis who goes on with it; False where it cannot be used again."""
        bench.link.mute = False
        if bench.family == "r6l":
            bench.device.inject("di1", 0)
        for task in bench.kept:
            task.cancel()
        bench.kept.clear()
        while (job := bench.bench.jobs.moving(bench.connected.drive.id)) is not None:
            await job.wait()
        await bench.bench.stop_cyclic(bench.link.url)
        bench.poke("6040:00", 0)
        if "605A:00" in bench.device.profile.by_key:
            bench.poke("605A:00", 2)
        for key in ("60FF:00", "6071:00"):
            bench.poke(key, 0)
        await asyncio.sleep(1.0)
        return not bench.device.control.alarms.active


def run_seed(seed: int) -> Mix:
    """One seed in simulated time."""
    mix = Mix(seed)
    run_simulated(mix.run)
    return mix


def main() -> int:
    """Seeds one after the other; the exit status shows whether something was found."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.chaos.simulated")
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("--first", type=int, default=1)
    wanted = parser.parse_args()
    findings = episodes = 0
    for seed in range(wanted.first, wanted.first + wanted.seeds):
        mix = run_seed(seed)
        episodes += mix.episodes
        findings += len(mix.findings)
        for text in mix.findings:
            print(f"seed {seed}: {text}", flush=True)
        print(f"seed {seed}: {mix.episodes} episodes", flush=True)
    print(f"{wanted.seeds} seeds, {episodes} episodes, {findings} findings")
    return 1 if findings else 0


if __name__ == "__main__":
    raise SystemExit(main())
