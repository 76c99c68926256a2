"""Start a virtual segment as a separate process and use its control channel."""

from __future__ import annotations

import contextlib
import json
import os
import selectors
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from types import TracebackType
from typing import IO, Any

from drivers.errors import LinkLost, LinkTimeout
from drivers.virtual.wires.netns import Namespace, child_environment

START_TIMEOUT_S = 180.0
"""Devices may first have to compile their physics, possibly on a busy computer."""
ANSWER_TIMEOUT_S = 5.0


class VirtualSegment:
    """A running segment. ``command`` uses the control channel of `control.Control`."""

    def __init__(self, process: subprocess.Popen[bytes], words: IO[bytes]) -> None:
        self._process = process
        self._words = words
        self._buffer = b""
        self._next_id = 0
        self._asking = threading.Lock()  # an answer belongs to the command sent before it
        self.description: dict[str, Any] = {}

    @classmethod
    def start(
        cls, interface: str, arguments: Sequence[str], namespace: Namespace | None = None
    ) -> VirtualSegment:
        """Start the segment on ``interface`` and wait until it processes frames.

        ``arguments`` are those of ``python -m drivers.virtual.wires.ethercat`` without the
        interface; with a ``namespace`` the segment runs inside it.

        Raises:
            LinkLost: it did not start; the message is from the segment.
        """
        module = "drivers.virtual.wires.ethercat"
        argv = [sys.executable, "-m", module, "--iface", interface, *arguments]
        # Its messages go to a file: a pipe that nobody reads blocks the process once full.
        words = tempfile.TemporaryFile()  # noqa: SIM115 - kept as long as the process
        process = subprocess.Popen(
            namespace.command(argv) if namespace else argv,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=words,
            env=child_environment(),
        )
        segment = cls(process, words)
        try:
            segment.description = segment._receive(START_TIMEOUT_S)
        except (LinkLost, LinkTimeout):
            segment.close()
            raise
        return segment

    @property
    def pid(self) -> int:
        """Process ID of the segment."""
        return self._process.pid

    def command(self, do: str, **arguments: object) -> Any:
        """Send one command and return its result.

        Raises:
            ValueError: the segment refuses it; the message is from the segment.
            LinkLost: the segment has ended.
            LinkTimeout: no answer within `ANSWER_TIMEOUT_S`.
        """
        with self._asking:
            self._next_id += 1
            message = {"id": self._next_id, "do": do, **arguments}
            assert self._process.stdin is not None
            try:
                self._process.stdin.write(json.dumps(message).encode() + b"\n")
                self._process.stdin.flush()
            except OSError as error:
                raise self._ended() from error
            deadline = time.monotonic() + ANSWER_TIMEOUT_S
            while True:
                answer = self._receive(deadline - time.monotonic())
                if answer.get("id") == self._next_id:
                    break
        if not answer["ok"]:
            raise ValueError(f"virtual segment refuses {do!r}: {answer['error']}")
        return answer.get("result")

    def kill(self) -> None:
        """Kill the segment, like a crash."""
        self._process.kill()
        self._process.wait()

    def close(self) -> None:
        """Stop the segment. Repeated calls have no effect."""
        process = self._process
        if process.stdin is not None:
            with contextlib.suppress(OSError):
                process.stdin.close()
        try:
            process.wait(timeout=5)
        except subprocess.TimeoutExpired:
            self.kill()
        if process.stdout is not None:
            process.stdout.close()
        self._words.close()

    def __enter__(self) -> VirtualSegment:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _receive(self, timeout_s: float) -> dict[str, Any]:
        assert self._process.stdout is not None
        handle = self._process.stdout.fileno()
        deadline = time.monotonic() + timeout_s
        with selectors.DefaultSelector() as selector:
            selector.register(handle, selectors.EVENT_READ)
            while b"\n" not in self._buffer:
                if not selector.select(max(0.0, deadline - time.monotonic())):
                    raise LinkTimeout("virtual.virtual-segment-silent", timeout_s=timeout_s)
                data = os.read(handle, 65536)
                if not data:
                    raise self._ended()
                self._buffer += data
        line, _, self._buffer = self._buffer.partition(b"\n")
        message: dict[str, Any] = json.loads(line)
        return message

    def _ended(self) -> LinkLost:
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(timeout=2)
        self._words.seek(0)
        text = self._words.read().decode(errors="replace").strip().splitlines()
        reason = text[-1] if text else f"exit status {self._process.poll()}"
        return LinkLost("virtual.virtual-segment-ended", reason=reason)
