"""One chapter of a report for one measurement: figures, plots, file and settings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from backend.report.document import Block, Figure, Heading, Note, Table
from backend.report.facts import Measured
from backend.report.loop_bands import bands
from backend.report.render.plot import Curve, Plot
from backend.report.texts import Words
from backend.report.tools import grid_table, kind_title, note_of, tool_blocks
from backend.tools.measuring.numbers import fixed, milliseconds, moment, significant
from backend.tools.moving.step.result import StepAnswer
from backend.tools.tuning.sweep.result import SweepAnswer
from backend.tools.tuning.sweep.run import TOOL as SWEEP
from backend.tools.tuning.sweep.texts import margins_grid, resonances_grid

#: Distinguishable in print and for colour-blind readers: dark blue, orange; grey for the demand.
_NOW, _EARLIER, _DEMAND = "#1a5c94", "#c2571a", "#5b6770"
_LEAST_COHERENCE = 0.5
_BAND = 1.96
_PHASE_STEPS = (15.0, 30.0, 45.0, 90.0, 180.0, 360.0)
_TURN = 360.0
#: Cell for a value that one of two compared steps does not have.
_ABSENT = "—"


def chapter(measured: Measured, words: Words) -> list[Block]:
    """The blocks of one measurement."""
    blocks: list[Block] = [Heading(kind_title(measured.kind, words), 3)]
    view = measured.view
    if isinstance(view, StepAnswer):
        blocks += _step(measured, view, words)
    elif isinstance(view, SweepAnswer):
        blocks += _sweep(measured, view, words)
    else:
        blocks += tool_blocks(view, words)
    return [*blocks, *_origin(measured, words)]


def _origin(measured: Measured, words: Words) -> list[Block]:
    text = words(
        "measured", time=moment(measured.saved), file=measured.file, program=measured.program or "?"
    )
    if measured.earlier is not None:
        earlier = measured.earlier
        text += " " + words("compared", time=moment(earlier.saved), file=earlier.file)
    envelope = measured.settings.get("envelope", measured.settings)
    if isinstance(envelope, Mapping):
        travel, speed, torque = (
            _plain(envelope.get(inner, envelope.get(f"{inner.split('_')[0]}_limit")))
            for inner in ("travel_rev", "speed_rpm", "torque_percent")
        )
        text += " " + words("limits", travel=travel, speed=speed, torque=torque)
    found: list[Block] = [Note(text)]
    if measured.differences:
        found.append(Note(words("differs", what=", ".join(measured.differences)), "warn"))
    return found


def _plain(value: object) -> str:
    return f"{value:g}" if isinstance(value, (int, float)) else "?"


# --- frequency response ----------------------------------------------------------------


def _sweep(measured: Measured, view: SweepAnswer, words: Words) -> list[Block]:
    earlier = measured.earlier.view if measured.earlier else None
    other = earlier if isinstance(earlier, SweepAnswer) else None
    blocks: list[Block] = [_bode(view, other, words)]
    if view.kind != "mechanics":
        if view.margins:
            blocks.append(_margins(view, other, words))
    elif view.trusted and view.resonances:
        blocks.append(grid_table(SWEEP, resonances_grid(view), words))
    else:
        blocks.append(note_of(SWEEP, SWEEP.report(view).notes[0], words))
    if measured.verdict is not None:
        blocks += bands(measured.verdict, words)
    if view.saturated_share > 0.0:
        share = fixed(view.saturated_share * 100, 1, "%")
        blocks.append(Note(words("warn.saturated", share=share), "warn"))
    cautions = view.in_language(words.language).warnings
    return [*blocks, *(Note(each, "warn") for each in cautions)]


def _margins(view: SweepAnswer, other: SweepAnswer | None, words: Words) -> Table:
    if other is None:
        return grid_table(SWEEP, margins_grid(view), words)
    return grid_table(SWEEP, margins_grid(other, view, heads=("before", "after")), words)


def _bode(view: SweepAnswer, other: SweepAnswer | None, words: Words) -> Figure:
    low, high = view.valid_band_hz
    first, last = view.frequency_hz[0], view.frequency_hz[-1]
    shown = (max(first, low * 0.8), min(last, high * 1.25))
    shown = shown if shown[0] < shown[1] else (first, last)
    unit = "dB" if view.unit == "1" else f"dB {view.unit}"

    def plot(title: str, y_label: str, curves: Sequence[Curve], height: float) -> Plot:
        whole = title == words("coherence")
        steps = (0.5,) if whole else _PHASE_STEPS if y_label == "°" else ()
        fixed_range = (0.0, 1.0) if whole else None
        return Plot(title, words("frequency"), y_label, tuple(curves), shown, True,
                    view.valid_band_hz, height, steps, fixed_range)  # fmt: skip

    looks = [_Look(view, words("after") if other else "", _NOW, False)]
    if other is not None:
        looks.append(_Look(other, words("before"), _EARLIER, True))
    magnitude = [_curve(of, of.view.magnitude_db, of.view.std_db) for of in looks]
    phase = [_curve(of, _whole_turns(of.view), of.view.std_deg) for of in looks]
    coherence = [
        Curve(of.label, of.color, of.view.frequency_hz, of.view.coherence, dashed=of.dashed)
        for of in looks
    ]
    caption = words(
        "bode.caption", low=fixed(low, 0), high=fixed(high, 0), rate=fixed(view.sample_rate_hz, 0)
    )
    return Figure(
        (
            plot(words("magnitude"), unit, magnitude, 190.0),
            plot(words("phase"), "°", phase, 150.0),
            plot(words("coherence"), "", coherence, 60.0),
        ),
        caption,
    )


@dataclass(frozen=True)
class _Look:
    """A response and how its curves are drawn."""

    view: SweepAnswer
    label: str
    color: str
    dashed: bool


def _curve(of: _Look, values: Sequence[float], std: Sequence[float | None]) -> Curve:
    """Curve of a response, without frequencies of low coherence, as on the page."""
    coherence = of.view.coherence
    kept = [v if c >= _LEAST_COHERENCE else None for v, c in zip(values, coherence, strict=True)]
    spread = [None if s is None else _BAND * s for s in std]
    return Curve(of.label, of.color, of.view.frequency_hz, kept, spread, of.dashed)


def _whole_turns(view: SweepAnswer) -> list[float]:
    """The unwrapped phase [deg], shifted by whole turns so that it begins within ±180°."""
    first = sorted(view.phase_deg[: max(1, len(view.phase_deg) // 20)])
    turns = round(first[len(first) // 2] / _TURN)
    return [value - _TURN * turns for value in view.phase_deg]


def _compared(
    names: Sequence[str], now: Sequence[str], before: Sequence[str] | None, words: Words
) -> Table:
    if before is None:
        rows = tuple(zip(names, now, strict=True))
        return Table((words("quantity"), words("value")), rows, (False, True))
    both = tuple(zip(names, before, now, strict=True))
    head = (words("quantity"), words("before"), words("after"))
    return Table(head, both, (False, True, True))


# --- steps -----------------------------------------------------------------------------


def _step(measured: Measured, view: StepAnswer, words: Words) -> list[Block]:
    earlier = measured.earlier.view if measured.earlier else None
    other = earlier if isinstance(earlier, StepAnswer) else None
    ends = (0.0, max(view.time_s[-1], other.time_s[-1] if other else 0.0))
    name = words("speed" if view.kind == "speed" else "position")
    now, before = (words("after"), words("before")) if other else ("", "")
    motion = [Curve(words("demand"), _DEMAND, view.time_s, view.demand, dashed=True)]
    torque = []
    if other is not None:
        motion.append(Curve(before, _EARLIER, other.time_s, other.actual, dashed=True))
        torque.append(Curve(before, _EARLIER, other.time_s, other.torque_percent, dashed=True))
    motion.append(Curve(now, _NOW, view.time_s, view.actual))
    torque.append(Curve(now, _NOW, view.time_s, view.torque_percent))
    figure = Figure(
        (
            Plot(name, words("time"), view.unit, tuple(motion), ends),
            Plot(
                words("torque"), words("time"), words("of_rated"), tuple(torque), ends, height=110.0
            ),
        ),
        words("step.caption"),
    )
    present = _numbers(view, words)
    past = _numbers(other, words) if other else {}
    # Either step may have a row that the other one lacks, such as a widened window.
    names = list(present | past)
    column = [present.get(each, _ABSENT) for each in names]
    earlier_column = [past.get(each, _ABSENT) for each in names] if other else None
    return [figure, _compared(names, column, earlier_column, words)]


def _numbers(view: StepAnswer, words: Words) -> dict[str, str]:
    """Characteristic values by their names, in the order of the table."""
    rows: list[tuple[str, str]] = []
    if view.step is not None:
        rows += [
            ("overshoot", fixed(view.step.overshoot_percent, 1, "%")),
            ("rise", milliseconds(view.step.rise_s)),
            ("settling", milliseconds(view.step.settling_s)),
        ]
        if view.widened and view.window is not None:
            rows.append(("window_widened", significant(view.window, view.unit)))
    if view.move is not None:
        rows += [
            ("following", significant(view.move.following_peak, view.unit)),
            ("following_rms", significant(view.move.following_rms, view.unit)),
            ("settling", milliseconds(view.move.settling_s)),
        ]
    rows += [
        ("torque_peak", fixed(view.torque_peak_percent, 0, "%")),
        ("torque_rms", fixed(view.torque_rms_percent, 0, "%")),
    ]
    if view.lost_percent > 0.0:
        rows.append(("samples_lost", fixed(view.lost_percent, 1, "%")))
    return {words(name): text for name, text in rows}
