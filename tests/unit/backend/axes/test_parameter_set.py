"""Files of parameter sets: round trip, damage, and what a comparison says."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backend.axes.drive.drive import Drive
from backend.axes.parameters import set_file as parameter_set
from backend.axes.parameters.set_file import BadSet
from backend.records.library import SetLibrary
from backend.tools import parameters
from drivers.errors import LinkLost, LinkTimeout, NotAllowed, OutOfRange, Rejected
from drivers.link import Address
from drivers.texts.answers import in_language
from drivers.texts.message import text
from tests.support.memory_link import MemoryLink

SAVED = datetime(2026, 11, 21, 10, 15, tzinfo=UTC)


async def written(drive: Drive, **changes: str) -> bytes:
    wanted = parameter_set.storable(drive.profile, motor_individual=False)
    readings = await drive.read_many([p.key for p in wanted if not drive.unreachable_why(p)])
    data = parameter_set.dump(drive, readings.values(), author="A", notes='say "hi" Ω', saved=SAVED)
    for old, new in changes.items():
        data = data.replace(old.encode(), new.encode())
    return data


def silent(_fraction: float, _step: str) -> None: ...


async def test_round_trip(drive: Drive) -> None:
    content = parameter_set.parse(await written(drive))
    assert content.profile == "sample"
    assert content.serial == 7
    assert content.firmware == "1.0"
    assert content.saved == SAVED
    assert content.notes == 'say "hi" Ω'
    rows = {row.key: row.raw for row in content.rows}
    assert rows == {"2005:03": 400, "2005:10": 0, "2100:00": 0}, (
        "commands, motor-individual values and what only Modbus reaches are left out"
    )


async def test_a_load_that_the_link_ends_says_how_far_it_came_and_how_to_take_it_back(
    drive: Drive, link: MemoryLink, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Half a set in force, and nothing but "the link is lost" said so."""
    content = parameter_set.parse(await written(drive))
    sent: list[int] = []
    write = link.write

    async def pulled(station: int, address: Address, data: bytes) -> None:
        sent.append(address.index or 0)
        if len(sent) == 2:
            raise LinkLost("the adapter is gone")
        await write(station, address, data)

    monkeypatch.setattr(link, "write", pulled)
    library = SetLibrary(tmp_path)
    with pytest.raises(LinkLost, match="1 of 2 rows were written before 2005:10") as reported:
        await parameters.load_set(
            drive,
            content,
            ["2005:03", "2005:10"],
            silent,
            library=library,
            accept_other_identity=False,
        )
    name = reported.value.message.split("“")[1].removesuffix("”")
    undo = library.load(name)
    assert {row.key: row.raw for row in undo.rows} == {"2005:03": 400, "2005:10": 0}


async def test_a_set_names_what_it_lacks(drive: Drive, link: MemoryLink, tmp_path: Path) -> None:
    assert parameter_set.parse(await written(drive)).not_read == ()
    link.read_errors[0x2005, 3] = Rejected("a general error", abort_code=0x08000000)
    library = SetLibrary(tmp_path)
    name = await parameters.save_set(
        drive, library, "partial", author="", notes="", motor_individual=False, overwrite=False
    )
    stored = library.load(name)
    assert stored.not_read == ("2005:03",)
    assert {row.key for row in stored.rows} == {"2005:10", "2100:00"}
    words = parameters.without(stored.not_read)
    assert words is not None
    assert words.words() == " without 1 setting that could not be read (2005:03)"
    more = parameters.without([*"abcdef"])
    assert more is not None
    assert "without 6 settings" in more.words()
    assert "…" in more.words("zh")
    assert parameters.without(()) is None


async def test_a_set_of_nothing_is_not_made(drive: Drive, link: MemoryLink, tmp_path: Path) -> None:
    link.objects.clear()
    with pytest.raises(LinkTimeout, match="no parameter could be read"):
        await parameters.read_settings(drive, motor_individual=False)


async def test_every_truncation_is_noticed(drive: Drive) -> None:
    data = await written(drive)
    end = data.index(b"[end]") + len(b"[end]")
    for length in range(end):
        with pytest.raises(BadSet):
            parameter_set.parse(data[:length])


@given(st.binary(max_size=300))
def test_any_bytes_are_refused_in_words(data: bytes) -> None:
    with pytest.raises(BadSet):
        parameter_set.parse(data)


@given(st.text(max_size=60))
def test_any_text_survives(text: str) -> None:
    line = "x = " + parameter_set._text(text)
    import tomllib

    if any(0xD800 <= ord(c) < 0xE000 for c in text):
        return
    assert tomllib.loads(line)["x"] == text


async def test_newer_version_is_refused(drive: Drive) -> None:
    data = (await written(drive)).replace(b"version = 1", b"version = 2")
    with pytest.raises(BadSet, match="version 2"):
        parameter_set.parse(data)


async def test_comparison(drive: Drive) -> None:
    content = parameter_set.parse(await written(drive))
    await drive.write("2005:03", 500)
    rows = [*content.rows, parameter_set.Row("9999:00", 1), parameter_set.Row("2005:03", 1)]
    rows += [parameter_set.Row("6041:00", 1), parameter_set.Row("2105:00", 9)]
    keys = ["2005:03", "2005:10", "2100:00", "6041:00", "2105:00", "200D:01"]
    result = parameter_set.compare(drive, rows, await drive.read_many(keys))
    by_key = {(r.key, r.status): r for r in result}
    assert by_key["2005:03", "differs"].selected
    assert by_key["2005:03", "invalid"].problem == text("sets.row-twice")
    assert ("2005:10", "same") in by_key
    unknown = by_key["9999:00", "not_in_drive"].problem
    assert unknown is not None
    assert unknown.code == "sets.row-no-parameter"
    assert "没有参数" in unknown.words("zh")
    assert not by_key["6041:00", "read_only"].selected
    assert not by_key["2105:00", "differs"].selected, "motor-individual: off by default"
    assert ("200D:01", "not_in_file") in by_key


async def test_bad_row_spoils_only_itself(drive: Drive) -> None:
    data = (await written(drive)).replace(b"raw = 400", b'raw = "many"')
    content = parameter_set.parse(data)
    result = parameter_set.compare(drive, content.rows, await drive.read_many(["2005:03"]))
    assert {r.key: r.status for r in result}["2005:03"] == "invalid"
    assert {r.key: r.status for r in result}["2005:10"] != "invalid"


async def test_load_writes_verifies_and_keeps_the_undo(drive: Drive, tmp_path) -> None:
    library = SetLibrary(tmp_path)
    content = parameter_set.parse((await written(drive)).replace(b"raw = 400", b"raw = 450"))
    result = await parameters.load_set(
        drive, content, ["2005:03"], silent, library=library, accept_other_identity=False
    )
    assert result["written"] == 1
    assert (await drive.read("2005:03")).raw == 450
    undo = library.load(str(result["backup"]))
    assert {row.key: row.raw for row in undo.rows} == {"2005:03": 400}


async def test_one_bad_choice_and_nothing_is_written(drive: Drive, link, tmp_path) -> None:
    content = parameter_set.parse((await written(drive)).replace(b"raw = 400", b"raw = 9999"))
    with pytest.raises(OutOfRange):
        await parameters.load_set(
            drive,
            content,
            ["2005:10", "2005:03"],
            silent,
            library=SetLibrary(tmp_path),
            accept_other_identity=False,
        )
    assert not link.written


async def test_other_family_and_other_serial(drive: Drive, link, tmp_path) -> None:
    data = await written(drive)
    library = SetLibrary(tmp_path)
    other = parameter_set.parse(data.replace(b'profile = "sample"', b'profile = "mms7"'))
    with pytest.raises(NotAllowed, match="mms7"):
        await parameters.load_set(
            drive, other, ["2005:03"], silent, library=library, accept_other_identity=True
        )
    swapped = parameter_set.parse(data.replace(b"serial = 7", b"serial = 8"))
    with pytest.raises(NotAllowed, match="serial number 8"):
        await parameters.load_set(
            drive, swapped, ["2005:03"], silent, library=library, accept_other_identity=False
        )
    assert not link.written


@pytest.mark.parametrize("name", ["../x", "a/b", ".hidden", "", "a\0b", "x" * 200, "..", "a..b"])
def test_names_stay_in_the_folder(tmp_path, name: str) -> None:
    with pytest.raises(NotAllowed, match="file name"):
        SetLibrary(tmp_path).read(name)


async def test_existing_file_is_not_replaced_unasked(drive: Drive, tmp_path) -> None:
    library = SetLibrary(tmp_path)
    library.store("a", await written(drive))
    with pytest.raises(NotAllowed, match="exists already"):
        library.store("a", await written(drive))


async def test_what_could_not_be_read_is_reported_in_any_language(
    drive: Drive, link: MemoryLink
) -> None:
    why = text("sets.row-twice")
    link.read_errors[0x2005, 3] = Rejected(why, abort_code=0x08000000)
    result = await parameters.read_all(drive, ["2005:03", "2005:10"], silent)
    assert result["read"] == 1
    assert result["failed"] == {"2005:03": why.words()}
    assert in_language(result, "zh")["failed"] == {"2005:03": why.words("zh")}
