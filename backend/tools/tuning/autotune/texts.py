"""Texts of an automatic tuning, English and Chinese, and its section of a report."""

from __future__ import annotations

from collections.abc import Iterator

from backend.tools.measuring.numbers import NONE, fixed, margin, milliseconds
from backend.tools.tool import Cell, Grid, Note, Section
from backend.tools.tuning.autotune.result import (
    AutotuneAnswer,
    BandInfo,
    CandidateInfo,
    IntervalInfo,
    VerifiedInfo,
)

TEXTS: dict[str, tuple[str, str]] = {
    "help": (
        "Measure, design and, with --apply or --keep, verify an axis's loop gains. The axis moves.",
        "测量、设计并（用 --apply 或 --keep）验证轴的环路增益。轴会运动。",
    ),
    "field.mark": ("Design to apply", "要应用的设计"),
    "field.load": ("Load", "负载"),
    "field.loop": ("Loop that is closed meanwhile", "测量时闭合的环路"),
    "field.scheme": ("How it may travel", "运动方式"),
    "field.ends_rev": ("Taught ends", "示教两端"),
    "field.apply": ("Write and verify it", "写入并验证"),
    "field.motor_inertia_kgm2": ("Motor alone", "仅电机"),
    "designed": ("designed, nothing was written", "已设计，未写入任何参数"),
    "verified": ("designed, written and verified", "已设计、写入并验证"),
    "kept_present": (
        "verified; what the axis had is kept",
        "已验证；保留轴原有的参数",
    ),
    "tried": ("not kept: {words}", "未保留：{words}"),
    "note": ("note: {words}", "注意：{words}"),
    "design": ("Design", "设计"),
    "robust": ("robust", "稳健"),
    "balanced": ("balanced", "均衡"),
    "fast": ("fast", "快速"),
    "speed_loop": ("Speed loop", "速度环"),
    "bandwidth": ("Bandwidth", "带宽"),
    "phase_margin": ("Phase margin", "相位裕度"),
    "gain_margin": ("Gain margin", "增益裕度"),
    "ms": ("Ms", "灵敏度 Ms"),
    "settling": ("Settling", "调节时间"),
    "overshoot": ("Overshoot", "超调"),
    "notches": ("Notches", "陷波"),
    "none": ("none", "无"),
    "quantity": ("Quantity", "量"),
    "predicted": ("predicted", "预测"),
    "measured": ("verified", "验证"),
    "phase_least": ("phase margin, at least", "相位裕度，至少"),
    "gain_least": ("gain margin, at least", "增益裕度，至少"),
    "ms_most": ("Ms, at most", "Ms，至多"),
    "band.measured": (
        "measured {low} to {high}: phase margin {phase}, gain margin {gain}, largest |S| {peak}",
        "测量频段 {low} 至 {high}：相位裕度 {phase}，增益裕度 {gain}，最大 |S| {peak}",
    ),
    "band.predicted": (
        "predicted {low} to {high}: phase margin {phase}, gain margin {gain}, largest |S| {peak}",
        "预测频段 {low} 至 {high}：相位裕度 {phase}，增益裕度 {gain}，最大 |S| {peak}",
    ),
    "coverage.measured": (
        "all crossovers lie within the measured band",
        "所有穿越频率都在测量频段内",
    ),
    "coverage.gain_steps": (
        "outside the measured band bounded by a raised gain",
        "测量频段以外由提高增益的试验限定",
    ),
    "coverage.predicted": (
        "outside the measured band predicted only",
        "测量频段以外仅为预测",
    ),
}


def report(result: AutotuneAnswer) -> Section:
    """The marked designs, the outcome of the applied one, and what it does without."""
    marked = tuple(_row(each) for each in result.candidates if each.marks)
    heads = (
        "design", "speed_loop", "bandwidth", "phase_margin", "gain_margin", "ms", "settling",
        "overshoot", "notches",
    )  # fmt: skip
    grids = [Grid(heads, marked)] if marked else []
    notes = [Note("designed")]
    if result.verified is not None and result.applied is not None:
        notes = [Note("verified" if result.before else "kept_present", "good")]
        notes += _bands(result.verified)
        grids.append(_figures(result.applied, result.verified))
    notes += [Note("tried", values={"words": each}) for each in result.tried]
    notes += [Note("note", "warn", {"words": each}) for each in result.notes]
    return Section(tuple(notes), grids=tuple(grids))


def _row(each: CandidateInfo) -> tuple[Cell, ...]:
    goals = each.promised
    centers = ", ".join(fixed(notch.center_hz, 0, "Hz") for notch in each.notches)
    return (
        Note(each.marks[0]) if len(each.marks) == 1 else "/".join(each.marks),
        fixed(each.gains.speed_bandwidth_hz, 1, "Hz"),
        fixed(each.bandwidth_hz, 1, "Hz"),
        fixed(goals.phase_margin_deg, 1, "°"),
        fixed(goals.gain_margin_db, 1, "dB"),
        fixed(goals.ms, 2),
        milliseconds(each.settling_s),
        fixed(each.overshoot_percent, 0, "%"),
        centers or Note("none"),
    )


def _figures(applied: CandidateInfo, verified: VerifiedInfo) -> Grid:
    """Table of the predicted figures and those that the verification states."""
    goals, read = applied.promised, verified.sweep.margins
    stated = verified.verdict.stated if verified.verdict else None
    phase, gain, peak = (
        (stated.phase_margin_deg, stated.gain_margin_db, stated.ms)
        if stated is not None
        else (margin(read, "phase_margin_deg"), margin(read, "gain_margin_db"), margin(read, "ms"))
    )
    wanted_hz, have_hz = verified.predicted_bandwidth_hz, verified.measured_bandwidth_hz
    return Grid(
        ("quantity", "predicted", "measured"),
        (
            (Note("bandwidth"), fixed(wanted_hz, 2, "Hz"), fixed(have_hz, 2, "Hz")),
            (Note("phase_least"), fixed(goals.phase_margin_deg, 2, "°"), fixed(phase, 2, "°")),
            (Note("gain_least"), fixed(goals.gain_margin_db, 2, "dB"), fixed(gain, 2, "dB")),
            (Note("ms_most"), fixed(goals.ms, 2), fixed(peak, 2)),
        ),
    )


def _bands(verified: VerifiedInfo) -> Iterator[Note]:
    """Notes on the margins of each band with their intervals; predictions are marked as such."""
    verdict = verified.verdict
    if verdict is None:
        return
    for name, band in (("measured", verdict.measured), ("predicted", verdict.predicted)):
        if band is not None:
            yield Note(f"band.{name}", values=_of_band(band))
    yield Note(f"coverage.{verdict.coverage}")


def _of_band(band: BandInfo) -> dict[str, str]:
    return {
        "low": fixed(band.low_hz, 0, "Hz"),
        "high": fixed(band.high_hz, 0, "Hz"),
        "phase": _interval(band.phase_margin_deg, 0, "°"),
        "gain": _interval(band.gain_margin_db, 1, "dB"),
        "peak": _interval(band.peak_sensitivity, 2),
    }


def _interval(found: IntervalInfo | None, digits: int, unit: str = "") -> str:
    """A value with the limits of its 95 % interval as text."""
    if found is None:
        return NONE
    ends = f"{fixed(found.low, digits)} … {fixed(found.high, digits)}"
    return f"{fixed(found.value, digits, unit)} ({ends})"
