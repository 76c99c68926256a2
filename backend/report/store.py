"""The folder of reports, and the rendering of a report."""

from __future__ import annotations

import re
from datetime import UTC, datetime
from pathlib import Path
from typing import Literal

from backend.foundation.store.files import checked_name, files_of, shown_name, write_atomically
from backend.report.compose import compose
from backend.report.document import Language
from backend.report.facts import Facts
from backend.report.render.html import render_html
from drivers.errors import NotAllowed

Format = Literal["html", "pdf"]
FORMATS: tuple[Format, ...] = ("html", "pdf")
_UNSAFE = re.compile(r"[^\w.\-]+")


def render(facts: Facts, language: Language, form: Format) -> bytes:
    """A report as a file's contents."""
    document = compose(facts, language)
    if form == "html":
        return render_html(document)
    # Imported by the first PDF, or by a server after its start (`backend.commands.server.serve`).
    from backend.report.render.pdf import render_pdf

    return render_pdf(document)


class ReportStore:
    """Reports of one folder; names are plain file names ending in ``.html`` or ``.pdf``."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def _path(self, name: str) -> Path:
        suffix = next((f".{form}" for form in FORMATS if name.endswith(f".{form}")), None)
        if suffix is None:
            raise NotAllowed("report.no-report", value=name, limit=".html, .pdf")
        return self.folder / checked_name(name, suffix)

    def save(self, drive: str, form: Format, data: bytes) -> str:
        """Write a new file; return its name.

        Raises:
            StorageFailed: the file cannot be written.
        """
        axis = _UNSAFE.sub("-", drive).strip("-.")[:40] or "axis"
        stem = f"{datetime.now(UTC):%Y%m%d-%H%M%S}-report-{axis}"
        name, number = f"{stem}.{form}", 2
        while (self.folder / name).exists():
            name, number = f"{stem}-{number}.{form}", number + 1
        write_atomically(self._path(name), data)
        return name

    def names(self) -> list[str]:
        """File names, newest first."""
        found = files_of(self.folder, *(f".{form}" for form in FORMATS))
        # One whose name is not UTF-8 has no address by which it could be read.
        return sorted((p.name for p in found if shown_name(p) == p.name), reverse=True)

    def read(self, name: str) -> bytes:
        """Contents of a file.

        Raises:
            NotAllowed: there is none of this name.
        """
        path = self._path(name)
        try:
            return path.read_bytes()
        except FileNotFoundError as error:
            raise NotAllowed("report.no-report-choose-list", value=path.name) from error

    def delete(self, name: str) -> None:
        """Delete a file.

        Raises:
            NotAllowed: there is none of this name.
        """
        self.read(name)
        self._path(name).unlink()
