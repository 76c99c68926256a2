"""Missing permissions for a real interface, and the exact commands that grant them on Linux.

SOEM opens a raw packet socket (CAP_NET_RAW) and switches the interface to promiscuous mode
(CAP_NET_ADMIN): both are required. CAP_SYS_NICE and CAP_IPC_LOCK only improve the timing of cycles.
Windows and macOS need a packet capture library instead: see
`drivers.computer.network.packet_capture`.
"""

from __future__ import annotations

import socket
import sys
from dataclasses import dataclass
from pathlib import Path

from drivers.computer.network.packet_capture import adapters, capture_state
from drivers.computer.network.sockets import interface_flags
from drivers.texts.message import Text, joined, text

NEEDED = {"CAP_NET_RAW": 13, "CAP_NET_ADMIN": 12}
USEFUL = {"CAP_SYS_NICE": 23, "CAP_IPC_LOCK": 14}
_IFF_UP = 1


@dataclass(frozen=True, slots=True)
class Permissions:
    """``missing`` prevents EtherCAT, ``advised`` improves its timing; both capability names.

    ``capture`` is why the packet capture library cannot be used, ``capture_remedy`` the remedy.
    """

    interface: str
    exists: bool
    up: bool
    missing: tuple[str, ...]
    advised: tuple[str, ...]
    commands: tuple[str, ...]
    capture: Text | None = None
    capture_remedy: Text | None = None

    @property
    def ready(self) -> bool:
        """Whether EtherCAT can be opened on this interface."""
        return self.exists and self.up and not self.missing and self.capture is None

    @property
    def text(self) -> Text:
        """Everything missing, as one message for the user."""
        if self.capture is not None:
            return self.capture
        if not self.exists:
            return text("computer.no-interface", interface=self.interface)
        parts = []
        if len(self.missing) == len(NEEDED):
            first, second = self.missing
            parts.append(text("computer.capabilities-missing", first=first, second=second))
        else:
            parts += [text("computer.capability-missing", name=name) for name in self.missing]
        if not self.up:
            parts.append(text("computer.interface-off", interface=self.interface))
        return joined(parts) if parts else text("computer.everything-granted")


def check(interface: str, *, status: str | None = None, python: str | None = None) -> Permissions:
    """Check the capabilities of this process and the interface.

    On systems other than Linux, check the packet capture library and its list of adapters.
    ``status`` is the text of /proc/self/status and ``python`` the interpreter's path, set only by
    tests.
    """
    if status is None and sys.platform != "linux":
        return captured(interface)
    read = Path("/proc/self/status").read_text("ascii") if status is None else status
    held = _effective(read)
    missing = tuple(name for name, bit in NEEDED.items() if not held >> bit & 1)
    advised = tuple(name for name, bit in USEFUL.items() if not held >> bit & 1)
    exists = interface in {name for _, name in socket.if_nameindex()}
    up = exists and _is_up(interface)
    commands = []
    if missing:
        names = ",".join(name.lower() for name in (*NEEDED, *USEFUL))
        path = str(Path(sys.executable if python is None else python).resolve())
        commands.append(f"sudo setcap {names}+ep {path}")
        caps = ",".join(f"+{name.removeprefix('CAP_').lower()}" for name in (*NEEDED, *USEFUL))
        commands.append(
            f"sudo setpriv --reuid $USER --init-groups --inh-caps {caps} --ambient-caps {caps}"
            " servodeck serve"
        )
    if exists and not up:
        commands.append(f"sudo ip link set {interface} up")
    return Permissions(interface, exists, up, missing, advised, tuple(commands))


def captured(interface: str) -> Permissions:
    """Check the packet capture library, and the adapter in its list."""
    state = capture_state()
    if not state.ready:
        exists = True  # not known yet
        return Permissions(interface, exists, exists, (), (), (), state.text, state.remedy)
    exists = any(one.name == interface for one in adapters())
    return Permissions(interface, exists, exists, (), (), ())


def _effective(status: str) -> int:
    for line in status.splitlines():
        if line.startswith("CapEff:"):
            return int(line.split()[1], 16)
    return 0


def _is_up(interface: str) -> bool:
    """Return IFF_UP by ioctl: /sys may show another network namespace's interfaces."""
    try:
        return bool(interface_flags(interface) & _IFF_UP)
    except OSError:
        return False
