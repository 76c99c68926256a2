"""The verdict on a tuned loop as a table, for its measured and its predicted band."""

from __future__ import annotations

from backend.report.document import Block, Note, Table, Tone
from backend.report.texts import Words
from backend.tools.measuring.numbers import NONE, fixed, hertz
from backend.tools.tuning.autotune.result import BandInfo, IntervalInfo, VerdictInfo


def bands(verdict: VerdictInfo, words: Words) -> list[Block]:
    """Margins of each band with their intervals, and a note on the band that the verdict covers."""
    rows = tuple(
        _row(words(f"verdict.{name}"), band)
        for name, band in (("measured", verdict.measured), ("predicted", verdict.predicted))
        if band is not None
    )
    head = (
        words("verdict.band"),
        words("phase_margin"),
        words("gain_margin"),
        words("verdict.peak"),
    )
    covered = words(
        f"verdict.coverage.{verdict.coverage}",
        last=hertz(verdict.last_crossover_hz),
        gain=fixed(verdict.shown_gain_db, 1, "dB"),
    )
    tone: Tone = "warn" if verdict.coverage == "predicted" else "plain"
    return [Table(head, rows, (False, True, True, True)), Note(covered, tone)]


def _row(name: str, band: BandInfo) -> tuple[str, ...]:
    return (
        f"{name}, {hertz(band.low_hz)} – {hertz(band.high_hz)}",
        _interval(band.phase_margin_deg, 0, "°"),
        _interval(band.gain_margin_db, 1, "dB"),
        _interval(band.peak_sensitivity, 2),
    )


def _interval(of: IntervalInfo | None, decimals: int, unit: str = "") -> str:
    """A value with the ends of its 95 % interval, as on the page."""
    if of is None:
        return NONE
    low, high = fixed(of.low, decimals), fixed(of.high, decimals)
    return f"{fixed(of.value, decimals, unit)} ({low} – {high})"
