"""A table of figures with their aims."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from benchmarks._aims import Aim, print_verdict


@dataclass(frozen=True, slots=True)
class Figure:
    """One line of the table; ``met`` is None where nothing is aimed at."""

    name: str
    aim: str
    value: str
    met: bool | None


def at_most(name: str, value: float, aim: float, unit: str) -> Figure:
    """A figure that is to be ``aim`` or less; one that is not a number misses it."""
    return Figure(name, f"≤ {aim:g} {unit}", f"{value:.3g} {unit}", value <= aim)


def at_least(name: str, value: float, aim: float, unit: str) -> Figure:
    """A figure that is to be ``aim`` or more."""
    return Figure(name, f"≥ {aim:g} {unit}", f"{value:.3g} {unit}", value >= aim)


def share(name: str, cases: Sequence[bool], aim: float) -> Figure:
    """Of these cases at least the share ``aim``, 0 to 1; without a case the aim is missed."""
    right, count = sum(cases), len(cases)
    return Figure(name, f"≥ {aim:.0%}", f"{right} of {count}", count > 0 and right >= aim * count)


def off_percent(found: float, truth: float) -> float:
    """By how much a value differs from the truth, in % of the truth."""
    return 100.0 * abs(found / truth - 1.0)


def print_figures(items: Mapping[str, Sequence[Figure]]) -> bool:
    """One table for all items, and a verdict; returns whether every aim was met."""
    wide = max(len(each.name) for figures in items.values() for each in figures)
    print(f"{'item':12} {'figure':{wide}} {'aim':>16} {'measured':>16}  met")
    aims = []
    for item, figures in items.items():
        for each in figures:
            state = "–" if each.met is None else "yes" if each.met else "NO"
            print(f"{item:12} {each.name:{wide}} {each.aim:>16} {each.value:>16}  {state}")
            if each.met is not None:
                aims.append(Aim(f"{item}: {each.name}: {each.value} ({each.aim})", each.met))
    missed = [aim for aim in aims if not aim.met]
    print_verdict(missed) if missed else print(f"verdict: all {len(aims)} aims met")
    return not missed
