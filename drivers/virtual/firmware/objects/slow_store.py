"""Storing that takes time and permits no SDO meanwhile: 1010h:01 of the EP3E (001:1209-1212)."""

from __future__ import annotations

from collections.abc import Callable

from drivers.virtual.device import ABORT_DEVICE_STATE, SdoAbort
from drivers.virtual.firmware.core import Core

_SHORTEST_S = 0.5
_LONGEST_S = 9.9
_KEY = "1010:01"


class SlowStore:
    """1010h:01 reads 1 after power-on and after a failure, 0 after a success.

    The longest time is printed for the change of all objects; a share of them takes that share of
    it. An SDO access meanwhile aborts the operation: Err68.
    """

    def __init__(self, core: Core, failed: Callable[[], None]) -> None:
        self._core = core
        self._failed = failed
        self._spoiled = False
        self.busy = False
        core.od.put(_KEY, 1)

    def begin(self, operation: Callable[[], None], share: float) -> None:
        """Execute the operation after its time has passed."""
        self.busy, self._spoiled = True, False
        wait_s = max(_SHORTEST_S, _LONGEST_S * share)
        self._core.schedule.after(wait_s, lambda: self._end(operation))

    def _end(self, operation: Callable[[], None]) -> None:
        self.busy = False
        done = not self._spoiled
        if done:
            try:
                operation()
            except SdoAbort:
                done = False
        self._core.od.put(_KEY, 0 if done else 1)
        if not done:
            self._failed()

    def guard(self) -> None:
        """Refuse an SDO access while storing, which it aborts."""
        if self.busy:
            self._spoiled = True
            raise SdoAbort(ABORT_DEVICE_STATE)
