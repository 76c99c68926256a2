"""All parameters of a drive over EtherCAT: our Link compared with a plain loop of pysoem
``sdo_read``.

Both read the same virtual drives, which take 1 ms for every answer, alternately in one run: one
drive, and then several at once, as "read all" of a machine does. Aim: at least three times as
fast, by complete access and by having the mailboxes of all drives at work.

    python -m benchmarks.ethercat_parameters [--drive mms7] [--sdo-ms 1] [--drives 1,4]

Entries of a process-data list beyond its count are not in use; our Link asks for none of them, so
the plain loop is not made to read them either. How far one drive can go is printed as well: the
least number of answers that it must give, each of which takes it its time.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import subprocess
import sys
import textwrap
import time

from drivers.errors import DriveError, NotInUse
from drivers.ethercat.link import EthercatLink
from drivers.link import Address
from drivers.virtual.wires.ethercat.launch import VirtualSegment
from drivers.virtual.wires.netns import Namespace, child_environment
from profiles.loader import load_profile

ROUNDS = 3

_PLAIN = textwrap.dedent(
    """
    import json, sys, time, pysoem
    places = json.loads(sys.stdin.readline())
    master = pysoem.Master()
    master.open("ec0m")
    assert master.config_init() > 0
    master.state_check(pysoem.PREOP_STATE, 3_000_000)
    for slave in master.slaves:
        slave.sdo_read(0x1018, 1)
    failed, began = 0, time.perf_counter()
    for slave in master.slaves:
        for index, subindex in places:
            try:
                slave.sdo_read(index, subindex)
            except (pysoem.SdoError, pysoem.WkcError):
                failed += 1
    print(json.dumps([time.perf_counter() - began, failed]))
    master.close()
    """
)


def plain(namespace: Namespace, addresses: list[Address]) -> tuple[float, int]:
    """Seconds of the plain loop, and how many reads were refused or timed out."""
    places = json.dumps([[a.index, a.subindex] for a in addresses])
    result = subprocess.run(
        namespace.command([sys.executable, "-c", _PLAIN]),
        input=places + "\n",
        capture_output=True,
        text=True,
        check=True,
        env=child_environment(),
    )
    seconds, failed = json.loads(result.stdout)
    return seconds, failed


async def ours(
    namespace: Namespace, addresses: list[Address], drives: int
) -> tuple[list[float], list[Address]]:
    """Seconds of three readings of all drives at once, and which entries there are.

    The first reading learns the layouts.
    """
    link = EthercatLink("ec0m", launcher=namespace.command([]))
    await link.open()
    try:
        await link.scan(lambda _share, _text: None)
        times = []
        for _ in range(3):
            began = time.perf_counter()
            answers = await asyncio.gather(
                *(link.read_many(station, addresses) for station in range(1, drives + 1))
            )
            times.append(time.perf_counter() - began)
            reported = [a for answer in answers for a in answer]
            failed = [
                a for a in reported if isinstance(a, DriveError) and not isinstance(a, NotInUse)
            ]
            assert not failed, failed[0]
    finally:
        await link.close()
    used = [
        a for a, reported in zip(addresses, answers[0], strict=True) if isinstance(reported, bytes)
    ]
    return times, used


def least_answers(addresses: list[Address]) -> int:
    """Objects: no protocol reads two of them with one request."""
    return len({address.index for address in addresses})


def compare(drive: str, sdo_ms: str, drives: int, addresses: list[Address]) -> None:
    """One line: ours and the plain loop in turn, the best of each."""
    arguments = ["--drive", drive] * drives + ["--sdo-ms", sdo_ms]
    first, again, slow, failed = [], [], [], 0
    with Namespace.create() as namespace, VirtualSegment.start("ec0s", arguments, namespace):
        for _ in range(ROUNDS):
            times, used = asyncio.run(ours(namespace, addresses, drives))
            first.append(times[0])
            again += times[1:]
            seconds, refused = plain(namespace, used)
            slow.append(seconds)
            failed += refused
    if failed:
        print(f"the plain loop failed to read {failed} values")
    print(
        f"{drives:3d} drives, {len(used)} entries in use   plain {min(slow):6.3f} s   ours"
        f" {min(first):6.3f} s, again {min(again):6.3f} s   ratio"
        f" {min(slow) / min(first):5.2f}, again {min(slow) / min(again):5.2f}",
        flush=True,
    )


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--drive", default="mms7")
    parser.add_argument("--sdo-ms", default="1")
    parser.add_argument("--drives", default="1,4")
    options = parser.parse_args(argv)
    addresses = [
        Address(p.index, p.subindex or 0, p.type)
        for p in load_profile(options.drive).parameters
        if p.index is not None and p.access != "wo"
    ]
    print(
        f"{len(addresses)} parameters of {options.drive} in {least_answers(addresses)} objects,"
        f" {options.sdo_ms} ms per answer"
    )
    for drives in map(int, options.drives.split(",")):
        compare(options.drive, options.sdo_ms, drives, addresses)
    return 0


if __name__ == "__main__":
    sys.exit(main())
