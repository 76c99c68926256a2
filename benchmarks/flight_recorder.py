"""Lateness of EtherCAT cycles with and without the flight recorder, in alternated rounds.

One exchange runs throughout, with its axes enabled and samples received. Rounds with and without
the recorder's process alternate in the order A B B A, so that what the computer does beside them
meets both alike. Lateness is how long after its grid point a cycle begins, in µs, of every cycle
as the host notes it. Printed are the 99th percentile of each kind over the rounds (median), the
growth of the pairs of rounds (median), and its 95 % interval by resampling the pairs. The aim is a
growth of at most 5 %; it is met only where the whole interval is below it.

    python -m benchmarks.flight_recorder [--pairs 12] [--seconds 10] [--rate 1000] [--slaves 2]
"""

from __future__ import annotations

import argparse
import asyncio
import sys
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from benchmarks._aims import Aim, print_verdict
from benchmarks.ethercat_cycle import signals
from drivers.cia402 import Mode, State
from drivers.ethercat.link import EthercatLink
from drivers.link import ScopeBlock
from drivers.virtual.wires.ethercat.launch import VirtualSegment
from drivers.virtual.wires.netns import Namespace
from profiles.loader import load_profile

AIM_PERCENT = 5.0
#: After the recorder has started or ended; its process takes the processor for a moment.
_SETTLE_S = 1.0
_RESAMPLES = 10_000
_SEED = 1


@dataclass(frozen=True, slots=True)
class Pair:
    """Two neighbouring rounds: the 99th percentile of the lateness in µs, and cycles measured."""

    without_us: float
    with_us: float
    cycles: int

    @property
    def growth_percent(self) -> float:
        """Of the percentile, by the recorder."""
        return 100 * (self.with_us / self.without_us - 1)


def growth_interval(pairs: Sequence[Pair]) -> tuple[float, float, float]:
    """Median growth of the pairs in percent, and its 95 % interval (percentile bootstrap)."""
    growth = np.array([pair.growth_percent for pair in pairs])
    drawn = np.random.default_rng(_SEED).choice(growth, (_RESAMPLES, len(growth)))
    low, high = np.percentile(np.median(drawn, axis=1), [2.5, 97.5])
    return float(np.median(growth)), float(low), float(high)


async def measure(
    namespace: Namespace, *, pairs: int, seconds: float, rate: int, slaves: int
) -> list[Pair]:
    """Pairs of rounds on the segment whose other end is ``ec0m``."""
    link = EthercatLink("ec0m", launcher=namespace.command([]))
    await link.open()
    try:
        await link.scan(lambda _share, _text: None)
        stations = range(1, slaves + 1)
        for station in stations:
            link.attach(station, load_profile("mms7"))
        cyclic = link.process_data
        await cyclic.configure(
            [s for n in stations for s in signals(n)[0]],
            [s for n in stations for s in signals(n)[1]],
            1 / rate,
        )
        await cyclic.start()
        try:
            blocks: list[ScopeBlock] = []
            cyclic.blocks(blocks.append)
            for station in stations:
                await cyclic.reset_fault(station)
                await cyclic.drive_to(station, State.OPERATION_ENABLED, Mode.CSP)
            found = []
            for number in range(pairs):
                order = (False, True) if number % 2 == 0 else (True, False)
                late = {on: await _round(link, seconds, recorder=on) for on in order}
                blocks.clear()
                found.append(_pair(late[False], late[True]))
            return found
        finally:
            await cyclic.stop()
    finally:
        await link.close()


async def _round(link: EthercatLink, seconds: float, *, recorder: bool) -> npt.NDArray[np.float64]:
    """Lateness of each cycle in µs."""
    await (link.recorder.start() if recorder else link.recorder.stop())
    if (link.recorder.process_id is not None) is not recorder:
        raise RuntimeError("the recorder did not start")
    await asyncio.sleep(_SETTLE_S)
    ring = link._host.ring
    if ring is None:
        raise RuntimeError("the host process has ended")
    reader = ring.reader({})
    await asyncio.sleep(seconds)
    taken, lost = reader.drain()
    if lost:
        raise RuntimeError(f"{lost} cycles were overwritten: choose shorter rounds")
    return taken["late_us"].astype(float)


def _pair(without: npt.NDArray[np.float64], recorded: npt.NDArray[np.float64]) -> Pair:
    # The host notes whole µs. A half more keeps a growth from being infinite.
    first, second = (float(np.percentile(late, 99)) + 0.5 for late in (without, recorded))
    return Pair(first, second, len(without) + len(recorded))


def main(argv: list[str] | None = None) -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--pairs", type=int, default=12)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--rate", type=int, default=1000)
    parser.add_argument("--slaves", type=int, default=2)
    options = parser.parse_args(argv)
    arguments = ["--drive", "mms7"] * options.slaves + ["--realtime", "20"]
    with Namespace.create() as namespace, VirtualSegment.start("ec0s", arguments, namespace):
        measuring = measure(
            namespace,
            pairs=options.pairs,
            seconds=options.seconds,
            rate=options.rate,
            slaves=options.slaves,
        )
        pairs = asyncio.run(measuring)
    print("pair  p99 without [µs]  p99 with [µs]  growth [%]")
    for number, pair in enumerate(pairs, 1):
        print(
            f"{number:4d} {pair.without_us:17.1f} {pair.with_us:14.1f} {pair.growth_percent:11.1f}"
        )
    middle, low, high = growth_interval(pairs)
    without, recorded = (
        float(np.median([getattr(pair, name) for pair in pairs]))
        for name in ("without_us", "with_us")
    )
    cycles = sum(pair.cycles for pair in pairs)
    print(
        f"{cycles} cycles at {options.rate} Hz, {options.slaves} slaves: p99 {without:.1f} µs"
        f" without, {recorded:.1f} µs with the recorder"
    )
    print(f"growth {middle:+.1f} % (95 % interval {low:+.1f} to {high:+.1f} %)")
    words = f"p99 of the lateness grows by at most {AIM_PERCENT:g} %: at most {high:+.1f} %"
    return 0 if print_verdict([Aim(words, high <= AIM_PERCENT)]) else 1


if __name__ == "__main__":
    sys.exit(main())
