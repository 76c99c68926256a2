"""Problems of a real kernel in a private network namespace: each is found and named first.

`tests/unit/preflight` has the same with files in place of a kernel, and those that no virtual
machine has (governor, C-states, coalescing). What this computer has by itself does not count.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from backend.foundation.preflight.findings import Code
from drivers.virtual.wires.netns import Namespace, child_environment, unavailable

ROOT = Path(__file__).resolve().parents[2]
MISSING = unavailable() or ("" if shutil.which("setpriv") else "setpriv (util-linux) is not here")
NAMES = ("net_raw", "net_admin", "sys_nice", "ipc_lock")
LOOK = """\
import json, resource, sys
from backend.foundation.preflight.findings import findings
from drivers.computer.timing.host_facts import Computer
for limit in (resource.RLIMIT_RTPRIO, resource.RLIMIT_MEMLOCK):
    resource.setrlimit(limit, (0, 0))
print(json.dumps([one.code for one in findings(Computer().facts(sys.argv[1]))]))
"""
#: SIOCSIFADDR of netdevice(7), an address for documentation (RFC 5737).
ADDRESS = """\
import fcntl, socket, struct
with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_one:
    fcntl.ioctl(any_one, 0x8916, struct.pack(
        "16sHH4s8x", b"ec0m", socket.AF_INET, 0, socket.inet_aton("198.51.100.1")))
"""
GROUPED = "from drivers.computer.network.ethtool import write_card; write_card('ec0m', 'gro', {})"
LINK = "from drivers.virtual.wires.netns import set_up; set_up('ec0m', {})"

pytestmark = pytest.mark.skipif(bool(MISSING), reason=MISSING)


class Computer:
    """This computer, with a network of its own, as a process with some capabilities sees it."""

    def __init__(self, network: Namespace) -> None:
        self._network = network

    def run(self, script: str) -> None:
        """Change something in the namespace."""
        subprocess.run(
            self._network.command([sys.executable, "-c", script]),
            cwd=ROOT,
            env=child_environment(),
            check=True,
        )

    def found(self, interface: str = "ec0m", without: str = "") -> list[str]:
        """Codes of the findings, in their order."""
        only = ",".join(["-all", *(f"+{name}" for name in NAMES if name != without)])
        done = subprocess.run(
            self._network.command(
                ["setpriv", "--securebits", "+noroot,+noroot_locked", f"--inh-caps={only}",
                 f"--ambient-caps={only}", f"--bounding-set={only}", sys.executable, "-c", LOOK,
                 interface]
            ),
            cwd=ROOT, env=child_environment(), check=True, capture_output=True, text=True,
        )  # fmt: skip
        return [str(code) for code in json.loads(done.stdout)]


@pytest.fixture(scope="module")
def computer() -> Iterator[Computer]:
    with Namespace.create() as network:
        made = Computer(network)
        made.run(GROUPED.format(0))
        yield made


@pytest.fixture(scope="module")
def before(computer: Computer) -> set[str]:
    """What this computer has anyway; stolen time and load come and go."""
    return {*computer.found(), Code.STOLEN_TIME, Code.IRQ_ON_BUSY_CORE}


@contextmanager
def process(*command: str) -> Iterator[None]:
    """A process under the name that ``command`` begins with."""
    started = subprocess.Popen([*command], executable=sys.executable)
    try:
        yield
    finally:
        started.kill()
        started.wait()


def first(found: list[str], before: set[str]) -> str:
    return next(code for code in found if code not in before)


@pytest.mark.long
@pytest.mark.parametrize(
    ("interface", "without", "code"),
    [
        ("nosuch0", "", Code.NO_INTERFACE),
        ("ec0m", "net_raw", Code.MISSING_CAPABILITY),
        ("ec0m", "net_admin", Code.MISSING_CAPABILITY),
        ("ec0m", "ipc_lock", Code.MEMORY_NOT_LOCKED),
    ],
)
def test_an_interface_or_a_capability_that_is_missing(
    computer: Computer, before: set[str], interface: str, without: str, code: Code
) -> None:
    assert code not in before
    assert first(computer.found(interface, without), before) == code


@pytest.mark.long
@pytest.mark.parametrize(
    ("cause", "undo", "code"),
    [
        (LINK.format(False), LINK.format(True), Code.INTERFACE_DOWN),
        (GROUPED.format(1), GROUPED.format(0), Code.GROUPED_FRAMES),
    ],
)
def test_a_setting_of_the_port(
    computer: Computer, before: set[str], cause: str, undo: str, code: Code
) -> None:
    assert code not in before
    computer.run(cause)
    try:
        assert first(computer.found(), before) == code
    finally:
        computer.run(undo)


def test_a_dhcp_client_on_the_port(computer: Computer, before: set[str]) -> None:
    assert Code.DHCP_ON_PORT not in before
    with process("dhclient", "-c", "import time; time.sleep(600)", "ec0m"):
        assert first(computer.found(), before) == Code.DHCP_ON_PORT


def test_without_real_time_priority_a_busy_core_counts(
    computer: Computer, before: set[str]
) -> None:
    assert not {Code.BUSY_CORE, Code.NO_REAL_TIME} & before
    spin = ("spin", "-c", "while True: pass")
    with process(*spin), process(*spin):
        found = computer.found(without="sys_nice")
    new = [code for code in found if code not in before]
    assert new[:2] == [Code.BUSY_CORE, Code.NO_REAL_TIME]


def test_an_address_on_the_port(computer: Computer, before: set[str]) -> None:
    """The last one: the namespace keeps it."""
    assert Code.PORT_CARRIES_IP not in before
    computer.run(ADDRESS)
    assert first(computer.found(), before) == Code.PORT_CARRIES_IP
