"""Hand-over on a live drive: commands on a wire and by a server, routes, and the report."""

from __future__ import annotations

import base64
import hashlib
import json
import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from backend.api.records.handover import routes
from backend.cli import app
from backend.records.handover.read import MAX_BYTES
from backend.station.demo import DemoBench
from backend.station.drives.description import import_in_process
from tests.support.station import Station

runner = CliRunner()
GAIN, LIMIT = "2005:03", "6072:00"
BENCH = '[[axis]]\nname = "X"\ndrive = "mms7"\non = "mlink://virtual0"\nstation = 1\n'


def call(*arguments: str, code: int = 0) -> str:
    result = runner.invoke(app, arguments)
    assert result.exit_code == code, result.output
    return result.output


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    folder = Path(tmp_path_factory.mktemp("handover"))
    (folder / "bench.toml").write_text(BENCH)
    with DemoBench(folder / "bench.toml", folder / "wires", folder / "nvm") as drives:
        yield drives.addresses["mlink://virtual0"]


def conflicts_of(*arguments: str) -> Any:
    return json.loads(call("handover", "compare", *arguments, "--json"))


def check_commands(tmp_path: Path, *where: str) -> None:
    """``where``: bus URL and the options that name the drive there."""
    bus, *options = where
    held, listed = tmp_path / "x.sdset", tmp_path / "x.xml"
    call("params", "dump", bus, "--out", str(held), *options)
    text = call("handover", "export", str(held), "--format", "twincat", "--out", str(listed))
    assert hashlib.sha256(listed.read_bytes()).hexdigest() in text
    assert (tmp_path / "x.xml.scaling.txt").exists()
    # Nothing was changed yet: the list is what the drive holds.
    found = conflicts_of(str(listed), bus, "--set", str(held), *options)
    assert (found["conflicts"], found["findings"], found["restored"]) == ([], [], [])
    assert found["not_read"] == []
    assert found["same"] > 50
    assert json.loads(call("handover", "watch", str(held), bus, *options, "--json")) == {
        "changed": [],
        "not_read": [],
    }

    # A tuning after the hand-over: the controller undoes it.
    before = int(
        next(
            line.partition("=")[2]
            for line in held.read_text().split("[[parameter]]")[1:]
            if f'"{GAIN}"' in line
            for line in line.splitlines()
            if line.startswith("raw")
        )
    )
    call("params", "set", bus, f"{GAIN}={before + 7}", "--raw", *options)
    try:
        found = conflicts_of(str(listed), bus, *options)
        (conflict,) = found["conflicts"]
        assert (conflict["key"], conflict["consequence"]) == (GAIN, "gain")
        assert (conflict["controller"], conflict["drive"]) == (before, before + 7)
        assert "the controller will undo your tuning of" in call(
            "handover", "compare", str(listed), bus, *options
        )
        # With our set, which agrees with the controller, it is the drive that differs.
        found = conflicts_of(str(listed), bus, "--set", str(held), *options)
        assert (found["conflicts"], found["restored"]) == ([], [GAIN])
        watched = json.loads(call("handover", "watch", str(held), bus, *options, "--json"))
        assert [(c["key"], c["ours"], c["drive"]) for c in watched["changed"]] == [
            (GAIN, before, before + 7)
        ]
        assert "1 of" in call("handover", "watch", str(held), bus, *options)
    finally:
        call("params", "set", bus, f"{GAIN}={before}", "--raw", *options)


@pytest.mark.long
def test_commands_on_a_wire(url: str, tmp_path: Path) -> None:
    check_commands(tmp_path, url, "--profile", "mms7")


@pytest.mark.long
def test_commands_by_a_server(station: Station, x: str, tmp_path: Path) -> None:
    check_commands(tmp_path, "mlink://virtual0", "--station", "1", "--server", station.url)


def test_a_list_is_compared_with_a_set_of_the_same_family(url: str, tmp_path: Path) -> None:
    other = tmp_path / "other.sdset"
    call("params", "dump", url, "--out", str(other), "--profile", "mms7")
    other.write_text(other.read_text().replace('profile = "mms7"', 'profile = "m6l"'))
    listed = tmp_path / "x.sh"
    listed.write_text("ethercat download -p 0 -t uint16 0x6072 0 500\n")
    text = call(
        "handover", "compare", str(listed), url, "--profile", "mms7", "--set", str(other), code=1
    )
    assert "m6l" in text


def test_a_hostile_list_is_one_error(url: str, tmp_path: Path) -> None:
    bomb = tmp_path / "bomb.xml"
    bomb.write_text('<!DOCTYPE a [<!ENTITY b "c">]><EtherCATMailbox>&b;</EtherCATMailbox>')
    text = call("handover", "compare", str(bomb), url, "--profile", "mms7", code=1)
    assert text.count("error:") == 1
    assert "Traceback" not in text


# --- routes ----------------------------------------------------------------------------


@pytest.fixture
def held(station: Station, x: str) -> str:
    body = {"file": "handed", "overwrite": True}
    return str(station.ok(station.http.post(f"/drives/{x}/sets", json=body))["file"])


def export(station: Station, x: str, held: str, **body: object) -> Any:
    asked = {"set_file": held, "format": "twincat", "file": "start.xml", **body}
    return station.ok(station.http.post(f"/drives/{x}/handover", json=asked))


def test_export_compare_and_changes(station: Station, x: str, held: str) -> None:
    made = export(station, x, held, choice="tuned")
    names = [each["name"] for each in made["files"]]
    assert names == ["start.xml", "start.xml.scaling.txt"]
    listed = base64.b64decode(made["files"][0]["content"])
    assert hashlib.sha256(listed).hexdigest() == made["files"][0]["sha256"]
    compare = f"/drives/{x}/handover/compare"
    query = {"file": "start.xml", "set_file": held}
    found = station.ok(station.http.post(compare, params=query, content=listed))
    assert (found["conflicts"], found["defects"], found["not_read"]) == ([], [], [])
    assert found["same"] == made["writes"]

    before = station.ok(station.http.get(f"/drives/{x}/parameters/{GAIN}"))["raw"]
    station.ok(station.http.put(f"/drives/{x}/parameters/{GAIN}", json={"raw": before + 5}))
    query = {"file": "start.xml"}
    (conflict,) = station.ok(station.http.post(compare, params=query, content=listed))["conflicts"]
    assert (conflict["key"], conflict["drive"], conflict["controller"]) == (
        GAIN,
        before + 5,
        before,
    )
    newest = station.ok(station.http.get(f"/drives/{x}/handovers"))[0]
    assert newest["sha256"] == made["files"][0]["sha256"]
    assert newest["person"]
    path = f"/drives/{x}/handovers/{newest['number']}/changes"
    changed = station.ok(station.http.get(path))
    assert [each["key"] for each in changed["changed"]] == [GAIN]
    assert changed["not_read"] == []

    body = {"format": "html", "person": "A. Person"}
    report = station.ok(station.http.post(f"/drives/{x}/reports", json=body))
    html = station.http.get(f"/reports/{report['file']}").text
    assert "Hand-over to the controller" in html
    assert made["files"][0]["sha256"] in html
    assert "was handed over as" in html
    station.ok(station.http.put(f"/drives/{x}/parameters/{GAIN}", json={"raw": before}))


@pytest.mark.long
def test_a_segment_is_one_list_and_noted_for_every_drive(
    station: Station, x: str, held: str
) -> None:
    y = station.add(2, name="Y")
    try:
        check_segment(station, x, y, held)
    finally:
        station.remove(y)


def check_segment(station: Station, x: str, y: str, held: str) -> None:
    asked = {"file": "second", "overwrite": True}
    second = station.ok(station.http.post(f"/drives/{y}/sets", json=asked))["file"]
    pair = [{"drive_id": y, "set_file": second}, {"drive_id": x, "set_file": held}]
    body: dict[str, object] = {"axes": pair, "format": "lcec", "file": "segment.xml"}
    made = station.ok(station.http.post("/handover", json=body))
    names = [each["name"] for each in made["files"]]
    assert names == [
        "segment.xml",
        "segment.xml.hal",
        "segment.xml.1.scaling.txt",
        "segment.xml.2.scaling.txt",
    ]
    listed = base64.b64decode(made["files"][0]["content"])
    for drive, slave in ((y, 1), (x, 2)):
        newest = station.ok(station.http.get(f"/drives/{drive}/handovers"))[0]
        assert newest["sha256"] == hashlib.sha256(listed).hexdigest()
        query: dict[str, str | int] = {"file": "segment.xml", "slave": slave}
        path = f"/drives/{drive}/handover/compare"
        found = station.ok(station.http.post(path, params=query, content=listed))
        assert found["conflicts"] == []
        assert found["same"] == newest["values"]
    one = station.http.post("/handover", json=body | {"format": "twincat"})
    assert one.status_code == 409
    assert "one drive" in one.json()["detail"]
    twice = station.http.post("/handover", json=body | {"axes": [pair[0], pair[0]]})
    assert twice.status_code == 409
    assert "twice" in twice.json()["detail"]
    nobody = station.http.post(
        "/handover", json=body | {"axes": [{"drive_id": "nobody", "set_file": held}]}
    )
    assert nobody.status_code == 404


def test_reasons_are_in_the_language_that_is_asked_for(station: Station, x: str, held: str) -> None:
    asked = {"set_file": held, "format": "twincat", "file": "start.xml"}
    answer = station.http.post(
        f"/drives/{x}/handover", json=asked, headers={"Accept-Language": "zh-CN"}
    )
    reasons = {row["reason"] for row in station.ok(answer)["left_out"]}
    assert reasons
    assert all(any("\u4e00" <= letter <= "\u9fff" for letter in reason) for reason in reasons)
    english = {row["reason"] for row in export(station, x, held)["left_out"]}
    assert len(english) == len(reasons)
    assert not english & reasons


@pytest.mark.long
def test_the_script_writes_over_the_api(
    station: Station, x: str, held: str, tmp_path: Path
) -> None:
    made = export(station, x, held, format="python", file="write.py", only=[GAIN, LIMIT])
    script = tmp_path / "write.py"
    script.write_bytes(base64.b64decode(made["files"][0]["content"]))
    keys = (GAIN, LIMIT)

    def now() -> list[int]:
        return [station.ok(station.http.get(f"/drives/{x}/parameters/{k}"))["raw"] for k in keys]

    before = now()
    for key, raw in zip(keys, before, strict=True):
        path = f"/drives/{x}/parameters/{key}"
        station.ok(station.http.put(path, json={"raw": raw - 1}))
    run = [sys.executable, str(script), station.url, x]
    ended = subprocess.run(run, capture_output=True, text=True, timeout=60, check=False)
    assert ended.stdout == "2 of 2 values written and read back\n", ended.stderr
    assert now() == before
    stranger = subprocess.run([*run[:3], "nobody"], capture_output=True, timeout=60, check=False)
    assert stranger.returncode == 1


@pytest.mark.long(keep=3)
@pytest.mark.parametrize(
    ("body", "status", "words"),
    [
        ({"set_file": "nothing.sdset"}, 404, "nothing"),
        ({"format": "excel"}, 422, ""),
        ({"file": "../../etc/passwd"}, 422, ""),
        ({"only": ["9999:00"]}, 409, "9999:00"),
        ({"format": "eni", "esi": ["%%%"]}, 409, "base64"),
        ({"format": "eni", "esi": [base64.b64encode(b"<a/>").decode()]}, 409, "ESI"),
    ],
)
def test_bad_exports_are_explained(
    station: Station, x: str, held: str, body: dict[str, object], status: int, words: str
) -> None:
    before = len(station.ok(station.http.get(f"/drives/{x}/handovers")))
    asked = {"set_file": held, "format": "twincat", "file": "start.xml", **body}
    answer = station.http.post(f"/drives/{x}/handover", json=asked)
    assert answer.status_code == status, answer.text
    assert words in answer.json()["detail"]
    assert len(station.ok(station.http.get(f"/drives/{x}/handovers"))) == before


@pytest.mark.long
def test_an_uploaded_esi_file_is_read_in_a_process_with_bounded_memory(
    station: Station, x: str, held: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Read in the server it would be answered that the file has no such drive."""
    monkeypatch.setattr(routes, "import_in_process", partial(import_in_process, limit_mib=128))
    device = b'<Device><Type ProductCode="#x1">A</Type>' + b'<a b=""/>' * 400_000 + b"</Device>"
    devices = b"<Descriptions><Devices>" + device + b"</Devices></Descriptions>"
    esi = base64.b64encode(b"<EtherCATInfo>" + devices + b"</EtherCATInfo>").decode()
    asked = {"set_file": held, "format": "eni", "file": "start.xml", "esi": [esi]}
    answer = station.http.post(f"/drives/{x}/handover", json=asked)
    assert answer.status_code == 409, answer.text
    assert "128 MiB of memory" in answer.json()["detail"]


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"hello",
        b"<EtherCATMailbox>",
        b'<!DOCTYPE a [<!ENTITY b "c">]><EtherCATMailbox>&b;</EtherCATMailbox>',
        b"a: &a [1]\nsdo: [*a, *a]",
    ],
)
def test_hostile_lists_get_one_clear_error(station: Station, x: str, content: bytes) -> None:
    answer = station.http.post(
        f"/drives/{x}/handover/compare", params={"file": "list.xml"}, content=content
    )
    assert answer.status_code == 409, answer.text
    assert "list.xml" in answer.json()["detail"]
    assert answer.json()["remedy"]


@pytest.mark.long
def test_a_huge_list_is_refused(station: Station, x: str) -> None:
    path = f"/drives/{x}/handover/compare"
    large = station.http.post(path, params={"file": "l.xml"}, content=b" " * (MAX_BYTES + 1))
    assert large.status_code == 409
    assert "larger" in large.json()["detail"]
    huge = station.http.post(path, params={"file": "l.xml"}, content=b" " * (10 << 20))
    assert huge.status_code == 413
