"""Imports in a process of their own, which the server starts with bounded memory.

Importing a manufacturer's file may take seconds, and its contents are unknown. In this process it
cannot delay a motion, and the caller can end it. One task comes pickled on the standard input, only
from our own parent; one JSON object goes to the standard output: ``{"ok": …}``, ``{"refused":
{"code": …, "params": …}}`` with a message of the catalogue, or ``{"error": "…"}`` in the words of
the operating system.
"""

from __future__ import annotations

import json
import pickle
import sys
from dataclasses import dataclass
from pathlib import Path

from profiles.importer.build import ImportedProfile, build_profile
from profiles.importer.description import Description
from profiles.importer.esi.esi import esi_devices, open_esi
from profiles.importer.files import import_file, is_xml, write_profile
from profiles.importer.report import ImportFailed, ImportReport
from profiles.loader import ProfileError, drive_names, load_profile


@dataclass(frozen=True, slots=True)
class FileTask:
    """Create a profile from a file and write it to ``folder``. ``name`` None: after the device."""

    data: bytes
    file: str
    folder: Path
    name: str | None = None
    product_code: int | None = None
    revision: int | None = None

    def run(self) -> dict[str, object]:
        """See `_written`."""
        imported = import_file(
            self.data,
            self.file,
            drive=self.name,
            product_code=self.product_code,
            revision=self.revision,
        )
        return _written(imported, self.folder)


@dataclass(frozen=True, slots=True)
class DescriptionTask:
    """Create a profile named ``name`` from a drive's report and write it to ``folder``."""

    description: Description
    report: ImportReport
    folder: Path
    name: str

    def run(self) -> dict[str, object]:
        """See `_written`."""
        return _written(build_profile(self.description, self.report, drive=self.name), self.folder)


@dataclass(frozen=True, slots=True)
class DevicesTask:
    """List the devices in a file; an EDS or DCF file has one, which is not read here."""

    data: bytes
    file: str

    def run(self) -> dict[str, object]:
        """Return ``devices``: name, product_code and revision of each; empty for an EDS file."""
        if not is_xml(self.data):
            return {"devices": []}
        devices = esi_devices(open_esi(self.data, self.file, ImportReport()))
        return {
            "devices": [
                {"name": d.name, "product_code": d.product_code, "revision": d.revision}
                for d in devices
            ]
        }


Task = FileTask | DescriptionTask | DevicesTask
#: Bytes reserved for the answer of a process that has used up its memory.
_RESERVE = 16 << 20


def _written(imported: ImportedProfile, folder: Path) -> dict[str, object]:
    """Write the profile and read it back through the loader."""
    profile, report = imported.profile, imported.report
    if profile.drive in drive_names():
        raise ImportFailed("description.profile-exists", name=profile.drive)
    path = write_profile(profile, folder)
    try:
        load_profile(profile.drive)
    except ProfileError as error:
        path.unlink(missing_ok=True)
        raise ImportFailed("description.not-read-back", detail=str(error)) from error
    return {
        "profile": profile.drive,
        "title": profile.title,
        "vendor_id": profile.identity.vendor_id,
        "product_code": profile.identity.product_code,
        "revision": profile.identity.revision,
        "links": [spec.kind for spec in profile.links],
        "parameters": len(profile.parameters),
        "path": str(path),
        "findings": [
            {"place": f.place, "code": f.code, "params": dict(f.params), "outcome": f.outcome}
            for f in report.findings
        ],
        "not_listed": report.not_listed,
    }


def main(most_mib: int = 0) -> None:
    """Execute the single task of this process, whose memory is limited to ``most_mib``."""
    answer: dict[str, object]
    reserve = [bytearray(_RESERVE)]
    try:
        task: Task = pickle.load(sys.stdin.buffer)  # noqa: S301 - from our own parent
        answer = {"ok": task.run()}
    except MemoryError:
        reserve.clear()
        answer = {
            "refused": {"code": "description.too-much-memory", "params": {"limit_mib": most_mib}}
        }
    except ImportFailed as error:
        answer = {"refused": {"code": error.code, "params": dict(error.params)}}
    except OSError as error:
        answer = {"error": str(error)}
    json.dump(answer, sys.stdout)
