"""What the engineer does: drives, axes, jobs, tools, the server and the command line."""

import time
from importlib.metadata import version

__version__ = version("servodeck")


def now() -> float:
    """Epoch seconds."""
    return time.time()
