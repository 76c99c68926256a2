"""What a file that is sent is called, for the browser."""

from typing import Literal
from urllib.parse import quote


def disposition(how: Literal["inline", "attachment"], name: str) -> dict[str, str]:
    """The header of a file with any name: headers are Latin-1, axes are not always (RFC 8187)."""
    return {"Content-Disposition": f"{how}; filename*=UTF-8''{quote(name, safe='')}"}
