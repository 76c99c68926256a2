"""Prints the SHA-256 of every file in a folder and keeps them there in ``SHA256SUMS``.

    python .ci/supply/checksums.py FOLDER

The file is of the form that ``sha256sum --check SHA256SUMS`` reads on the computer that the folder
is carried to.
"""

from __future__ import annotations

import hashlib
import sys
from pathlib import Path

NAME = "SHA256SUMS"


def digest(file: Path) -> str:
    """SHA-256 of a file, in hexadecimal digits."""
    with file.open("rb") as content:
        return hashlib.file_digest(content, "sha256").hexdigest()


def write(folder: Path) -> str:
    """Keep the sums of all files below ``folder``, and return them, one line for each file."""
    files = sorted(path for path in folder.rglob("*") if path.is_file() and path.name != NAME)
    lines = [f"{digest(file)}  {file.relative_to(folder).as_posix()}\n" for file in files]
    (folder / NAME).write_text("".join(lines), "utf-8")
    return "".join(lines)


if __name__ == "__main__":
    print(write(Path(sys.argv[1])), end="")
