"""The task of a station on Windows: started at the log-in, and ended by nobody but its user."""

from __future__ import annotations

import sys
from pathlib import Path
from xml.etree import ElementTree

from typer.testing import CliRunner

from backend import cli
from backend.station.install.windows_task import windows_task

NAMES = {"task": "http://schemas.microsoft.com/windows/2004/02/mit/task"}
PROGRAM = r"C:\Users\Jürgen Müller & Söhne\servodeck\python\python.exe"


def said(xml: ElementTree.Element, path: str) -> str | None:
    return xml.findtext("/".join(f"task:{one}" for one in path.split("/")), None, NAMES)


def made(*arguments: str) -> ElementTree.Element:
    text = windows_task(PROGRAM, arguments)
    return ElementTree.fromstring(text.partition("\n")[2])


def test_the_scheduler_never_ends_it() -> None:
    """By default it does: after 72 hours, and when the battery takes over."""
    xml = made("-m", "backend", "serve")
    assert said(xml, "Settings/ExecutionTimeLimit") == "PT0S"
    assert said(xml, "Settings/StopIfGoingOnBatteries") == "false"
    assert said(xml, "Settings/DisallowStartIfOnBatteries") == "false"
    assert said(xml, "Settings/IdleSettings/StopOnIdleEnd") == "false"
    assert said(xml, "Settings/MultipleInstancesPolicy") == "IgnoreNew"


def test_it_has_no_rights_beyond_its_user() -> None:
    xml = made("serve")
    assert said(xml, "Principals/Principal/RunLevel") == "LeastPrivilege"
    assert said(xml, "Principals/Principal/LogonType") == "InteractiveToken"


def test_names_with_spaces_umlauts_and_signs_of_xml() -> None:
    xml = made("serve", "--config", r"C:\Users\王伟\OneDrive - A & B\state")
    assert said(xml, "Actions/Exec/Command") == PROGRAM
    assert (
        said(xml, "Actions/Exec/Arguments")
        == r'serve --config "C:\Users\王伟\OneDrive - A & B\state"'
    )


def test_the_file_is_of_the_form_that_windows_reads(tmp_path: Path) -> None:
    file = tmp_path / "task.xml"
    done = CliRunner().invoke(
        cli.app, ["station", "task", str(file), "--config", str(tmp_path / "state folder")]
    )
    assert done.exit_code == 0, done.output
    assert "schtasks /Create /TN servodeck /XML" in done.output
    data = file.read_bytes()
    assert data[:2] in (b"\xff\xfe", b"\xfe\xff")
    xml = ElementTree.fromstring(data)
    assert said(xml, "Actions/Exec/Command") == sys.executable
    assert str(tmp_path / "state folder") in (said(xml, "Actions/Exec/Arguments") or "")
