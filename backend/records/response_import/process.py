"""Imports in a separate process: ``python -m backend.records.response_import.process``.

A file from elsewhere may take seconds and much memory, and its contents are not known. In its own
process the import does not delay motion, and its caller can end it. One pickled task comes from
the parent process by standard input; one JSON object goes to standard output.
"""

from __future__ import annotations

import asyncio
import base64
import json
import pickle
import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from backend.foundation.work.child import run_child
from backend.records.response_import.contents import read_table
from backend.records.response_import.errors import BadRecording
from backend.records.response_import.evaluation import ImportSettings, evaluate_signals, prepared
from backend.records.response_import.preview import preview
from backend.records.response_import.stored import pack_import
from drivers.computer.processes import limit_memory, yield_processor
from drivers.texts.message import Text, prose, text

#: Time limit of an evaluation [s]; the largest file takes a fraction of it.
LIMIT_S = 120.0
#: Memory limit of the process: more than any permitted file needs.
_MEMORY_BYTES = 6 << 30


@dataclass(frozen=True, slots=True)
class ImportTask:
    """A file's bytes with a person's settings; without ``settings`` only a preview is made."""

    data: bytes
    name: str
    settings: ImportSettings | None

    def run(self) -> dict[str, object]:
        """The preview, or the packed measurement."""
        if self.settings is None:
            return preview(self.data, self.name)
        signals = prepared(read_table(self.data, self.name), self.name, self.settings)
        result = evaluate_signals(signals, self.name, self.settings)
        packed = pack_import(self.name, signals, self.settings, result, datetime.now(UTC))
        return {"packed": base64.b64encode(packed).decode()}


async def import_in_process(task: ImportTask, limit_s: float = LIMIT_S) -> dict[str, Any]:
    """Carry out a task in a separate process, which ends with the caller's task.

    Raises:
        BadRecording: the file is not usable, or its evaluation takes too long.
    """
    try:
        given = await run_child(
            "backend.records.response_import.process",
            sent=await asyncio.to_thread(pickle.dumps, task),
            limit_s=limit_s,
        )
    except TimeoutError:
        raise BadRecording(
            "import.evaluation-ended-after",
            value=task.name,
            limit=f"{limit_s:g} s",
            limit_s=limit_s,
        ) from None
    try:
        answer: dict[str, Any] = await asyncio.to_thread(json.loads, given.out)
    except ValueError:
        raise BadRecording(
            "import.evaluation-failed-exit-code",
            value=task.name,
            returncode=given.exit_code,
            last=given.last_line,
        ) from None
    if "error" in answer:
        refused = answer["error"]
        remedy, limit = refused.pop("remedy"), refused.pop("limit")
        raise BadRecording(
            Text.from_wire(refused.pop("text")),
            remedy=None if remedy is None else Text.from_wire(remedy),
            limit=None if limit is None else Text.from_wire(limit),
            **refused,
        )
    result: dict[str, Any] = answer["ok"]
    return result


def main() -> None:
    """Carry out the one task of this process."""
    # STOP and the buses have priority, however many files are read.
    yield_processor()
    # Where the system supports it, a file made to exhaust the memory ends only this process.
    limit_memory(_MEMORY_BYTES)
    task: ImportTask = pickle.load(sys.stdin.buffer)  # noqa: S301 - from our own parent
    answer: dict[str, object]
    try:
        answer = {"ok": task.run()}
    except BadRecording as error:
        answer = {
            "error": {
                "text": error.text.to_wire(),
                "parameter": error.parameter,
                "value": error.value,
                "limit": None if error.limit_text is None else error.limit_text.to_wire(),
                "remedy": None if error.own_remedy is None else error.own_remedy.to_wire(),
            }
        }
    except MemoryError:
        most_gib = _MEMORY_BYTES >> 30
        answer = {
            "error": {
                "text": text("import.too-much-memory", name=task.name, most_gib=most_gib).to_wire(),
                "value": task.name,
                "limit": prose(f"{most_gib} GiB").to_wire(),
                "remedy": None,
            }
        }
    json.dump(answer, sys.stdout, default=float)


if __name__ == "__main__":
    main()
