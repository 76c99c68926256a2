"""Reading a register of one slave over a line that may lose frames. No I/O of its own."""

from __future__ import annotations

import time
from collections.abc import Callable

from drivers.ethercat.wire.steps import Pause, Read, Steps

TRIES = 3
"""A frame that comes back untouched so often says for certain that nobody answers."""
GONE_S = 1.0
"""For so long frames that do not come back are sent again: they say nothing of the slave."""
_AGAIN_S = 0.005


def read_again(
    register: int, size: int, clock: Callable[[], float] = time.monotonic
) -> Steps[bytes | None]:
    """What a register holds; None where nobody answers, or no frame came back for `GONE_S`.

    It is asked once more after that time, as this computer may have stood still meanwhile.
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
