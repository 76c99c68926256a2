"""Layout of a sample in the ring: the position of each channel, and contiguous runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from drivers.ethercat.exchange.mapping import Entry, StationPlan

_NUMPY = {
    "b": "<i1", "B": "<u1", "h": "<i2", "H": "<u2", "i": "<i4", "I": "<u4", "q": "<i8",
    "Q": "<u8", "f": "<f4",
}  # fmt: skip


def contiguous(taken: npt.NDArray[np.void]) -> list[npt.NDArray[np.void]]:
    """Split into runs without a gap in the cycle counter."""
    if not len(taken):
        return []
    breaks = np.flatnonzero(np.diff(taken["cycle"].astype(np.int64)) != 1) + 1
    return list(np.split(taken, breaks))


def fields_of(plans: Sequence[StationPlan]) -> dict[str, tuple[str, int]]:
    """Map channel name to numpy type and offset in a sample: outputs, then inputs, per station."""
    fields: dict[str, tuple[str, int]] = {}
    start = 0
    for plan in plans:
        names = {(s.address.index, s.address.subindex): s.channel for s in plan.mapped}
        for pdo in (plan.rx, plan.tx):
            start = _add_fields(fields, names, pdo.entries, start)
    return fields


def _add_fields(
    fields: dict[str, tuple[str, int]],
    names: Mapping[tuple[int | None, int], str],
    entries: Sequence[Entry],
    start: int,
) -> int:
    for entry in entries:
        name = names.get((entry.index, entry.subindex))
        if name is not None and entry.code in _NUMPY:
            fields[name] = (_NUMPY[entry.code], start)
        start += entry.size
    return start
