"""What is wrong with a recording that somebody brings."""

from __future__ import annotations

from drivers.errors import NotAllowed


class BadRecording(NotAllowed):
    """A file of which no response can be made; names column, value and remedy."""

    kind = "bad-recording"
