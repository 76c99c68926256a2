"""An EtherCAT station starts with exactly the capabilities that its ways in declare.

The unit of the Debian package is that of ``servodeck station unit``: see `tests/unit/packages`.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import pytest

from backend.station.install.service import systemd_unit
from drivers.virtual.wires.ethercat.launch import VirtualSegment
from drivers.virtual.wires.netns import Namespace, child_environment, unavailable
from tests.support.contained import NUMBERS
from tests.support.limited import only_with
from tests.wire.ethercat_host.conftest import FACTORY

ROOT = Path(__file__).resolve().parents[3]
MISSING = unavailable() or ("" if shutil.which("setpriv") else "setpriv (util-linux) is not here")

pytestmark = pytest.mark.skipif(bool(MISSING), reason=MISSING)


def of_unit() -> list[str]:
    found = re.search(r"^CapabilityBoundingSet=(.*)$", systemd_unit(), re.MULTILINE)
    assert found is not None
    return found[1].split()


def of_container() -> list[str]:
    text = (ROOT / ".ci/supply/Containerfile").read_text()
    return [f"CAP_{name}" for name in re.findall(r"--cap-add (\w+)", text)]


#: Of no way in: here, where the folders of checkout and interpreter are closed to others.
READING = {"CAP_DAC_READ_SEARCH": 2}
NOBODY = ["--reuid=65534", "--regid=65534", "--clear-groups"]
#: Creates the cables in a network of its own but as the users of this computer: an ordinary user
#: exists only there.
HOLDER = """
import sys
from drivers.virtual.wires import netns
netns.leave_namespaces = lambda: None
sys.exit(netns._hold(sys.argv[1:]))
"""


def to_read_the_project() -> list[str]:
    """What another user needs to read interpreter and checkout, where their folders are closed."""
    # The first command of setpriv still has root's capabilities; its child has not.
    command = ["setpriv", *NOBODY, "sh", "-c", f"{sys.executable} -c 'import backend'"]
    tried = subprocess.run(command, cwd=ROOT, capture_output=True, check=False)
    return [] if tried.returncode == 0 else list(READING)


@pytest.fixture(scope="module")
def users_network() -> Iterator[Namespace]:
    """With a drive, and with this computer's users."""
    if os.geteuid() != 0:
        pytest.skip("only root can start a program as another user")
    holder = subprocess.Popen(
        ["unshare", "--net", sys.executable, "-c", HOLDER, "ec0m", "ec0s"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=child_environment(),
    )
    assert holder.stdout is not None
    answer = holder.stdout.readline().strip()
    with Namespace(holder, (("ec0m", "ec0s"),)) as namespace:
        assert answer == "ready", answer
        arguments = ["--factory", FACTORY, "--lockstep", "--drive", "serial=7"]
        segment = VirtualSegment.start("ec0s", arguments, namespace)
        yield namespace
        segment.close()


@pytest.fixture(scope="module")
def network() -> Iterator[Namespace]:
    with Namespace.create() as namespace:
        arguments = ["--factory", FACTORY, "--lockstep", "--drive", "serial=7"]
        segment = VirtualSegment.start("ec0s", arguments, namespace)
        yield namespace
        segment.close()


def limited(
    network: Namespace, names: list[str], *program: str, user: Sequence[str] = ()
) -> list[str]:
    """A command line inside, with these capabilities alone."""
    command = [sys.executable, "-m", "backend", *program]
    return network.command(only_with(names, command, user))


@contextmanager
def station(command: list[str], folder: Path) -> Iterator[tuple[int, str]]:
    """A running server: its process, and its address."""
    process = subprocess.Popen(
        command,
        cwd=folder,
        env=child_environment(),
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    assert process.stdout is not None
    try:
        printed = []
        for line in process.stdout:
            printed.append(line)
            if found := re.search(r"is at (http://\S+)/", line):
                yield process.pid, found[1]
                return
        raise AssertionError("".join(printed))
    finally:
        process.terminate()
        process.communicate()


def run(command: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command, cwd=folder, env=child_environment(), capture_output=True, text=True, check=False
    )


def scan_by_server(
    network: Namespace, names: list[str], *options: str, folder: Path, user: Sequence[str] = ()
) -> str:
    """Scan the bus by a server with these capabilities; return its ``/proc/PID/status``."""
    serve = limited(network, names, "serve", "--port", "0", *options, user=user)
    with station(serve, folder) as (process, address):
        status = Path(f"/proc/{process}/status").read_text()
        wanted = sum(1 << (NUMBERS | READING)[name] for name in names)
        for kind in ("CapEff", "CapPrm", "CapBnd"):
            assert f"{kind}:\t{wanted:016x}\n" in status
        scan = [sys.executable, "-m", "backend", "scan", "ethercat://ec0m", "--server", address]
        found = run(network.command(scan), folder)
    assert found.returncode == 0, found.stdout + found.stderr
    assert "station 1:" in found.stdout
    return status


@pytest.mark.long
def test_the_station_scans_with_what_unit_and_container_declare(
    network: Namespace, tmp_path: Path
) -> None:
    names = of_unit()
    assert sorted(of_container()) == sorted(names)
    scan_by_server(network, names, "--config", str(tmp_path / "state"), folder=tmp_path)


def test_a_user_without_rights_scans_with_them(users_network: Namespace) -> None:
    """As the unit's ``User=``, who owns nothing but the state folder."""
    with tempfile.TemporaryDirectory() as folder:
        os.chown(folder, 65534, 65534)
        names = [*of_unit(), *to_read_the_project()]
        status = scan_by_server(
            users_network, names, "--config", folder, folder=Path(folder), user=NOBODY
        )
        assert "Uid:\t65534\t65534\t65534\t65534\n" in status


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("missing", ["CAP_NET_RAW", "CAP_NET_ADMIN"])
def test_without_one_that_is_needed_the_bus_is_refused_with_its_name(
    missing: str, network: Namespace, tmp_path: Path
) -> None:
    """Else the test above would show nothing."""
    names = [name for name in of_unit() if name != missing]
    refused = run(limited(network, names, "scan", "ethercat://ec0m"), tmp_path)
    assert refused.returncode == 1
    assert missing in refused.stderr
