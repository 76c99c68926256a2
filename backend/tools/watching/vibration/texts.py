"""Texts of a map of vibration over speed, English and Chinese, and its section of a report."""

from __future__ import annotations

from typing import Literal

from backend.tools.tool import Cell, Chart, Grid, Line, Note, Row, Section
from backend.tools.watching.vibration.result import Code, VibrationFinding, VibrationResult

TEXTS: dict[str, tuple[str, str]] = {
    "help": (
        "Map vibration over speed, both directions: orders, frequencies and the resonances that "
        "orders excite. The axis moves.",
        "测绘双向的振动-速度图谱：阶次、频率以及由阶次激发的谐振。轴会运动。",
    ),
    "lead": (
        "The axis turns at constant speeds, to and fro about where it stands, within the limits. "
        "What repeats per revolution is distinguished from what has a frequency of its own.",
        "轴在限制范围内以恒速围绕当前位置往复转动，由此区分随转速变化的阶次与频率固定的振动。",
    ),
    "start": ("Map the vibration", "测绘振动"),
    "field.speeds": ("Speeds in each direction", "每个方向的速度数"),
    "field.closer": ("Further speeds about the highest level", "最高振动附近补测的速度数"),
    "field.slowest_rpm": ("Slowest speed", "最低速度"),
    "unit.slowest_rpm": ("rpm", "rpm"),
    "resonance": ("Resonance", "谐振"),
    "order": ("Order {order}, largest at {speed} rpm", "{order} 阶，在 {speed} rpm 处最大"),
    "frequency": ("Fixed frequency", "固定频率"),
    "head.order": ("Order per revolution", "每转阶次"),
    "head.interval": ("95 % interval", "95 % 区间"),
    "head.level": ("Speed amplitude (rpm)", "速度幅值 (rpm)"),
    "head.torque": ("Torque amplitude (%)", "转矩幅值 (%)"),
    "head.at": ("At (rpm)", "所在速度 (rpm)"),
    "head.place": ("Where it may come from", "可能来源"),
    "head.resonance": ("Resonance (Hz)", "谐振 (Hz)"),
    "head.excited_by": ("Excited by order", "激发阶次"),
    "head.avoid": ("Speeds to avoid (rpm)", "应避开的速度 (rpm)"),
    "head.speed": ("Speed (rpm)", "速度 (rpm)"),
    "head.speed_rms": ("Speed, RMS (rpm)", "速度均方根 (rpm)"),
    "head.torque_rms": ("Torque, RMS (%)", "转矩均方根 (%)"),
    "head.main": ("Largest component", "最大分量"),
    "main": (
        "{frequency} Hz, order {order}, {level} rpm",
        "{frequency} Hz，{order} 阶，{level} rpm",
    ),
    "none": ("none stands out", "无突出分量"),
    "place.whole": (
        "motor, or what turns with its shaft: coupling, screw, cogging",
        "电机或随其轴转动的部件：联轴器、丝杠、齿槽转矩",
    ),
    "place.not_whole": (
        "not fixed to the motor shaft: gear, bearing, belt",
        "不随电机轴转动的部件：齿轮、轴承、同步带",
    ),
    "place.unknown": ("the interval is too wide to state it", "区间过宽，无法判断"),
    "over_speed": ("Amplitude of orders over speed", "各阶次幅值-速度"),
    "axis.speed": ("Speed (rpm)", "速度 (rpm)"),
    "axis.level": ("Amplitude of the speed (rpm)", "速度幅值 (rpm)"),
    "line.first": ("largest order", "最大阶次"),
    "line.second": ("second order by size", "第二大阶次"),
    "line.third": ("third order by size", "第三大阶次"),
    "line.fourth": ("fourth order by size", "第四大阶次"),
    "finding.resonance": (
        "A resonance at {value} {unit} is excited where an order meets it.",
        "在 {value} {unit} 处有谐振，当某阶次达到该频率时被激发。",
    ),
    "finding.orders_only": (
        "{value} components repeat by the angle; no resonance shows between the speeds measured.",
        "有 {value} 个分量随转角重复；在所测速度范围内未见谐振。",
    ),
    "finding.nothing_seen": (
        "No order and no frequency stands out: none has more than about {value} {unit} at the "
        "motor.",
        "没有突出的阶次或频率：电机处均不超过约 {value} {unit}。",
    ),
    "finding.fixed_frequency": (
        "At {value} {unit} the axis vibrates at several speeds alike: no order excites it. A loop "
        "with too much gain or a source outside does.",
        "在 {value} {unit} 处，轴在多个速度下同样振动：并非由阶次激发，而是由过高的环路增益或外部"
        "振源引起。",
    ),
    "finding.highest_at_end": (
        "The level still rises at the fastest speed, {value} {unit}: whether a resonance follows "
        "cannot be known.",
        "在最高速度 {value} {unit} 处振动仍在上升：无法得知其后是否有谐振。",
    ),
    "finding.not_closer": (
        "No time was left for further speeds about the highest level. Permit more time or measure "
        "fewer speeds.",
        "没有时间在最高振动附近补测。请允许更长时间或减少速度数。",
    ),
    "finding.unassigned": (
        "At {value} speeds there are components that keep neither order nor frequency, as those "
        "do that the sampling folds.",
        "在 {value} 个速度下存在既不保持阶次也不保持频率的分量，采样混叠的分量即如此。",
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
    "finding.samples_lost": (
        "{value} plateaus lost too many samples and are left out.",
        "有 {value} 段恒速因丢失过多采样而未计入。",
    ),
    "finding.band": (
        "Nothing above {value} {unit} is stated: the samples of the bus do not show it, or fold it "
        "to a lower frequency.",
        "不对 {value} {unit} 以上作出结论：总线采样无法显示，或将其混叠到较低频率。",
    ),
    "finding.highest_order": (
        "At the fastest speed orders above {value} lie beyond this band.",
        "在最高速度下，{value} 阶以上超出该频带。",
    ),
    "finding.motor_side": (
        "All of this is seen from the motor, with the loops as they are: a part that vibrates "
        "behind a soft coupling may not show.",
        "以上均从电机侧、在当前环路设置下观察：软联轴器之后部件的振动可能无法显示。",
    ),
    "finding.listen": (
        "To find the part by hand and ear, let the axis dwell at {value} {unit}.",
        "要用手和耳找到该部件，请让轴在 {value} {unit} 处定频激振。",
    ),
}
_SHOWN = 8
_LINES = ("line.first", "line.second", "line.third", "line.fourth")
_TONES: dict[Code, Literal["good", "warn"]] = {
    "resonance": "warn",
    "fixed_frequency": "warn",
    "highest_at_end": "warn",
    "not_closer": "warn",
    "uneven_speeds": "warn",
    "samples_lost": "warn",
    "nothing_seen": "good",
    "orders_only": "good",
}


def report(result: VibrationResult) -> Section:
    """Findings, resonances and orders with their intervals, speeds, and levels over speed."""
    rows = [
        Row("resonance", each.frequency_hz, "Hz", each.frequency_ci95_hz)
        for each in result.resonances
    ]
    rows += [
        Row("frequency", each.frequency_hz, "Hz", each.frequency_ci95_hz)
        for each in result.frequencies[:_SHOWN]
    ]
    grids = (_resonances(result), _orders(result), _speeds(result))
    charts = (_chart(result),) if result.orders else ()
    notes = tuple(_note(each) for each in result.findings)
    return Section(notes, tuple(rows), charts, tuple(grid for grid in grids if grid.rows))


def _note(finding: VibrationFinding) -> Note:
    value = "" if finding.value is None else f"{finding.value:.3g}"
    places = {"value": value, "unit": finding.unit}
    return Note(f"finding.{finding.code}", _TONES.get(finding.code, "plain"), places)


def _resonances(result: VibrationResult) -> Grid:
    heads = ("head.resonance", "head.excited_by", "head.speed", "head.avoid")
    rows = tuple(
        (
            f"{each.frequency_hz:.4g}",
            f"{one.order_per_rev:.4g}",
            f"{one.speed_rpm:.4g}",
            f"{one.low_rpm:.4g}–{one.high_rpm:.4g}",
        )
        for each in result.resonances
        for one in each.avoid
    )
    return Grid(heads, rows)


def _orders(result: VibrationResult) -> Grid:
    heads = ("order", "interval", "level", "torque", "at", "place")
    rows = tuple(
        (
            f"{each.order_per_rev:.5g}",
            "–".join(f"{end:.5g}" for end in each.order_ci95),
            f"{each.largest_rpm:.3g}",
            f"{each.torque_percent:.3g}",
            f"{each.at_rpm:.4g}",
            Note(f"place.{each.place}"),
        )
        for each in result.orders[:_SHOWN]
    )
    return Grid(tuple(f"head.{name}" for name in heads), rows)


def _speeds(result: VibrationResult) -> Grid:
    heads = ("head.speed", "head.speed_rms", "head.torque_rms", "head.main")
    rows: list[tuple[Cell, ...]] = []
    for each in result.speeds:
        main: Cell = Note("none")
        if each.parts:
            largest = each.parts[0]
            main = Note(
                "main",
                values={
                    "frequency": f"{largest.frequency_hz:.4g}",
                    "order": f"{largest.order_per_rev:.4g}",
                    "level": f"{largest.speed_rpm:.3g}",
                },
            )
        rms = f"{each.speed_rms_rpm:.3g}", f"{each.torque_rms_percent:.3g}"
        rows.append((f"{each.speed_rpm:.4g}", *rms, main))
    return Grid(heads, tuple(rows))


def _chart(result: VibrationResult) -> Chart:
    lines = tuple(
        Line(name, *_sorted(each.level_speed_rpm, each.level_rpm))
        for name, each in zip(_LINES, result.orders, strict=False)
    )
    return Chart("over_speed", "axis.speed", "axis.level", lines)


def _sorted(
    x: tuple[float, ...], y: tuple[float, ...]
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    pairs = sorted(zip(x, y, strict=True))
    return tuple(p[0] for p in pairs), tuple(p[1] for p in pairs)
