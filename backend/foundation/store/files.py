"""Atomic file writes: to a temporary name, flushed, then renamed into place."""

from __future__ import annotations

import errno
import os
import re
import tempfile
import unicodedata
from pathlib import Path

from drivers.errors import NotAllowed
from drivers.texts.message import text
from profiles.replacing import move_into_place

_DEVICE = re.compile(r"CON|PRN|AUX|NUL|(?:COM|LPT)[0-9¹²³]", re.IGNORECASE)
_NAME = re.compile(r"^\w[\w .\-]{0,100}$")


class StorageFailed(NotAllowed):
    """A file could not be written; the previous file is unharmed."""

    kind = "storage-failed"


def checked_name(name: str, suffix: str) -> str:
    """Plain file name with ``suffix``; no folders, no leading dot.

    Raises:
        NotAllowed: the name is anything else.
    """
    stem = name.removesuffix(suffix)
    if not _NAME.fullmatch(stem) or ".." in stem:
        raise NotAllowed("store.not-file-name", value=name, limit=text("limit.file-name"))
    return stem + suffix


def new_name(name: str, suffix: str) -> str:
    """Plain file name for a new file that every system can have.

    Windows takes some names for devices, with any suffix (learn.microsoft.com, "Naming Files,
    Paths, and Namespaces"). They are refused on each system, as files are carried from one to
    another; existing files of these names can still be read where the system has them.

    Raises:
        NotAllowed: as `checked_name`, or the name of a device.
    """
    checked = checked_name(name, suffix)
    if _DEVICE.fullmatch(checked.partition(".")[0].rstrip()):
        raise NotAllowed("store.device-name", value=name)
    return checked


def same_but_for_case(folder: Path, name: str) -> str | None:
    """Other file of a folder that Windows and macOS take for ``name``; None where there is none.

    Their file systems ignore case, that of macOS also how a letter with an accent is composed. On
    Linux both can exist, and only one of them could be carried to such a system.
    """
    wanted = _without_case(name)
    try:
        present = [path.name for path in folder.iterdir()]
    except OSError:
        return None
    return next((one for one in present if one != name and _without_case(one) == wanted), None)


def require_own_name(folder: Path, name: str) -> None:
    """Check that a new file is not, on another system, one that the folder has already.

    Raises:
        NotAllowed: the folder has a file whose name differs in case only.
    """
    other = same_but_for_case(folder, name)
    if other is not None:
        raise NotAllowed("store.same-but-for-case", value=name, other=other)


def is_taken(folder: Path, name: str) -> bool:
    """Whether a folder has a file of this name on any system."""
    return (folder / name).exists() or same_but_for_case(folder, name) is not None


def _without_case(name: str) -> str:
    return unicodedata.normalize("NFC", unicodedata.normalize("NFD", name).casefold())


def files_of(folder: Path, *suffixes: str) -> list[Path]:
    """Files of a folder with one of these suffixes; no folders, dead links or hidden files."""
    return [
        path
        for suffix in suffixes
        for path in folder.glob(f"*{suffix}")
        if not path.name.startswith(".") and path.is_file()
    ]


def shown_name(path: Path) -> str:
    """Name of a file for lists and messages: what is not UTF-8 in it is replaced."""
    return os.fsencode(path.name).decode("utf-8", "replace")


def write_atomically(path: Path, data: bytes, *, durable: bool = True) -> None:
    """Replace ``path`` by ``data``, or leave it as it was.

    Data that is not ``durable`` survives the end of the process but perhaps not a power failure;
    the call then does not wait for the disk.

    Raises:
        StorageFailed: for example disk full, no permission, or open in a program for longer than a
            moment; the old file stays.
    """
    try:
        if path.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        path.parent.mkdir(parents=True, exist_ok=True)
        handle = tempfile.NamedTemporaryFile(  # noqa: SIM115 - renamed, not deleted, at the end
            dir=path.parent, prefix=f".{path.name}.", delete=False
        )
    except OSError as error:
        raise _failed(path, error) from error
    temporary = Path(handle.name)
    try:
        with handle:
            handle.write(data)
            handle.flush()
            if durable:
                os.fsync(handle.fileno())
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise _failed(path, error) from error
    try:
        move_into_place(temporary, path)
    except PermissionError as error:
        # The folder can be written, as the temporary file was.
        temporary.unlink(missing_ok=True)
        raise StorageFailed(
            "store.held-open",
            value=str(path),
            path=str(path.name or path),
            strerror=str(error.strerror or error),
        ) from error
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise _failed(path, error) from error


def require_writable(path: Path) -> None:
    """Check that `write_atomically` can write this file, by a temporary file beside it.

    Raises:
        StorageFailed: as `write_atomically`; nothing is left behind.
    """
    try:
        if path.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}.") as file:
            file.write(b" ")
    except OSError as error:
        raise _failed(path, error) from error


def _failed(path: Path, error: OSError) -> StorageFailed:
    return StorageFailed(
        "store.not-written",
        value=str(path),
        path=str(path.name or path),
        strerror=str(error.strerror or error),
    )
