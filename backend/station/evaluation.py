"""Evaluation of stored measurements again, and comparison with the stored result."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from backend.records.library.measurements import BadMeasurement, Measurement
from backend.records.response_import import stored as response_import
from backend.tools.registry import BY_KIND
from drivers.texts.message import reason_of

#: Relative tolerance of equal numbers, as another computer may sum in another order.
_SAME = 1e-6
#: Absolute tolerance of equal numbers; phases and decibels are of the order of one.
_NOTHING = 1e-9
_NAMED_AT_MOST = 5


@dataclass(frozen=True)
class Evaluation:
    """Result of an evaluation and its comparison with the stored one.

    ``result``: the tool's result in JSON form. ``agrees``: None where no result was stored.
    ``differences``: names of differing fields, at most five.
    """

    result: dict[str, object]
    agrees: bool | None
    differences: tuple[str, ...]


def evaluate(measurement: Measurement) -> Evaluation:
    """Evaluate the raw data again and compare with the stored result.

    Raises:
        BadMeasurement: of a kind that cannot be evaluated, or not complete.
        NotAllowed: the data do not permit a result.
    """
    result = recompute(measurement)
    stored = measurement.meta.get("result")
    if not isinstance(stored, dict):
        return Evaluation(result, None, ())
    found = list(_differences(stored, result, ""))
    return Evaluation(result, not found, tuple(found[:_NAMED_AT_MOST]))


def recompute(measurement: Measurement) -> dict[str, object]:
    """Evaluate the raw data again; the tool's result in JSON form.

    Raises:
        BadMeasurement: of a kind that cannot be evaluated, or not complete.
        NotAllowed: the data do not permit a result.
    """
    arrays, meta = measurement.arrays, measurement.meta
    try:
        tool = BY_KIND.get(str(meta.get("tool")))
        if tool is not None:
            return dict(tool.reevaluate(arrays, meta).model_dump(mode="json"))
        if meta.get("tool") == "response-import":
            return response_import.reevaluate(arrays, meta)
    except (
        ValueError, KeyError, TypeError, IndexError, AttributeError, ArithmeticError, MemoryError,
    ) as error:  # fmt: skip
        raise BadMeasurement(
            "station.measurement-not-complete", value=measurement.kind, cause=reason_of(error)
        ) from error
    raise BadMeasurement("station.measurement-kind-nothing-evaluate", value=measurement.kind)


def _differences(then: object, now: object, path: str) -> Iterator[str]:
    """Paths of fields of the stored result that differ now; new fields do not count."""
    if isinstance(then, Mapping) and isinstance(now, Mapping):
        for name, value in then.items():
            if name in now:
                yield from _differences(value, now[name], f"{path}.{name}" if path else str(name))
            else:
                yield f"{path}.{name}" if path else str(name)
    elif _is_list(then) and _is_list(now):
        pairs = list(zip(then, now, strict=False))  # type: ignore[call-overload]
        changed = len(then) != len(now)  # type: ignore[arg-type]
        if changed or any(next(_differences(a, b, path), None) is not None for a, b in pairs):
            yield path
    elif not _same(then, now):
        yield path


def _is_list(value: object) -> bool:
    return isinstance(value, Sequence) and not isinstance(value, str)


def _same(then: object, now: object) -> bool:
    numbers = (int, float)
    if isinstance(then, numbers) and isinstance(now, numbers) and not isinstance(then, bool):
        return math.isclose(then, now, rel_tol=_SAME, abs_tol=_NOTHING)
    return then == now
