"""Stored measurements: the raw signals, how they were made, and what was concluded.

One file each (``.sdmeas``, a zip as numpy writes it): ``meta`` is JSON, every other member an
array. Whoever opens it can evaluate it anew; see `recompute`.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import numpy.typing as npt

from backend.drive import Drive
from backend.files import checked_name, write_atomically
from backend.tools import inertia as inertia_tool
from backend.tools import sweep as sweep_tool
from drivers.errors import NotAllowed

SUFFIX = ".sdmeas"
VERSION = 1
Arrays = dict[str, npt.NDArray[np.generic]]


class BadMeasurement(NotAllowed):
    """A file that is not a measurement, or is damaged."""

    kind = "bad-measurement"


@dataclass(frozen=True)
class Measurement:
    """``meta`` holds settings and facts of the tool, identity, profile, time, and the result."""

    kind: str
    saved: datetime
    drive: str
    meta: dict[str, object]
    arrays: Arrays


def pack(
    kind: str,
    drive: Drive,
    arrays: Mapping[str, npt.NDArray[np.generic]],
    meta: Mapping[str, object],
    saved: datetime,
    result: Mapping[str, object] | None = None,
) -> bytes:
    """A file's contents."""
    found = drive.found
    head = {
        **meta,
        "version": VERSION,
        "kind": kind,
        "saved": saved.isoformat(),
        "drive": drive.name,
        "profile": drive.profile.drive,
        "manual": drive.profile.manual,
        "identity": {
            "vendor_id": found.vendor_id, "product_code": found.product_code,
            "revision": found.revision, "serial": found.serial, "firmware": found.firmware,
        } if found else None,
        "result": result,
    }  # fmt: skip
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
    try:
        arrays: Arrays = {}
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            for member in archive.namelist():
                values = np.load(io.BytesIO(archive.read(member)), allow_pickle=False)
                arrays[member.removesuffix(".npy").replace(".", "/")] = values
        meta = json.loads(arrays.pop("meta").tobytes())
        if int(meta["version"]) > VERSION:
            raise BadMeasurement(
                f"{name} was written by a newer version", value=name,
                remedy="update servodeck to open it",
            )  # fmt: skip
        saved = datetime.fromisoformat(meta["saved"])
        return Measurement(str(meta["kind"]), saved, str(meta["drive"]), meta, arrays)
    except (zipfile.BadZipFile, KeyError, ValueError, TypeError, EOFError) as error:
        raise BadMeasurement(
            f"{name} is not a measurement: {error}", value=name,
            remedy="choose a file that servodeck wrote",
        ) from error  # fmt: skip


def recompute(measurement: Measurement) -> dict[str, object]:
    """Evaluate the raw data anew; the tool's JSON form.

    Raises:
        BadMeasurement: of a kind that cannot be evaluated anew, or not complete.
    """
    try:
        match measurement.meta.get("tool"):
            case "sweep":
                return sweep_tool.as_json(
                    sweep_tool.reevaluate(measurement.arrays, measurement.meta)
                )
            case "inertia":
                return inertia_tool.as_json(
                    inertia_tool.reevaluate(measurement.arrays, measurement.meta)
                )
    except ValueError as error:
        raise BadMeasurement(str(error), value=measurement.kind) from error
    raise BadMeasurement(
        f"a measurement of kind {measurement.kind} has nothing to evaluate", value=measurement.kind
    )


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
        """Write a new file; returns its name.

        Raises:
            StorageFailed: the disk.
        """
        saved = datetime.now(UTC)
        stem = f"{saved:%Y%m%d-%H%M%S}-{kind}-{drive.id}"
        name, number = stem + SUFFIX, 2
        while (self.folder / name).exists():
            name, number = f"{stem}-{number}{SUFFIX}", number + 1
        write_atomically(self.folder / name, pack(kind, drive, arrays, meta, saved, result))
        return name

    def names(self) -> list[str]:
        """File names, newest first."""
        found = sorted((p.name for p in self.folder.glob(f"*{SUFFIX}")), reverse=True)
        return [name for name in found if not name.startswith(".")]

    def read(self, name: str) -> bytes:
        """Contents of a file.

        Raises:
            NotAllowed: there is none of this name.
        """
        path = self.folder / checked_name(name, SUFFIX)
        try:
            return path.read_bytes()
        except FileNotFoundError as error:
            raise NotAllowed(f"there is no measurement {path.name}", value=path.name) from error

    def load(self, name: str) -> Measurement:
        """Read and parse.

        Raises:
            NotAllowed: no such file. BadMeasurement: not usable.
        """
        return unpack(self.read(name), name)

    def store(self, name: str, data: bytes) -> str:
        """Take a file from elsewhere; returns its name.

        Raises:
            BadMeasurement: nothing is written. NotAllowed: the name exists.
        """
        path = self.folder / checked_name(name, SUFFIX)
        unpack(data, path.name)
        if path.exists():
            raise NotAllowed(f"{path.name} exists already", value=path.name,
                             remedy="choose another name")  # fmt: skip
        write_atomically(path, data)
        return path.name

    def delete(self, name: str) -> None:
        """Delete a file.

        Raises:
            NotAllowed: there is none of this name.
        """
        self.read(name)
        (self.folder / checked_name(name, SUFFIX)).unlink()
