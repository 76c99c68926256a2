"""Settings of kernel and network cards that are read, changed and restored."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from drivers.computer.network.ethtool import SETTINGS, write_card
from drivers.computer.timing.host_facts import Computer

#: Only these are ever written, whatever a restore list on the disk contains.
_FILES = ("sys/devices/system/cpu/", "proc/irq/")


@dataclass(frozen=True, slots=True)
class Setting:
    """One setting: ``card`` is the interface of the card, empty for a file of the kernel.

    Raises:
        ValueError: neither a setting of a card nor one of the files that may be written.
    """

    place: str
    card: str = ""

    def __post_init__(self) -> None:
        known = self.place in SETTINGS if self.card else self.place.startswith(_FILES)
        if not known or ".." in self.place.split("/"):
            raise ValueError(f"{self.place!r} is no setting that servodeck changes")

    def __str__(self) -> str:
        return f"{self.place} of {self.card}" if self.card else f"/{self.place}"


def affinity(interrupt: int) -> Setting:
    """Return the setting for the cores that handle an interrupt (/proc/irq/N/smp_affinity_list)."""
    return Setting(f"proc/irq/{interrupt}/smp_affinity_list")


def command(setting: Setting, value: str) -> str:
    """Return the command that sets it by hand."""
    if not setting.card:
        return f"echo {value} | sudo tee /{setting.place}"
    if setting.place.endswith("usecs"):
        return f"sudo ethtool -C {setting.card} {setting.place} {value}"
    return f"sudo ethtool -K {setting.card} {setting.place} {'on' if value == '1' else 'off'}"


@dataclass(frozen=True, slots=True)
class HostSettings:
    """The settings of one computer."""

    computer: Computer = field(default_factory=Computer)
    write_card: Callable[[str, str, int], None] = write_card

    def read(self, setting: Setting) -> str:
        """Return the present value; empty if the setting does not exist."""
        if setting.card:
            return str(self.computer.read_card(setting.card).get(setting.place, ""))
        return self.computer.text(setting.place)

    def write(self, setting: Setting, value: str) -> None:
        """Set it.

        Raises:
            OSError: not permitted, not present, or not accepted.
        """
        if setting.card:
            self.write_card(setting.card, setting.place, int(value))
        else:
            self.computer.write(setting.place, value)
