"""Transactions carried out without a bus: one frame after the other, on a clock of their own."""

from __future__ import annotations

from typing import TypeVar

from drivers.ethercat.wire.steps import Gap, Pause, Read, Step, Steps, Write

T = TypeVar("T")
_MOST_S = 60.0


class ByHand:
    """``frame`` answers a frame and lets `now` pass by as long as it takes; None: it is lost."""

    now: float

    def frame(self, step: Read | Write) -> bytes | None:
        raise NotImplementedError

    def run(self, steps: Steps[T]) -> T:
        reply: bytes | None = None
        while True:
            try:
                step = steps.send(reply)
            except StopIteration as stop:
                result: T = stop.value
                return result
            assert self.now < _MOST_S, "the transaction does not end"
            reply = self._do(step)

    def _do(self, step: Step) -> bytes | None:
        if isinstance(step, Pause):
            self.now += step.seconds
        return b"" if isinstance(step, Pause | Gap) else self.frame(step)
