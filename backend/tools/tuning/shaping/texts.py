"""Texts of command shaping, English and Chinese, and its section of a report."""

from __future__ import annotations

from typing import Literal

from backend.tools.tool import Cell, Chart, Grid, Line, Note, Row, Section
from backend.tools.tuning.shaping.result import (
    DesignedShaper,
    ShapingComparison,
    ShapingFinding,
    ShapingResult,
    Signal,
    Verdict,
)

TEXTS: dict[str, tuple[str, str]] = {
    "help": (
        "Frequency and damping of the slow vibration after a move, input shapers for it, and the "
        "same move with one of them. The axis moves.",
        "测量移动后的低频振动频率与阻尼，设计输入整形器，并用其中之一重复同一移动。轴会运动。",
    ),
    "lead": (
        "The axis makes the same move out and back, first as it is. What oscillates after each end "
        "shows the frequency and damping of the slow mode. Then the move is repeated with a "
        "shaper, and both are compared.",
        "轴先按原样往返执行同一移动。每次到位后的振荡给出低频模态的频率与阻尼。"
        "随后带整形器重复该移动，并比较两者。",
    ),
    "start": ("Measure and shape", "测量并整形"),
    "field.size": ("Way of the move (rev)", "移动行程（圈）"),
    "field.speed": ("Speed of the move (rpm)", "移动速度 (rpm)"),
    "field.acceleration": ("Acceleration of the move (rpm/s)", "移动加速度 (rpm/s)"),
    "field.hold_s": ("Time at each end (s)", "每个终点的保持时间 (s)"),
    "field.repetitions": ("Moves out and back", "往返次数"),
    "field.lowest_hz": ("Lowest frequency (Hz)", "最低频率 (Hz)"),
    "field.highest_hz": ("Highest frequency (Hz)", "最高频率 (Hz)"),
    "field.frequency_hz": (
        "Frequency of the mode (Hz), where it is known",
        "模态频率 (Hz)，若已知",
    ),
    "field.damping": ("Damping ratio of that mode", "该模态的阻尼比"),
    "field.shaper": ("Shaper", "整形器"),
    "field.tolerance_percent": (
        "Vibration that may be left (%)",
        "允许残余振动 (%)",
    ),
    "field.window_rev": (
        "Settling window of the position (rev); a tenth of the vibration where empty",
        "位置稳定窗口（圈）；留空则取振动的十分之一",
    ),
    "field.verify": ("Play the shaped move, too, and compare", "同时执行整形后的移动并比较"),
    "shaper.auto": ("the shortest that suffices", "满足要求的最短整形器"),
    "shaper.zv": ("ZV (half a period)", "ZV（半个周期）"),
    "shaper.zvd": ("ZVD (one period)", "ZVD（一个周期）"),
    "shaper.ei": ("EI (one period)", "EI（一个周期）"),
    "verdict.verified": (
        "The {shaper} shaper was verified: {residual} % of the vibration is left, and settling "
        "takes {after} instead of {before}.",
        "{shaper} 整形器已验证：残余振动为 {residual} %，调节时间由 {before} 变为 {after}。",
    ),
    "verdict.improved": (
        "The {shaper} shaper reduces the vibration to {residual} %, less than half of what was "
        "aimed at; settling takes {after} instead of {before}.",
        "{shaper} 整形器将振动减至 {residual} %，未达到减半；调节时间由 {before} 变为 {after}。",
    ),
    "verdict.no_better": (
        "The {shaper} shaper does not reduce the vibration: {residual} % is left. Do not use it.",
        "{shaper} 整形器未减小振动：残余 {residual} %。请勿使用。",
    ),
    "verdict.designed": (
        "Shapers are designed. None was tried.",
        "整形器已设计，尚未试验。",
    ),
    "verdict.stated": (
        "The motor does not show the stated mode. The shapers are made for the stated frequency "
        "and were not tried.",
        "电机侧看不到所给的模态。整形器按所给频率设计，未经试验。",
    ),
    "verdict.not_seen": (
        "The motor shows no slow vibration after this move.",
        "该移动之后，电机侧未见低频振动。",
    ),
    "finding.motor_side": (
        "All of this is seen from the motor. What oscillates at the load while the motor stands in "
        "its friction is not seen here: watch the load, too.",
        "以上均为电机侧所见。电机被摩擦保持静止时，负载侧的振荡在此看不到：请同时观察负载。",
    ),
    "finding.not_excited": (
        "A move whose ramps last a whole number of periods excites nothing: change speed or "
        "acceleration. With a slow position loop or much friction the motor may not show the load.",
        "若加减速时间为周期的整数倍，则不会激起振动：请改变速度或加速度。"
        "位置环较慢或摩擦较大时，电机侧可能看不到负载的振动。",
    ),
    "finding.long_periods": (
        "Below {value} {unit} the time at the end holds fewer than three periods: such a mode is "
        "not seen. Stay longer.",
        "低于 {value} {unit} 时，保持时间内不足三个周期，看不到此类模态。请延长保持时间。",
    ),
    "finding.wide_mode": (
        "The mode differs between the moves, so that up to {value} {unit} may be left.",
        "各次移动的模态不同，因此残余可能达 {value} {unit}。",
    ),
    "finding.beyond_prediction": (
        "{value} {unit} of the vibration is left, more than predicted: something else oscillates, "
        "too, or the mode is not linear.",
        "残余振动 {value} {unit}，高于预测：还有其他振荡，或该模态非线性。",
    ),
    "finding.not_settled": (
        "The shaped move, too, is not settled after {value} {unit}.",
        "整形后的移动在 {value} {unit} 后仍未稳定。",
    ),
    "finding.samples_lost": (
        "{value} ring-downs lost too many samples and were left out.",
        "{value} 次衰减振荡丢失采样过多，未采用。",
    ),
    "finding.drive_filter": (
        "The drive has a filter of its own against this; the table shows its values. They were not "
        "tried, and the manual does not say whether it acts on cyclic positions: set them, and "
        "repeat the unshaped move.",
        "驱动器自带相应滤波器，数值见表。这些值未经试验，手册也未说明其是否作用于周期位置设定值："
        "设定后请重复未整形的移动。",
    ),
    "finding.drive_filter_range": (
        "The drive's own filter {parameter} cannot be set to this mode: it ends at {value} {unit}.",
        "驱动器自带滤波器 {parameter} 无法设定到该模态：其上限为 {value} {unit}。",
    ),
    "finding.drive_unstated": (
        "The manual states neither unit nor meaning of {parameter}: it is left as it is.",
        "手册未说明 {parameter} 的单位和含义：保持不变。",
    ),
    "finding.in_controller": (
        "The shaper belongs into the controller that makes the setpoints. Each setpoint is the sum "
        "of the shares of the setpoints that were due at the listed times before.",
        "整形器应置于生成设定值的控制器中。每个设定值为表中各延时之前设定值按份额之和。",
    ),
    "frequency": ("Frequency of the mode", "模态频率"),
    "damping": ("Damping ratio", "阻尼比"),
    "ring_downs": ("Ring-downs", "衰减振荡次数"),
    "explained": ("Share of the signal that is this mode", "该模态占信号的份额"),
    "unshaped": ("Vibration without shaper", "无整形器的振动"),
    "shaped": ("Vibration with shaper", "有整形器的振动"),
    "ratio": ("Vibration that is left", "残余振动"),
    "settling_unshaped": ("Settling time without shaper", "无整形器的调节时间"),
    "settling_shaped": (
        "Settling time with shaper, its delay included",
        "有整形器的调节时间（含延时）",
    ),
    "window": ("Settling window", "稳定窗口"),
    "head.shaper": ("Shaper", "整形器"),
    "head.shares": ("Shares (%)", "份额 (%)"),
    "head.times": ("Delays (ms)", "延时 (ms)"),
    "head.left": ("Predicted (%)", "预测残余 (%)"),
    "head.band": ("Within tolerance (Hz)", "容差内频率 (Hz)"),
    "head.parameter": ("Parameter", "参数"),
    "head.value": ("Value", "值"),
    "chosen": ("{shaper}, played", "{shaper}（已采用）"),
    "plain": ("{shaper}", "{shaper}"),
    "named": ("{parameter} {name}", "{parameter} {name}"),
    "chart": ("After the end of the move", "移动结束之后"),
    "chart.time": ("Time in s", "时间（s）"),
    "chart.position_error": ("Position error in rev", "位置误差（圈）"),
    "chart.speed": ("Speed in rpm", "速度（rpm）"),
    "chart.torque": ("Torque in % of rated", "转矩（额定的 %）"),
    "line.unshaped": ("without shaper", "无整形器"),
    "line.shaped": ("with shaper", "有整形器"),
}
_TONES: dict[Verdict, Literal["good", "warn", "plain"]] = {
    "verified": "good",
    "improved": "warn",
    "no_better": "warn",
    "designed": "plain",
    "stated": "warn",
    "not_seen": "warn",
}
_WARN = frozenset({"beyond_prediction", "not_settled", "samples_lost", "wide_mode"})


def report(result: ShapingResult) -> Section:
    """Verdict and findings, mode and comparison, shapers and drive values, and both traces."""
    grids: list[Grid] = []
    if result.shapers:
        grids.append(
            Grid(
                ("head.shaper", "head.shares", "head.times", "head.left", "head.band"),
                tuple(_cells(each, result) for each in result.shapers),
            )
        )
    if result.drive_values:
        rows = tuple(
            (
                Note("named", values={"parameter": each.parameter, "name": each.name}),
                f"{each.value:.4g} {each.unit}".rstrip(),
            )
            for each in result.drive_values
        )
        grids.append(Grid(("head.parameter", "head.value"), rows))
    charts = () if result.signal is None or not result.trace_s else (_chart(result, result.signal),)
    return Section(tuple(notes(result)), tuple(_rows(result)), charts, tuple(grids))


def notes(result: ShapingResult) -> list[Note]:
    """Notes on the result: the verdict first, then the findings."""
    places = {"shaper": (result.chosen or "").upper(), "residual": "", "before": "", "after": ""}
    if (found := result.comparison) is not None:
        places |= {
            "residual": f"{100.0 * found.ratio:.3g}",
            "before": _seconds(found.settling_unshaped_s, found),
            "after": _seconds(found.settling_shaped_s, found),
        }
    first = Note(f"verdict.{result.verdict}", _TONES[result.verdict], places)
    return [first, *(_finding(each) for each in result.findings)]


def _seconds(value: float | None, found: ShapingComparison) -> str:
    """A settling time as text; longer than the recorded time where it did not settle."""
    return f"> {found.watched_s:g} s" if value is None else f"{value:.3g} s"


def _finding(finding: ShapingFinding) -> Note:
    value = "" if finding.value is None else f"{finding.value:.3g}"
    places = {"value": value, "unit": finding.unit, "parameter": finding.parameter}
    return Note(f"finding.{finding.code}", "warn" if finding.code in _WARN else "plain", places)


def _rows(result: ShapingResult) -> list[Row]:
    rows: list[Row] = []
    if (mode := result.mode) is not None:
        rows += [
            Row("frequency", mode.frequency_hz, "Hz", mode.frequency_ci95_hz),
            Row("damping", mode.damping, "", mode.damping_ci95),
            Row("ring_downs", float(mode.ring_downs), ""),
            Row("explained", 100.0 * mode.explained, "%"),
        ]
    if (found := result.comparison) is not None:
        rows += _compared(found)
    return rows


def _compared(found: ShapingComparison) -> list[Row]:
    return [
        Row("unshaped", found.unshaped, found.unit, found.unshaped_ci95),
        Row("shaped", found.shaped, found.unit, found.shaped_ci95),
        Row("ratio", 100.0 * found.ratio, "%"),
        Row("settling_unshaped", found.settling_unshaped_s, "s"),
        Row("settling_shaped", found.settling_shaped_s, "s"),
        Row("window", found.settling_window, found.settling_unit),
    ]


def _cells(shaper: DesignedShaper, result: ShapingResult) -> tuple[Cell, ...]:
    name = "chosen" if shaper.kind == result.chosen and result.comparison else "plain"
    least, most = shaper.residual_percent
    low, high = shaper.tolerated_hz
    return (
        Note(name, values={"shaper": shaper.kind.upper()}),
        " / ".join(f"{100.0 * each.share:.2f}" for each in shaper.impulses),
        " / ".join(f"{1e3 * each.time_s:.1f}" for each in shaper.impulses),
        f"{least:.1f}–{most:.1f}",
        f"{low:.3g}–{high:.3g}",
    )


def _chart(result: ShapingResult, signal: Signal) -> Chart:
    return Chart(
        "chart",
        "chart.time",
        f"chart.{signal}",
        (
            Line("line.unshaped", result.trace_s, result.trace_unshaped),
            Line("line.shaped", result.trace_s, result.trace_shaped),
        ),
    )
