"""An EtherCAT station starts with exactly the capabilities that its ways in declare.

The unit of the Debian package is that of ``servodeck station unit``: see `tests/unit/packages`.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from backend.station.install.service import systemd_unit
from drivers.virtual.wires.ethercat.launch import VirtualSegment
from drivers.virtual.wires.netns import Namespace, child_environment, unavailable
from tests.support.contained import NUMBERS
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


@pytest.fixture(scope="module")
def network() -> Iterator[Namespace]:
    with Namespace.create() as namespace:
        arguments = ["--factory", FACTORY, "--lockstep", "--drive", "serial=7"]
        segment = VirtualSegment.start("ec0s", arguments, namespace)
        yield namespace
        segment.close()


def limited(network: Namespace, names: list[str], *program: str) -> list[str]:
    """A command line inside, with these capabilities alone; being root gives no others."""
    only = ",".join(["-all", *(f"+{name.removeprefix('CAP_').lower()}" for name in names)])
    return network.command(
        ["setpriv", "--securebits", "+noroot,+noroot_locked", f"--inh-caps={only}",
         f"--ambient-caps={only}", f"--bounding-set={only}", "--no-new-privs",
         sys.executable, "-m", "backend", *program]
    )  # fmt: skip


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


@pytest.mark.long
def test_the_station_scans_with_what_unit_and_container_declare(
    network: Namespace, tmp_path: Path
) -> None:
    names = of_unit()
    assert sorted(of_container()) == sorted(names)
    serve = limited(network, names, "serve", "--port", "0", "--config", str(tmp_path / "state"))
    with station(serve, tmp_path) as (process, address):
        status = Path(f"/proc/{process}/status").read_text()
        wanted = sum(1 << NUMBERS[name] for name in names)
        for kind in ("CapEff", "CapPrm", "CapBnd"):
            assert f"{kind}:\t{wanted:016x}\n" in status
        scan = [sys.executable, "-m", "backend", "scan", "ethercat://ec0m", "--server", address]
        found = run(network.command(scan), tmp_path)
    assert found.returncode == 0, found.stdout + found.stderr
    assert "station 1:" in found.stdout


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
