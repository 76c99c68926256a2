"""Libraries that load slowly, so that they must be loaded before an axis moves."""

from __future__ import annotations

import importlib
from collections.abc import Iterable

#: Libraries that measurements compute with.
COMPUTING = ("scipy.fft", "scipy.ndimage", "scipy.optimize", "scipy.signal", "scipy.special")


def load(names: Iterable[str] = COMPUTING) -> None:
    """Load the libraries, or wait until another thread has; not on the event loop's thread."""
    for name in names:
        importlib.import_module(name)
