"""EtherCAT frames where a process has no raw sockets: Npcap on Windows, bpf(4) on macOS.

SOEM sends and receives through the packet capture library of the system. This module determines
whether that can be used, and which adapters there are. Npcap belongs to the computer and is never
installed by servodeck: its licence does not permit redistribution. Sources: Npcap's own scripts
(FixInstall.bat, CheckStatus.bat: the keys of the registry), its users' guide ("Restrict Npcap
driver's access to Administrators only"), bpf(4) of macOS.
"""

from __future__ import annotations

import ctypes
import os
import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from drivers.computer.registry import REGISTRY, RegistryValue
from drivers.texts.message import Text, text

NPCAP_LEAST = (1, 0)
"""The first version that its authors call stable (2020)."""

_PARAMETERS = r"SYSTEM\CurrentControlSet\Services\npcap\Parameters"
_SERVICE = r"SYSTEM\CurrentControlSet\Services\npcap"
_UNINSTALL = (
    r"SOFTWARE\WOW6432Node\Microsoft\Windows\CurrentVersion\Uninstall\NpcapInst",
    r"SOFTWARE\Microsoft\Windows\CurrentVersion\Uninstall\NpcapInst",
)
_BPF = "/dev/bpf0"
_DEVICE = "\\Device\\"
NPF_NAME = re.compile(r"NPF_\{[0-9A-F]{8}(?:-[0-9A-F]{4}){3}-[0-9A-F]{12}\}", re.IGNORECASE)
"""Form of Windows adapter names in bus URLs: the device's name without its folder."""


class Capture(StrEnum):
    """Whether frames can be sent and received by packet capture."""

    READY = "ready"
    NPCAP_MISSING = "npcap-missing"
    NPCAP_TOO_OLD = "npcap-too-old"
    NPCAP_ADMINISTRATORS = "npcap-administrators"
    BPF_DENIED = "bpf-denied"


@dataclass(frozen=True, slots=True)
class Adapter:
    """``name`` as in bus URLs, ``device`` as opened by SOEM, ``title`` for people."""

    name: str
    device: str
    title: str


@dataclass(frozen=True, slots=True)
class CaptureState:
    """State of the packet capture library, with the version of Npcap found; empty if unknown."""

    capture: Capture
    version: str = ""

    @property
    def ready(self) -> bool:
        """Whether adapters can be opened."""
        return self.capture is Capture.READY

    @property
    def text(self) -> Text:
        """The reason; only valid if it is not ready."""
        if self.capture is Capture.NPCAP_MISSING:
            return text("computer.npcap-missing")
        if self.capture is Capture.NPCAP_TOO_OLD:
            least = ".".join(str(part) for part in NPCAP_LEAST)
            return text("computer.npcap-too-old", version=self.version, least=least)
        if self.capture is Capture.NPCAP_ADMINISTRATORS:
            return text("computer.npcap-administrators")
        return text("computer.bpf-denied", device=_BPF)

    @property
    def remedy(self) -> Text:
        """The remedy; only valid if it is not ready."""
        if self.capture in (Capture.NPCAP_MISSING, Capture.NPCAP_TOO_OLD):
            return text("computer.install-npcap")
        if self.capture is Capture.NPCAP_ADMINISTRATORS:
            return text("computer.allow-npcap")
        return text("computer.allow-bpf")


def npcap_state(registry: RegistryValue, *, administrator: bool) -> CaptureState:
    """Determine the state of Npcap from the registry.

    A version that the registry does not state is accepted.
    """
    if registry(_SERVICE, "ImagePath") is None:
        return CaptureState(Capture.NPCAP_MISSING)
    stated = (registry(key, "DisplayVersion") for key in _UNINSTALL)
    version = next((one for one in stated if isinstance(one, str)), "")
    numbers = tuple(int(part) for part in re.findall(r"\d+", version)[:2])
    if numbers and numbers < NPCAP_LEAST:
        return CaptureState(Capture.NPCAP_TOO_OLD, version)
    if registry(_PARAMETERS, "AdminOnly") == 1 and not administrator:
        return CaptureState(Capture.NPCAP_ADMINISTRATORS, version)
    return CaptureState(Capture.READY, version)


def bpf_state(device: Path = Path(_BPF)) -> CaptureState:
    """Determine whether this user may open the packet filter of macOS."""
    allowed = os.access(device, os.R_OK | os.W_OK)
    return CaptureState(Capture.READY if allowed else Capture.BPF_DENIED)


def capture_state() -> CaptureState:
    """Determine whether frames can be sent and received by packet capture on this computer."""
    if sys.platform == "win32":
        administrator = bool(ctypes.windll.shell32.IsUserAnAdmin())
        return npcap_state(REGISTRY.value, administrator=administrator)
    elif sys.platform == "darwin":  # noqa: RET505 - type checkers follow the branches of a system
        return bpf_state()
    return CaptureState(Capture.READY)


def find_library() -> None:
    """Make Windows find the libraries of an Npcap installed without WinPcap compatibility.

    Only the WinPcap-compatible mode puts them into a folder that is searched.
    """
    if sys.platform == "win32":
        folder = Path(os.environ.get("SYSTEMROOT", r"C:\Windows"), "System32", "Npcap")
        if folder.is_dir():
            os.add_dll_directory(str(folder))


def adapters(found: Sequence[Any] | None = None) -> list[Adapter]:
    """Return the adapters that SOEM can open; empty if the capture library cannot be loaded.

    ``found`` is the result of `pysoem.find_adapters`, set by tests.
    """
    if found is None:
        find_library()
        try:
            import pysoem
        except ImportError:
            return []
        found = pysoem.find_adapters()
    listed = []
    for one in found:
        device = str(one.name)
        title = one.desc.decode("utf-8", "replace") if isinstance(one.desc, bytes) else one.desc
        listed.append(Adapter(device.removeprefix(_DEVICE), device, str(title or device)))
    return listed
