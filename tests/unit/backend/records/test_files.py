"""Writing files: whole or not at all, also when the disk is full."""

from __future__ import annotations

import resource
import signal
from pathlib import Path

import pytest

from backend.foundation.store.files import StorageFailed, write_atomically


@pytest.fixture
def full_disk():
    """The kernel refuses to write beyond 100 bytes, as it does on a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)
    signal.signal(signal.SIGXFSZ, handler)


def test_full_disk_leaves_the_old_file(tmp_path: Path, full_disk: None) -> None:
    path = tmp_path / "a.sdset"
    write_atomically(path, b"old")
    with pytest.raises(StorageFailed, match=r"a\.sdset could not be written"):
        write_atomically(path, b"x" * 1000)
    assert path.read_bytes() == b"old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.sdset"], "no leftovers"


def test_unwritable_folder_is_reported(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(StorageFailed):
        write_atomically(tmp_path / "file" / "a", b"x")


def test_a_folder_is_not_taken_for_a_file(tmp_path: Path) -> None:
    with pytest.raises(StorageFailed, match="could not be written: Is a directory"):
        write_atomically(tmp_path, b"x")
