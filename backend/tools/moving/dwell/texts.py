"""Texts of a dwell at one frequency, English and Chinese, and its section of a report."""

from __future__ import annotations

from typing import Literal

from backend.tools.moving.dwell.result import Code, DwellEstimate, DwellFinding, DwellResult
from backend.tools.tool import Chart, Line, Note, Row, Section

TEXTS: dict[str, tuple[str, str]] = {
    "help": (
        "Vibrate at one frequency, for a person who looks for what rattles by hand and ear. The "
        "axis moves.",
        "以单一频率激振，供人用手和耳查找异响部件。轴会运动。",
    ),
    "lead": (
        "The axis vibrates at the frequency, faded in and out, and the step of the job shows the "
        "amplitude at the motor meanwhile. Keep hands away from what moves; STOP ends it at any "
        "moment.",
        "轴以该频率振动，渐入渐出，任务步骤实时显示电机处的幅值。请勿触碰运动部件；"
        "按“停止”（STOP）可随时结束。",
    ),
    "start": ("Vibrate", "开始激振"),
    "field.frequency_hz": ("Frequency", "频率"),
    "field.by": ("Carried by", "激振方式"),
    "field.amplitude_rpm": ("Amplitude of the speed", "速度幅值"),
    "field.amplitude_percent": ("Amplitude of the torque", "转矩幅值"),
    "field.turn_rpm": ("Slow speed beneath it", "叠加的低速"),
    "field.duration_s": ("Time at full amplitude", "满幅时间"),
    "unit.frequency_hz": ("Hz", "Hz"),
    "unit.duration_s": ("s", "s"),
    "unit.amplitude_rpm": ("rpm", "rpm"),
    "unit.amplitude_percent": ("%", "%"),
    "unit.turn_rpm": ("rpm", "rpm"),
    "by.speed": ("speed setpoint", "速度设定值"),
    "by.torque": ("torque ahead of the speed loop", "速度环前馈转矩"),
    "excitation": ("Excitation", "激振幅值"),
    "speed": ("Speed at the frequency, amplitude", "该频率的速度幅值"),
    "position": ("Position at the frequency, amplitude", "该频率的位置幅值"),
    "torque": ("Torque at the frequency, amplitude", "该频率的转矩幅值"),
    "phase": ("Phase of the speed over the excitation", "速度相对激振的相位"),
    "harmonic": ("Speed at {multiple} times the frequency", "{multiple} 倍频的速度幅值"),
    "over": ("Time that these values are of", "上述数值所依据的时间"),
    "over_time": ("Amplitude while it vibrated", "激振过程中的幅值"),
    "axis.time": ("Time (s)", "时间 (s)"),
    "axis.speed": ("Amplitude of the speed (rpm)", "速度幅值 (rpm)"),
    "line": ("speed", "速度"),
    "finding.excited": (
        "The motor vibrated at this frequency with {value} {unit}.",
        "电机以该频率振动，幅值为 {value} {unit}。",
    ),
    "finding.not_seen": (
        "The motor shows no vibration at this frequency; there is no more than {value} {unit}.",
        "电机在该频率未见振动；不超过 {value} {unit}。",
    ),
    "finding.turn_slowly": (
        "Friction may hold the axis at standstill: take a larger amplitude, or let it turn slowly.",
        "静止时摩擦可能阻止振动：请增大幅值或让轴慢速转动。",
    ),
    "finding.not_linear": (
        "A multiple of the frequency has {value} {unit} of the amplitude: something in the way of "
        "the torque is not linear, such as backlash, friction or a part that rattles.",
        "倍频分量达到幅值的 {value} {unit}：传动路径中存在非线性，例如间隙、摩擦或松动部件。",
    ),
    "finding.linear": (
        "No multiple of the frequency has {value} {unit} of the amplitude.",
        "没有倍频分量达到幅值的 {value} {unit}。",
    ),
    "finding.level_changed": (
        "The amplitude changed by {value} {unit} between the beginning and the end.",
        "幅值从开始到结束变化了 {value} {unit}。",
    ),
    "finding.harmonics_beyond_band": (
        "Multiples of the frequency above {value} {unit} are not stated: the samples of the bus do "
        "not show them.",
        "不对 {value} {unit} 以上的倍频作出结论：总线采样无法显示。",
    ),
    "finding.blocks_lost": (
        "{value} {unit} of the samples did not come.",
        "有 {value} {unit} 的采样未到达。",
    ),
    "finding.motor_side": (
        "All of this is seen from the motor: which part rattles is for hand and ear.",
        "以上均从电机侧观察：哪个部件松动需用手和耳判断。",
    ),
}
_TONES: dict[Code, Literal["good", "warn"]] = {
    "excited": "good",
    "not_seen": "warn",
    "not_linear": "warn",
    "level_changed": "warn",
    "blocks_lost": "warn",
}


def report(result: DwellResult) -> Section:
    """Findings, amplitudes with their intervals, and the amplitude over time."""
    unit = "rpm" if result.by == "speed" else "%"
    rows = [
        Row("excitation", result.excitation, unit),
        _row("speed", result.speed_rpm, "rpm"),
        _row("position", result.position_deg, "°"),
        _row("torque", result.torque_percent, "%"),
        _row("phase", result.phase_deg, "°"),
    ]
    rows += [
        Row(
            "harmonic", each.speed_rpm, "rpm", each.speed_ci95_rpm, {"multiple": str(each.multiple)}
        )
        for each in result.harmonics
    ]
    rows.append(Row("over", result.over_s, "s"))
    line = Line("line", result.trace_s, result.trace_rpm)
    chart = Chart("over_time", "axis.time", "axis.speed", (line,))
    return Section(tuple(_note(each) for each in result.findings), tuple(rows), (chart,))


def _note(finding: DwellFinding) -> Note:
    value = "" if finding.value is None else f"{finding.value:.3g}"
    places = {"value": value, "unit": finding.unit}
    return Note(f"finding.{finding.code}", _TONES.get(finding.code, "plain"), places)


def _row(name: str, found: DwellEstimate | None, unit: str) -> Row:
    return Row(name, None, unit) if found is None else Row(name, found.value, unit, found.ci95)
