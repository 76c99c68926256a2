"""The registry of a computer with Windows, and the module `winreg` over it, for tests on Linux.

Keys and values are those of real computers: FTDI's knowledge base ("Setting a Custom Default
Latency Timer Value") has the keys of FTDIBUS; instances of chips without a serial number and of
chips with several ports are as Device Manager lists them.
"""

from __future__ import annotations

import types
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

Value = str | int | bytes
ENUM = r"SYSTEM\CurrentControlSet\Enum"
SERVICES = r"SYSTEM\CurrentControlSet\Services"
PARAMETERS = "Device Parameters"


@dataclass
class Hive:
    """HKEY_LOCAL_MACHINE: values by key. Names are equal without regard to case."""

    values: dict[str, dict[str, Value]] = field(default_factory=dict)
    unreadable: set[str] = field(default_factory=set)
    administrator: bool = True
    written: list[tuple[str, str, int]] = field(default_factory=list)

    def put(self, key: str, **values: Value) -> None:
        self.values.setdefault(key.upper(), {}).update(values)

    def port(
        self,
        instance: str,
        name: Value,
        ms: Value | None = None,
        *,
        service: str | None = "FTSER2K",
        present: bool = True,
    ) -> str:
        """A port of a chip, with its driver's list of present devices; returns its parameters."""
        key = rf"{ENUM}\{instance}"
        self.put(key, DeviceDesc="@oem9.inf,%desc%;USB Serial Port")
        parameters = rf"{key}\{PARAMETERS}"
        self.put(parameters, PortName=name)
        if ms is not None:
            self.put(parameters, LatencyTimer=ms)
        if service is not None:
            self.put(key, Service=service)
            self.put(
                rf"{SERVICES}\{service}", ImagePath=r"\SystemRoot\system32\drivers\ftser2k.sys"
            )
            if present:
                listed = self.values.setdefault(rf"{SERVICES}\{service}\Enum".upper(), {})
                number = int(str(listed.get("Count", 0)))
                listed.update({str(number): instance, "Count": number + 1})
        return parameters

    def keys(self, key: str) -> list[str]:
        start = f"{key.upper()}\\"
        below = [one[len(start) :] for one in self.values if one.startswith(start)]
        return list(dict.fromkeys(one.partition("\\")[0] for one in below))

    def exists(self, key: str) -> bool:
        return key.upper() in self.values or bool(self.keys(key))


def winreg(hive: Hive) -> types.ModuleType:
    """The module `winreg`, as far as servodeck calls it."""
    module = types.ModuleType("winreg")
    found: dict[str, object] = {
        "HKEY_LOCAL_MACHINE": 0x80000002,
        "KEY_READ": 0x20019,
        "KEY_SET_VALUE": 2,
        "REG_DWORD": 4,
    }

    @contextmanager
    def open_key(root: int, key: str, reserved: int = 0, access: int = 0x20019) -> Iterator[str]:
        assert (root, reserved) == (0x80000002, 0)
        if not hive.exists(key):
            raise FileNotFoundError(2, "The system cannot find the file specified", None, 2)
        if key.upper() in {one.upper() for one in hive.unreadable}:
            raise PermissionError(13, "Access is denied", None, 5)
        if access == 2 and not hive.administrator:
            raise PermissionError(13, "Access is denied", None, 5)
        yield key

    def query_value(key: str, name: str) -> tuple[Value, int]:
        values = {one.upper(): value for one, value in hive.values.get(key.upper(), {}).items()}
        if name.upper() not in values:
            raise FileNotFoundError(2, "The system cannot find the file specified", None, 2)
        value = values[name.upper()]
        return value, {int: 4, str: 1, bytes: 3}[type(value)]

    def set_value(key: str, name: str, reserved: int, kind: int, value: int) -> None:
        assert (reserved, kind) == (0, 4)
        hive.put(key, **{name: value})
        hive.written.append((key, name, value))

    found |= {
        "OpenKey": open_key,
        "QueryInfoKey": lambda key: (len(hive.keys(key)), len(hive.values.get(key.upper(), {})), 0),
        "EnumKey": lambda key, number: hive.keys(key)[number],
        "QueryValueEx": query_value,
        "SetValueEx": set_value,
    }
    module.__dict__.update(found)
    return module
