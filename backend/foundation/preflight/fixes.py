"""Settings of the computer that servodeck changes and restores on request.

The earlier values are on the disk before anything is changed (``preflight-restore.json`` in the
state folder), so that they can be restored after a crash as well. A setting that somebody has
changed since is left as it is. A restart of the computer restores all of them.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from backend.foundation.preflight.findings import Fix
from drivers.computer.timing.host_facts import HostFacts
from drivers.computer.timing.host_settings import HostSettings, Setting, affinity, command
from drivers.errors import NotAllowed
from drivers.texts.message import text
from profiles.replacing import move_into_place

RESTORE_LIST = "preflight-restore.json"
_QUICK_IDLE_US = 20


@dataclass(frozen=True, slots=True)
class Change:
    """A changed setting with its earlier and its new value."""

    fix: Fix
    setting: Setting
    before: str
    after: str


@dataclass(frozen=True, slots=True)
class Undone:
    """Changes that were restored, and those left because somebody had changed the setting since."""

    restored: list[Change]
    left: list[Change]


@dataclass(slots=True)
class Fixes:
    """The fixes of one computer, with the restore list in ``folder``."""

    folder: Path
    settings: HostSettings = field(default_factory=HostSettings)

    def pending(self) -> list[Change]:
        """Changes that can be restored, oldest first.

        Raises:
            NotAllowed: the restore list cannot be read.
        """
        try:
            listed = json.loads((self.folder / RESTORE_LIST).read_text("utf-8"))
            return [_change(one) for one in listed]
        except FileNotFoundError:
            return []
        except (OSError, ValueError, KeyError, TypeError) as error:
            path = self.folder / RESTORE_LIST
            raise NotAllowed(
                "preflight.list-preflight-changed-cannot", value=str(error), path=str(path)
            ) from error

    def apply(self, fix: Fix, interface: str) -> list[Change]:
        """Apply a fix; settings that have the value already are not written.

        Raises:
            NotAllowed: not permitted, or refused by the system; nothing stays changed.
        """
        facts = self.settings.computer.facts(interface)
        wanted = [
            Change(fix, setting, before, after)
            for setting, after in _wanted(fix, facts)
            if (before := self.settings.read(setting)) != after
        ]
        kept = self.pending()
        self._keep([*kept, *wanted])
        done: list[Change] = []
        try:
            for change in wanted:
                self.settings.write(change.setting, change.after)
                done.append(change)
        except OSError as error:
            for made in reversed(done):
                self.settings.write(made.setting, made.before)
            self._keep(kept)
            raise NotAllowed(
                "preflight.cannot-set",
                value=change.after,
                remedy=text(
                    "preflight.as-administrator", command=command(change.setting, change.after)
                ),
                setting=change.setting.place,
                strerror=error.strerror or str(error),
            ) from error
        return wanted

    def undo(self) -> Undone:
        """Restore all changes, the latest first.

        Raises:
            NotAllowed: not permitted; changes that could not be restored stay in the list.
        """
        changes, restored, left = self.pending(), [], []
        while changes:
            change = changes[-1]
            if self.settings.read(change.setting) != change.after:
                left.append(change)
            else:
                try:
                    self.settings.write(change.setting, change.before)
                except OSError as error:
                    raise NotAllowed(
                        "preflight.cannot-restored",
                        value=change.before,
                        setting=change.setting.place,
                        strerror=error.strerror or str(error),
                    ) from error
                restored.append(change)
            changes.pop()
            self._keep(changes)
        return Undone(restored, left)

    def _keep(self, changes: list[Change]) -> None:
        """Write the restore list to the disk, flushed, before anything is changed."""
        listed = [
            {
                "fix": one.fix,
                "place": one.setting.place,
                "card": one.setting.card,
                "before": one.before,
                "after": one.after,
            }
            for one in changes
        ]
        self.folder.mkdir(parents=True, exist_ok=True)
        fresh = self.folder / f".{RESTORE_LIST}.new"
        with fresh.open("w", encoding="utf-8") as file:
            json.dump(listed, file, indent=1)
            file.flush()
            os.fsync(file.fileno())
        move_into_place(fresh, self.folder / RESTORE_LIST)


def _change(kept: dict[str, str]) -> Change:
    setting = Setting(kept["place"], kept["card"])
    return Change(Fix(kept["fix"]), setting, kept["before"], kept["after"])


def _wanted(fix: Fix, facts: HostFacts) -> Iterator[tuple[Setting, str]]:
    """The settings of a fix with their new values."""
    if fix is Fix.GOVERNOR:
        yield from ((Setting(file), "performance") for file in facts.governors)
    elif fix is Fix.IDLE:
        slow = (one for one in facts.idle_states if one.latency_us > _QUICK_IDLE_US)
        yield from ((Setting(file), "1") for one in slow for file in one.switches)
    elif facts.port is not None:
        port = facts.port
        if fix is Fix.INTERRUPTS:
            quiet = min(range(len(facts.busy)), key=lambda core: facts.busy[core], default=0)
            for number in port.interrupts:
                yield affinity(number), str(quiet)
        else:
            names = ("rx-usecs", "tx-usecs") if fix is Fix.COALESCING else ("gro", "lro")
            yield from ((Setting(one, port.name), "0") for one in names if one in port.card)
