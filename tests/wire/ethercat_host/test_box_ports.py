"""A station in the cabinet from its first start: two ports in a network of its own, nobody yet.

It is started with the unit's own command line, and set up over HTTPS by way of the office's port.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from drivers.virtual.wires.ethercat.launch import VirtualSegment
from drivers.virtual.wires.netns import Namespace, child_environment, unavailable
from tests.wire.ethercat_host.conftest import FACTORY

CLIENT = Path(__file__).with_name("box_client.py")
MISSING = unavailable() or ("" if shutil.which("ip") else "ip (iproute2) is not here")
ADDRESS = "10.11.12.1"
#: The ports of the namespace stand in /sys too, as those of a computer do.
WITH_SYS = ("unshare", "--mount", "sh", "-c", 'mount -t sysfs sysfs /sys && exec "$@"', "sh")

pytestmark = pytest.mark.skipif(bool(MISSING), reason=MISSING)


@pytest.fixture(scope="module")
def network() -> Iterator[Namespace]:
    """EtherCAT on ec0m; the office on off0, which alone has an address."""
    with Namespace.create([("ec0m", "ec0s"), ("off0", "off1")]) as namespace:
        for command in (
            ["ip", "link", "set", "lo", "up"],
            ["ip", "addr", "add", f"{ADDRESS}/24", "dev", "off0"],
        ):
            subprocess.run(namespace.command(command), check=True, env=child_environment())
        arguments = ["--factory", FACTORY, "--lockstep", "--drive", "serial=7"]
        segment = VirtualSegment.start("ec0s", arguments, namespace)
        yield namespace
        segment.close()


@contextmanager
def started(network: Namespace, state: Path) -> Iterator[tuple[int, list[str]]]:
    """The station: its port, and what is on its console when it answers."""
    process = subprocess.Popen(
        network.command([*WITH_SYS, sys.executable, "-m", "backend", "serve", "--bind", "0.0.0.0",
                         "--port", "0", "--config", str(state)]),
        cwd=state.parent, env=child_environment(), text=True,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    )  # fmt: skip
    assert process.stdout is not None
    try:
        printed: list[str] = []
        end = "SHA-256" if (state / "box.json").exists() else "scan this"
        for line in process.stdout:
            printed.append(line.rstrip("\n"))
            if end in line:
                break
        port = re.search(r"https://[^:/]+:(\d+)/", "\n".join(printed))
        assert port is not None, printed
        yield int(port[1]), printed
    finally:
        process.terminate()
        process.communicate()


def asked(network: Namespace, port: int, *said: str) -> dict[str, Any]:
    done = subprocess.run(
        network.command([sys.executable, str(CLIENT), f"https://{ADDRESS}:{port}", *said]),
        capture_output=True,
        text=True,
        check=False,
        env=child_environment(),
    )
    assert done.returncode == 0, done.stderr
    answer: dict[str, Any] = json.loads(done.stdout)
    return answer


@pytest.mark.long
def test_from_the_first_start_to_the_first_drive(network: Namespace, tmp_path: Path) -> None:
    state = tmp_path / "state"
    with started(network, state) as (port, printed):
        code = printed[
            next(n for n, line in enumerate(printed) if "asks for this code" in line) + 1
        ]
        # A phone finds no host name; the address is that of the port which faces the network.
        assert f"https://{ADDRESS}:{port}/" in printed[-1]
        found = asked(network, port, code.strip(), "ec0m", "off0", "Cabinet-3")
    before = {key: status for key, status in found.items() if key.startswith("before ")}
    assert set(before.values()) == {401}
    assert (found["wrong code"], found["set up"], found["second"]) == (403, 201, 403)

    assert found["box"]["configured"] is False
    ports = {one["name"]: one for one in found["box"]["ports"]}
    assert ports["off0"]["addresses"] == [ADDRESS]
    assert [name for name, one in ports.items() if one["here"]] == ["off0"]
    assert found["cut off"]["code"] == "station.box-port-of-this-page"

    assert found["roles"]["status"] == 200
    assert {key: found["roles"]["said"][key] for key in ("name", "ethercat", "office")} == {
        "name": "cabinet-3",
        "ethercat": "ec0m",
        "office": "off0",
    }
    refused = found["scan of the office"]
    assert refused["said"]["state"] == "failed"
    assert refused["said"]["problem"]["code"] == "station.box-office-port"
    assert found["scan of the drives"]["said"]["state"] == "done"

    with started(network, state) as (port, printed):
        assert not any("code" in line for line in printed)
        found = asked(network, port, "resolve", "", "", "cabinet-3")
    assert found == {"resolved": [ADDRESS], "by name": 200, "trusted": ["cabinet-3.local"]}
