"""The registry of Windows, below HKEY_LOCAL_MACHINE; on another system it has no keys."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Protocol

RegistryValue = Callable[[str, str], str | int | None]
"""A value by key and name; None if it does not exist."""


class Registry(Protocol):
    """Keys below HKEY_LOCAL_MACHINE."""

    def keys(self, key: str) -> list[str]:
        """Return the names of the keys in a key; empty if it does not exist or is not readable."""

    def value(self, key: str, name: str) -> str | int | None:
        """Return a value; None if it does not exist, is not readable, or of another type."""

    def write(self, key: str, name: str, number: int) -> None:
        """Set a number (REG_DWORD) in a key that exists.

        Raises:
            OSError: the key does not exist; PermissionError: not an administrator.
        """


class WindowsRegistry:
    """The registry of this computer; without any key on another system."""

    def keys(self, key: str) -> list[str]:
        """See `Registry.keys`."""
        found: list[str] = []
        if sys.platform == "win32":
            import winreg

            try:
                with winreg.OpenKey(winreg.HKEY_LOCAL_MACHINE, key) as opened:
                    count = winreg.QueryInfoKey(opened)[0]
                    found.extend(winreg.EnumKey(opened, number) for number in range(count))
            except OSError:
                return []
        return found

    def value(self, key: str, name: str) -> str | int | None:
        """See `Registry.value`."""
        if sys.platform == "win32":
            import winreg

            try:
                with winreg.OpenKey(winreg.HKEY_LOCAL_MACHINE, key) as opened:
                    value, _ = winreg.QueryValueEx(opened, name)
            except OSError:
                return None
            return value if isinstance(value, str | int) else None
        return None

    def write(self, key: str, name: str, number: int) -> None:
        """See `Registry.write`."""
        if sys.platform == "win32":
            import winreg

            access = winreg.KEY_SET_VALUE
            with winreg.OpenKey(winreg.HKEY_LOCAL_MACHINE, key, 0, access) as opened:
                winreg.SetValueEx(opened, name, 0, winreg.REG_DWORD, number)
        else:
            raise OSError("there is no registry on this system")


REGISTRY = WindowsRegistry()
