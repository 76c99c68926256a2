"""Texts of a frequency response, English and Chinese, and its section of a report."""

from __future__ import annotations

from typing import Literal

from backend.tools.measuring.numbers import fixed, hertz, margin
from backend.tools.thresholds import sweep_texts as threshold
from backend.tools.tool import Cell, Grid, Note, Section
from backend.tools.tuning.autotune.result import VerdictInfo
from backend.tools.tuning.sweep.result import SweepAnswer

_MEASURED = (
    "Measured from {low} to {high}: phase margin {pm}, gain margin {gm}, Ms {ms}, bandwidth {bw}. "
    "A figure that is missing lies outside of that band.",
    "测量频段 {low} 至 {high}：相位裕度 {pm}，增益裕度 {gm}，Ms {ms}，带宽 {bw}。"
    "缺少的数值位于该频段之外。",
)
_BANDS = (
    "The worse of what was measured and what is predicted above it: phase margin {pm}, gain margin "
    "{gm}, Ms {ms}; bandwidth {bw}.",
    "取测得部分与其上预测部分中较差者：相位裕度 {pm}，增益裕度 {gm}，Ms {ms}；带宽 {bw}。",
)

TEXTS: dict[str, tuple[str, str]] = {
    "help": (
        "Measure a frequency response and write it as JSON. The axis moves.",
        "测量频率响应并写为 JSON。轴会运动。",
    ),
    "field.kind": ("What is measured", "测量对象"),
    "field.loop": ("Loop that is closed meanwhile", "测量时闭合的环路"),
    "field.f_min_hz": ("Lowest line", "最低频点"),
    "field.f_max_hz": ("Highest line", "最高频点"),
    "field.share": ("Share of the permitted torque", "占允许转矩的份额"),
    "field.realisations": ("Pairs of realisations", "实现对数"),
    "field.base_motion": ("Slow motion meanwhile", "叠加慢速运动"),
    "field.excitation": ("Signal", "激励信号"),
    "field.odd_lines": ("Odd lines alone", "仅奇数谱线"),
    "warning": ("Note: {words}", "注意：{words}"),
    "resonances": ("Resonances {peaks}", "谐振 {peaks}"),
    "no_resonance": ("No resonance was found in the valid band.", "有效频段内未发现谐振。"),
    "untrusted": (
        "No mechanical model explains this recording; nothing may be designed from it.",
        "没有机械模型能解释该录制；不可据此设计。",
    ),
    "kind": ("Kind", "类型"),
    "resonance": ("resonance", "谐振"),
    "antiresonance": ("antiresonance", "反谐振"),
    "frequency": ("Frequency", "频率"),
    "damping": ("Damping", "阻尼"),
    "height": ("Height", "高度"),
    "quantity": ("Quantity", "量"),
    "value": ("Value", "值"),
    "before": ("Before", "之前"),
    "after": ("After", "之后"),
    "bandwidth": ("Bandwidth (−3 dB)", "带宽（−3 dB）"),
    "bandwidth90": ("Bandwidth (−90°)", "带宽（−90°）"),
    "crossover": ("Crossover", "穿越频率"),
    "phase_margin": ("Phase margin", "相位裕度"),
    "gain_margin": ("Gain margin", "增益裕度"),
    "ms": ("Peak sensitivity Ms", "最大灵敏度 Ms"),
    "unstable": ("not stable.", "不稳定。"),
    "unknown": (
        "too few lines of the loop could be measured; its margins are not known.",
        "可测频点过少，裕度未知。",
    ),
    "loop.good": (f"sound. {_MEASURED[0]}", f"良好。{_MEASURED[1]}"),
    "loop.warn": (f"close to the limit. {_MEASURED[0]}", f"接近极限。{_MEASURED[1]}"),
    "loop.fault": (f"not sound. {_MEASURED[0]}", f"不合格。{_MEASURED[1]}"),
    "loop.incomplete": (
        f"sound as far as it was measured. {_MEASURED[0]}",
        f"在所测频段内良好。{_MEASURED[1]}",
    ),
    "bands.good": (f"sound. {_BANDS[0]}", f"良好。{_BANDS[1]}"),
    "bands.warn": (f"close to the limit. {_BANDS[0]}", f"接近极限。{_BANDS[1]}"),
    "bands.fault": (f"not sound. {_BANDS[0]}", f"不合格。{_BANDS[1]}"),
    "bands.incomplete": (
        f"sound as far as it was measured. {_BANDS[0]}",
        f"在所测频段内良好。{_BANDS[1]}",
    ),
}


def report(result: SweepAnswer) -> Section:
    """The verdict, resonances or margins, and the warnings."""
    mechanics = result.kind == "mechanics"
    grids: tuple[Grid, ...] = (resonances_grid(result) if mechanics else margins_grid(result),)
    if mechanics and not (result.trusted and result.resonances):
        grids = ()
    cautions = tuple(Note("warning", "warn", {"words": each}) for each in result.warnings)
    verdict = _mechanics_verdict(result) if mechanics else _loop_verdict(result)
    return Section((verdict, *cautions), grids=grids)


def resonances_grid(result: SweepAnswer) -> Grid:
    """Table with a row for each resonance and antiresonance."""
    return Grid(
        ("kind", "frequency", "damping", "height"),
        tuple(
            (
                Note(each.kind),
                hertz(each.frequency_hz),
                fixed(each.damping * 100, 1, "%"),
                fixed(each.height_db, 1, "dB"),
            )
            for each in result.resonances
        ),
    )


def margins_grid(*results: SweepAnswer, heads: tuple[str, ...] = ("value",)) -> Grid:
    """Bandwidths and margins of one loop, or of several side by side."""

    def row(name: str, *shown: str) -> tuple[Cell, ...]:
        return Note(name), *shown

    found = [each.margins for each in results]
    return Grid(
        ("quantity", *heads),
        (
            row("bandwidth", *(hertz(margin(m, "bandwidth_hz")) for m in found)),
            row("bandwidth90", *(hertz(margin(m, "bandwidth_90deg_hz")) for m in found)),
            row("crossover", *(hertz(margin(m, "crossover_hz")) for m in found)),
            row("phase_margin", *(fixed(margin(m, "phase_margin_deg"), 1, "°") for m in found)),
            row("gain_margin", *(fixed(margin(m, "gain_margin_db"), 1, "dB") for m in found)),
            row("ms", *(fixed(margin(m, "ms"), 2) for m in found)),
        ),
    )


def _mechanics_verdict(result: SweepAnswer) -> Note:
    if not result.trusted:
        return Note("untrusted", "warn")
    peaks = [hertz(r.frequency_hz) for r in result.resonances if r.kind == "resonance"]
    if not peaks:
        return Note("no_resonance", "good")
    return Note("resonances", "good", {"peaks": ", ".join(peaks)})


def _loop_verdict(result: SweepAnswer) -> Note:
    found = result.margins
    if found.get("stable") is False:
        return Note("unstable", "fault")
    figures = tuple(margin(found, name) for name in ("phase_margin_deg", "gain_margin_db", "ms"))
    if figures == (None, None, None):
        return Note("unknown", "warn")
    tone, name = _judged(figures)
    phase, gain, peak = figures
    return Note(
        f"loop.{name}",
        tone,
        {
            "pm": fixed(phase, 0, "°"),
            "gm": fixed(gain, 1, "dB"),
            "ms": fixed(peak, 2),
            "bw": hertz(margin(found, "bandwidth_hz")),
            "low": hertz(margin(found, "from_hz")),
            "high": hertz(margin(found, "to_hz")),
        },
    )


def tuned_verdict(result: SweepAnswer, verdict: VerdictInfo) -> Note:
    """The worse of two verdicts: of the measured band, and of the prediction above it."""
    if not verdict.stable or verdict.contradicted:
        return Note("unstable", "fault")
    worst = verdict.stated
    tone, name = _judged((worst.phase_margin_deg, worst.gain_margin_db, worst.ms))
    if verdict.coverage == "predicted" and tone == "good":
        tone, name = "warn", "incomplete"
    return Note(
        f"bands.{name}",
        tone,
        {
            "pm": fixed(worst.phase_margin_deg, 0, "°"),
            "gm": fixed(worst.gain_margin_db, 1, "dB"),
            "ms": fixed(worst.ms, 2),
            "bw": hertz(margin(result.margins, "bandwidth_hz")),
        },
    )


def _judged(figures: tuple[float | None, ...]) -> tuple[Literal["good", "warn", "fault"], str]:
    """Tone and word for a loop; with a missing figure it is not called sound."""
    if _within(figures, threshold.SOUND):
        return ("warn", "incomplete") if None in figures else ("good", "good")
    return ("warn", "warn") if _within(figures, threshold.POOR) else ("fault", "fault")


def _within(figures: tuple[float | None, ...], limits: tuple[float, float, float]) -> bool:
    """Whether the figures meet the limits; a missing figure neither violates nor meets one."""
    phase, gain, peak = figures
    return (
        (phase is None or phase >= limits[0])
        and (gain is None or gain >= limits[1])
        and (peak is None or peak <= limits[2])
    )
