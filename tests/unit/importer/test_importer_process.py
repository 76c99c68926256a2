"""Imports run in a process of their own, which never outlives whoever asked."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import pytest
from importer_samples import GOOD_EDS, GOOD_ESI

from backend.station.description import BadDescription, import_in_process
from profiles.importer.process import DevicesTask, FileTask, Task
from profiles.loader import ProfileError, broken_profiles, load_all, load_profile


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("SERVODECK_PROFILES", str(tmp_path / "mine"))
    monkeypatch.setenv("SERVODECK_CACHE", str(tmp_path / "cache"))
    return tmp_path / "mine"


def run(task: Task, limit_s: float = 60.0) -> dict[str, Any]:
    return asyncio.run(import_in_process(task, limit_s))


def test_a_file_becomes_a_profile(folder: Path) -> None:
    made = run(FileTask(GOOD_EDS.encode(), "good.eds", folder, "good"))
    assert made["profile"] == "good"
    assert made["product_code"] == 0x190
    assert load_profile("good").by_key["2010:00"].max_raw == 2000
    with pytest.raises(BadDescription, match="already"):
        run(FileTask(GOOD_EDS.encode(), "good.eds", folder, "good"))


def test_no_import_hides_a_family_that_servodeck_brings(folder: Path) -> None:
    with pytest.raises(BadDescription, match="'mms7' already"):
        run(FileTask(GOOD_EDS.encode(), "good.eds", folder, "mms7"))
    assert not folder.exists()


def test_devices_of_a_series(folder: Path) -> None:
    reported = run(DevicesTask(GOOD_ESI.encode(), "good.xml"))
    assert 0x191 in {device["product_code"] for device in reported["devices"]}
    assert run(DevicesTask(GOOD_EDS.encode(), "a.eds")) == {"devices": []}


def test_an_import_that_takes_too_long_is_ended(folder: Path) -> None:
    with pytest.raises(BadDescription, match=r"ended after 0\.001 s"):
        run(FileTask(GOOD_EDS.encode(), "a.eds", folder, "slow"), 0.001)
    assert not folder.exists()


def test_a_cancelled_import_leaves_nothing(folder: Path) -> None:
    async def cancelled() -> None:
        started = import_in_process(FileTask(GOOD_EDS.encode(), "a.eds", folder, "gone"))
        task = asyncio.ensure_future(started)
        await asyncio.sleep(0.05)  # an interpreter alone takes longer to start
        task.cancel()
        await task

    with pytest.raises(asyncio.CancelledError):
        asyncio.run(cancelled())
    assert not folder.exists()


def test_edits_count_at_once_and_slips_spoil_one_profile_only(folder: Path) -> None:
    made = run(FileTask(GOOD_EDS.encode(), "good.eds", folder, "good"))
    path = Path(str(made["path"]))
    text = path.read_text("utf-8")
    path.write_text(text.replace("Servo 400", "Servo 401"), "utf-8")
    assert load_profile("good").identity.model == "Servo 401"
    path.write_text(text.replace("parameters:", "parametres:"), "utf-8")
    with pytest.raises(ProfileError, match="parametres"):
        load_profile("good")
    assert list(broken_profiles()) == ["good"]
    known = load_all()
    assert "mms7" in known
    assert "good" not in known
