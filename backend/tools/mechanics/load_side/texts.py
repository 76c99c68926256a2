"""Texts of the load side, English and Chinese, and its section of a report."""

from __future__ import annotations

from typing import Literal

from backend.tools.mechanics.load_side.result import Code, Estimate, Finding, LoadSideResult
from backend.tools.tool import Chart, Line, Note, Row, Section

TEXTS: dict[str, tuple[str, str]] = {
    "help": (
        "Measure backlash, stiffness and transmission error with a second encoder. The axis moves.",
        "用第二编码器测量间隙、刚度与传动误差。轴会运动。",
    ),
    "lead": (
        "The axis turns slowly both ways and then to and fro, within the limits. The drive must "
        "report a second position, of an encoder at the load.",
        "轴先双向慢转，再在限制范围内往复运动。驱动器必须报告装在负载侧的第二编码器的位置。",
    ),
    "start": ("Measure the load side", "测量负载侧"),
    "field.gear_ratio": ("Gear ratio (motor : load)", "减速比（电机 : 负载）"),
    "field.motor_inertia_kgm2": ("Inertia of the motor alone", "电机自身惯量"),
    "field.slow_rpm": ("Speed of the slow passes", "低速运动的速度"),
    "unit.gear_ratio": ("rev/rev", "圈/圈"),
    "unit.motor_inertia_kgm2": ("kg·m²", "kg·m²"),
    "unit.slow_rpm": ("rpm", "rpm"),
    "backlash": ("Backlash at the load", "负载侧间隙"),
    "backlash_motor": ("Backlash at the motor", "折算到电机侧的间隙"),
    "lost_motion": ("Lost motion between slow passes", "低速往返的失动量"),
    "stiffness": ("Torsional stiffness at the load", "负载侧扭转刚度"),
    "stiffness_least": ("Torsional stiffness at the load, at least", "负载侧扭转刚度，至少"),
    "locked_motor": ("Load on the held motor swings at", "电机固定时负载的摆动频率"),
    "load_inertia": ("Inertia of the load, at the motor shaft", "负载惯量（折算到电机轴）"),
    "error_span": ("Transmission error, peak to peak", "传动误差（峰峰值）"),
    "order": ("Transmission error, {order} per load revolution", "传动误差，负载每转 {order} 次"),
    "counts": ("Counts per load revolution", "负载每转计数"),
    "over_angle": ("Transmission error over the load's angle", "传动误差-负载角度"),
    "angle": ("Load angle (°)", "负载角度 (°)"),
    "error": ("Load behind the motor (°)", "负载滞后于电机 (°)"),
    "curve": ("error", "误差"),
    "finding.measured": (
        "The backlash is {value}{unit} at the load. If that is more than the machine permits, "
        "check coupling, keys, belt tension and gear for wear, and measure again after the repair.",
        "负载侧间隙为 {value}{unit}。若超过机器允许值，请检查联轴器、键、同步带张力和齿轮的磨损，"
        "维修后重新测量。",
    ),
    "finding.backlash_not_seen": (
        "No backlash shows; there is no more than {value}{unit} at the load.",
        "未见间隙；负载侧间隙不超过 {value}{unit}。",
    ),
    "finding.flank_kept": (
        "Backlash and stiffness cannot be known: it is not certain on which flank the load lies, "
        "as where friction or a pull keeps it on one. Lost motion is {value}{unit} at most. "
        "Permit more speed and torque, or balance the load.",
        "无法得知间隙和刚度：无法确定负载贴在哪一侧齿面，例如摩擦或恒定拉力使其始终贴在一侧。"
        "失动量至多 {value}{unit}。请允许更高的速度和转矩，或平衡负载。",
    ),
    "finding.stiffness_not_seen": (
        "The coupling is too stiff for a value: no twist shows above its uncertainty.",
        "扭转刚度太大，无法给出数值：扭转未超过其不确定度。",
    ),
    "finding.motor_inertia_unknown": (
        "Stiffness needs the inertia of the motor alone: the drive does not state it, and none was "
        "given.",
        "求刚度需要电机自身惯量：驱动器未给出，也未填写。",
    ),
    "finding.rated_torque_unknown": (
        "Stiffness cannot be known: nobody states the rated torque that 100 % means.",
        "无法得知刚度：未给出与 100 % 对应的额定转矩。",
    ),
    "finding.setpoints_held": (
        "Stiffness cannot be known: the drive holds each setpoint for a cycle (no 60C2h), and the "
        "torque within a cycle is not seen.",
        "无法得知刚度：驱动器在每个周期内保持设定值（无 60C2h），看不到周期内的转矩。",
    ),
    "finding.pull_large": (
        "Stiffness cannot be known: a pull takes too much of the torque that accelerates the load. "
        "Balance the load, or permit more torque and speed.",
        "无法得知刚度：恒定拉力占用了过多用于加速负载的转矩。请平衡负载，或允许更高的转矩和速度。",
    ),
    "finding.load_light": (
        "Stiffness cannot be known: the inertia of the load is no larger than its uncertainty.",
        "无法得知刚度：负载惯量未超过其不确定度。",
    ),
    "finding.revolution_not_covered": (
        "The travel covers no whole revolution of the load: its transmission error is that of the "
        "part that was covered.",
        "行程未覆盖负载一整圈：传动误差仅为所覆盖部分。",
    ),
}
_SHOWN = 6
_TONES: dict[Code, Literal["good", "warn"]] = {
    "measured": "good",
    "backlash_not_seen": "good",
    "flank_kept": "warn",
}


def report(result: LoadSideResult) -> Section:
    """Findings, figures and the transmission error over the angle."""
    rows = [
        _row("backlash", result.backlash_deg, "°"),
        _row("backlash_motor", result.backlash_motor_rev, "rev"),
        _row("lost_motion", result.lost_motion_deg, "°"),
        _row("stiffness", result.stiffness_nm_per_rad, "N·m/rad"),
    ]
    if result.stiffness_at_least_nm_per_rad is not None:
        rows[-1] = Row("stiffness_least", result.stiffness_at_least_nm_per_rad, "N·m/rad")
    rows += [
        _row("locked_motor", result.locked_motor_hz, "Hz"),
        _row("load_inertia", result.load_inertia_kgm2, "kg·m²"),
        _row("error_span", result.error_span_deg, "°"),
    ]
    rows += [
        Row(
            "order",
            each.amplitude_deg,
            "°",
            each.amplitude_ci95_deg,
            {"order": f"{each.order_per_rev:g}"},
        )
        for each in result.error_orders[:_SHOWN]
    ]
    rows.append(Row("counts", result.counts_per_load_rev, ""))
    line = Line("curve", result.error_angle_deg, result.error_deg)
    chart = Chart("over_angle", "angle", "error", (line,))
    return Section(tuple(_note(each) for each in result.findings), tuple(rows), (chart,))


def _note(finding: Finding) -> Note:
    value = "" if finding.value is None else f"{finding.value:.3g}"
    places = {"value": value, "unit": finding.unit}
    return Note(f"finding.{finding.code}", _TONES.get(finding.code, "plain"), places)


def _row(name: str, found: Estimate | None, unit: str) -> Row:
    if found is None:
        return Row(name, None, unit)
    return Row(name, found.value, unit, found.ci95)
