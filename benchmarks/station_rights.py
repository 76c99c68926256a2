"""An EtherCAT station from the files of ``make packages``, with the capabilities declared there.

    python -m benchmarks.station_rights [DIST]

The container's root is laid out as the Containerfile says and its program started in namespaces, as
`tests.support.contained` does. The Debian package is installed in a root of its own and its program
started with the capabilities of the unit that it brings. Each scans a virtual segment on a virtual
cable.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from benchmarks._aims import Aim, print_verdict
from benchmarks.install import DIST, Walk, debian_program
from drivers.virtual.wires.ethercat.launch import VirtualSegment
from drivers.virtual.wires.netns import Namespace
from tests.support.contained import NUMBERS, Recipe
from tests.support.limited import only_with

ROOT = Path(__file__).resolve().parents[1]
_FACTORY = "tests.wire.ethercat_host.servo_device:make_servo"
_UNIT = "usr/lib/systemd/system/servodeck.service"


def main() -> None:
    """Print what each station had and found."""
    dist = Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else DIST
    if not (dist / "wheels").is_dir():
        print("not possible here: no dist/wheels: make packages")
        return
    aims: list[Aim] = []
    with (
        tempfile.TemporaryDirectory(prefix="servodeck-rights-") as place,
        Namespace.create() as network,
    ):
        segment = VirtualSegment.start(
            "ec0s", ["--factory", _FACTORY, "--lockstep", "--drive", "serial=7"], network
        )
        try:
            for name, declared, serve in _stations(Path(place), dist):
                held, found = _scan(serve, network)
                print(f"{name}: {found}")
                wanted = sum(1 << NUMBERS[capability] for capability in declared)
                said = f"{name}: capabilities {held:016x}, declared {wanted:016x}"
                aims.append(Aim(said, held == wanted))
                aims.append(Aim(f"{name}: the drive is found", "station 1:" in found))
        finally:
            segment.close()
    print_verdict(aims)


def _stations(place: Path, dist: Path) -> Iterator[tuple[str, Sequence[str], list[str]]]:
    """Name, declared capabilities and command line of each way whose files are here."""
    state = place / "state"
    state.mkdir()
    recipe = Recipe.read((ROOT / ".ci/supply/Containerfile").read_text("utf-8"))
    recipe.unpack(dist.parent, place / "container")
    serve = recipe.started(place / "container", state, "serve", "--port", "0")
    yield "container", recipe.capabilities, serve
    if shutil.which("dpkg") is None:
        print("Debian package: no dpkg on this computer")
        return
    walk = Walk(place, offline=False)
    program = debian_program(walk, dist)
    unit = (walk.scratch / "root" / _UNIT).read_text("utf-8")
    (declared,) = re.findall(r"^CapabilityBoundingSet=(.*)$", unit, re.MULTILINE)
    command = [str(program), "serve", "--port", "0", "--config", str(place / "debian-state")]
    yield "Debian package", declared.split(), only_with(declared.split(), command)


def _scan(serve: list[str], network: Namespace) -> tuple[int, str]:
    """Capabilities of the server, and what a scan through it prints."""
    process = network.popen(serve, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    try:
        address = ""
        for line in process.stdout or ():
            found = re.search(r"is at (http://\S+)/", line)
            if found:
                address = found[1]
                break
        status = Path(f"/proc/{process.pid}/status").read_text("ascii")
        (held,) = re.findall(r"^CapEff:\t(\w+)$", status, re.MULTILINE)
        scan = [sys.executable, "-m", "backend", "scan", "ethercat://ec0m", "--server", address]
        done = subprocess.run(network.command(scan), capture_output=True, text=True, check=False)
        return int(held, 16), done.stdout + done.stderr
    finally:
        process.terminate()
        process.communicate()


if __name__ == "__main__":
    main()
