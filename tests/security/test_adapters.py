"""Bus URLs name adapters of known forms; nothing that a library beneath could take for more."""

from __future__ import annotations

import json
import os
import pty
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest

from backend.station.bench import Bench
from drivers.adapters import require_channel, require_serial_form, serial_device
from drivers.canopen.adapters.adapter import open_bus
from drivers.canopen.url import CanUrl
from drivers.errors import DriveError, LinkLost, OutOfRange
from drivers.modbus.port import LineSettings, open_port
from drivers.urls import link_for, parse_url
from tests.security.conftest import Cast
from tests.support.guarded import GuardedServer
from tests.support.station import until

#: pyserial's own URLs (serial.urlhandler), and other ways to say them.
HANDLERS = [
    "spy://{pty}?file={file}&raw", "SPY://{pty}?file={file}", "spy:{pty}?file={file}",
    "alt://{pty}?class=PosixPollSerial", "loop://", "loop:", "socket://127.0.0.1:{port}",
    "rfc2217://127.0.0.1:{port}", "hwgrep://.*", "cp2110://0:0:0",
]  # fmt: skip
SCHEMES = ["mlink", "modbus", "canopen", "ethercat"]


@pytest.fixture
def terminal() -> Iterator[str]:
    master, slave = pty.openpty()
    yield os.ttyname(slave)
    os.close(master)
    os.close(slave)


class Listener:
    """A port of this machine that counts who connects."""

    def __init__(self) -> None:
        self.connected = 0
        self._line = socket.create_server(("127.0.0.1", 0))
        self.port = self._line.getsockname()[1]
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self) -> None:
        while True:
            try:
                other, _ = self._line.accept()
            except OSError:
                return
            self.connected += 1
            other.close()

    def close(self) -> None:
        self._line.close()


@pytest.fixture
def listener() -> Iterator[Listener]:
    made = Listener()
    yield made
    made.close()


def ended(cast: Cast, job_id: str) -> Any:
    def over() -> Any:
        job = cast.operator.ok("GET", f"/jobs/{job_id}")
        return job if job["ended"] else None

    return until(over)


def written(scheme: str, place: str) -> list[str]:
    """The place as it is, percent-encoded once and twice, and with what parsers throw away."""
    start = f"{scheme}://slcan/" if scheme == "canopen" else f"{scheme}://"
    once = quote(place, safe="")
    return [start + place, start + once, start + quote(once, safe=""), f"{start}/{place}",
            start + place.replace("?", "#"), f"{start}{once}?timeout_ms=500"]  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("handler", HANDLERS)
def test_no_url_of_pyserial_is_an_adapter(
    server: GuardedServer,
    cast: Cast,
    terminal: str,
    listener: Listener,
    tmp_path: Path,
    scheme: str,
    handler: str,
) -> None:
    file = tmp_path / "kept"
    file.write_text("precious")
    place = handler.format(pty=terminal, file=file, port=listener.port)
    for url in written(scheme, place):
        body = {"url": url, "station": 1, "profile": "mms7", "name": "evil"}
        connected = cast.operator.ask("POST", "/drives", json=body)
        assert 400 <= connected.status_code <= 503, (url, connected.text[:300])
        for path in ("/scan", "/search-line"):
            began = cast.operator.ask("POST", path, json={"url": url})
            if began.status_code == 202:
                job = ended(cast, began.json()["id"])
                assert job["state"] == "failed", (url, job)
    assert file.read_text() == "precious"
    assert sorted(tmp_path.iterdir()) == [file]
    assert listener.connected == 0


@pytest.mark.parametrize("handler", HANDLERS)
def test_the_link_itself_opens_none_either(
    terminal: str, listener: Listener, tmp_path: Path, handler: str
) -> None:
    """Whoever made the settings: the last check is where the port is opened."""
    place = handler.format(pty=terminal, file=tmp_path / "made", port=listener.port)
    with pytest.raises(DriveError):
        open_bus(CanUrl("canopen://slcan/x", "slcan", place, 500_000))
    with pytest.raises(DriveError):
        open_port(LineSettings(place))
    assert not list(tmp_path.iterdir())
    assert listener.connected == 0


async def test_a_saved_list_of_drives_opens_none(tmp_path: Path, listener: Listener) -> None:
    kept = tmp_path / "kept"
    state = tmp_path / "state"
    state.mkdir()
    urls = [
        f"canopen://slcan/spy:%2F%2F%2Fdev%2Fptmx%3Ffile={kept}",
        f"modbus://socket://127.0.0.1:{listener.port}",
        f"mlink://rfc2217://127.0.0.1:{listener.port}",
    ]
    drives = [
        {"name": f"d{n}", "profile": "mms7", "ports": [{"url": url, "station": 1}]}
        for n, url in enumerate(urls)
    ]
    (state / "bench.json").write_text(json.dumps({"version": 1, "drives": drives}))
    bench = Bench(state)
    try:
        await bench.restore()
        reported = " ".join(entry.text for entry in bench.journal.entries())
        for number in range(len(urls)):
            assert f"d{number}: not connected" in reported
    finally:
        await bench.close()
    assert not kept.exists()
    assert listener.connected == 0


@pytest.mark.long
def test_the_command_line_opens_none(tmp_path: Path, listener: Listener) -> None:
    for url in (
        f"canopen://slcan/spy:%2F%2F%2Fdev%2Fptmx%3Ffile={tmp_path / 'made'}",
        f"modbus://socket://127.0.0.1:{listener.port}",
    ):
        ended = subprocess.run(
            [sys.executable, "-m", "backend", "scan", url],
            capture_output=True,
            text=True,
            timeout=100,
            check=False,
        )
        assert ended.returncode != 0
        assert "is not a serial port" in ended.stderr + ended.stdout
    assert not (tmp_path / "made").exists()
    assert listener.connected == 0


# --- serial ports ---------------------------------------------------------------------


@pytest.mark.parametrize(
    "place",
    ["/dev/ttyUSB0", "/dev/serial/by-id/usb-FTDI_FT232R_A50285BI-if00-port0", "/dev/cu.usb-1420",
     "/dev/my axis", "/tmp/wires/mlink0", "COM3", "com12", r"\\.\COM12"],
)  # fmt: skip
def test_forms_of_serial_ports(place: str) -> None:
    require_serial_form(place)


@pytest.mark.parametrize(
    "place",
    ["ttyUSB0", "dev/ttyUSB0", "COM0", "COM", "COM1234", "COM3 ", "COM3:", "/dev/../etc/passwd",
     "/dev/tty\nUSB0", "/dev/ttyUSB0\x00", "//server/share", r"\\server\share", r"\\.\pipe\x",
     "/", "", "/dev/tty?x=1", "/" + "x" * 300, "CON", "/dev/\ud800"],
)  # fmt: skip
def test_everything_else_is_no_serial_port(place: str) -> None:
    with pytest.raises(OutOfRange):
        require_serial_form(place)


def test_a_link_to_a_pseudo_terminal_is_a_serial_port(terminal: str, tmp_path: Path) -> None:
    wire = tmp_path / "wire"
    wire.symlink_to(terminal)
    again = tmp_path / "again"
    again.symlink_to(wire)
    assert serial_device(str(again)) == terminal
    open_port(LineSettings(str(again))).close()


@pytest.mark.skipif(sys.platform == "win32", reason="device files")
def test_what_is_no_serial_device_is_not_opened(tmp_path: Path) -> None:
    """Not a file, not a fifo (it would wait), not another device (it could act by itself)."""
    file, fifo = tmp_path / "file", tmp_path / "fifo"
    file.write_text("x")
    os.mkfifo(fifo)
    names = {
        "file": file,
        "fifo": fifo,
        "null": Path("/dev/null"),
        "zero": Path("/dev/zero"),
        "mem": Path("/dev/mem"),
        "shadow": Path("/etc/shadow"),
        "gone": tmp_path / "gone",
    }
    for name, target in names.items():
        link = tmp_path / f"to-{name}"
        link.symlink_to(target)
        refusals = []
        for place in (str(target), str(link)):
            with pytest.raises(LinkLost) as refused:
                open_port(LineSettings(place))
            refusals.append(refused.value.message)
        assert refusals[1] == f"there is no serial port {link}", "whether a file is there is secret"


def test_the_terminal_of_the_server_is_no_port() -> None:
    """Whoever reads it takes what its user types; whoever writes it writes on their screen."""
    master, slave = pty.openpty()
    name = os.ttyname(slave)
    code = (
        "from drivers.adapters import serial_device\n"
        "from drivers.errors import LinkLost\n"
        f"try: serial_device({name!r})\n"
        "except LinkLost as error: raise SystemExit(7 if 'runs in' in error.message else 1)\n"
    )
    try:
        ended = subprocess.run([sys.executable, "-c", code], stdin=slave, check=False, timeout=60)
    finally:
        os.close(master)
        os.close(slave)
    assert ended.returncode == 7


# --- CAN and EtherCAT -----------------------------------------------------------------


@pytest.mark.parametrize(
    ("interface", "channel"),
    [("socketcan", "can0"), ("socketcan", "vcan-line.2"), ("slcan", "/dev/ttyACM0"),
     ("slcan", "COM8"), ("pcan", "PCAN_USBBUS1"), ("pcan", "PCAN_PCIBUS16"), ("kvaser", "0"),
     ("usb2can", "ED000200"), ("udp_multicast", "239.74.163.2"), ("udp_multicast", "ff15::7"),
     ("virtual", "lockstep-3")],
)  # fmt: skip
def test_channels(interface: str, channel: str) -> None:
    require_channel(interface, channel)


@pytest.mark.parametrize(
    ("interface", "channel"),
    [("socketcan", "can0; reboot"), ("socketcan", "../can0"), ("socketcan", "x" * 16),
     ("slcan", "/dev/ttyACM0\n"), ("slcan", "COM8@115200"), ("slcan", "spy:///dev/x"),
     ("pcan", "../../x.dll"), ("kvaser", "0; x"), ("usb2can", "../x"),
     ("udp_multicast", "10.0.0.1"), ("udp_multicast", "localhost"),
     ("udp_multicast", "ff15::7%eth0"), ("virtual", "../x")],
)  # fmt: skip
def test_what_is_no_channel(interface: str, channel: str) -> None:
    with pytest.raises(OutOfRange):
        require_channel(interface, channel)
    with pytest.raises(OutOfRange):
        open_bus(CanUrl("canopen://x", interface, channel, 500_000))
    with pytest.raises(OutOfRange):
        link_for(f"canopen://{interface}/{quote(channel, safe='')}")


def test_a_port_below_1024_is_somebody_elses() -> None:
    with pytest.raises(OutOfRange, match="1024"):
        link_for("canopen://udp_multicast/239.74.163.2?port=53")


@pytest.mark.parametrize("name", ["", "eth0;reboot", "$(reboot)", "a b", "x" * 16, "../eth0", "-x"])
def test_what_is_no_interface(cast: Cast, name: str) -> None:
    """The answer has commands to copy: no part of them may be somebody else's."""
    with pytest.raises(OutOfRange):
        parse_url(f"ethercat://{name}")
    answer = cast.operator.ask("GET", "/ethercat/permissions", params={"url": f"ethercat://{name}"})
    assert answer.status_code == 422
