"""Content-Disposition header: the name of a file that is sent to a browser."""

from typing import Literal
from urllib.parse import quote


def disposition(how: Literal["inline", "attachment"], name: str) -> dict[str, str]:
    """Header for any file name: headers are Latin-1, names of axes may not be (RFC 8187)."""
    return {"Content-Disposition": f"{how}; filename*=UTF-8''{quote(name, safe='')}"}
