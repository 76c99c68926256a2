"""What each threshold of the analysis does: halved and doubled, on axes whose truth is known.

    python -m benchmarks.thresholds [--only NAME ...] [--limit SECONDS] [--table]

The axes, their drives and buses are drawn by `tests/unit/analysis/random_axes.py` and simulated by
a program that shares nothing with the product's drives. Each number of `backend/analysis/
thresholds.py` that is read meanwhile is halved and doubled in a process of its own (counts are
rounded and stay at least 1), and the response is evaluated and a loop designed again. Printed are
the figures that changed. ``--table`` writes them into the table; a number that is not read on
these axes stays without them.
"""

from __future__ import annotations

import argparse
import ast
import json
import multiprocessing
import os
import pickle
import re
import sys
import textwrap
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")
# Imported before the processes fork, which then need not.
import numpy  # noqa: F401
import pydantic  # noqa: F401
import scipy.optimize
import scipy.signal  # noqa: F401

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "unit" / "analysis")]

TABLE = ROOT / "backend" / "analysis" / "thresholds.py"
#: Seed and sample rate: close resonances, hardly damped ones, and a vertical axis next to its speed
#: loop. The loop is designed for the first of them.
AXES = ((1, 1000.0), (2, 1000.0), (3, 1000.0))
Name = tuple[str, str]
_WIDTH = 96


@dataclass(frozen=True)
class Figures:
    """Means over the axes, and the design of one of them; an empty `failed` means all went well."""

    magnitude_db: float
    phase_deg: float
    covered: float
    missed: int
    untrusted: int
    listed: int
    bandwidth_hz: float
    notches: int
    failed: str = ""

    def compared_with(self, base: Figures) -> str:
        """What is different, as text."""
        if self.failed:
            return self.failed
        shown = (
            ("magnitude error {:.3f} dB", self.magnitude_db, base.magnitude_db, 5e-4),
            ("phase error {:.2f}°", self.phase_deg, base.phase_deg, 5e-3),
            ("lines in the band {:.0%}", self.covered, base.covered, 5e-3),
            ("{:.0f} modes missed", self.missed, base.missed, 0.5),
            ("{:.0f} models untrusted", self.untrusted, base.untrusted, 0.5),
            ("{:.0f} modes listed", self.listed, base.listed, 0.5),
            ("designed bandwidth {:.1f} Hz", self.bandwidth_hz, base.bandwidth_hz, 0.05),
            ("{:.0f} notches", self.notches, base.notches, 0.5),
        )
        changed = [
            f"{words.format(now)} ({words[words.index('{') : words.index('}') + 1].format(then)})"
            for words, now, then, least in shown
            if abs(now - then) > least
        ]
        return ", ".join(changed) or "no difference"


class _Recorder:
    """Stands in for a namespace of the table and notes what is read of it."""

    def __init__(self, space: type, name: str, read: set[Name]) -> None:
        self.__dict__.update(_space=space, _name=name, _read=read)

    def __getattr__(self, name: str) -> Any:
        self._read.add((self._name, name))
        return getattr(self._space, name)


def _responses(records: list[Any]) -> list[Any]:
    from random_axes import result_of

    return [result_of(case, played) for case, played in records]


def _designed(case: Any, result: Any) -> tuple[float, int]:
    """Speed bandwidth in Hz and number of notches of the design that is marked "balanced"."""
    from backend.analysis.loop.design import design
    from backend.analysis.loop.loop_structure import DriveLoops
    from backend.analysis.loop.measured_plant import measured_plant

    if result.model is None:
        return 0.0, 0
    plant = measured_plant(result.frf, result.model)
    loops = DriveLoops(1000.0, 50e-6)
    rows = design(plant, case.mechanics.total_kgm2, loops, "medium", slots=1)
    best = next((c for c in rows if "balanced" in c.marks), None)
    return (best.gains.speed_bandwidth_hz, len(best.notches)) if best else (0.0, 0)


def _figures(records: list[Any], results: list[Any], made: tuple[float, int]) -> Figures:
    from random_axes import errors, missed_modes

    found = []
    for (case, _), result in zip(records, results, strict=True):
        high = 1000.0 if case.rate_hz > 2000 else 200.0 if case.loop_hz else 400.0
        found.append(errors(result.frf, case.mechanics, 5.0, high))
    count = len(found)
    return Figures(
        sum(e.magnitude_db for e in found) / count,
        sum(e.phase_deg for e in found) / count,
        sum(e.covered for e in found) / count,
        sum(len(missed_modes(r, case)) for (case, _), r in zip(records, results, strict=True)),
        sum(not result.trusted for result in results),
        sum(len(result.resonances) for result in results),
        *made,
    )


def _of_a_loop(space: str) -> bool:
    """Whether numbers of this namespace act on a design alone, not on the response before it."""
    from backend.analysis import thresholds

    return (getattr(thresholds, space).__doc__ or "").startswith("`loop/")


def _child(send: Any, packed: bytes, change: tuple[Name, Any] | None, base: bytes | None) -> None:
    """Evaluate with one number changed; without a change note what is read.

    What is unpacked imports the analysis, so that is done after the number is changed.
    """
    from backend.analysis import thresholds

    read: set[Name] = set()
    loop = change is not None and _of_a_loop(change[0][0])
    if change is not None:
        (space, name), value = change
        setattr(getattr(thresholds, space), name, value)
    else:
        for space, each in list(vars(thresholds).items()):
            if isinstance(each, type):
                setattr(thresholds, space, _Recorder(each, space, read))
    try:
        records = pickle.loads(packed)
        known, made = pickle.loads(base) if base else (None, None)
        results = known if loop else _responses(records)
        if loop or base is None:
            made = _designed(records[0][0], results[0])
        send.send((_figures(records, results, made), read, pickle.dumps((results, made))))
    except Exception as error:  # what a number breaks is an answer
        failed = f"fails with {type(error).__name__}"
        send.send((Figures(0, 0, 0, 0, 0, 0, 0, 0, failed), read, b""))


def run(
    packed: bytes, change: tuple[Name, Any] | None, base: bytes | None, limit_s: float
) -> tuple[Figures, set[Name], bytes]:
    """Figures, names read and results.

    Each has a process, which imports the analysis after the number is changed.
    """
    context = multiprocessing.get_context("fork")
    here, there = context.Pipe()
    process = context.Process(target=_child, args=(there, packed, change, base))
    process.start()
    there.close()
    failed = f"takes longer than {limit_s:.0f} s"
    try:
        if here.poll(limit_s):
            answer: tuple[Figures, set[Name], bytes] = here.recv()
            return answer
    except EOFError:
        failed = "ends the program"
    finally:
        process.kill()
        process.join()
    return Figures(0, 0, 0, 0, 0, 0, 0, 0, failed), set(), b""


def changed(value: Any, factor: float) -> Any:
    """The number, or each of several, times the factor; counts stay whole."""
    if isinstance(value, tuple):
        return tuple(changed(each, factor) for each in value)
    return max(1, round(value * factor)) if isinstance(value, int) else value * factor


def _drawn(send: Any) -> None:
    from random_axes import played, random_case

    cases = [random_case(seed, rate_hz) for seed, rate_hz in AXES]
    send.send_bytes(
        pickle.dumps([(case, found) for case in cases if (found := played(case)) is not None])
    )


def written(source: str, effects: dict[Name, tuple[str, str]]) -> str:
    """The table with these effects behind their numbers."""
    lines = source.splitlines()
    spaces = [node for node in ast.parse(source).body if isinstance(node, ast.ClassDef)]
    for space in reversed(spaces):
        for number, line in reversed(list(zip(space.body, space.body[1:], strict=False))):
            if not isinstance(number, ast.Assign) or not isinstance(line, ast.Expr):
                continue
            effect = effects.get((space.name, ast.unparse(number.targets[0])))
            if effect is None or not isinstance(line.value, ast.Constant):
                continue
            kept = re.sub(r"\s+Halved: .*", "", " ".join(str(line.value.value).split()))
            text = f'"""{kept} Halved: {effect[0]}. Doubled: {effect[1]}."""'
            wrapped = textwrap.wrap(text, _WIDTH, break_on_hyphens=False)
            lines[line.lineno - 1 : line.end_lineno] = ["    " + each for each in wrapped]
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--only", nargs="*", default=[], help="namespaces, or NAMESPACE.NUMBER")
    parser.add_argument("--limit", type=float, default=120.0, help="seconds for one evaluation")
    parser.add_argument("--table", action="store_true", help="write what was measured there")
    parser.add_argument("--known", type=Path, help="file that keeps what was measured so far")
    options = parser.parse_args()
    from backend.analysis import thresholds

    known: dict[str, list[str]] = {}
    if options.known and options.known.exists():
        known = json.loads(options.known.read_text())
    here, there = multiprocessing.get_context("fork").Pipe()
    drawing = multiprocessing.get_context("fork").Process(target=_drawn, args=(there,))
    drawing.start()
    packed = here.recv_bytes()
    start = time.perf_counter()
    base, read, results = run(packed, None, None, 3600.0)
    print(f"{base}\n{len(read)} numbers are read; {time.perf_counter() - start:.0f} s", flush=True)
    for space, name in sorted(read, key=lambda each: _place(options.only, each)):
        full = f"{space}.{name}"
        if full in known or (
            options.only and space not in options.only and full not in options.only
        ):
            continue
        value = getattr(getattr(thresholds, space), name)
        known[full] = [
            run(packed, ((space, name), changed(value, factor)), results, options.limit)[
                0
            ].compared_with(base)
            for factor in (0.5, 2.0)
        ]
        print(f"{full} = {value}  ½: {known[full][0]}  ×2: {known[full][1]}", flush=True)
        if options.known:
            options.known.write_text(json.dumps(known, ensure_ascii=False, indent=1))
    if options.table:
        effects = {tuple(k.split(".")): (v[0], v[1]) for k, v in known.items()}
        TABLE.write_text(written(TABLE.read_text(), effects))  # type: ignore[arg-type]


def _place(order: list[str], name: Name) -> tuple[int, Name]:
    return (order.index(name[0]) if name[0] in order else len(order), name)


if __name__ == "__main__":
    main()
