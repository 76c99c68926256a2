"""The server under trial: `servodeck serve` on wires that somebody else has made.

::

    python -m benchmarks.chaos.server --state DIR --wires JSON

(with ``--grants FD`` each begin and end of a grant is written there, see `benchmarks.chaos.grants`)
prints ``{"port": N}``, then takes one JSON command per line: ``tell`` (tasks and threads),
``jump`` (the wall clock, by seconds), and ends in order when its standard input closes.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import sys
import threading
import time
from functools import partial
from pathlib import Path
from typing import Any

_ahead_s = 0.0
_true_time = time.time


def _jumping_time() -> float:
    return _true_time() + _ahead_s


# Before anything of the product is imported: some of it keeps the clock that it finds.
time.time = _jumping_time

import uvicorn  # noqa: E402
from argon2 import PasswordHasher  # noqa: E402

from backend.commands.server.serve import Serving, _config, _listen  # noqa: E402
from backend.foundation.people.login.passwords import Passwords  # noqa: E402
from backend.foundation.people.rights import Role  # noqa: E402
from backend.foundation.people.station import People  # noqa: E402
from backend.station.bench import Bench  # noqa: E402
from benchmarks.chaos.station import PASSWORD  # noqa: E402
from drivers.errors import DriveError  # noqa: E402
from drivers.ethercat.link import EthercatLink  # noqa: E402
from drivers.urls import link_for  # noqa: E402

NAMES = {"Anna": Role.ADMINISTRATOR, "Olaf": Role.OPERATOR, "Petra": Role.OPERATOR}


def _wire(name: str, facts: dict[str, Any]) -> Any:
    if "real" in facts:
        return partial(link_for, facts["real"])
    return partial(
        EthercatLink,
        facts["interface"],
        url=name,
        launcher=tuple(facts["launcher"]),
        lockstep=1.0,
    )


def _obey(server: uvicorn.Server, loop: asyncio.AbstractEventLoop) -> None:
    global _ahead_s  # noqa: PLW0603 - the clock of this process
    for line in sys.stdin:
        command = json.loads(line)
        if command["do"] == "jump":
            _ahead_s += command["by_s"]
            answer: dict[str, Any] = {"ahead_s": _ahead_s}
        else:
            names = asyncio.run_coroutine_threadsafe(_tasks(), loop).result(30)
            answer = {"tasks": names, "threads": [t.name for t in threading.enumerate()]}
        print(json.dumps(answer), flush=True)
    server.should_exit = True


async def _tasks() -> list[str]:
    return sorted(task.get_name() for task in asyncio.all_tasks())


def _report_grants(bench: Bench, pipe: int) -> None:
    def changed(drive: str) -> None:
        live = bench.authority.grant_of(drive) is not None
        line = {"at": time.monotonic(), "drive": drive, "live": live}
        os.write(pipe, json.dumps(line).encode() + b"\n")

    bench.authority.listen(changed)


async def _serve(state: Path, wires: dict[str, dict[str, Any]], grants: int) -> None:
    cheap = Passwords(PasswordHasher(time_cost=1, memory_cost=8, parallelism=1))
    people = People(state, accounts_needed=True, passwords=cheap)
    await people.open()
    for name, role in NAMES.items():
        if not any(account.name == name for account in people.accounts.directory.all()):
            await people.accounts.add(name, PASSWORD, role)
    bench = Bench(state, {name: _wire(name, facts) for name, facts in wires.items()})
    _report_grants(bench, grants)
    listening = _listen("127.0.0.1", 0)
    server = uvicorn.Server(_config(bench, people, Serving(accounts=True), None))
    serving = asyncio.create_task(server.serve(sockets=[listening]))
    while not server.started:  # noqa: ASYNC110 - uvicorn has no event for it
        await asyncio.sleep(0.01)
    print(json.dumps({"port": listening.getsockname()[1]}), flush=True)
    loop = asyncio.get_running_loop()
    threading.Thread(target=_obey, args=(server, loop), daemon=True, name="obey").start()
    await serving


def main() -> int:
    """Serve until standard input closes."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--state", type=Path, required=True)
    parser.add_argument("--wires", required=True)
    parser.add_argument("--grants", type=int, required=True, help="file descriptor")
    options = parser.parse_args()
    try:
        asyncio.run(_serve(options.state, json.loads(options.wires), options.grants))
    except DriveError as error:
        print(error.message, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
