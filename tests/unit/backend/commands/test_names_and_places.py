"""File names and folders as Windows has them: device names, other scripts, deep folders."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from backend.axes.scope.stored import ScopeStore
from backend.commands.base.state import state_folder
from backend.foundation.store.files import (
    StorageFailed,
    checked_name,
    new_name,
    same_but_for_case,
    write_atomically,
)
from backend.records.library.folder import SetLibrary
from backend.records.recording.library import RecordingLibrary
from backend.station.drives.drive_list import DriveList
from drivers.computer import files as computer_files
from drivers.computer.files import longest_path
from drivers.errors import NotAllowed


@pytest.mark.parametrize(
    "name",
    ["CON", "con", "nul.sdset", "AUX", "Prn", "COM1", "com9.old", "LPT3", "COM¹", "aux ", "nul.x"],
)
def test_a_device_of_windows_is_no_new_file(name: str) -> None:
    with pytest.raises(NotAllowed, match="the name of a device on Windows") as caught:
        new_name(name, ".sdset")
    assert caught.value.remedy
    # What an older servodeck has stored on Linux can still be read there.
    assert checked_name(name, ".sdset")


@pytest.mark.parametrize(
    "name", ["console", "nullpoint", "aux axis", "COM10", "COM", "lpt", "X-CON", "Größe 王伟"]
)
def test_other_names_are_as_they_were(name: str) -> None:
    assert new_name(name, ".sdset") == f"{name}.sdset"


def test_libraries_refuse_it(tmp_path: Path) -> None:
    with pytest.raises(NotAllowed, match="device"):
        SetLibrary(tmp_path).store("aux", b"")
    with pytest.raises(NotAllowed, match="device"):
        RecordingLibrary(tmp_path).free_name("nul")


#: As Windows makes them: the user's name, and OneDrive's folder of a company.
FOLDERS = [
    Path("Jürgen Müller") / "OneDrive - Größenwahn & Söhne GmbH" / "servodeck",
    Path("王伟") / "文档" / "伺服 调试",
    Path("d" * 60) / ("e" * 60) / ("f" * 60) / "servodeck",
]


@pytest.mark.parametrize("folder", FOLDERS, ids=["umlauts", "chinese", "long"])
def test_a_state_folder_of_any_name(tmp_path: Path, folder: Path) -> None:
    place = tmp_path / folder
    drives = DriveList(place / "bench.json")
    drives.store([])
    assert DriveList(place / "bench.json").load() == ([], [])
    file = place / "sets" / "Größe 王伟.sdset"
    write_atomically(file, b"one")
    write_atomically(file, b"two")
    assert file.read_bytes() == b"two"
    assert [one.name for one in file.parent.iterdir()] == [file.name]


def test_a_path_that_is_too_long_is_an_error_that_says_so(tmp_path: Path) -> None:
    with pytest.raises(StorageFailed, match="could not be written"):
        write_atomically(tmp_path / ("x" * 300), b"")


def test_a_state_folder_too_deep_for_windows_is_refused_before_it_is_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    deep = tmp_path / ("d" * 120)
    assert state_folder(deep) == deep
    monkeypatch.setattr(computer_files, "sys", SimpleNamespace(platform="win32"))
    assert longest_path(lambda _key, _name: 1) is None  # LongPathsEnabled
    assert longest_path(lambda _key, _name: None) == 259
    with pytest.raises(NotAllowed, match="too long") as caught:
        state_folder(deep)
    assert "LongPathsEnabled" in (caught.value.remedy or "")
    assert not deep.exists()
    near = Path("/tmp/servodeck")
    assert state_folder(near) == near


def test_two_files_that_windows_takes_for_one_cannot_come_about(tmp_path: Path) -> None:
    """Linux has both; on a laptop one would replace the other, or be shown under its name."""
    library = RecordingLibrary(tmp_path)
    (tmp_path / "Größe x.sdrec").touch()
    assert library.free_name("GRÖSSE X") == "GRÖSSE X 2.sdrec"
    (tmp_path / "grösse x 2.sdrec").touch()
    assert library.free_name("GRÖSSE X") == "GRÖSSE X 3.sdrec"

    scope = ScopeStore(tmp_path)
    scope.save_setup("Current loop", {"kept": 1})
    with pytest.raises(NotAllowed, match="Windows and macOS take both for one file") as caught:
        scope.save_setup("current LOOP", {"kept": 2})
    assert "Current loop" in caught.value.message
    assert caught.value.remedy
    scope.save_setup("Current loop", {"kept": 3})
    assert [(one.name, one.content) for one in scope.setups()] == [("Current loop", {"kept": 3})]


def test_an_accent_that_macos_composes_otherwise_is_the_same_name(tmp_path: Path) -> None:
    (tmp_path / "u\u0308ber.sdset").touch()
    assert same_but_for_case(tmp_path, "\u00dcber.sdset") == "u\u0308ber.sdset"
    assert same_but_for_case(tmp_path, "uber.sdset") is None
    assert same_but_for_case(tmp_path, "u\u0308ber.sdset") is None, "the file itself"
    assert same_but_for_case(tmp_path / "nowhere", "x") is None
