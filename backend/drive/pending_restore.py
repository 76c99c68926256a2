"""What was changed for the length of a motion and could not be put back: owed to the drive."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Protocol

from backend.drive.readings import Reading
from profiles.schema import Raw


@dataclass(frozen=True, slots=True)
class Debt:
    """One parameter that may still hold what was meant for a while; raw values.

    ``left`` is what it holds if nobody changed it since: empty where that is not known.
    ``unapplied``: the value is back, but the drive has not been told to act on it.
    """

    key: str
    raw: Raw
    left: frozenset[Raw]
    unapplied: bool = False


class Note(Protocol):
    """What writes the list down; ``durable`` waits for the disk, within bounds."""

    def __call__(self, *, durable: bool = False) -> None:
        """Write down what is outstanding now."""


def _no_note(*, durable: bool = False) -> None:
    """Nobody keeps the list."""


class Owed:
    """The debts to one drive, in the order in which they arose. For the event loop."""

    def __init__(self) -> None:
        self._debts: dict[str, Debt] = {}
        self._lent: dict[str, list[Raw]] = {}
        self._sent: dict[str, frozenset[Raw]] = {}
        self._listeners: list[Callable[[], None]] = []
        self._note: Note = _no_note

    def __bool__(self) -> bool:
        return bool(self._debts)

    def listen(self, listener: Callable[[], None]) -> None:
        """Call ``listener`` after every change of the list."""
        self._listeners.append(listener)

    def keep(self, note: Note) -> None:
        """Call ``note`` after every change of `outstanding`; durable before a value changes."""
        self._note = note

    def recall(self, debts: Iterable[Debt]) -> None:
        """What a process that is no more has left."""
        for debt in debts:
            self._debts[debt.key] = debt
            self._sent[debt.key] = debt.left

    @contextmanager
    def lent(self, values: Mapping[str, Raw]) -> Iterator[None]:
        """Around a motion that changes these raw values and puts them back when it ends."""
        lent = dict(values)
        for key, raw in lent.items():
            self._lent.setdefault(key, []).append(raw)
        if lent:
            self._note(durable=True)
        try:
            yield
        finally:
            for key in lent:
                self._lent[key].pop()
                if not self._lent[key]:
                    del self._lent[key]
            self._note()

    @property
    def outstanding(self) -> tuple[Debt, ...]:
        """What would be owed if this process ended now, without a chance to put anything back."""
        lent = {
            key: Debt(key, raws[0], self._sent.get(key, frozenset()))
            for key, raws in self._lent.items()
        }
        return tuple((lent | self._debts).values())

    @property
    def in_motion(self) -> bool:
        """A motion goes on that has changed something for its length."""
        return bool(self._lent)

    @property
    def debts(self) -> tuple[Debt, ...]:
        """All that is owed."""
        return tuple(self._debts.values())

    @property
    def unapplied(self) -> bool:
        """Something that is back does not act yet."""
        return any(debt.unapplied for debt in self._debts.values())

    def add(self, values: Mapping[str, Raw], *, unapplied: bool = False) -> None:
        """These raw values could not be put back, or (``unapplied``) not made to act."""
        for key, raw in values.items():
            known = self._debts.get(key)
            left = self._sent.get(key, frozenset())
            raw = self.original(key, raw)  # noqa: PLW2901
            self._debts[key] = Debt(key, raw, left | (known.left if known else left), unapplied)
        if values:
            self._changed()

    def sent(self, key: str, wanted: Raw, after: Raw | None) -> None:
        """A write went out; ``after`` is what was read back, None where that is not known.

        Whoever writes something else to what is owed has other plans: it is offered, not done.
        """
        earlier = self._sent.get(key, frozenset())
        self._sent[key] = earlier | {wanted} if after is None else frozenset({after})
        debt = self._debts.get(key)
        if debt is not None and wanted != debt.raw:
            self._debts[key] = replace(debt, left=frozenset())
        if debt is not None or key in self._lent:
            self._note()

    def original(self, key: str, raw: Raw) -> Raw:
        """What it was before all motions that have changed it; ``raw`` where none has."""
        return self._lent[key][0] if key in self._lent else raw

    def lends(self, key: str) -> bool:
        """A motion has changed this for its length, and puts it back."""
        return key in self._lent

    def restores(self, key: str, raw: Raw) -> bool:
        """Whether writing this raw value puts back what a motion has changed."""
        debt = self._debts.get(key)
        return raw in self._lent.get(key, ()) or (debt is not None and debt.raw == raw)

    def commanded(self, key: str, raw: Raw) -> None:
        """A motion object is about to be written, which nobody reads back.

        Only the mode is ever lent of these; set-points and control words leave no trace here.
        """
        if key in self._lent or key in self._debts:
            self.sent(key, raw, None)

    def seen(self, readings: Iterable[Reading]) -> None:
        """What a drive holds as it should is owed no longer."""
        debts = self._debts
        gone = [r.key for r in readings if r.key in debts and r.raw == debts[r.key].raw]
        self.settle([key for key in gone if not debts[key].unapplied])

    def settle(self, keys: Iterable[str]) -> None:
        """These are back, or shall stay as they are."""
        gone = [key for key in keys if self._debts.pop(key, None) is not None]
        if gone:
            self._changed()

    def _changed(self) -> None:
        self._note()
        for listener in self._listeners:
            listener()
