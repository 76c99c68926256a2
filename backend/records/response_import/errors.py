"""Error of an imported recording."""

from __future__ import annotations

from drivers.errors import NotAllowed


class BadRecording(NotAllowed):
    """No response can be made from a file; the error has column, value and remedy."""

    kind = "bad-recording"
