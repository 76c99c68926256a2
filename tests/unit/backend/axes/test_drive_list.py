"""The list of drives over restarts: nothing lost, one bad entry spoils only itself."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import pytest

from backend.api.messages.errors import NotFound
from backend.api.station.routes import remove_drive
from backend.axes.axis.remembered import AxisRecord
from backend.axes.scales.scale import ScaleUnknown
from backend.axes.scales.taught import Taught
from backend.foundation.store.files import StorageFailed
from backend.station.bench import Bench
from backend.station.drives.drive_list import DriveList, SavedDrive, SavedPort
from drivers.errors import LinkLost
from drivers.link import Found
from tests.support.memory_link import MemoryLink

X = SavedDrive("X", "mms7", (SavedPort("mlink:///dev/ttyUSB0", 1),), "left", 77)
Z = SavedDrive(
    "Z 轴", "ds_c", (SavedPort("canopen://can0", 3), SavedPort("modbus:///dev/ttyUSB1", 3))
)


def test_what_is_stored_is_loaded(tmp_path: Path) -> None:
    drives = DriveList(tmp_path / "bench.json")
    assert drives.load() == ([], [])
    drives.store([X, Z])
    assert DriveList(tmp_path / "bench.json").load() == ([X, Z], [])


def test_a_bad_entry_spoils_only_itself(tmp_path: Path) -> None:
    path = tmp_path / "bench.json"
    drives = DriveList(path)
    drives.store([X, Z])
    content = json.loads(path.read_text("utf-8"))
    content["drives"][0]["ports"][0]["station"] = "one"
    content["drives"].insert(0, {"name": "no ports", "profile": "mms7", "ports": []})
    content["drives"].append("what")
    path.write_text(json.dumps(content), "utf-8")
    loaded, problems = drives.load()
    assert loaded == [Z]
    assert len(problems) == 3
    assert "drive 2: ports.0.station" in problems[1].words()


def test_a_damaged_file_is_reported_and_not_fatal(tmp_path: Path) -> None:
    path = tmp_path / "bench.json"
    for text in ("", "[1]", '{"version": 1}', "\x00"):
        path.write_text(text, "utf-8")
        loaded, problems = DriveList(path).load()
        assert (loaded, len(problems)) == ([], 1)
        assert "bench.json cannot be read" in problems[0].words()
        assert "无法读取" in problems[0].words("zh")


@pytest.mark.parametrize("damage", ["whole", "entry", "no list"])
def test_a_damaged_list_is_kept_under_another_name(tmp_path: Path, damage: str) -> None:
    path = tmp_path / "bench.json"
    drives = DriveList(path)
    for number in (1, 2):
        drives.store([X, Z])
        content = json.loads(path.read_text("utf-8"))
        content["drives"][number - 1]["profile"] = number
        as_list = json.dumps(content)
        damaged = {"whole": as_list[:-9], "entry": as_list, "no list": '{"drives": 0}'}[damage]
        path.write_text(damaged, "utf-8")
        # Starts alone change nothing.
        for _ in range(2):
            drives = DriveList(path)
            loaded, problems = drives.load()
            assert len(problems) == number, "the damage, and every earlier list that is kept"
        drives.store(loaded)
        drives.store([X])
        aside = tmp_path / ("bench.json.damaged" + ("" if number == 1 else "-2"))
        assert aside.read_text("utf-8") == damaged
    again, problems = DriveList(path).load()
    assert again == [X]
    assert [str(tmp_path / "bench.json.damaged") in each.words() for each in problems] == [True] * 2
    assert "已保留" in problems[0].words("zh")


def test_a_damaged_list_that_cannot_be_kept_is_not_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "bench.json"
    path.write_text("[", "utf-8")
    drives = DriveList(path)
    drives.load()

    def refused(*_: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "hardlink_to", refused)
        patch.setattr(Path, "rename", refused)
        with pytest.raises(StorageFailed):
            drives.store([X])
    assert path.read_text("utf-8") == "["
    drives.store([X])
    assert drives.load()[0] == [X]


async def test_a_full_disk_keeps_nobody_from_connecting_a_drive(tmp_path: Path) -> None:
    """As on a full disk: bench.json cannot be written, here because a folder is in its place."""
    (tmp_path / "bench.json").mkdir()
    link = MemoryLink({})
    bench = Bench(tmp_path, {"mlink://virtual0": lambda: link})
    try:
        connected = await bench.connect("mlink://virtual0", 1, "mms7", "X")
        assert bench.connected_drives == {"x": connected}
        assert "the list of drives is not stored" in next(
            e.text for e in bench.journal.entries() if e.level == "error"
        )
        with pytest.raises(StorageFailed, match=r"bench\.json could not be written"):
            bench.rename("x", "Y", "on the left")
        assert (connected.drive.name, connected.drive.notes) == ("X", "")
        await bench.remove("x")
        assert bench.connected_drives == {}
    finally:
        await bench.close()


def _bench(folder: Path, *missing: str) -> Bench:
    """A bench whose adapters are there, but for the missing ones."""

    def link(place: str) -> MemoryLink:
        found = MemoryLink({})
        if place in missing:
            found.open = _not_there  # type: ignore[method-assign]
        return found

    wires = {f"mlink://virtual{n}": partial(link, f"mlink://virtual{n}") for n in range(40)}
    return Bench(folder, wires)  # type: ignore[arg-type]


async def _not_there() -> None:
    raise LinkLost("no such adapter")


async def test_notes_and_serial_number_outlive_several_starts(tmp_path: Path) -> None:
    drives = DriveList(tmp_path / "bench.json")
    here = SavedDrive("X", "mms7", (SavedPort("mlink://virtual0", 1),), "left", 77, "x")
    drives.store([here])
    for _ in range(3):
        bench = _bench(tmp_path)
        await bench.restore()
        connected = bench.connected("x")
        assert connected.drive.notes == "left"
        assert connected.drive.found is not None
        assert connected.drive.found.serial == 77
        assert drives.load() == ([here], [])
        await bench.close()


async def test_an_adapter_that_is_missing_at_a_start_loses_no_drive(tmp_path: Path) -> None:
    drives = DriveList(tmp_path / "bench.json")
    both = SavedPort("mlink://virtual2", 4)
    saved = [
        SavedDrive("X", "mms7", (SavedPort("mlink://virtual0", 1),), "left", 77, "x"),
        SavedDrive("Y", "mms7", (SavedPort("mlink://virtual1", 1), both), "right", 78, "y"),
    ]
    drives.store(saved)
    bench = _bench(tmp_path, "mlink://virtual0", "mlink://virtual2")
    await bench.restore()
    assert list(bench.connected_drives) == ["y"]
    found = bench.connected("y").drive.found
    assert found is not None
    assert found.serial == 78, "another drive at this place is still noticed"
    bench.rename("y", None, "far right")
    await bench.close()
    loaded, _ = drives.load()
    assert sorted(loaded, key=lambda each: each.name) == [
        saved[0],
        SavedDrive("Y", "mms7", saved[1].ports, "far right", 78, "y"),
    ]
    # The next start has all of them; a drive that takes the place of a missing one replaces it.
    bench = _bench(tmp_path, "mlink://virtual0")
    await bench.restore()
    assert [len(m.drive.ports) for m in bench.connected_drives.values()] == [2]
    bench.buses.wires["mlink://virtual0"] = lambda: MemoryLink({})  # type: ignore[assignment,return-value]
    await bench.connect("mlink://virtual0", 1, "mms7", "Z")
    await bench.close()
    assert sorted(each.name for each in drives.load()[0]) == ["Y", "Z"]


async def test_a_drive_that_is_gone_for_good_can_be_removed(tmp_path: Path) -> None:
    drives = DriveList(tmp_path / "bench.json")
    saved = [
        SavedDrive("X", "mms7", (SavedPort("mlink://virtual0", 1),), id="x"),
        SavedDrive("Y", "mms7", (SavedPort("mlink://virtual1", 1),), id="y"),
    ]
    drives.store(saved)
    bench = _bench(tmp_path, "mlink://virtual0")
    bench.axis_records.put("x", AxisRecord(scales=Taught(counts_per_rev=1000.0)))
    await bench.restore()
    try:
        lines = [e.text for e in bench.journal.entries() if e.level == "warning"]
        assert any("servodeck station forget x" in line for line in lines)
        answer = await remove_drive(bench, "x")
        assert answer.status_code == 204
        assert [each.id for each in drives.load()[0]] == ["y"]
        assert bench.axis_records.get("x").scales is None
        with pytest.raises(NotFound):
            await remove_drive(bench, "x")
        await remove_drive(bench, "y")
        assert drives.load() == ([], [])
    finally:
        await bench.close()


async def test_a_missing_drive_stays_where_the_list_cannot_be_stored(tmp_path: Path) -> None:
    path = tmp_path / "bench.json"
    DriveList(path).store([SavedDrive("X", "mms7", (SavedPort("mlink://virtual0", 1),), id="x")])
    bench = _bench(tmp_path, "mlink://virtual0")
    await bench.restore()
    path.unlink()
    path.mkdir()
    try:
        with pytest.raises(StorageFailed):
            await remove_drive(bench, "x")
        assert bench.missing("x") is not None
    finally:
        await bench.close()


async def test_a_bench_may_have_many_drives(tmp_path: Path) -> None:
    drives = DriveList(tmp_path / "bench.json")
    drives.store(
        SavedDrive(f"X{n}", "mms7", (SavedPort(f"mlink://virtual{n}", 1),), serial=n + 1)
        for n in range(40)
    )
    bench = _bench(tmp_path)
    await bench.restore()
    assert len(bench.connected_drives) == 40
    await bench.close()


async def test_an_axis_keeps_its_own_scales_when_another_is_missing(tmp_path: Path) -> None:
    """Names without Latin letters give ids by number, which must not shift."""
    drives = DriveList(tmp_path / "bench.json")
    drives.store(
        SavedDrive(name, "mms7", (SavedPort(f"mlink://virtual{n}", 1),))
        for n, name in enumerate(("轴一", "轴二"))
    )
    bench = _bench(tmp_path)
    await bench.restore()
    second = bench.connected("drive-2").drive
    assert second.name == "轴二"
    of = bench.taught_drive(bench.connected("drive").drive)
    taught = Taught(counts_per_rev=1000.0, drive=of)
    bench.axis_records.put("drive", AxisRecord(scales=taught))
    bench.rename("drive-2", None, "stored")
    await bench.close()
    bench = _bench(tmp_path, "mlink://virtual0")
    await bench.restore()
    assert list(bench.connected_drives) == ["drive-2"]
    other = await bench.connect("mlink://virtual5", 1, "mms7", "轴三")
    assert other.drive.id == "drive-3"
    # The first one is found again at another adapter.
    first = await bench.connect("mlink://virtual6", 1, "mms7", "轴一")
    assert first.drive.id == "drive"
    assert bench.axis_records.get(first.drive.id).scales == taught
    assert first.axis.taught is None, "without a serial number it may be another drive"
    await bench.close()
    assert len(drives.load()[0]) == 3
    # Another order in the list changes nothing.
    loaded, _ = drives.load()
    drives.store(reversed(loaded))
    bench = _bench(tmp_path)
    await bench.restore()
    assert {m.drive.name: m.drive.id for m in bench.connected_drives.values()} == {
        "轴一": "drive",
        "轴二": "drive-2",
        "轴三": "drive-3",
    }
    await bench.close()


# --- scales that a person stated, and the drive that they belong to -------------------------

P0, P1 = "canopen://virtual0", "canopen://virtual1"
STATED = Taught(counts_per_rev=10_000, raw_per_rpm=10.0, raw_per_rpm_s=10.0)


def _silent() -> MemoryLink:
    """A drive that states nothing of its scales."""
    link = MemoryLink({})
    link.kind = "canopen"
    return link


def _scales_bench(folder: Path) -> Bench:
    return Bench(folder, {P0: _silent, P1: _silent})


def _state(bench: Bench, drive_id: str) -> None:
    connected = bench.connected(drive_id)
    taught = STATED.model_copy(update={"drive": bench.taught_drive(connected.drive)})
    bench.axis_records.put(drive_id, AxisRecord(scales=taught))
    connected.axis.teach(taught)


async def _add(bench: Bench, url: str, serial: int | None, profile: str = "generic402") -> bool:
    """Whether the scales of the drive "X" are certain."""
    found = None if serial is None else Found(1, serial=serial)
    connected = await bench.connect(url, 1, profile, "X", found=found)
    assert connected.drive.id == "x"
    return (await connected.axis.units()).scales.position.certain


@pytest.mark.parametrize(
    ("stated_for", "url", "serial", "counts"),
    [
        (7, P0, 7, True),
        (7, P1, 7, True),  # the serial number tells
        (7, P0, 8, False),
        (7, P0, None, True),  # not known here: by place
        (7, P1, None, False),
        (None, P0, None, False),  # removed with the drive, as nothing tells the next one
        (None, P0, 8, False),
    ],
)
async def test_scales_are_those_of_the_same_drive_only(
    tmp_path: Path, stated_for: int | None, url: str, serial: int | None, counts: bool
) -> None:
    bench = _scales_bench(tmp_path)
    try:
        await _add(bench, P0, stated_for)
        _state(bench, "x")
        assert (await bench.connected("x").axis.units()).scales.position.certain
        await bench.remove("x")
        assert await _add(bench, url, serial) == counts
    finally:
        await bench.close()


async def test_another_drive_under_a_known_name_says_why_its_scale_is_unknown(
    tmp_path: Path,
) -> None:
    bench = _scales_bench(tmp_path)
    try:
        await _add(bench, P0, 7)
        _state(bench, "x")
        await bench.remove("x")
        assert not await _add(bench, P0, 8)
        with pytest.raises(ScaleUnknown, match=r"stated for another drive.*serial number 7") as no:
            await bench.connected("x").axis.require_certain_scales()
        assert "另一台驱动器" in no.value.text.words("zh")
        lines = [e.text for e in bench.journal.entries() if e.level == "warning"]
        assert any("serial number 7" in line and "not used" in line for line in lines)
        # The next start says the same of the drive in the list.
        await bench.close()
        bench = _scales_bench(tmp_path)
        await bench.restore()
        assert bench.connected("x").axis.taught is None
    finally:
        await bench.close()


async def test_a_drive_of_the_list_keeps_its_scales_over_a_start(tmp_path: Path) -> None:
    for serial in (7, None):
        bench = _scales_bench(tmp_path)
        await _add(bench, P0, serial)
        _state(bench, "x")
        await bench.close()
        bench = _scales_bench(tmp_path)
        await bench.restore()
        assert bench.connected("x").axis.taught is not None
        await bench.remove("x")
        await bench.close()


async def test_scales_of_earlier_versions_stay_with_the_drive_of_the_list(tmp_path: Path) -> None:
    drives = DriveList(tmp_path / "bench.json")
    drives.store([SavedDrive("X", "generic402", (SavedPort(P0, 1),), serial=7, id="x")])
    bench = _scales_bench(tmp_path)
    bench.axis_records.put("x", AxisRecord(scales=STATED))
    bench.axis_records.put("y", AxisRecord(scales=STATED))
    await bench.restore()
    try:
        taught = bench.connected("x").axis.taught
        assert taught is not None
        assert taught.drive is not None
        assert taught.drive.serial == 7
        # Nobody knows for which drive the others were stated.
        other = await bench.connect(P1, 1, "generic402", "Y")
        assert other.drive.id == "y"
        assert other.axis.taught is None
        assert bench.axis_records.get("y").scales is None
    finally:
        await bench.close()
