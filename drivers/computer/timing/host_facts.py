"""Facts about this computer that determine its timing: read from kernel files, not evaluated.

Sources: proc(5), sysfs-devices-system-cpu and sysfs-class-net (Documentation/ABI of Linux).
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from drivers.computer.network.ethtool import read_card
from drivers.computer.network.sockets import interface_flags

Preemption = Literal["rt", "full", "dynamic", "voluntary", "unknown"]
_CAPABILITY_BITS = {"CAP_NET_ADMIN": 12, "CAP_NET_RAW": 13, "CAP_IPC_LOCK": 14, "CAP_SYS_NICE": 23}
_DHCP_CLIENTS = ("dhclient", "dhcpcd", "udhcpc")
_BUSY_SAMPLE_S = 0.3
_IFF_UP = 1


@dataclass(frozen=True, slots=True)
class IdleState:
    """A C-state that is not disabled: its exit latency, and the files that disable it."""

    name: str
    latency_us: int
    switches: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Port:
    """A network interface as a port for EtherCAT; None for facts that the system does not state."""

    name: str
    exists: bool
    up: bool = False
    carrier: bool | None = None
    wireless: bool = False
    managed_by: str = ""
    dhcp_by: str = ""
    carries_ip: bool = False
    card: Mapping[str, int] = field(default_factory=dict)
    interrupts: Mapping[int, tuple[int, ...]] = field(default_factory=dict)
    """Cores that may handle an interrupt, by interrupt number."""


@dataclass(frozen=True, slots=True)
class HostFacts:
    """This computer; shares are 0…1, times µs. ``port`` is None if no interface was given."""

    kernel: str
    preemption: Preemption
    cores: int
    busy: tuple[float, ...]
    stolen: float
    governors: Mapping[str, str]
    """Governors by the file that sets them."""
    idle_states: tuple[IdleState, ...]
    capabilities: frozenset[str]
    fifo_allowed: bool
    memory_lock_allowed: bool
    discharging: bool
    interrupts_balanced: bool
    port: Port | None


@dataclass(frozen=True, slots=True)
class Computer:
    """Source of the facts: the real system, or a folder with the same layout (tests)."""

    root: Path = Path("/")
    read_card: Callable[[str], Mapping[str, int]] = read_card
    wait: Callable[[], None] = lambda: time.sleep(_BUSY_SAMPLE_S)
    interface_flags: Callable[[str], int] = interface_flags
    """Interface flags in the network namespace of this process; /sys may show another one's."""

    def facts(self, interface: str = "") -> HostFacts:
        """Read all facts. Takes about 0.3 s to measure the load of the cores."""
        before = self._times()
        self.wait()
        busy, stolen = _shares(before, self._times())
        version = self.text("proc/version")
        held = self._capabilities()
        limits = self.text("proc/self/limits")
        processes = self._processes()
        return HostFacts(
            kernel=self.text("proc/sys/kernel/osrelease"),
            preemption=_preemption(version, self.text("sys/kernel/realtime")),
            cores=len(busy),
            busy=busy,
            stolen=stolen,
            governors={
                self._path(file): self.text(self._path(file))
                for file in self._files("sys/devices/system/cpu", "cpu*/cpufreq/scaling_governor")
            },
            idle_states=self._idle_states(),
            capabilities=held,
            fifo_allowed="CAP_SYS_NICE" in held or _limit(limits, "Max realtime priority") > 0,
            memory_lock_allowed="CAP_IPC_LOCK" in held
            or _limit(limits, "Max locked memory") == float("inf"),
            discharging=self._discharging(),
            interrupts_balanced=any(command[:1] == ["irqbalance"] for command in processes),
            port=self._port(interface, processes) if interface else None,
        )

    def text(self, path: str) -> str:
        """Return the file's content without the end of line; empty without the file."""
        try:
            return (self.root / path).read_text("utf-8", "replace").strip()
        except OSError:
            return ""

    def write(self, path: str, value: str) -> None:
        """Set one of the kernel's switches.

        Raises:
            OSError: not permitted, not present, or not accepted.
        """
        (self.root / path).write_text(value, "utf-8")

    def _path(self, file: Path) -> str:
        return file.relative_to(self.root).as_posix()

    def _files(self, folder: str, pattern: str) -> list[Path]:
        return sorted((self.root / folder).glob(pattern))

    def _times(self) -> list[list[int]]:
        """Return per core: user, nice, system, idle, iowait, irq, softirq, steal [ticks]."""
        lines = self.text("proc/stat").splitlines()
        found = (re.match(r"cpu\d+ (.*)", line) for line in lines)
        return [[int(number) for number in one[1].split()[:8]] for one in found if one]

    def _capabilities(self) -> frozenset[str]:
        found = re.search(r"^CapEff:\s*([0-9a-f]+)", self.text("proc/self/status"), re.MULTILINE)
        held = int(found[1], 16) if found else 0
        return frozenset(name for name, bit in _CAPABILITY_BITS.items() if held >> bit & 1)

    def _idle_states(self) -> tuple[IdleState, ...]:
        found: dict[str, tuple[int, list[str]]] = {}
        for switch in self._files("sys/devices/system/cpu", "cpu*/cpuidle/state*/disable"):
            if self.text(self._path(switch)) != "0":
                continue
            state = self._path(switch.parent)
            latency = self.text(f"{state}/latency")
            known = found.setdefault(self.text(f"{state}/name"), (int(latency or 0), []))
            known[1].append(self._path(switch))
        return tuple(IdleState(name, us, tuple(files)) for name, (us, files) in found.items())

    def _discharging(self) -> bool:
        supplies = self._files("sys/class/power_supply", "*/type")
        return any(
            self.text(self._path(one)) == "Battery"
            and self.text(self._path(one.parent / "status")) == "Discharging"
            for one in supplies
        )

    def _processes(self) -> list[list[str]]:
        """Return command lines; the program without its folder."""
        found = []
        for file in (self.root / "proc").glob("[0-9]*/cmdline"):
            try:
                words = file.read_text("utf-8", "replace").rstrip("\0").split("\0")
            except OSError:
                continue
            found.append([words[0].rpartition("/")[2], *words[1:]])
        return found

    def _port(self, name: str, processes: list[list[str]]) -> Port:
        folder = f"sys/class/net/{name}"
        try:
            flags = self.interface_flags(name)
        except OSError:
            return Port(name, exists=False)
        index = self.text(f"{folder}/ifindex")
        carrier = self.text(f"{folder}/carrier")
        return Port(
            name,
            exists=True,
            up=bool(flags & _IFF_UP),
            carrier=carrier == "1" if carrier else None,
            wireless=(self.root / folder / "wireless").exists(),
            managed_by=self._manager(index),
            dhcp_by=self._dhcp_client(name, index, processes),
            carries_ip=any(
                line.split()[0] == name for line in self.text("proc/net/route").splitlines() if line
            ),
            card=self.read_card(name),
            interrupts=self._interrupts(name),
        )

    def _manager(self, index: str) -> str:
        """Return the service that configures the interface automatically."""
        state = self.text(f"run/NetworkManager/devices/{index}")
        return "NetworkManager" if re.search(r"^managed=(true|full)$", state, re.MULTILINE) else ""

    def _dhcp_client(self, name: str, index: str, processes: list[list[str]]) -> str:
        # /sys can show the interfaces of another network namespace: then the index is unknown.
        if index and (self.root / f"run/systemd/netif/leases/{index}").exists():
            return "systemd-networkd"
        clients = (one[0] for one in processes if one[0] in _DHCP_CLIENTS and name in one[1:])
        return next(clients, "")

    def _interrupts(self, name: str) -> dict[int, tuple[int, ...]]:
        found = {}
        for line in self.text("proc/interrupts").splitlines():
            entry = re.match(rf"\s*(\d+):.*\b{re.escape(name)}(?:-\S*)?$", line)
            if entry is not None:
                listed = self.text(f"proc/irq/{entry[1]}/smp_affinity_list")
                found[int(entry[1])] = _cores(listed)
        return found


def _preemption(version: str, realtime: str) -> Preemption:
    if realtime == "1" or "PREEMPT_RT" in version:
        return "rt"
    if "PREEMPT_DYNAMIC" in version:
        return "dynamic"
    if "PREEMPT" in version:
        return "full"
    return "voluntary" if version else "unknown"


def _limit(limits: str, name: str) -> float:
    """Return a soft limit of /proc/self/limits."""
    found = re.search(rf"^{name}\s+(\S+)", limits, re.MULTILINE)
    if found is None:
        return 0.0
    return float("inf") if found[1] == "unlimited" else float(found[1])


def _shares(before: list[list[int]], after: list[list[int]]) -> tuple[tuple[float, ...], float]:
    """Return the busy share of each core, and the stolen share of all of them."""
    busy, stolen, whole = [], 0, 0
    for old, new in zip(before, after, strict=False):
        passed = [late - early for early, late in zip(old, new, strict=False)]
        total = sum(passed)
        idle = passed[3] + passed[4]
        busy.append((total - idle) / total if total > 0 else 0.0)
        stolen += passed[7] if len(passed) > 7 else 0
        whole += total
    return tuple(busy), stolen / whole if whole > 0 else 0.0


def _cores(listed: str) -> tuple[int, ...]:
    """Return ``0-2,5`` as 0, 1, 2, 5."""
    found: list[int] = []
    for part in filter(None, listed.split(",")):
        first, _, last = part.partition("-")
        found += range(int(first), int(last or first) + 1)
    return tuple(found)
