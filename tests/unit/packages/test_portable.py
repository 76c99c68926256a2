"""The self-contained folder's launchers and contents, and the checksums of what is carried.

The folder itself is built by `make packages` and started by ``python -m benchmarks.install``.
"""

from __future__ import annotations

import importlib
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture
def portable(monkeypatch: pytest.MonkeyPatch) -> object:
    monkeypatch.syspath_prepend(str(ROOT / ".ci/supply"))
    return importlib.import_module("portable")


@pytest.fixture
def checksums(monkeypatch: pytest.MonkeyPatch) -> object:
    monkeypatch.syspath_prepend(str(ROOT / ".ci/supply"))
    return importlib.import_module("checksums")


@pytest.fixture
def folder(portable: object, tmp_path: Path) -> Path:
    """With a stand-in for the interpreter that prints how it is called."""
    made = tmp_path / "a folder with ümlauts 中文"
    (made / "bin").mkdir(parents=True)
    python = made / "bin" / portable.PYTHON  # type: ignore[attr-defined]
    python.write_text(
        '#!/bin/sh\nprintf "%s|" "$PYTHONPATH" "$PYTHONHOME" "$PYTHONNOUSERSITE" "$@"'
    )
    python.chmod(0o755)
    known = {"version": "0.1.0", "machine": "x86_64", "glibc": "2.36"}
    portable.put_texts(made, known, ["one.whl"])  # type: ignore[attr-defined]
    return made


def started(launcher: Path, *arguments: str) -> list[str]:
    done = subprocess.run(
        [launcher, *arguments],
        capture_output=True,
        text=True,
        check=True,
        env={"PATH": "/usr/bin:/bin", "PYTHONPATH": "/elsewhere", "PYTHONHOME": "/elsewhere"},
    )
    return done.stdout.split("|")[:-1]


def test_the_launcher_uses_its_own_interpreter_and_nothing_of_the_computers(folder: Path) -> None:
    assert started(folder / "servodeck", "scan", "a b") == ["", "", "1", "-m", "backend", "scan",
                                                            "a b"]  # fmt: skip


def test_the_launcher_of_the_page_opens_it(folder: Path) -> None:
    assert started(folder / "open-page")[3:] == ["-m", "backend", "serve", "--open"]


def test_the_launcher_works_by_a_link_from_elsewhere(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(folder / "servodeck")
    assert started(tmp_path / "link", "--help")[3:] == ["-m", "backend", "--help"]


def test_the_oldest_c_library_is_the_newest_that_a_file_asks_for(
    portable: object, folder: Path
) -> None:
    (folder / "lib").mkdir()
    (folder / "lib/one.so").write_bytes(b"\0GLIBC_2.4\0GLIBC_2.34\0")
    (folder / "lib/two.so.1").write_bytes(b"\0GLIBC_2.9\0GLIBC_PRIVATE\0")
    assert portable.oldest_glibc(folder) == "2.34"  # type: ignore[attr-defined]


@pytest.mark.skipif(shutil.which("sha256sum") is None, reason="no sha256sum on this computer")
def test_the_checksums_of_all_files_are_those_that_sha256sum_checks(
    checksums: object, tmp_path: Path
) -> None:
    (tmp_path / "wheels").mkdir()
    (tmp_path / "wheels/one.whl").write_bytes(b"abc")
    (tmp_path / "two.deb").write_bytes(b"")
    # FIPS 180-2, appendix B.1, and the hash of nothing.
    assert checksums.write(tmp_path) == (  # type: ignore[attr-defined]
        "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855  two.deb\n"
        "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad  wheels/one.whl\n"
    )
    check = ["sha256sum", "--check", "--quiet", "SHA256SUMS"]
    assert subprocess.run(check, cwd=tmp_path, check=False).returncode == 0
    (tmp_path / "two.deb").write_bytes(b"changed")
    assert subprocess.run(check, cwd=tmp_path, check=False, capture_output=True).returncode == 1
