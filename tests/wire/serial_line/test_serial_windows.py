"""Errors of COM ports as pyserial on Windows gives them: nothing but the text of a WinError."""

from __future__ import annotations

import errno
from types import SimpleNamespace

import can
import pytest
import serial

from drivers.canopen.adapters.adapter import translate
from drivers.canopen.url import parse_canopen_url
from drivers.computer.serial_ports import terminals
from drivers.computer.serial_ports.terminals import is_in_use, may_open, port_errno
from drivers.errors import LinkLost, OutOfRange
from drivers.modbus import port as port_module
from drivers.modbus.port import LineSettings, open_port

#: serialwin32.py of pyserial 3.5, lines 64 and 222; the system's words are in its language.
IN_USE = "could not open port 'COM3': PermissionError(13, 'Zugriff verweigert', None, 5)"
MISSING = "could not open port 'COM3': FileNotFoundError(2, '系统找不到指定的文件。', None, 2)"
BAUD = (
    "Cannot configure port, something went wrong. Original message: "
    "OSError(22, 'The parameter is incorrect.', None, 87)"
)
BROKEN = (
    "could not open port 'COM3': "
    "OSError(22, 'A device attached to the system is not functioning.', None, 31)"
)


@pytest.mark.parametrize(
    ("message", "number"),
    [(IN_USE, errno.EBUSY), (MISSING, errno.ENOENT), (BAUD, errno.EINVAL), (BROKEN, 0), ("", 0)],
)
def test_the_number_behind_the_words(message: str, number: int) -> None:
    assert port_errno(serial.SerialException(message)) == number


def test_errors_of_posix_have_their_number() -> None:
    stated = serial.SerialException(errno.EBUSY, "could not open port /dev/ttyUSB0")
    assert port_errno(stated) == errno.EBUSY
    text = serial.SerialException("could not open port: [Errno 13] Permission denied")
    assert port_errno(text) == errno.EACCES


@pytest.mark.parametrize(
    ("message", "kind", "code"),
    [
        (IN_USE, LinkLost, "modbus.use-another-program"),
        (MISSING, LinkLost, "modbus.no-serial-port"),
        (BAUD, OutOfRange, "modbus.cannot-set"),
        (BROKEN, LinkLost, "modbus.cannot-opened"),
    ],
)
def test_a_line_that_cannot_be_opened_is_explained(
    message: str, kind: type[Exception], code: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_arguments: object, **_options: object) -> object:
        raise serial.SerialException(message)

    monkeypatch.setattr(port_module.serial, "Serial", refused)
    monkeypatch.setattr(port_module, "serial_device", lambda place: place)  # as on Windows
    with pytest.raises(kind) as caught:
        open_port(LineSettings("COM3"))
    assert caught.value.code == code  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("message", "code"), [(IN_USE, "canopen.adapter-in-use"), (MISSING, "canopen.adapter-missing")]
)
def test_a_can_adapter_that_cannot_be_opened_is_explained(message: str, code: str) -> None:
    wrapped = can.CanInitializationError(message)
    wrapped.__cause__ = serial.SerialException(message)
    lost = translate(parse_canopen_url("canopen://slcan/COM3?bitrate=1000000"), wrapped)
    assert lost.text.params["why"].code == code  # type: ignore[union-attr]


def test_whether_a_program_has_a_port_open(monkeypatch: pytest.MonkeyPatch) -> None:
    answers = {"COM3": IN_USE, "COM4": MISSING}
    closed: list[str] = []

    def made(device: str, **_options: object) -> object:
        if device in answers:
            raise serial.SerialException(answers[device])
        return SimpleNamespace(close=lambda: closed.append(device))

    monkeypatch.setattr(terminals.serial, "Serial", made)
    assert [is_in_use(one) for one in ("COM3", "COM4", "COM5")] == [True, False, False]
    assert closed == ["COM5"]


def test_a_com_port_is_no_file_whose_permissions_forbid_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """`os.access` finds no file COM10 on Windows."""
    assert not may_open("COM10")
    monkeypatch.setattr(terminals, "sys", SimpleNamespace(platform="win32"))
    assert may_open("COM10")
