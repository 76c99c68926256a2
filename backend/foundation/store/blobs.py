"""Large contents outside the database, by SHA-256: in a folder or an S3-compatible store.

A blob is written once and never changed; when read, it is compared with its name, so that damage is
detected. It is stored before the row that refers to it: a crash in between leaves an unused blob,
never a row without its blob.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import fsspec
from fsspec.implementations.local import LocalFileSystem

from backend.foundation.store.files import StorageFailed, write_atomically
from drivers.texts.message import text

_NAME = re.compile(r"^[0-9a-f]{64}$")


class BlobFailed(StorageFailed):
    """Contents could not be stored or fetched, or are damaged."""


class Blobs:
    """Blobs at a place: a folder's path, ``s3://bucket/prefix``, or another fsspec URL.

    All methods block and belong on a worker thread.
    """

    def __init__(self, place: str) -> None:
        self.place = place
        try:
            self._fs, self._root = fsspec.core.url_to_fs(place)
        except (ImportError, ValueError) as error:
            raise BlobFailed(
                "store.cannot-used-contents",
                value=place,
                limit=text("limit.place-of-contents"),
                split=place.split("://", 1)[0],
                cause=str(error),
            ) from error

    def put(self, data: bytes) -> str:
        """Store contents; returns their name. Contents already stored are not written again.

        Raises:
            BlobFailed: nothing was stored.
        """
        name = hashlib.sha256(data).hexdigest()
        path = self._path(name)
        try:
            if self._fs.exists(path) and self._fs.size(path) == len(data):
                return name
            if isinstance(self._fs, LocalFileSystem):
                write_atomically(Path(path), data)
            else:
                # An object store shows an object only when all of it has arrived, so no
                # temporary name is needed.
                self._fs.pipe_file(path, data)
        except Exception as error:
            raise self._failed("stored", error) from error
        return name

    def get(self, name: str) -> bytes:
        """Read contents and check them against their name.

        Raises:
            BlobFailed: missing, damaged, or the place cannot be reached.
        """
        path = self._path(name)
        try:
            data = self._fs.cat_file(path)
        except FileNotFoundError as error:
            raise BlobFailed(
                "store.contents-missing", value=name, name=name[:12], place=self.place
            ) from error
        except Exception as error:
            raise self._failed("fetched", error) from error
        if not isinstance(data, bytes) or hashlib.sha256(data).hexdigest() != name:
            raise BlobFailed("store.contents-damaged", value=name, name=name[:12], place=self.place)
        return data

    def names(self) -> Iterator[str]:
        """Names of all stored blobs.

        Raises:
            BlobFailed: the place cannot be reached.
        """
        try:
            found = self._fs.find(self._root) if self._fs.exists(self._root) else []
        except Exception as error:
            raise self._failed("listed", error) from error
        for path in found:
            name = str(path).rsplit("/", 1)[-1]
            if _NAME.match(name):
                yield name

    def modified(self, name: str) -> datetime:
        """Time at which contents were stored.

        Raises:
            BlobFailed: missing, or the place cannot be reached.
        """
        try:
            moment = self._fs.modified(self._path(name))
        except Exception as error:
            raise self._failed("found", error) from error
        if not isinstance(moment, datetime):
            raise BlobFailed("store.not-tell-when-contents", value=name, place=self.place)
        return moment if moment.tzinfo else moment.replace(tzinfo=UTC)

    def delete(self, name: str) -> None:
        """Delete contents that nothing refers to any more; does nothing if they do not exist.

        Raises:
            BlobFailed: the place cannot be reached.
        """
        path = self._path(name)
        try:
            if self._fs.exists(path):
                self._fs.rm_file(path)
        except Exception as error:
            raise self._failed("deleted", error) from error

    def _path(self, name: str) -> str:
        if not _NAME.match(name):
            raise BlobFailed("store.no-name-contents", value=name)
        return f"{self._root}/{name[:2]}/{name}"

    def _failed(self, what: str, error: Exception) -> BlobFailed:
        # Every kind of store has its own errors; a botocore error, for example, is not an OSError.
        return BlobFailed("store.contents-not", value=self.place, what=what, error=str(error))
