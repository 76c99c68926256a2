"""Texts of a health check, English and Chinese, and its section of a report."""

from __future__ import annotations

from backend.tools.tool import Note, Row, Section
from backend.tools.watching.health.result import UNITS, HealthResult, HealthValue

TEXTS: dict[str, tuple[str, str]] = {
    "help": (
        "Measure what the condition of an axis is followed by: resonances, friction, inertia. "
        "The axis moves.",
        "测量用于跟踪轴状态的量：谐振、摩擦、惯量。轴会运动。",
    ),
    "lead": (
        "The axis makes the chosen measurements one after another, within the limits, as often as "
        "there are rounds. Three rounds or more make a baseline; two compare with it.",
        "轴在限制范围内依次进行所选测量，重复所设轮数。三轮及以上可作为基线；两轮可与基线比较。",
    ),
    "start": ("Measure", "测量"),
    "field.rounds": ("Rounds", "轮数"),
    "field.response": ("Frequency response", "频率响应"),
    "field.friction": ("Friction over speed", "摩擦-速度"),
    "field.inertia": ("Inertia", "惯量"),
    "field.step_rpm": ("Step of speed (0: none)", "速度阶跃（0：不做）"),
    "field.lowest_hz": ("Lowest frequency", "最低频率"),
    "field.speeds": ("Speeds in each direction", "每个方向的速度数"),
    "field.slowest_rpm": ("Slowest speed", "最低速度"),
    "unit.step_rpm": ("rpm", "rpm"),
    "unit.lowest_hz": ("Hz", "Hz"),
    "unit.slowest_rpm": ("rpm", "rpm"),
    "resonance": ("Resonance {number}, round {round}", "谐振 {number}，第 {round} 轮"),
    "antiresonance": ("Antiresonance {number}, round {round}", "反谐振 {number}，第 {round} 轮"),
    "friction": ("Friction, round {round}", "摩擦，第 {round} 轮"),
    "inertia": ("Inertia, round {round}", "惯量，第 {round} 轮"),
    "step_rise": ("Rise time of the step, round {round}", "阶跃上升时间，第 {round} 轮"),
    "step_overshoot": ("Overshoot of the step, round {round}", "阶跃超调，第 {round} 轮"),
    "measured": ("{rounds} rounds were measured.", "已测量 {rounds} 轮。"),
    "missing": (
        "Measured without an answer in round {round}: {name}.",
        "第 {round} 轮已测量但没有结果：{name}。",
    ),
}


def report(result: HealthResult) -> Section:
    """Every quantity of every round, and the missing ones."""
    notes = [Note("measured", values={"rounds": str(len(result.rounds))})]
    rows = []
    for index, one in enumerate(result.rounds, 1):
        notes += [
            Note("missing", "warn", {"round": str(index), "name": name}) for name in one.missing
        ]
        rows += [_row(each, index) for each in one.values]
    return Section(tuple(notes), tuple(rows))


def _row(each: HealthValue, index: int) -> Row:
    places = {"number": str(each.number), "round": str(index)}
    ends = None if each.low is None and each.high is None else (each.low, each.high)
    return Row(each.quantity, each.value, UNITS[each.quantity], ends, places)
