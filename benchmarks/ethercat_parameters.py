"""All parameters of a drive over EtherCAT: our Link beside a plain loop of pysoem ``sdo_read``.

Both read the same virtual drive, which takes 1 ms for every answer, one after the other in one
run. Aim: at least three times as fast, by complete access.

    python -m benchmarks.ethercat_parameters [--drive mms7] [--sdo-ms 1]
"""

from __future__ import annotations

import argparse
import asyncio
import json
import subprocess
import sys
import textwrap
import time

from drivers.errors import DriveError
from drivers.ethercat.link import EthercatLink
from drivers.link import Address
from drivers.virtual.wires.ethercat.launch import VirtualSegment
from drivers.virtual.wires.netns import Namespace, child_environment
from profiles.loader import load_profile

_PLAIN = textwrap.dedent(
    """
    import json, sys, time, pysoem
    places = json.loads(sys.stdin.readline())
    master = pysoem.Master()
    master.open("ec0m")
    assert master.config_init() == 1
    master.state_check(pysoem.PREOP_STATE, 3_000_000)
    slave = master.slaves[0]
    slave.sdo_read(0x1018, 1)
    failed, began = 0, time.perf_counter()
    for index, subindex in places:
        try:
            slave.sdo_read(index, subindex)
        except pysoem.SdoError:
            failed += 1
    print(json.dumps([time.perf_counter() - began, failed]))
    master.close()
    """
)


def plain(namespace: Namespace, addresses: list[Address]) -> tuple[float, int]:
    """Seconds and refusals of the plain loop."""
    places = json.dumps([[a.index, a.subindex] for a in addresses])
    result = subprocess.run(
        namespace.command([sys.executable, "-c", _PLAIN]),
        input=places + "\n", capture_output=True, text=True, check=True, env=child_environment(),
    )  # fmt: skip
    seconds, failed = json.loads(result.stdout)
    return seconds, failed


async def ours(namespace: Namespace, addresses: list[Address]) -> tuple[float, float, int]:
    """Seconds of the first and of the second reading, and refusals."""
    link = EthercatLink("ec0m", launcher=namespace.command([]))
    await link.open()
    try:
        await link.scan(lambda _share, _text: None)
        times = []
        failed = 0
        for _ in range(2):
            began = time.perf_counter()
            answers = await link.read_many(1, addresses)
            times.append(time.perf_counter() - began)
            failed = sum(isinstance(answer, DriveError) for answer in answers)
    finally:
        await link.close()
    return times[0], times[1], failed


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--drive", default="mms7")
    parser.add_argument("--sdo-ms", default="1")
    options = parser.parse_args(argv)
    addresses = [
        Address(p.index, p.subindex or 0, p.type)
        for p in load_profile(options.drive).parameters
        if p.index is not None and p.access != "wo"
    ]
    arguments = ["--drive", options.drive, "--sdo-ms", options.sdo_ms]
    with Namespace.create() as namespace, VirtualSegment.start("ec0s", arguments, namespace):
        before = plain(namespace, addresses)
        first, second, failed = asyncio.run(ours(namespace, addresses))
        after = plain(namespace, addresses)
    slow = min(before[0], after[0])
    print(f"{len(addresses)} parameters of {options.drive}, {options.sdo_ms} ms per answer")
    print(f"plain sdo_read loop   {before[0]:6.3f} s and {after[0]:6.3f} s  ({before[1]} refused)")
    print(f"our Link              {first:6.3f} s, again {second:6.3f} s  ({failed} refused)")
    print(f"ratio                 {slow / first:5.2f}, again {slow / second:5.2f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
