"""A computer in a folder: the kernel's files as Linux has them, with whatever is wrong with it."""

from __future__ import annotations

import errno
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from drivers.computer.timing.host_facts import Computer

#: linux/capability.h: NET_ADMIN 12, NET_RAW 13, IPC_LOCK 14, SYS_NICE 23.
ALL = 1 << 12 | 1 << 13 | 1 << 14 | 1 << 23
_IDLE = "cpu{core} {busy} 0 0 {idle} 0 0 0 {steal} 0 0\n"


@dataclass
class FakeComputer:
    """A good computer for EtherCAT on eth1; change a file, then ask for its `facts`."""

    root: Path
    card: dict[str, int] = field(
        default_factory=lambda: {"rx-usecs": 0, "tx-usecs": 0, "gro": 0, "lro": 0}
    )
    interfaces: set[str] = field(default_factory=lambda: {"lo", "eth1"})
    flags: int = 1
    busy: tuple[float, float] = (0.05, 0.05)
    steal: float = 0.0

    def __post_init__(self) -> None:
        self.write("proc/version", "Linux version 6.12.0 #1 SMP PREEMPT_DYNAMIC")
        self.write("proc/sys/kernel/osrelease", "6.12.0")
        self.capabilities(ALL)
        self.write(
            "proc/self/limits",
            "Max realtime priority     0     0\n"
            "Max locked memory         8388608      8388608     bytes\n",
        )
        for core in (0, 1):
            cpu = f"sys/devices/system/cpu/cpu{core}"
            self.write(f"{cpu}/cpufreq/scaling_governor", "performance")
            for number, (name, latency) in enumerate([("POLL", 0), ("C1", 2), ("C6", 133)]):
                self.write(f"{cpu}/cpuidle/state{number}/name", name)
                self.write(f"{cpu}/cpuidle/state{number}/latency", str(latency))
                self.write(f"{cpu}/cpuidle/state{number}/disable", "1" if latency > 20 else "0")
        net = "sys/class/net/eth1"
        self.write(f"{net}/ifindex", "3")
        self.write(f"{net}/carrier", "1")
        self.write("proc/net/route", "Iface\tDestination\neth0\t00000000")
        self.write(
            "proc/interrupts",
            "            CPU0       CPU1\n"
            " 41:    100      0  PCI-MSI 524288-edge      eth1-TxRx-0\n",
        )
        self.write("proc/irq/41/smp_affinity_list", "0")

    def write(self, path: str, text: str) -> None:
        file = self.root / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)

    def read(self, path: str) -> str:
        return (self.root / path).read_text()

    def capabilities(self, held: int) -> None:
        self.write("proc/self/status", f"Name:\tpython\nCapEff:\t{held:016x}\n")

    def process(self, number: int, *command: str) -> None:
        self.write(f"proc/{number}/cmdline", "\0".join(command) + "\0")

    def write_card(self, interface: str, name: str, value: int) -> None:
        assert interface == "eth1"
        self.card[name] = value

    def _flags(self, name: str) -> int:
        if name not in self.interfaces:
            raise OSError(errno.ENODEV, "No such device")
        return self.flags

    def _card(self, interface: str) -> Mapping[str, int]:
        return dict(self.card) if interface == "eth1" else {}

    def _stat(self, ticks: int) -> None:
        lines = [
            _IDLE.format(
                core=core,
                busy=round(ticks * share),
                steal=round(ticks * self.steal),
                idle=round(ticks * (1 - share - self.steal)),
            )
            for core, share in enumerate(self.busy)
        ]
        self.write("proc/stat", "cpu  0 0 0 0 0 0 0 0 0 0\n" + "".join(lines))

    @property
    def computer(self) -> Computer:
        self._stat(1000)
        return Computer(self.root, self._card, lambda: self._stat(2000), self._flags)
