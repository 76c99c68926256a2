"""Libraries that take long to load, and that nothing may wait for while an axis moves."""

from __future__ import annotations

import importlib
from collections.abc import Iterable

#: What measurements compute with.
COMPUTING = ("scipy.fft", "scipy.ndimage", "scipy.optimize", "scipy.signal", "scipy.special")


def load(names: Iterable[str] = COMPUTING) -> None:
    """Load them, or wait until another thread has: not on the thread of the event loop."""
    for name in names:
        importlib.import_module(name)
