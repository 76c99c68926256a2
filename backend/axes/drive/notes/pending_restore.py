"""The restore list of a drive: values changed for a motion and not restored yet."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Protocol

from backend.axes.drive.readings import Reading
from profiles.schema import Raw


@dataclass(frozen=True, slots=True)
class PendingRestore:
    """One parameter that may still hold a temporary value; raw values.

    ``raw``: value to restore. ``left``: possible values now if nobody changed it since; empty where
    they are not known. ``unapplied``: the value is restored but not in effect, as the drive has not
    been commanded to apply it.
    """

    key: str
    raw: Raw
    left: frozenset[Raw]
    unapplied: bool = False


class Note(Protocol):
    """Callback that stores the list; with ``durable`` it waits for the disk, for a limited time."""

    def __call__(self, *, durable: bool = False) -> None:
        """Store the restores that are outstanding now.

        Raises:
            NotAllowed: they cannot be stored, with ``durable`` (a value is about to change).
        """


def _no_note(*, durable: bool = False) -> None:
    """Default where the list is not stored."""


class PendingRestores:
    """Pending restores of one drive, in order of occurrence. For the event loop only."""

    def __init__(self) -> None:
        self._entries: dict[str, PendingRestore] = {}
        self._temporary: dict[str, list[Raw]] = {}
        self._sent: dict[str, frozenset[Raw]] = {}
        self._listeners: list[Callable[[], None]] = []
        self._note: Note = _no_note

    def __bool__(self) -> bool:
        return bool(self._entries)

    def listen(self, listener: Callable[[], None]) -> None:
        """Call ``listener`` after every change of the list."""
        self._listeners.append(listener)

    def keep(self, note: Note) -> None:
        """Call ``note`` after every change of `outstanding`; durable before a value changes."""
        self._note = note

    def recall(self, entries: Iterable[PendingRestore]) -> None:
        """Take over the entries that an ended process has left."""
        for entry in entries:
            self._entries[entry.key] = entry
            self._sent[entry.key] = entry.left

    @contextmanager
    def temporary(self, values: Mapping[str, Raw]) -> Iterator[None]:
        """Context of a motion that changes these raw values and restores them when it ends.

        Raises:
            NotAllowed: the list cannot be stored on the disk. Nothing may be changed then, as after
                a kill of the process the values to restore would not be known.
        """
        temporary = dict(values)
        known = all(key in self._temporary for key in temporary)
        for key, raw in temporary.items():
            self._temporary.setdefault(key, []).append(raw)
        try:
            if temporary:
                self._note(durable=not known)
            yield
        finally:
            for key in temporary:
                self._temporary[key].pop()
                if not self._temporary[key]:
                    del self._temporary[key]
            self._note()

    @property
    def outstanding(self) -> tuple[PendingRestore, ...]:
        """Restores that would be pending if this process ended now without restoring anything."""
        temporary = {
            key: PendingRestore(key, raws[0], self._sent.get(key, frozenset()))
            for key, raws in self._temporary.items()
        }
        return tuple((temporary | self._entries).values())

    @property
    def in_motion(self) -> bool:
        """Whether a motion is under way that has changed values for its duration."""
        return bool(self._temporary)

    @property
    def entries(self) -> tuple[PendingRestore, ...]:
        """All pending restores."""
        return tuple(self._entries.values())

    @property
    def unapplied(self) -> bool:
        """Whether a restored value is not in effect yet."""
        return any(entry.unapplied for entry in self._entries.values())

    def add(self, values: Mapping[str, Raw], *, unapplied: bool = False) -> None:
        """Add raw values that could not be restored or, with ``unapplied``, not be applied."""
        for key, raw in values.items():
            known = self._entries.get(key)
            left = self._sent.get(key, frozenset())
            raw = self.original(key, raw)  # noqa: PLW2901
            self._entries[key] = PendingRestore(
                key, raw, left | (known.left if known else left), unapplied
            )
        if values:
            self._changed()

    def sent(self, key: str, wanted: Raw, after: Raw | None) -> None:
        """Record a write; ``after`` is the value read back, None where it is not known.

        After a person has written another value, the restore is offered but not carried out
        automatically.
        """
        earlier = self._sent.get(key, frozenset())
        self._sent[key] = earlier | {wanted} if after is None else frozenset({after})
        entry = self._entries.get(key)
        if entry is not None and wanted != entry.raw:
            self._entries[key] = replace(entry, left=frozenset())
        if entry is not None or key in self._temporary:
            self._note()

    def original(self, key: str, raw: Raw) -> Raw:
        """Raw value before all motions that have changed it; ``raw`` where none has."""
        return self._temporary[key][0] if key in self._temporary else raw

    def is_temporary(self, key: str) -> bool:
        """Whether a motion has changed this parameter for its duration and restores it."""
        return key in self._temporary

    def restores(self, key: str, raw: Raw) -> bool:
        """Whether writing this raw value restores a value that a motion has changed."""
        entry = self._entries.get(key)
        return raw in self._temporary.get(key, ()) or (entry is not None and entry.raw == raw)

    def commanded(self, key: str, raw: Raw) -> None:
        """Record a motion object that is about to be written without reading back.

        Of these objects only the mode can be temporary; setpoints and control words are not
        recorded.
        """
        if key in self._temporary or key in self._entries:
            self.sent(key, raw, None)

    def seen(self, readings: Iterable[Reading]) -> None:
        """Remove entries whose parameter holds its original value again, according to readings."""
        entries = self._entries
        gone = [r.key for r in readings if r.key in entries and r.raw == entries[r.key].raw]
        self.settle([key for key in gone if not entries[key].unapplied])

    def settle(self, keys: Iterable[str]) -> None:
        """Remove entries that are restored, or that shall stay as they are."""
        gone = [key for key in keys if self._entries.pop(key, None) is not None]
        if gone:
            self._changed()

    def _changed(self) -> None:
        self._note()
        for listener in self._listeners:
            listener()
