"""EtherCAT slaves of another stack: from their ESI to Operational, jog and STOP.

    python -m benchmarks.independent_slave --kickcat FOLDER --argparse FOLDER [--build FOLDER]

Builds the network simulator of KickCAT (public, CeCILL-C) from a checkout, outside this repository,
and runs the product against it on a virtual cable in a private network. Its emulated ESC, state
machine, mailbox and CiA 402 motor share no line with the virtual drives of this project. Needed
are cmake, a C++17 compiler, the headers of tinyxml2 and nlohmann-json, and a checkout of the
header-only library p-ranav/argparse. Without a checkout nothing is run, and the reason is printed.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx

from benchmarks._aims import Aim, print_verdict
from drivers.virtual.wires.netns import Namespace

_PORT = 8437
_SERVER = f"http://127.0.0.1:{_PORT}"
_BUS = "ethercat://ec0m"
_COUNTS_PER_REV = 50_000
_RPM, _STOOD_REV = 60.0, 0.001
_OFF = ("MASTER_EXAMPLES", "SLAVE_EXAMPLES", "TOOLS", "UNIT_TESTS")
_FIND_ARGPARSE = """add_library(argparse::argparse INTERFACE IMPORTED)
set_target_properties(argparse::argparse PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "{include}")
"""


@dataclass(frozen=True)
class Product:
    """The product's commands, with profiles and state in a folder of their own."""

    folder: Path

    def run(self, *words: str) -> subprocess.CompletedProcess[str]:
        """Run one command to its end."""
        return subprocess.run(
            self._command(words), env=self._environment(), capture_output=True, text=True,
            timeout=180, check=False,
        )  # fmt: skip

    @contextmanager
    def running(self, *words: str) -> Iterator[subprocess.Popen[str]]:
        """Have one command run meanwhile."""
        process = subprocess.Popen(
            self._command(words),
            env=self._environment(),
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        try:
            yield process
        finally:
            process.terminate()
            process.wait(30)

    def _command(self, words: tuple[str, ...]) -> list[str]:
        return [sys.executable, "-m", "backend", *words]

    def _environment(self) -> dict[str, str]:
        kinds = ("STATE", "CONFIG", "DATA")
        return os.environ | {f"XDG_{kind}_HOME": str(self.folder / kind) for kind in kinds}


def built(source: Path, headers: Path, folder: Path) -> Path:
    """Build the simulator; returns the program."""
    found = folder / "argparse"
    found.mkdir(parents=True, exist_ok=True)
    (found / "argparseConfig.cmake").write_text(_FIND_ARGPARSE.format(include=headers / "include"))
    off = [f"-DBUILD_{name}=OFF" for name in _OFF]
    subprocess.run(
        ["cmake", "-S", source, "-B", folder / "build", "-DCMAKE_BUILD_TYPE=Release", *off,
         "-DBUILD_SIMULATION=ON", f"-Dargparse_DIR={found}"],
        check=True, stdout=subprocess.DEVNULL,
    )  # fmt: skip
    subprocess.run(
        ["cmake", "--build", folder / "build", "--target", "network_simulator", "-j2"],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    return folder / "build" / "simulation" / "network_simulator"


def by_command(product: Product, esi: Path) -> Iterator[Aim]:
    """Import, search, bring-up and rules of the standards, without a server."""
    imported = product.run("profile", "import", str(esi))
    yield Aim(f"import of the ESI: {_last(imported.stdout)[:60]}", imported.returncode == 0)
    scanned = product.run("scan", _BUS)
    yield Aim(f"search: {_last(scanned.stdout)[:60]}", "(certain)" in scanned.stdout)
    doctor = product.run("doctor", _BUS)
    yield Aim(f"bring-up: {_last(doctor.stdout)}", doctor.returncode == 0)
    printed = product.run("conformance", _BUS, "--json").stdout
    failed = {rule["code"] for rule in _rules(json.loads(printed)) if rule["verdict"] == "failed"}
    # Of this stack both are known: it answers a value that is too long with a mailbox error, and
    # its 1018h holds the defaults of the ESI, not the identity.
    known = {"sdo-too-long", "stored-identity"}
    yield Aim(f"rules that the slave breaks: {', '.join(sorted(failed))}", failed <= known)


def _rules(found: Any) -> Iterator[dict[str, str]]:
    if isinstance(found, dict) and "verdict" in found:
        yield found
    elif isinstance(found, dict | list):
        for value in found.values() if isinstance(found, dict) else found:
            yield from _rules(value)


def by_server(product: Product) -> Iterator[Aim]:
    """Jog and STOP; this drive does not follow a quick stop of its control word."""
    with product.running("serve", "--port", str(_PORT)) as server:
        for line in server.stdout or ():
            if "is at http" in line:
                break
        raw = str(_COUNTS_PER_REV / 60)
        stated = product.run(
            "scales", "set", _BUS, "--server", _SERVER, "--counts-per-rev", str(_COUNTS_PER_REV),
            "--raw-per-rpm", raw, "--raw-per-rpm-s", raw,
        )  # fmt: skip
        yield Aim("scales stated from a data sheet", stated.returncode == 0)
        with product.running(
            "jog", _BUS, "--server", _SERVER, "--seconds", "20", "--speed", str(_RPM), "--travel",
            "100", "--cycle-us", "2000",
        ), httpx.Client(base_url=f"{_SERVER}/api/v1", timeout=20.0) as client:  # fmt: skip
            yield from _jogged_and_stopped(client)


def _jogged_and_stopped(client: httpx.Client) -> Iterator[Aim]:
    deadline, speed = time.monotonic() + 30.0, 0.0
    while speed < 0.5 * _RPM and time.monotonic() < deadline:
        time.sleep(0.1)
        speed = abs(_state(client)["velocity"] or 0.0)
    yield Aim(f"jog: {speed:.0f} rpm", speed >= 0.5 * _RPM)
    answer = client.post("/stop", json={}).json()["axes"][0]
    before = _state(client)["position"]
    yield Aim(f"STOP: {answer['verdict']}, {answer['took_s']} s", answer["verdict"] == "stopped")
    time.sleep(1.0)
    moved = abs(_state(client)["position"] - before)
    yield Aim(f"the shaft after STOP: {moved:.4f} rev", moved < _STOOD_REV)


def _state(client: httpx.Client) -> dict[str, Any]:
    """Position [rev], speed [rpm] and more."""
    drive = client.get("/drives").json()[0]["id"]
    state: dict[str, Any] = client.get(f"/drives/{drive}/state").json()
    return state


def _last(printed: str) -> str:
    lines = [line for line in printed.splitlines() if line.strip()]
    return re.sub(r"\s+", " ", lines[-1]) if lines else "nothing"


def inside(folder: Path, esi: Path) -> int:
    """What is run in the private network."""
    product = Product(folder)
    return 0 if print_verdict([*by_command(product, esi), *by_server(product)]) else 1


def outside(source: Path, headers: Path, folder: Path) -> int:
    """Build, and run the simulator and the product on one virtual cable."""
    configs = source / "simulation" / "slave_configs"
    program = built(source, headers, folder)
    with Namespace.create() as network:
        config = str(configs / "ecat402-drive.json")
        slave = network.popen([str(program), "-i", "ec0s", "-s", config], stdout=subprocess.DEVNULL)
        try:
            here = [sys.executable, "-m", "benchmarks.independent_slave", "--inside", str(folder)]
            return network.popen([*here, "--esi", str(configs / "ecat402-drive.xml")]).wait()
        finally:
            slave.kill()
            slave.wait()


def main() -> int:
    """Print which aims were met."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.independent_slave")
    parser.add_argument("--kickcat", type=Path, help="checkout of KickCAT")
    parser.add_argument("--argparse", type=Path, help="checkout of p-ranav/argparse")
    parser.add_argument("--build", type=Path, help="folder that is kept; default: temporary")
    parser.add_argument("--inside", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--esi", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.inside is not None:
        return inside(options.inside, options.esi)
    if options.kickcat is None or options.argparse is None:
        print("not run: --kickcat and --argparse name the checkouts that it is built from")
        return 0
    if options.build is not None:
        return outside(options.kickcat, options.argparse, options.build)
    with tempfile.TemporaryDirectory(prefix="servodeck-slave-") as folder:
        return outside(options.kickcat, options.argparse, Path(folder))


if __name__ == "__main__":
    raise SystemExit(main())
