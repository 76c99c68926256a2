"""Stations that write until they are killed: forked from one process that has imported everything.

    python -m tests.support.crash_child FOLDER DATABASE

For each line on its standard input it forks a child, says ``pid NUMBER``, and ``dead`` when that
has ended. What was confirmed to the child as stored it notes in ``FOLDER/reported`` at once. A line
is a seed, for a life until somebody kills it; or a seed, an act and a number: the child does this
one thing and kills itself at that step on the way to the disk (statement, commit, flush, rename).
"""

from __future__ import annotations

import asyncio
import functools
import hashlib
import json
import os
import random
import signal
import sys
import threading
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

from sqlalchemy import Engine, event

from backend.foundation.store.files import write_atomically
from backend.foundation.work.journal import Journal
from backend.records.audit import Fact
from backend.records.library.catalogue import INLINE
from backend.records.library.entries import Addition, AxisIdentity
from backend.records.recording.writer import RecordingWriter
from backend.station.records import Records
from tests.unit.recording.support import block, header

SET = """format = "servodeck parameter set"
version = 1
[identity]
profile = "mms7"
drive = "X"
[about]
notes = "{token}"
[end]
parameters = 0
"""


class Life:
    """One life of a station. Everything that it does is drawn from the seed."""

    def __init__(self, folder: Path, database: str, seed: int) -> None:
        self.seed = seed
        self.folder = folder
        self.dice = random.Random(seed)
        self.reported = (folder / "reported").open("ab", buffering=0)
        self.records = Records(folder / "state", Journal(), database)
        self.number = 0

    def tell(self, **fact: object) -> None:
        # One write call into the page cache: it outlives the process, whole or not at all.
        self.reported.write(json.dumps(fact).encode() + b"\n")

    def once(self, act: str, step: int) -> None:
        """One thing, cut off before the given step."""
        # What is not the thing itself, such as opening the database, happens before.
        self.records.store.open()
        cut_off_at(step)
        acts = {
            "save": self.save,
            "save_large": self.save_large,
            "event": self.event,
            "drop_file": self.drop_file,
            "change": self.change,
        }
        acts[act]()
        self.records.audit.close()
        self.tell(act="end")

    def run(self) -> None:
        self.records.audit.start()
        (self.folder / "state" / "recordings").mkdir(parents=True, exist_ok=True)
        recording = RecordingWriter(
            self.folder / "state" / "recordings" / f"r{self.seed}.sdrec", header(), print
        )
        acts = (self.save, self.save_large, self.event, self.event, self.drop_file, self.change)
        while True:
            self.number += 1
            recording.put(0, block(self.number))
            self.dice.choice(acts)()

    @property
    def token(self) -> str:
        return f"{self.seed}-{self.number}"

    def save(self, size: int = 50) -> None:
        data = self.dice.randbytes(size)
        axis = AxisIdentity("mms7", "X", serial=7)
        name = f"{self.dice.choice('abc')}.bin"
        entry = self.records.library.add("report", name, data, Addition(axis))
        self.tell(
            act="save",
            entry=entry.id,
            number=entry.latest.number,
            sha256=hashlib.sha256(data).hexdigest(),
        )

    def save_large(self) -> None:
        self.save(INLINE + 1 + self.dice.randrange(1000))

    def event(self) -> None:
        self.records.audit.add(Fact("write", "written", "X", "2005:03", new=self.token))
        if asyncio.run(self.records.audit.settled(20.0)):
            self.tell(act="event", token=self.token)

    def drop_file(self) -> None:
        name = f"s{self.token}.sdset"
        data = SET.format(token=self.token).encode()
        write_atomically(self.folder / "state" / "sets" / name, data)
        self.tell(act="file", name=name, sha256=hashlib.sha256(data).hexdigest())
        self.records.sets.take_in()

    def change(self) -> None:
        entries = self.records.library.all_of("report")
        if entries:
            entry = self.dice.choice(entries)
            self.records.library.annotate(entry.id, tags=(self.token, "tag"), notes=self.token)
            self.tell(act="change", entry=entry.id, notes=self.token)


def cut_off_at(step: int) -> None:
    """End this process as by kill -9 just before its n-th step on the way to the disk."""
    lock, count = threading.Lock(), 0

    def here(*_: object, **__: object) -> None:
        nonlocal count
        with lock:
            count += 1
            if count == step:
                os.kill(os.getpid(), signal.SIGKILL)

    def before(function: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(function)
        def stepped(*arguments: Any, **named: Any) -> Any:
            here()
            return function(*arguments, **named)

        return stepped

    for name in ("fsync", "replace", "rename", "unlink"):
        setattr(os, name, before(getattr(os, name)))
    event.listen(Engine, "before_cursor_execute", here)
    event.listen(Engine, "commit", here)


def main() -> None:
    folder, database = Path(sys.argv[1]), sys.argv[2]
    for line in sys.stdin:
        child = os.fork()
        if child == 0:
            try:
                seed, *once = line.split()
                life = Life(folder, database, int(seed))
                if once:
                    life.once(once[0], int(once[1]))
                else:
                    life.run()
            except BaseException:
                traceback.print_exc()
            finally:
                os._exit(1)
        print(f"pid {child}", flush=True)
        os.waitpid(child, 0)
        print("dead", flush=True)


if __name__ == "__main__":
    main()
