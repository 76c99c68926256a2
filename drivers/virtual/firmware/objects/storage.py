"""Sources of parameter values at power-on, and their storage."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from drivers.virtual.device import ABORT_STORE, SdoAbort
from drivers.virtual.firmware.cia402.base import Family
from drivers.virtual.firmware.objects.dictionary import Entry, ObjectDictionary
from drivers.virtual.firmware.objects.nvm import Nvm
from drivers.virtual.firmware.objects.settings import MotorData
from drivers.virtual.mechanics import MechanicsSpec
from profiles.schema import Profile, Raw

#: Setpoints and commands, which no drive stores.
VOLATILE: Final = frozenset(
    f"{index:04X}:00"
    for index in (0x6040, 0x6060, 0x607A, 0x60FF, 0x6071, 0x60B0, 0x60B1, 0x60B2, 0x60B8)
) | {"60FE:01", "60FE:02"}


class Storage:
    """Printed defaults, the factory settings for this motor, and the NVM over both."""

    def __init__(
        self,
        profile: Profile,
        family: Family,
        od: ObjectDictionary,
        mechanics: MechanicsSpec,
        motor: MotorData,
        nvm_path: Path | None,
    ) -> None:
        self._printed = profile.by_key
        self._family = family
        self._od = od
        self._mechanics = mechanics
        self._motor = motor
        self._volatile = VOLATILE | set(family.traits.commands)
        self.nvm = Nvm(nvm_path)
        self.writes = 0
        """Number of writes to the memory since the drive was created; it wears out (Er.013)."""

    def power_on(self) -> None:
        """Set every value as after switching on."""
        for entry in self._od:
            entry.value = entry.active = entry.default()
        self._load_factory()
        self._od.load(self.nvm.load())

    def _load_factory(self) -> None:
        fallback = self._family.fallback_values(self._motor)
        self._od.load(
            {
                key: value
                for key, value in fallback.items()
                if key not in self._printed or self._printed[key].default_raw is None
            }
        )
        self._od.load(self._family.factory_values(self._mechanics, self._motor))

    def changed_share(self) -> float:
        """Return the share of the storable values that differ from the stored ones, 0 to 1."""
        stored = self.nvm.load()
        entries = [e for e in self._od if e.parameter.access == "rw"]
        changed = sum(e.value != stored.get(e.key, e.default()) for e in entries)
        return changed / max(len(entries), 1)

    def save(self) -> None:
        """Save all writable parameters to the NVM. Raises SdoAbort if it cannot be written."""
        self._store(
            {
                entry.key: entry.value
                for entry in self._od
                if entry.parameter.access == "rw" and entry.key not in self._volatile
            }
        )

    def restore(self) -> None:
        """Restore factory values, in use and in the NVM. Raises SdoAbort on failure."""
        self._store({})
        for entry in self._od:
            if entry.parameter.access != "ro" and entry.key not in self._volatile:
                entry.value = entry.active = entry.default()
        self._load_factory()

    def autosave(self, entry: Entry) -> None:
        """Store a single written value in families that do so, as their EEPROM does."""
        index = entry.parameter.index
        if index is None or entry.key in self._volatile or entry.parameter.access != "rw":
            return
        for rule in self._family.traits.autosave:
            inside = rule.first_index <= index <= rule.last_index
            if inside and int(self._od.number(rule.key)) & rule.mask:
                self._store(self.nvm.load() | {entry.key: entry.value})
                return

    def _store(self, values: dict[str, Raw]) -> None:
        self.writes += 1
        if self.writes > self._family.traits.eeprom_writes:
            raise SdoAbort(ABORT_STORE)
        try:
            self.nvm.save(values)
        except OSError:
            raise SdoAbort(ABORT_STORE) from None
