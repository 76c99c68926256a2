"""Choice of the assigned PDOs in one direction, by the rules of the profile: pure, no I/O.

Source: ETG.2000 v1.0.10 clauses 6.10 (Fixed, Mandatory, Exclude, Sm) and 6.9 (PDOs of an operation
mode); ETG.1000.6 clause 5.6.7.4.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Literal

from profiles.bring_up import BringUp
from profiles.schema import PdoSet, PdoSpec, Profile

Direction = Literal["rx", "tx"]


@dataclass(frozen=True, slots=True)
class AssignmentRules:
    """Rules for the assignment in one direction of one drive.

    ``free`` is the PDO whose contents are written, None if there is none; ``kept`` are the PDOs
    assigned next to it. ``room_bytes`` is the capacity of the sync manager.
    """

    sets: tuple[PdoSet, ...]
    default: tuple[PdoSet, ...]
    mandatory: tuple[PdoSet, ...]
    free: PdoSet | None
    kept: tuple[PdoSet, ...]
    assignable: bool
    room_bytes: int | None


def assignment_rules(profile: Profile, spec: PdoSpec, direction: Direction) -> AssignmentRules:
    """Derive the rules for one direction from ``profile``."""
    rules = profile.bring_up
    assignable = rules is None or rules.coe.pdo_assign is not False
    sets = tuple(s for s in spec.sets if s.direction == direction)
    listed = () if rules is None else rules.mode_pdos(_manager_number(rules, direction))
    if listed:
        sets = tuple(s for s in sets if s.mandatory or s.index in listed) or sets
    mandatory = tuple(s for s in sets if s.mandatory)
    default = _default(spec, sets, direction, listed)
    free = _free(spec, sets, direction, default, mandatory, assignable=assignable)
    others = mandatory if assignable else default
    kept = tuple(s for s in others if free is not None and s.index != free.index)
    return AssignmentRules(
        sets, default, mandatory, free, kept, assignable, _room(rules, spec, direction)
    )


def _manager_number(rules: BringUp, direction: Direction) -> int:
    found = rules.sync_manager("outputs" if direction == "rx" else "inputs")
    return (2 if direction == "rx" else 3) if found is None else found.number


def _room(rules: BringUp | None, spec: PdoSpec, direction: Direction) -> int | None:
    manager = None
    if rules is not None:
        manager = rules.sync_manager("outputs" if direction == "rx" else "inputs")
    limits = [spec.max_bytes, None if manager is None else manager.max_size or None]
    return min((limit for limit in limits if limit is not None), default=None)


def _default(
    spec: PdoSpec, sets: tuple[PdoSet, ...], direction: Direction, listed: Collection[int]
) -> tuple[PdoSet, ...]:
    """Return the PDOs assigned without a master: those with a sync manager, else the first one."""
    chosen = tuple(s for s in sets if s.index in listed)
    chosen = chosen or tuple(s for s in sets if s.sync_manager is not None)
    first = spec.default_rx if direction == "rx" else spec.default_tx
    return chosen or tuple(s for s in sets if s.index == first)


def _free(
    spec: PdoSpec,
    sets: tuple[PdoSet, ...],
    direction: Direction,
    default: tuple[PdoSet, ...],
    mandatory: tuple[PdoSet, ...],
    *,
    assignable: bool,
) -> PdoSet | None:
    """Return the PDO to fill: the profile's choice if the rules allow it, else another."""
    preferred = spec.free_set(direction)
    if preferred is None:
        return None
    candidates = [s for s in (sets if assignable else default) if s.is_free]
    candidates.sort(key=lambda s: s.index != preferred)
    for candidate in candidates:
        if all(compatible(candidate, other) for other in mandatory):
            return candidate
    if not any(s.index == preferred for s in sets) and not default:
        # A profile may name a free PDO without describing its contents.
        return PdoSet(index=preferred, direction=direction, entries=(), source=spec.source)
    return None


def compatible(one: PdoSet, other: PdoSet) -> bool:
    """Return whether two PDOs can be assigned together."""
    return one is other or (other.index not in one.exclude and one.index not in other.exclude)


def choose_fixed(
    rules: AssignmentRules,
    must: Collection[str],
    want: Collection[str],
    keys_of: Callable[[Sequence[PdoSet]], Collection[str]],
) -> tuple[PdoSet, ...] | None:
    """Choose PDOs with fixed contents that carry all of ``must`` and most of ``want``.

    ``keys_of`` returns the objects that a list of PDOs carries in whole bytes. One PDO next to the
    mandatory ones is preferred if sufficient, the default assignment if it carries as much, and
    several PDOs are used only if necessary. None if no assignment carries ``must``.
    """
    if not rules.assignable:
        return rules.default if set(must) <= set(keys_of(rules.default)) else None
    candidates = [_with(rules, (each,)) for each in rules.sets]
    candidates.append(_with(rules, rules.default))
    usable = [c for c in candidates if c and set(must) <= set(keys_of(c))]
    if not usable:
        several = _several(rules, must, keys_of)
        usable = [several] if set(must) <= set(keys_of(several)) else []
    if not usable:
        return None
    default = {s.index for s in rules.default}
    return max(
        usable,
        key=lambda c: (
            len(set(want) & set(keys_of(c))),
            {s.index for s in c} == default,
            any(s.index in default for s in c),
            -len(c),
        ),
    )


def _with(rules: AssignmentRules, chosen: Sequence[PdoSet]) -> tuple[PdoSet, ...]:
    """Return mandatory PDOs and ``chosen`` in file order; empty if they exclude each other."""
    wanted = {s.index for s in (*rules.mandatory, *chosen)}
    together = tuple(s for s in rules.sets if s.index in wanted)
    fits = all(compatible(one, other) for one in together for other in together)
    keys = [key for each in together if each.direction == "rx" for key in each.entries]
    # An output mapped twice would have to be written in both places.
    return together if fits and len(keys) == len(set(keys)) else ()


def _several(
    rules: AssignmentRules,
    must: Collection[str],
    keys_of: Callable[[Sequence[PdoSet]], Collection[str]],
) -> tuple[PdoSet, ...]:
    """Add to the mandatory PDOs, one by one, the PDO that carries most of what is missing."""
    taken = _with(rules, ())
    while missing := set(must) - set(keys_of(taken)):
        further = [
            longer
            for each in rules.sets
            if each not in taken
            and (longer := _with(rules, (*taken, each)))
            and missing & set(keys_of((each,)))
        ]
        if not further:
            break
        taken = max(further, key=lambda c: len(missing & set(keys_of(c))))
    return taken
