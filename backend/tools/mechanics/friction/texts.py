"""Texts of a friction map, English and Chinese, and its section of a report."""

from __future__ import annotations

from typing import Literal

from backend.tools.mechanics.friction.result import Code, Estimate, Finding, FrictionResult
from backend.tools.tool import Chart, Interval, Line, Note, Row, Section

TEXTS: dict[str, tuple[str, str]] = {
    "help": (
        "Map friction over speed and torque over position, both directions. The axis moves.",
        "测绘双向的摩擦-速度与转矩-位置曲线。轴会运动。",
    ),
    "lead": (
        "The axis turns at constant speeds, to and fro about where it stands, within the limits. "
        "Slow speeds take most of the time.",
        "轴在限制范围内以恒速围绕当前位置往复转动。低速占用大部分时间。",
    ),
    "start": ("Map the friction", "测绘摩擦"),
    "field.speeds": ("Speeds in each direction", "每个方向的速度数"),
    "field.slowest_rpm": ("Slowest speed", "最低速度"),
    "field.ripple": ("Ripple over one revolution", "单圈转矩脉动"),
    "field.orders": ("Highest order per revolution", "每转最高阶次"),
    "unit.slowest_rpm": ("rpm", "rpm"),
    "coulomb": ("Coulomb friction", "库仑摩擦"),
    "viscous": ("Viscous friction", "粘性摩擦"),
    "stribeck": ("Stribeck friction above Coulomb's", "斯特里贝克摩擦（高于库仑摩擦部分）"),
    "stribeck_speed": ("Stribeck speed", "斯特里贝克速度"),
    "load": ("Constant pull of the load", "负载恒定拉力"),
    "standstill": ("Break-away torque at standstill", "静止起动转矩"),
    "harmonic": ("Ripple, {order} per revolution", "转矩脉动，每转 {order} 次"),
    "over_speed": ("Torque over speed, both directions", "转矩-速度（双向）"),
    "over_angle": ("Torque over position, about its mean", "转矩-位置（相对均值）"),
    "speed": ("Speed (rpm)", "速度 (rpm)"),
    "angle": ("Motor angle (°)", "电机角度 (°)"),
    "torque": ("Torque (% of rated)", "转矩（额定转矩的 %）"),
    "curve": ("curve", "曲线"),
    "points": ("measured, 95 % band", "实测，95% 带"),
    "forward": ("forwards", "正向"),
    "backward": ("backwards", "反向"),
    "finding.mapped": (
        "Friction is mapped at {value} speeds, both directions counted.",
        "已在 {value} 个速度（双向合计）测得摩擦。",
    ),
    "finding.standstill_not_measured": (
        "Friction at standstill cannot be known from this map: the slowest speed was {value} "
        "{unit}.",
        "无法由本图谱得知静止摩擦：最低速度为 {value} {unit}。",
    ),
    "finding.stribeck_not_seen": (
        "No Stribeck curve shows down to {value} {unit}.",
        "低至 {value} {unit} 未见斯特里贝克曲线。",
    ),
    "finding.stribeck_not_reached": (
        "The height of the Stribeck curve cannot be known: friction still rises at the slowest "
        "speed, {value} {unit}.",
        "无法得知斯特里贝克曲线的高度：在最低速度 {value} {unit} 处摩擦仍在上升。",
    ),
    "finding.few_speeds": (
        "{value} speeds are too few to look for a Stribeck curve.",
        "{value} 个速度不足以判断斯特里贝克曲线。",
    ),
    "finding.ripple_not_asked": ("Ripple was not measured.", "未测量转矩脉动。"),
    "finding.ripple_needs_revolution": (
        "Ripple cannot be known: the travel or time leaves no slow whole revolution each way.",
        "无法得知转矩脉动：行程或时间不足以双向各慢转一整圈。",
    ),
    "finding.ripple_not_seen": (
        "No ripple above {value} {unit} of rated torque shows.",
        "未见超过额定转矩 {value} {unit} 的转矩脉动。",
    ),
    "finding.uneven_speeds": (
        "Up to {value} {unit} the axis did not turn evenly (stick-slip): these speeds are left "
        "out.",
        "在 {value} {unit} 及以下轴转动不均匀（爬行）：这些速度未计入。",
    ),
    "finding.fastest_by_travel": (
        "The travel limit leaves no speed above {value} {unit}.",
        "行程限值使速度不超过 {value} {unit}。",
    ),
    "finding.slowest_by_time": (
        "The time limit leaves no speed below {value} {unit}.",
        "时间限制使速度不低于 {value} {unit}。",
    ),
    "finding.model_misfit": (
        "The points differ from the model by up to {value} {unit}; the curve goes through the "
        "points.",
        "实测点与模型最多相差 {value} {unit}；曲线经过实测点。",
    ),
    "finding.compensation_in_controller": (
        "No object is known by which this drive compensates this ripple. The table over one motor "
        "revolution can be saved (CSV) for a controller that adds it to the torque command.",
        "未知该驱动器有补偿此转矩脉动的对象。可将电机一圈的补偿表保存为 CSV，"
        "供能将其叠加到转矩指令的控制器使用。",
    ),
    "save_table": ("Save the compensation table (CSV)", "保存补偿表 (CSV)"),
}
_TURN_RPM = 9.549296585513721
"""Factor from rad/s to rpm."""
_SHOWN = 8
_TONES: dict[Code, Literal["good", "warn"]] = {
    "mapped": "good",
    "uneven_speeds": "warn",
    "model_misfit": "warn",
}


def report(result: FrictionResult) -> Section:
    """Findings, parameters and charts; torques in Nm where the rated torque is known."""
    rated = result.rated_torque_nm
    torque, unit = (0.01 * rated, "N·m") if rated else (1.0, "%")
    slope, slope_unit = (0.01 * rated * _TURN_RPM, "N·m·s/rad") if rated else (1.0, "%/rpm")
    rows = [
        _row("coulomb", result.coulomb_percent, torque, unit),
        _row("viscous", result.viscous_percent_per_rpm, slope, slope_unit),
        _row("stribeck", result.stribeck_percent, torque, unit),
        _row("stribeck_speed", result.stribeck_speed_rpm, 1.0, "rpm"),
        _row("load", result.load_percent, torque, unit),
        _row("standstill", result.standstill_percent, torque, unit),
    ]
    rows += [
        Row(
            "harmonic",
            torque * each.amplitude_percent,
            unit,
            _scaled(each.amplitude_ci95_percent, torque),
            {"order": str(each.order_per_rev)},
        )
        for each in result.harmonics[:_SHOWN]
    ]
    notes = tuple(_note(finding) for finding in result.findings)
    charts = [_over_speed(result)]
    if result.ripple_angle_deg:
        charts.append(_over_angle(result))
    return Section(notes, tuple(rows), tuple(charts))


def _note(finding: Finding) -> Note:
    value = "" if finding.value is None else f"{finding.value:.3g}"
    places = {"value": value, "unit": finding.unit}
    return Note(f"finding.{finding.code}", _TONES.get(finding.code, "plain"), places)


def _row(name: str, found: Estimate | None, factor: float, unit: str) -> Row:
    if found is None:
        return Row(name, None, unit)
    return Row(name, factor * found.value, unit, _scaled(found.ci95, factor))


def _scaled(ends: Interval, factor: float) -> Interval:
    low, high = (None if end is None else factor * end for end in ends)
    return low, high


def _over_speed(result: FrictionResult) -> Chart:
    spread = tuple(
        0.5 * (p.torque_ci95_percent[1] - p.torque_ci95_percent[0]) for p in result.points
    )
    points = Line(
        "points",
        tuple(p.speed_rpm for p in result.points),
        tuple(p.torque_percent for p in result.points),
        spread,
    )
    curve = Line("curve", result.curve_speed_rpm, result.curve_percent)
    return Chart("over_speed", "speed", "torque", (curve, points))


def _over_angle(result: FrictionResult) -> Chart:
    lines = [
        _way("forward", result.ripple_angle_deg, result.ripple_forward_percent),
        _way("backward", result.ripple_angle_deg, result.ripple_backward_percent),
    ]
    return Chart("over_angle", "angle", "torque", tuple(lines))


def _way(name: str, angle: tuple[float, ...], torque: tuple[float | None, ...]) -> Line:
    seen = [(a, t) for a, t in zip(angle, torque, strict=True) if t is not None]
    return Line(name, tuple(a for a, _ in seen), tuple(t for _, t in seen))
