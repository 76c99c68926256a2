"""Reading a register of one slave over a line that may lose frames. No I/O of its own."""

from __future__ import annotations

import time
from collections.abc import Callable

from drivers.ethercat.wire.steps import Pause, Read, Steps

TRIES = 3
"""Number of unprocessed frames that prove that no slave answers."""
GONE_S = 1.0
"""Time during which lost frames are repeated [s]: they are no evidence about the slave."""
_AGAIN_S = 0.005


def read_again(
    register: int, size: int, clock: Callable[[], float] = time.monotonic
) -> Steps[bytes | None]:
    """Read a register; None if no slave answers, or if no frame came back for `GONE_S`.

    It is read once more after that time, as this computer may have been stalled meanwhile.
    """
    deadline = clock() + GONE_S
    untouched = 0
    while True:
        last = clock() > deadline
        data = yield Read(register, size, may_be_empty=True)
        if data:
            return data
        untouched += data is not None
        if untouched >= TRIES or last:
            return None
        if data is None:
            yield Pause(_AGAIN_S)
