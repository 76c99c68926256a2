"""The last minute of frames of every opened bus, for a support bundle or a download."""

from __future__ import annotations

import re
from collections.abc import Mapping

from drivers.errors import DriveError
from drivers.link import Link

SUFFIX = ".pcapng"


def file_name(url: str) -> str:
    """File name for a bus: the letters and digits of its URL."""
    return (re.sub(r"[^A-Za-z0-9]+", "-", url).strip("-")[:60] or "bus") + SUFFIX


async def flights(opened: Mapping[str, Link]) -> dict[str, bytes]:
    """A pcapng file of each bus that records its frames; a bus that fails is left out."""
    found: dict[str, bytes] = {}
    for url, link in list(opened.items()):
        if link.frames is None:
            continue
        try:
            data = await link.frames.flight()
        except DriveError:
            continue
        name, number = file_name(url), 2
        while name in found:
            name, number = f"{number}-{file_name(url)}", number + 1
        found[name] = data
    return found
