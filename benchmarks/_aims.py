"""Says plainly which aims a run met."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Aim:
    """``words`` name the aim with the figure that was reached."""

    words: str
    met: bool


def print_verdict(aims: list[Aim]) -> bool:
    """One line for each aim and one for all; returns whether all were met."""
    for aim in aims:
        print(f"  {'met    ' if aim.met else 'NOT MET'}  {aim.words}")
    failed = sum(not aim.met for aim in aims)
    print("verdict: all aims met" if not failed else f"verdict: {failed} of {len(aims)} NOT MET")
    return not failed
