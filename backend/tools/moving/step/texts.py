"""Texts of a speed step and a move, English and Chinese, and their section of a report."""

from __future__ import annotations

from typing import Literal

from backend.tools.moving.step.result import StepAnswer
from backend.tools.tool import Chart, Line, Note, Row, Section

TEXTS: dict[str, tuple[str, str]] = {
    "help": (
        "Command a step of speed or a move and read overshoot, settling and torque. The axis "
        "moves.",
        "给出速度阶跃或移动指令，读取超调、调节时间与转矩。轴会运动。",
    ),
    "field.kind": ("Kind", "类型"),
    "field.size": ("Size", "幅值"),
    "field.hold_s": ("Time at the end", "终点保持时间"),
    "field.speed": ("Speed of a move", "移动速度"),
    "field.acceleration": ("Acceleration of a move", "移动加速度"),
    "field.window": ("Settling window", "稳定窗口"),
    "settled": ("settled within {window} {unit}", "已稳定在 {window} {unit} 以内"),
    "not_settled": ("not settled within {window} {unit}", "未稳定到 {window} {unit} 以内"),
    "settling_unknown": (
        "not known whether it settled within {window} {unit}",
        "无法判断是否已稳定在 {window} {unit} 以内",
    ),
    "samples_lost": (
        "{value} % of the samples were not received: figures that depend on them are left out, "
        "the others are of those that were.",
        "有 {value} % 的采样未收到：依赖这些采样的指标未给出，其余指标仅来自已收到的采样。",
    ),
    "widened": (
        "Noise is more than a tenth of the usual settling window: a wider one was taken.",
        "噪声超过常用稳定窗口的十分之一：已采用更宽的窗口。",
    ),
    "overshoot": ("Overshoot", "超调"),
    "rise": ("Rise time", "上升时间"),
    "settling": ("Settling time", "调节时间"),
    "following_peak": ("Following error, peak", "跟随误差，峰值"),
    "following_rms": ("Following error, RMS", "跟随误差，有效值"),
    "torque_peak": ("Torque, peak", "转矩，峰值"),
    "torque_rms": ("Torque, RMS", "转矩，有效值"),
    "chart": ("Commanded and actual", "指令与实际"),
    "chart.time": ("Time in s", "时间（s）"),
    "chart.speed": ("Speed in rpm", "速度（rpm）"),
    "chart.move": ("Position in rev", "位置（rev）"),
    "chart.demand": ("commanded", "指令"),
    "chart.actual": ("actual", "实际"),
}


def report(result: StepAnswer) -> Section:
    """Whether it settled, the figures, and the curves."""
    numbers = result.step or result.move
    settled = numbers is not None and numbers.settling_s is not None
    window = "–" if result.window is None else f"{result.window:.3g}"
    unknown = "settling_s" in result.unknown
    verdict = "settled" if settled else "settling_unknown" if unknown else "not_settled"
    tone: Literal["plain", "warn"] = "plain" if settled else "warn"
    notes = [Note(verdict, tone, {"window": window, "unit": result.unit})]
    if result.lost_percent > 0.0:
        notes.append(Note("samples_lost", "warn", {"value": f"{result.lost_percent:.2g}"}))
    if result.widened:
        notes.append(Note("widened"))
    rows: list[Row] = []
    if result.step is not None:
        rows += [
            Row("overshoot", result.step.overshoot_percent, "%"),
            Row("rise", result.step.rise_s, "s"),
            Row("settling", result.step.settling_s, "s"),
        ]
    if result.move is not None:
        rows += [
            Row("following_peak", result.move.following_peak, result.unit),
            Row("following_rms", result.move.following_rms, result.unit),
            Row("overshoot", result.move.overshoot, result.unit),
            Row("settling", result.move.settling_s, "s"),
        ]
    rows += [
        Row("torque_peak", result.torque_peak_percent, "%"),
        Row("torque_rms", result.torque_rms_percent, "%"),
    ]
    chart = Chart(
        "chart",
        "chart.time",
        f"chart.{result.kind}",
        (
            Line("chart.demand", result.time_s, result.demand),
            Line("chart.actual", result.time_s, result.actual),
        ),
    )
    return Section(tuple(notes), tuple(rows), (chart,))
