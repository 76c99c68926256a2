"""An EtherCAT station in the container's root, with exactly the capabilities that it declares.

    python -m benchmarks.container

Lays out the files of ``make packages`` as the Containerfile says, starts its program in namespaces
as `tests.support.contained` does, and lets it scan a virtual segment on a virtual cable.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks._aims import Aim, print_verdict
from drivers.virtual.wires.ethercat.launch import VirtualSegment
from drivers.virtual.wires.netns import Namespace
from tests.support.contained import NUMBERS, Recipe

ROOT = Path(__file__).resolve().parents[1]
_FACTORY = "tests.wire.ethercat_host.servo_device:make_servo"


def main() -> None:
    """Print what the station had and found."""
    recipe = Recipe.read((ROOT / ".ci/supply/Containerfile").read_text("utf-8"))
    wanted = sum(1 << NUMBERS[name] for name in recipe.capabilities)
    with tempfile.TemporaryDirectory(prefix="servodeck-container-") as place:
        root, state = Path(place) / "root", Path(place) / "state"
        state.mkdir()
        recipe.unpack(ROOT, root)
        with Namespace.create() as network:
            segment = VirtualSegment.start(
                "ec0s", ["--factory", _FACTORY, "--lockstep", "--drive", "serial=7"], network
            )
            try:
                held, found = _scan(recipe, root, state, network)
            finally:
                segment.close()
    print(found)
    print_verdict(
        [
            Aim(f"capabilities {held:016x}, declared {wanted:016x}", held == wanted),
            Aim("the station finds the drive on its segment", "station 1:" in found),
        ]
    )


def _scan(recipe: Recipe, root: Path, state: Path, network: Namespace) -> tuple[int, str]:
    """Capabilities of the server, and what a scan through it prints."""
    serve = recipe.started(root, state, "serve", "--port", "0")
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
