"""What a command says when something is wrong: one sentence, one remedy, never a traceback."""

from __future__ import annotations

import asyncio
import errno
import io
import json
import os
import re
import signal
import socket
import sys
from contextlib import redirect_stdout
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from backend import cli
from backend.axes.drive.drive import Drive
from backend.axes.drive.readings import Reading
from backend.commands.base import session
from backend.commands.drive import live, scales
from backend.commands.drive.values import assignment, line, show_readings
from backend.commands.server.serve import _print_problems
from backend.station.bench import Bench
from backend.station.records import REMOTE_S
from drivers.errors import LinkLost, NotAllowed
from drivers.texts.message import prose
from profiles import load_profile
from tests.support.machine import OwnTime
from tests.support.memory_link import MemoryLink
from tests.support.station import HANG_S


@pytest.fixture
def bus(monkeypatch: pytest.MonkeyPatch, link: MemoryLink) -> MemoryLink:
    monkeypatch.setattr(session, "link_for", lambda _url: link)
    return link


def test_an_unknown_profile_is_reported_with_those_that_there_are(bus: MemoryLink) -> None:
    done = CliRunner().invoke(
        cli.app, ["params", "get", "mlink:///x", "6041:00", "--profile", "mms8"]
    )
    assert done.exit_code == 1
    assert "error: no profile named 'mms8'; there are: ds_c" in done.stderr
    assert "try:" in done.stderr
    assert isinstance(done.exception, SystemExit)


def test_a_profile_of_drives_without_this_port_is_refused(bus: MemoryLink) -> None:
    """An M6-L has EtherCAT only: its numbers would go into some other drive."""
    words = ["params", "set", "mlink:///x", "6040:00=15", "--profile", "m6l"]
    done = CliRunner().invoke(cli.app, words)
    assert done.exit_code == 1
    assert "has no mlink port" in done.stderr
    assert bus.written == []


async def test_the_bench_refuses_it_too(tmp_path: Path, link: MemoryLink) -> None:
    bench = Bench(tmp_path, {"mlink://virtual0": lambda: link})
    try:
        with pytest.raises(NotAllowed, match="has no mlink port"):
            await bench.connect("mlink://virtual0", 1, "m6l")
        with pytest.raises(NotAllowed, match="no profile named 'mms8'; there are"):
            await bench.connect("mlink://virtual0", 1, "mms8")
        assert bench.connected_drives == {}
    finally:
        await bench.close()


async def test_a_state_folder_that_cannot_be_used_is_reported_in_the_terminal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    bench = Bench(tmp_path / "file")
    await bench.restore()
    try:
        _print_problems(bench)
    finally:
        await bench.close()
    assert "  note: " in (said := capsys.readouterr().out)
    assert f"{tmp_path}/file" in said


async def test_a_database_out_of_reach_is_reported_at_once_and_keeps_no_drive_waiting(
    tmp_path: Path, link: MemoryLink, capsys: pytest.CaptureFixture[str]
) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))  # and not listening: it refuses
        place = f"127.0.0.1:{taken.getsockname()[1]}/audit"
        url = f"postgresql://me:secret@{place}"
        bench = Bench(tmp_path, {"mlink://virtual0": lambda: link}, database=url)
        said = ""
        with OwnTime() as took:
            await bench.restore()
            _print_problems(bench)
            # A computer that keeps the database's thread waiting hears of it later.
            async with asyncio.timeout(HANG_S):
                while "failed:" not in said:
                    await asyncio.sleep(0.01)
                    said += capsys.readouterr().out
        try:
            await bench.connect("mlink://virtual0", 1, "mms7")
        finally:
            await bench.close()
    assert took.s < REMOTE_S
    assert f"me:***@{place} failed:" in said
    assert "check free space" in said
    assert "secret" not in said


async def test_what_goes_wrong_later_is_reported_too_but_not_every_drives_trouble(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bench = Bench(tmp_path)
    _print_problems(bench)
    bench.journal.add(prose("the audit waits: the disk is full"), level="error")
    bench.journal.add(prose("it may still be enabled"), level="error", drive="x")
    bench.journal.add(prose("opened mlink:///dev/ttyUSB0"))
    assert capsys.readouterr().out == "  note: the audit waits: the disk is full\n"
    await bench.close()


@pytest.mark.parametrize("text", ["nan", "inf", "-inf", "1e400", "five"])
def test_what_is_no_number_is_refused_before_the_bus(drive: Drive, text: str) -> None:
    with pytest.raises(NotAllowed, match=f"2005:03 .*: '{text}' is not a number"):
        assignment(drive.parameter, f"2005:03={text}")


def test_a_file_that_cannot_be_opened_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(typer.Exit) as ended, session.reported():
        (tmp_path / "none" / "x").write_bytes(b"")
    assert ended.value.exit_code == 1
    assert capsys.readouterr().err == f"error: {tmp_path}/none/x: No such file or directory\n"


def test_a_defect_of_the_program_is_one_sentence_and_its_own_exit_code(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken() -> None:
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr(cli, "app", broken)
    monkeypatch.delenv("SERVODECK_TRACEBACK", raising=False)
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == 70
    said = capsys.readouterr().err
    assert "ZeroDivisionError('division by zero')" in said
    assert "SERVODECK_TRACEBACK=1" in said
    assert "Traceback" not in said
    monkeypatch.setenv("SERVODECK_TRACEBACK", "1")
    with pytest.raises(ZeroDivisionError):
        cli.main()


@pytest.mark.parametrize("encoding", ["ascii", "cp1252"])
def test_letters_that_a_terminal_lacks_do_not_end_a_command(
    encoding: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    written = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(written, encoding=encoding))
    monkeypatch.setattr(cli, "app", lambda: print("drive 1 → file 2 …", flush=True))
    cli.main()
    assert written.getvalue().decode("utf-8") == "drive 1 → file 2 …\n"  # no terminal: a file


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--inertia", "nan", "--cycle", "1"], "--inertia cannot be nan"),
        (["--inertia", "1e-4", "--cycle", "-1"], "--cycle cannot be -1"),
        (["--inertia", "1e-4", "--cycle", "1", "--voltage", "0"], "--voltage cannot be 0"),
    ],
)
def test_braking_needs_numbers_of_a_machine(arguments: list[str], says: str) -> None:
    done = CliRunner().invoke(cli.app, ["braking", "--speed", "3000", "--time", "0.1", *arguments])
    assert (done.exit_code, done.stdout) == (1, "")
    assert says in done.stderr


def test_a_wrong_dimension_is_named_with_its_value() -> None:
    done = CliRunner().invoke(cli.app, ["gear", "mms7", "--kind", "screw", "--lead", "-1"])
    assert done.exit_code == 1
    assert "lead_mm is -1.0: Input should be greater than" in done.stderr


@pytest.mark.parametrize(
    "words", [["list"], ["list", "--json"], ["export", "x.sdset"], ["purge"]], ids=" ".join
)
def test_a_library_that_is_not_there_is_not_an_empty_one(words: list[str], tmp_path: Path) -> None:
    """A slip in --config must not look as if everything had been deleted, nor make a folder."""
    elsewhere = tmp_path / "sttion"
    done = CliRunner().invoke(cli.app, ["library", *words, "--config", str(elsewhere)])
    assert (done.exit_code, done.stdout) == (1, "")
    assert f"there is no database {elsewhere}/servodeck.db" in done.stderr
    assert not elsewhere.exists()


def test_a_service_managers_end_lets_go_of_everything() -> None:
    """SIGTERM alone would end the process at once and leave the demo's folders behind."""
    let_go: list[str] = []

    async def work() -> None:
        try:
            signal.raise_signal(signal.SIGTERM)
            await asyncio.sleep(10)
        finally:
            let_go.append("folder")

    before = signal.getsignal(signal.SIGTERM)
    try:
        session.until_interrupted(work)
    finally:
        signal.signal(signal.SIGTERM, before)
    assert let_go == ["folder"]


def test_a_comparison_that_could_not_be_made_is_none_that_differs(
    bus: MemoryLink, tmp_path: Path
) -> None:
    """A script that asks for 1, "they differ", must not take a failure for it."""
    words = ["params", "diff", "mlink:///x", str(tmp_path / "none.sdset"), "--profile", "mms7"]
    done = CliRunner().invoke(cli.app, words)
    assert done.exit_code == 2
    assert "cannot be read" in done.stderr


def test_values_come_as_json_and_with_their_unit() -> None:
    profile = load_profile("mms7")
    speed, status = profile.by_key["2005:03"], profile.by_key["6041:00"]
    read = [
        (speed, Reading("2005:03", 1500, 150.0, 0.0)),
        (status, Reading("6041:00", 0x0250, 0x0250, 0.0)),
        (speed, Reading("2005:03", None, None, None, prose("no answer"))),
    ]
    out = io.StringIO()
    with redirect_stdout(out):
        assert not show_readings(read, "mms7", as_json=True)
    shown = json.loads(out.getvalue())
    assert (shown[0]["value"], shown[0]["unit"], shown[0]["raw"]) == (150.0, "Hz", 1500)
    assert (shown[2]["value"], shown[2]["error"]) == (None, "no answer")
    assert line(status, read[1][1], "mms7") == "6041:00  Status word = 592 (0x0250)"


@pytest.mark.parametrize(
    "line",
    [
        b'{"n":"\xff\xfe"}\n',
        b'{"number":1e999,"previous":"","hash":"","body":"{}"}\n',
        b'{"number":1,"previous":"","hash":"","body":"\\ud800"}\n',
        b"[" * 100_000 + b"\n",
    ],
    ids=["not UTF-8", "infinite", "half a character", "deep"],
)
def test_a_file_that_is_no_audit_is_reported(tmp_path: Path, line: bytes) -> None:
    file = tmp_path / "audit.jsonl"
    file.write_bytes(line)
    _refused("line 1 is not an entry", "audit", "verify", "--file", str(file))


def test_numbers_that_are_none_are_reported(tmp_path: Path) -> None:
    file = tmp_path / "audit.jsonl"
    file.write_bytes(b"")
    _refused("anchor", "audit", "verify", "--anchor", f"²:{'a' * 64}", "--file", str(file))
    file = tmp_path / "drive.xml"
    file.write_bytes(b'<?xml version="1.0"?><EtherCATInfo/>')
    which = ("--product-code", "abc")
    _refused("is not a number", "eeprom", "compare", "ethercat:eth9", str(file), *which)
    _refused("--for-days", "health", "permit", "--axis", "x", "--for-days", "99999999", code=2)


def _refused(words: str, *command: str, code: int = 1) -> None:
    result = CliRunner().invoke(cli.app, list(command))
    assert isinstance(result.exception, SystemExit), result.exception
    assert result.exit_code == code
    assert words in re.sub(r"\x1b\[[0-9;]*m", "", result.output)


def test_a_slip_of_the_keyboard_is_asked_again(monkeypatch: pytest.MonkeyPatch) -> None:
    answers = iter(["half", "nan", "0,5"])
    monkeypatch.setattr(typer, "prompt", lambda *_words, **_options: next(answers))
    assert scales._turned(500) == 0.5
    monkeypatch.setattr(typer, "prompt", lambda *_words, **_options: " ")
    assert scales._turned(500) is None


async def test_a_full_disk_is_not_blamed_on_the_connection(monkeypatch: pytest.MonkeyPatch) -> None:
    class Page:
        async def __aenter__(self) -> Page:
            return self

        async def __aexit__(self, *_error: object) -> None: ...

    async def greeting(*_arguments: object) -> None: ...

    monkeypatch.setattr(live, "connect", lambda *_address, **_options: Page())
    monkeypatch.setattr(live, "_next", greeting)
    with pytest.raises(OSError, match="No space left"):
        async with live._page("http://station"):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    with pytest.raises(LinkLost):
        async with live._page("http://station"):
            raise TimeoutError
