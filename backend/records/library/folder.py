"""A plain folder of parameter sets, as the command line uses it: list, read, store, delete."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

from backend.axes.parameters import set_file as parameter_set
from backend.axes.parameters.set_file import SUFFIX, ParameterSet
from backend.foundation.store.files import (
    checked_name,
    new_name,
    require_own_name,
    write_atomically,
)
from drivers.errors import NotAllowed


class SetStore(Protocol):
    """Storage of parameter sets. All methods block and must run on a thread."""

    def load(self, name: str) -> ParameterSet:
        """Read and parse."""
        ...

    def store(
        self, name: str, data: bytes, *, overwrite: bool = False, tags: Sequence[str] = ()
    ) -> str:
        """Check and store; returns the name."""
        ...


class SetLibrary:
    """Parameter-set files of one folder. Names are plain file names ending in ``.sdset``."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def _path(self, name: str) -> Path:
        return self.folder / checked_name(name, SUFFIX)

    def names(self) -> list[str]:
        """File names, newest first."""
        found = sorted(self.folder.glob(f"*{SUFFIX}"), key=lambda p: -p.stat().st_mtime)
        return [path.name for path in found if not path.name.startswith(".")]

    def read(self, name: str) -> bytes:
        """Contents of a file.

        Raises:
            NotAllowed: there is none of this name.
        """
        path = self._path(name)
        try:
            return path.read_bytes()
        except FileNotFoundError as error:
            raise NotAllowed("library.no-parameter-set", value=path.name) from error

    def load(self, name: str) -> ParameterSet:
        """Read and parse.

        Raises:
            NotAllowed: no such file. BadSet: not usable.
        """
        return parameter_set.parse(self.read(name), self._path(name).name)

    def store(
        self, name: str, data: bytes, *, overwrite: bool = False, tags: Sequence[str] = ()
    ) -> str:
        """Check and write a file; returns its name. A plain folder keeps no ``tags``.

        Raises:
            BadSet: the contents are not a parameter set; nothing is written.
            NotAllowed: the name exists and ``overwrite`` is False, or it differs in case only from
                one that exists. StorageFailed: disk.
        """
        del tags
        path = self.folder / new_name(name, SUFFIX)
        parameter_set.parse(data, path.name)
        require_own_name(self.folder, path.name)
        if path.exists() and not overwrite:
            raise NotAllowed("library.exists-already", value=path.name)
        write_atomically(path, data)
        return path.name

    def delete(self, name: str) -> None:
        """Delete a file.

        Raises:
            NotAllowed: there is none of this name.
        """
        self.read(name)
        self._path(name).unlink()
