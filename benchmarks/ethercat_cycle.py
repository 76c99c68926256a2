"""Cyclic jitter, overruns and CPU use of the EtherCAT host compared with a bare pysoem loop.

For every rate and number of slaves, one after the other in one run: a bare pysoem loop that does
nothing but sleep, send and receive, and our host with scope streaming; each with a server next to
it that is idle, and with one that is busy (a thread computing spectra, as a web client's analysis
would).

    python -m benchmarks.ethercat_cycle [--seconds 5] [--rates 1000,2000,4000] [--slaves 1,4]

Lateness is how long after its grid point a cycle begins, in µs, as the upper edge of its
power-of-two bin. CPU is in percent of one core.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import subprocess
import sys
import textwrap
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from pathlib import Path

import numpy as np

from drivers.cia402 import Mode, State
from drivers.ethercat.link import EthercatLink
from drivers.link import Address, CyclicSignal, ScopeBlock
from drivers.virtual.wires.ethercat.launch import VirtualSegment
from drivers.virtual.wires.netns import Namespace, child_environment
from profiles.loader import load_profile
from profiles.schema import DataType

_BARE = textwrap.dedent(
    """
    import ctypes, gc, json, os, sys, time, pysoem
    from drivers.ethercat.exchange.cyclic import percentile_us
    rate, seconds = int(sys.argv[1]), float(sys.argv[2])
    ctypes.CDLL(None).prctl(29, 1, 0, 0, 0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(40))
    except OSError:
        pass
    master = pysoem.Master()
    master.open("ec0m")
    assert master.config_init() > 0
    master.config_map()
    master.config_dc()
    master.state_check(pysoem.SAFEOP_STATE, 3_000_000)
    gc.disable()
    late, overruns, bad, worst = [0] * 16, 0, 0, 0
    period = 1_000_000_000 // rate
    at = time.monotonic_ns() + period
    used = time.process_time()
    for _ in range(int(rate * seconds)):
        ahead = at - time.monotonic_ns()
        if ahead > 0:
            time.sleep(ahead * 1e-9)
        behind = max(time.monotonic_ns() - at, 0)
        if behind >= period:
            overruns += behind // period
            at += behind // period * period
        late[min((behind // 1000).bit_length(), 15)] += 1
        worst = max(worst, behind // 1000)
        master.send_processdata()
        if master.receive_processdata(2000) != master.expected_wkc:
            bad += 1
        at += period
    cpu = 100 * (time.process_time() - used) / seconds
    half, most = percentile_us(late, 0.5), percentile_us(late, 0.99)
    print(json.dumps([half, most, worst, overruns, bad, cpu]))
    master.close()
    """
)
Row = tuple[int, int, int, int, int, float]


def bare(namespace: Namespace, rate: int, seconds: float, *, busy: bool) -> Row:
    """Figures of the loop that does nothing else."""
    with busy_server() if busy else nullcontext():
        result = subprocess.run(
            namespace.command([sys.executable, "-c", _BARE, str(rate), str(seconds)]),
            capture_output=True,
            text=True,
            check=True,
            env=child_environment(),
        )
    row: Row = tuple(json.loads(result.stdout))
    return row


def cpu_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text("ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def signals(station: int) -> tuple[list[CyclicSignal], list[CyclicSignal]]:
    wanted: tuple[tuple[int, DataType], ...] = (
        (0x6041, "UINT16"),
        (0x6064, "INT32"),
        (0x606C, "INT32"),
        (0x6077, "INT16"),
    )
    inputs = [CyclicSignal(station, Address(i, 0, t), f"{station}.{i:04X}") for i, t in wanted]
    return inputs, [CyclicSignal(station, Address(0x607A, 0, "INT32"), f"{station}.target")]


async def ours(
    namespace: Namespace, rate: int, slaves: int, seconds: float, *, busy: bool
) -> tuple[Row, float]:
    """Figures of the host, and the server's CPU; samples are received throughout."""
    link = EthercatLink("ec0m", launcher=namespace.command([]))
    await link.open()
    work = ExitStack()
    try:
        await link.scan(lambda _share, _text: None)
        cyclic = link.process_data
        stations = range(1, slaves + 1)
        for station in stations:
            link.attach(station, load_profile("mms7"))
        await cyclic.configure(
            [s for n in stations for s in signals(n)[0]],
            [s for n in stations for s in signals(n)[1]],
            1 / rate,
        )
        await cyclic.start()
        blocks: list[ScopeBlock] = []
        cyclic.blocks(blocks.append)
        for station in stations:
            await cyclic.reset_fault(station)
        await asyncio.sleep(0.3)
        for station in stations:
            await cyclic.drive_to(station, State.OPERATION_ENABLED, Mode.CSP)
        await asyncio.sleep(1.0)
        if busy:
            work.enter_context(busy_server())
        before = dict(link.quality().details)
        errors = link.quality().wkc_errors + link.quality().lost_frames
        pid = link._host.pid
        assert pid is not None
        host, server = cpu_s(pid), cpu_s(os.getpid())
        await asyncio.sleep(seconds)
        host, server = cpu_s(pid) - host, cpu_s(os.getpid()) - server
        after = link.quality()
        late = [
            int(after.details[f"late_below_{2**n}_us"]) - int(before[f"late_below_{2**n}_us"])
            for n in range(16)
        ]
        row = (
            _percentile(late, 0.5),
            _percentile(late, 0.99),
            int(after.details["cyclic_late_max_us"]),
            int(after.details["cyclic_overruns"]) - int(before["cyclic_overruns"]),
            after.wkc_errors + after.lost_frames - errors,
            100 * host / seconds,
        )
        await cyclic.stop()
    finally:
        work.close()
        await link.close()
    return row, 100 * server / seconds


def _percentile(late: list[int], fraction: float) -> int:
    from drivers.ethercat.exchange.cyclic import percentile_us

    return percentile_us(late, fraction)


@contextmanager
def busy_server() -> Iterator[None]:
    """This process computes as the server of a busy page does."""
    stop = threading.Event()
    worker = threading.Thread(target=_spectra, args=(stop,))
    worker.start()
    try:
        yield
    finally:
        stop.set()
        worker.join()


def _spectra(stop: threading.Event) -> None:
    data = np.random.default_rng(1).normal(size=1 << 16)
    while not stop.wait(0.01):
        np.fft.rfft(data)


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--rates", default="1000,2000,4000")
    parser.add_argument("--slaves", default="1,4")
    options = parser.parse_args(argv)
    print(
        "rate  slaves  who                   p50   p99    max  overruns  invalid  CPU %  server %"
    )
    for slaves in map(int, options.slaves.split(",")):
        arguments = ["--drive", "mms7"] * slaves + ["--realtime", "20"]
        with Namespace.create() as namespace, VirtualSegment.start("ec0s", arguments, namespace):
            for rate in map(int, options.rates.split(",")):
                for busy in (False, True):
                    row = bare(namespace, rate, options.seconds, busy=busy)
                    _show(rate, slaves, "bare, busy server" if busy else "bare, idle server", row)
                for busy in (False, True):
                    row, server = asyncio.run(
                        ours(namespace, rate, slaves, options.seconds, busy=busy)
                    )
                    name = "host, busy server" if busy else "host, idle server"
                    _show(rate, slaves, name, row, server)
    return 0


def _show(rate: int, slaves: int, name: str, row: Row, server: float | None = None) -> None:
    p50, p99, worst, overruns, bad, cpu = row
    last = "" if server is None else f"{server:8.1f}"
    print(
        f"{rate:5d} {slaves:5d}   {name:18s} {p50:6d} {p99:6d} {worst:6d} {overruns:8d} {bad:8d}"
        f" {cpu:6.1f} {last}",
        flush=True,
    )


if __name__ == "__main__":
    sys.exit(main())
