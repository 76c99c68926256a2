"""Linux namespaces: entering those of another process, and creating new ones.

Only light modules are imported: a namespace can be changed only while there is one thread.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys
from pathlib import Path

_CLONE_NEWUSER = 0x10000000
_CLONE_NEWNET = 0x40000000
#: Whether the system has network namespaces.
AVAILABLE = sys.platform == "linux"


def enter_namespaces(pid: int) -> None:
    """Move this process into the user and network namespace of ``pid``.

    Raises:
        OSError: not permitted, more than one thread, or no such process; ``filename`` states which
            namespace.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    for kind, flag in (("user", _CLONE_NEWUSER), ("net", _CLONE_NEWNET)):
        path = Path(f"/proc/{pid}/ns/{kind}")
        if path.samefile(f"/proc/self/ns/{kind}"):
            continue
        handle = os.open(path, os.O_RDONLY)
        try:
            if libc.setns(handle, flag):
                code = ctypes.get_errno()
                raise OSError(code, os.strerror(code), str(path))
        finally:
            os.close(handle)


def leave_namespaces() -> None:
    """Create a new user and network namespace; without user namespaces, as root, the network only.

    Raises:
        OSError: the system forbids both.
    """
    if sys.platform == "linux":
        libc = ctypes.CDLL(None, use_errno=True)
        uid, gid = os.geteuid(), os.getegid()
        if libc.unshare(_CLONE_NEWUSER | _CLONE_NEWNET) == 0:
            # The kernel requires that setgroups is denied before an ordinary user may map a group.
            Path("/proc/self/setgroups").write_text("deny", encoding="ascii")
            Path("/proc/self/uid_map").write_text(f"0 {uid} 1", encoding="ascii")
            Path("/proc/self/gid_map").write_text(f"0 {gid} 1", encoding="ascii")
            return
        code = ctypes.get_errno()
        if libc.unshare(_CLONE_NEWNET):
            raise OSError(code, f"the system forbids user namespaces ({os.strerror(code)})")
    else:
        raise OSError("network namespaces exist on Linux only")


def disable_ipv6(interface: str) -> None:
    """Disable IPv6 on an interface of this namespace; no effect in a kernel without IPv6."""
    with contextlib.suppress(OSError):
        path = Path(f"/proc/sys/net/ipv6/conf/{interface}/disable_ipv6")
        path.write_text("1", encoding="ascii")
