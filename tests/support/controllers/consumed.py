"""What a controller took from a list, and how it says that it does not take one."""

from __future__ import annotations

from dataclasses import dataclass, field


class Refused(Exception):
    """The controller does not take the file; the message states the reason."""


@dataclass
class Consumed:
    """A list as its controller understands it."""

    writes: list[tuple[int, int, bytes, str]] = field(default_factory=list)
    """Index, subindex, bytes in the order of travel, transition in which it is written."""
    pdos: dict[int, list[tuple[int, int, int]]] = field(default_factory=dict)
    """By index of the PDO: index, subindex and bits of its entries; empty if none are stated."""
    identity: tuple[int, int] | None = None
    cycle_us: int | None = None
    assign_activate: int | None = None
    ordered: bool = True
    """Whether the writes are in the order in which the controller sends them."""


def need(condition: object, why: str) -> None:
    """Refuse the file unless the condition holds."""
    if not condition:
        raise Refused(why)


def unsigned(text: str | None, bits: int, what: str, base: int = 10) -> int:
    """A number without sign that fits."""
    try:
        value = int(text or "", base)
    except ValueError as error:
        raise Refused(f"{what}: {text!r} is no number of base {base}") from error
    need(0 <= value < 1 << bits, f"{what}: {value} does not fit {bits} bits")
    return value
