"""Stored measurements: raw signals, settings and result.

One file each (``.sdmeas``, a zip like numpy's .npz): ``meta`` is JSON, every other member an array.
The raw signals can be evaluated again; see `backend.station.evaluation`.
"""

from __future__ import annotations

import hashlib
import io
import json
import struct
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from tokenize import TokenError

import numpy as np
import numpy.typing as npt

import backend
from backend.axes.drive.drive import Drive
from backend.foundation.store.files import checked_name, files_of, shown_name, write_atomically
from drivers.errors import NotAllowed
from profiles.schema import Profile

SUFFIX = ".sdmeas"
VERSION = 1
#: Largest unpacked size; no measurement reaches it, a larger file is made to exhaust the memory.
_MAX_UNPACKED = 1024 * 1024 * 1024
#: Largest size of the JSON of a file. Tools write some ten KiB, with curves of thousands of points
#: 1 MiB. The JSON decoder blocks all other threads until it has ended (20 ms per MiB).
_MAX_HEAD = 4 * 1024 * 1024
Arrays = dict[str, npt.NDArray[np.generic]]


class BadMeasurement(NotAllowed):
    """A file is not a measurement, or is damaged."""

    kind = "bad-measurement"


@dataclass(frozen=True)
class Head:
    """Header of a measurement.

    ``meta``: settings and facts of the tool, identity, profile, time, and the result.
    """

    kind: str
    saved: datetime
    drive: str
    meta: dict[str, object]


@dataclass(frozen=True)
class Measurement:
    """A whole file: its header, and the raw signals [n] by name."""

    head: Head
    arrays: Arrays

    @property
    def kind(self) -> str:
        """Tool and kind of measurement, such as ``sweep-mechanics``."""
        return self.head.kind

    @property
    def meta(self) -> dict[str, object]:
        """See `Head`."""
        return self.head.meta


def profile_version(profile: Profile) -> str:
    """Twelve hex digits of a hash over the whole profile."""
    return hashlib.sha256(profile.model_dump_json().encode()).hexdigest()[:12]


def pack(
    kind: str,
    drive: Drive,
    arrays: Mapping[str, npt.NDArray[np.generic]],
    meta: Mapping[str, object],
    saved: datetime,
    result: Mapping[str, object] | None = None,
) -> bytes:
    """Contents of the file of a measurement."""
    found = drive.found
    head = {
        **meta,
        "version": VERSION,
        "kind": kind,
        "saved": saved.isoformat(),
        "drive": drive.name,
        "drive_id": drive.id,
        "program": backend.__version__,
        "profile": drive.profile.drive,
        "profile_title": drive.profile.title,
        "profile_version": profile_version(drive.profile),
        "manual": drive.profile.manual,
        "identity": {
            "vendor_id": found.vendor_id,
            "product_code": found.product_code,
            "revision": found.revision,
            "serial": found.serial,
            "firmware": found.firmware,
        }
        if found
        else None,
        "result": result,
    }
    return _zipped(head, arrays)


def pack_other(
    kind: str,
    title: str,
    arrays: Mapping[str, npt.NDArray[np.generic]],
    meta: Mapping[str, object],
    saved: datetime,
    result: Mapping[str, object] | None = None,
) -> bytes:
    """Contents of a file that was not measured on a drive here; ``title`` replaces its name."""
    head = {
        **meta, "version": VERSION, "kind": kind, "saved": saved.isoformat(), "drive": title,
        "program": backend.__version__, "profile": "", "profile_version": "", "identity": None,
        "result": result,
    }  # fmt: skip
    return _zipped(head, arrays)


def _zipped(head: Mapping[str, object], arrays: Mapping[str, npt.NDArray[np.generic]]) -> bytes:
    out = io.BytesIO()
    text = np.frombuffer(json.dumps(head, default=str).encode(), dtype=np.uint8)
    members: dict[str, npt.NDArray[np.generic]] = {"meta": text}
    members |= {name.replace("/", "."): values for name, values in arrays.items()}
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, values in members.items():
            part = io.BytesIO()
            np.save(part, values, allow_pickle=False)
            archive.writestr(f"{name}.npy", part.getvalue())
    return out.getvalue()


def unpack(data: bytes, name: str = "the file") -> Measurement:
    """Read a file's contents.

    Raises:
        BadMeasurement: not a measurement, damaged, or of a newer version.
    """
    with _reported(name), zipfile.ZipFile(io.BytesIO(data)) as archive:
        if sum(each.file_size for each in archive.infolist()) > _MAX_UNPACKED:
            raise ValueError("it is larger than any measurement")
        _require_small_head(archive)
        arrays: Arrays = {}
        for member in archive.namelist():
            values = np.load(io.BytesIO(archive.read(member)), allow_pickle=False)
            if values.dtype.kind not in "biuf":
                raise ValueError(f"{member} holds no numbers")
            arrays[member.removesuffix(".npy").replace(".", "/")] = values
        return Measurement(_head(arrays.pop("meta"), name), arrays)


def unpack_head(file: Path) -> Head:
    """Header of a file, without reading its signals.

    Raises:
        BadMeasurement: as `unpack`; damage of the signals is not detected.
    """
    with _reported(file.name), zipfile.ZipFile(file) as archive:
        _require_small_head(archive)
        values = np.load(io.BytesIO(archive.read("meta.npy")), allow_pickle=False)
        return _head(values, file.name)


def _require_small_head(archive: zipfile.ZipFile) -> None:
    if archive.getinfo("meta.npy").file_size > _MAX_HEAD:
        raise ValueError("it is larger than any measurement")


def _head(text: npt.NDArray[np.generic], name: str) -> Head:
    meta = json.loads(text.tobytes())
    if int(meta["version"]) > VERSION:
        raise BadMeasurement("library.written-newer-version", value=name)
    saved = datetime.fromisoformat(meta["saved"])
    if not 1 < saved.year < 9999:
        raise ValueError("no date")  # some time zone cannot express it
    # Half of a surrogate pair, which JSON may contain and no answer or database can.
    json.dumps(meta, ensure_ascii=False).encode()
    return Head(str(meta["kind"]), saved, str(meta["drive"]), meta)


@contextmanager
def _reported(name: str) -> Iterator[None]:
    """Convert all errors that a damaged file causes to BadMeasurement."""
    try:
        yield
    except (
        zipfile.BadZipFile, zlib.error, struct.error, KeyError, ValueError, TypeError, EOFError,
        OSError, NotImplementedError, MemoryError, OverflowError, SyntaxError, RecursionError,
        TokenError,
    ) as error:  # fmt: skip
        raise BadMeasurement(
            "library.damaged-no-measurement", value=name, cause=str(error)
        ) from error


class MeasurementStore:
    """The folder of measurements; names are plain file names ending in ``.sdmeas``."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def save(
        self,
        kind: str,
        drive: Drive,
        arrays: Mapping[str, npt.NDArray[np.generic]],
        meta: Mapping[str, object],
        result: Mapping[str, object] | None = None,
    ) -> str:
        """Write a new file; return its name.

        Raises:
            StorageFailed: the file cannot be written.
        """
        saved = datetime.now(UTC)
        stem = f"{saved:%Y%m%d-%H%M%S}-{kind}-{drive.id}"
        name, number = stem + SUFFIX, 2
        while (self.folder / name).exists():
            name, number = f"{stem}-{number}{SUFFIX}", number + 1
        write_atomically(self.folder / name, pack(kind, drive, arrays, meta, saved, result))
        return name

    def conclude(
        self, name: str, result: Mapping[str, object], verdict: Mapping[str, object] | None = None
    ) -> None:
        """Add the result to a file, so that a later evaluation can be compared with it.

        ``verdict`` on a tuned loop is based on other measurements as well, and is stored unchanged.

        Raises:
            NotAllowed: no such file.
            StorageFailed: the file cannot be written and is unchanged.
        """
        more = {} if verdict is None else {"verdict": verdict}
        self._add(self.load(name), name, {"result": result, **more})

    def sign(
        self, name: str, signature: Mapping[str, object], result: Mapping[str, object]
    ) -> None:
        """Add the signature to a file, and the result that was signed.

        Raises:
            NotAllowed: no such file.
            StorageFailed: the file cannot be written and is unchanged.
        """
        self._add(self.load(name), name, {"signature": signature, "result": result})

    def _add(self, found: Measurement, name: str, facts: Mapping[str, object]) -> None:
        write_atomically(self.path(name), _zipped({**found.meta, **facts}, found.arrays))

    def names(self) -> list[str]:
        """File names, newest first."""
        return sorted(map(shown_name, files_of(self.folder, SUFFIX)), reverse=True)

    def read(self, name: str) -> bytes:
        """Contents of a file.

        Raises:
            NotAllowed: there is none of this name.
        """
        path = self.path(name)
        try:
            return path.read_bytes()
        except FileNotFoundError as error:
            raise NotAllowed("library.no-measurement-choose-list", value=path.name) from error

    def load(self, name: str) -> Measurement:
        """Read and parse.

        Raises:
            NotAllowed: no such file. BadMeasurement: not usable.
        """
        return unpack(self.read(name), name)

    def path(self, name: str) -> Path:
        """Path of a file of this name, whether it exists or not.

        Raises:
            NotAllowed: not a plain file name.
        """
        return self.folder / checked_name(name, SUFFIX)

    def head(self, name: str) -> Head:
        """Header of a file.

        Raises:
            NotAllowed: no such file. BadMeasurement: not usable.
        """
        path = self.path(name)
        if not path.is_file():
            raise NotAllowed("library.no-measurement", value=path.name)
        return unpack_head(path)

    def store(self, name: str, data: bytes) -> str:
        """Import a file; return its name.

        Raises:
            BadMeasurement: nothing is written. NotAllowed: the name exists.
        """
        path = self.path(name)
        unpack(data, path.name)
        if path.exists():
            raise NotAllowed("library.exists-already-choose-another", value=path.name)
        write_atomically(path, data)
        return path.name

    def delete(self, name: str) -> None:
        """Delete a file.

        Raises:
            NotAllowed: there is none of this name.
        """
        self.read(name)
        self.path(name).unlink()
