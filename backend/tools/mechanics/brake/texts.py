"""Texts of a brake test, English and Chinese, and its section of a report.

Signal words as in ISO 3864-2: danger is death or serious injury if it is not avoided, warning is
where either could result.
"""

from __future__ import annotations

from typing import Literal

from backend.tools.mechanics.brake.result import BrakeResult, BrakeWay, Verdict
from backend.tools.thresholds import brake_evaluate
from backend.tools.thresholds import brake_texts as threshold
from backend.tools.tool import Chart, Line, Note, Row, Section

TEXTS: dict[str, tuple[str, str]] = {
    "help": (
        "Torque against the closed holding brake, both directions, until the test torque or slip. "
        "The axis is energised.",
        "在抱闸抱紧时双向施加转矩，直至达到测试转矩或打滑。轴会得电。",
    ),
    "lead": (
        "The axis is energised while its holding brake stays closed, and the torque rises to the "
        "test torque, forwards and then backwards. Where the shaft moves by the slip limit, the "
        "torque is removed in the next cycle.",
        "抱闸始终抱紧，轴得电，转矩先正向后反向升至测试转矩。轴移动达到打滑限值时，"
        "在下一个周期撤去转矩。",
    ),
    "danger": (
        "DANGER. A hanging load falls where its brake slips: support it so that it can neither "
        "fall nor be lifted off its support, and let nobody be below it or within its reach.",
        "危险。抱闸打滑时悬挂负载会坠落：请将负载支撑牢固，使其既不能坠落也不会被抬离支撑，"
        "其下方及运动范围内不得有人。",
    ),
    "warning": (
        "WARNING. The shaft may turn suddenly. Keep away from everything that it drives. While "
        "the drive does not control the brake (its output has another function), nothing but "
        "this brake holds the axis.",
        "警告。轴可能突然转动，请远离其驱动的所有部件。驱动器在测试期间不控制抱闸（其输出已改为"
        "其他功能），轴仅由该抱闸保持。",
    ),
    "step.support": (
        "1. Move the load to its lowest place or support it there; lock the support.",
        "1. 将负载移到最低位置，或在原处支撑并锁定支撑。",
    ),
    "step.clear": (
        "2. Clear the danger zone, and keep STOP within reach.",
        "2. 使所有人离开危险区域，并确保“停止”按钮触手可及。",
    ),
    "step.state": (
        "3. State below what hangs at the axis, then start. Remove the support after a brake that "
        "held, and never after one that slipped.",
        "3. 在下方声明轴上的悬挂情况，然后启动。抱闸能够保持时，测试后方可撤去支撑；"
        "抱闸打滑时切勿撤去。",
    ),
    "state_first": ("State first what hangs at the axis.", "请先声明轴上的悬挂情况。"),
    "start": ("Test the brake", "测试抱闸"),
    "field.test_percent": ("Test torque (% of rated)", "测试转矩（额定的 %）"),
    "field.test_torque_nm": ("Test torque (N·m), instead", "测试转矩 (N·m)，替代百分比"),
    "field.brake_rated_nm": ("Rated torque of the brake (N·m)", "抱闸额定转矩 (N·m)"),
    "field.slip_limit_rev": ("Slip limit (revolutions)", "打滑限值（圈）"),
    "field.ramp_s": ("Time of the ramp (s)", "斜坡时间 (s)"),
    "field.brake_supply_cut": (
        "I have disconnected the brake's supply",
        "我已断开抱闸电源",
    ),
    "field.nothing_hangs": (
        "No load pulls at this axis, whether its brake holds or not",
        "无论抱闸是否抱紧，都没有负载对此轴施力（如重力、弹簧力）",
    ),
    "field.load_supported": (
        "The hanging load is supported and nobody is below it",
        "悬挂负载已支撑，且其下方无人",
    ),
    "verdict.held": (
        "The brake held {value} % of the motor's rated torque in both directions.",
        "抱闸双向保持了电机额定转矩的 {value} %。",
    ),
    "verdict.slipped": (
        "The brake slipped at {value} % of the motor's rated torque. Do not rely on it: secure "
        "the load, and have the brake repaired or replaced.",
        "抱闸在电机额定转矩的 {value} % 处打滑。请勿依赖该抱闸：固定负载，并修理或更换抱闸。",
    ),
    "verdict.not_closed": (
        "The brake is not closed, or holds less than {value} % of the motor's rated torque. "
        "Secure the load; then look at the brake's wiring and at its output.",
        "抱闸未抱紧，或保持转矩低于电机额定转矩的 {value} %。请固定负载，"
        "然后检查抱闸接线及其输出。",
    ),
    "verdict.cannot_be_tested": ("The brake cannot be tested.", "无法测试抱闸。"),
    "obstacle.means_unknown": (
        "Nothing is known of how this drive could keep its brake closed while it is enabled. "
        "Disconnect the brake's supply, state that, and start again.",
        "不知道该驱动器在使能时如何使抱闸保持抱紧。请断开抱闸电源并声明，然后重新开始。",
    ),
    "obstacle.built_in": (
        "The brake inside the motor opens with the power stage; the manual prints no other way.",
        "电机内置抱闸随功率级得电而松开；手册未给出其他方式。",
    ),
    "obstacle.fixed_output": (
        "The drive's output for the brake opens it when the axis is enabled, and cannot be given "
        "another function. Disconnect the brake's supply, state that, and start again.",
        "轴使能时驱动器的抱闸输出会松开抱闸，且无法改为其他功能。请断开抱闸电源并声明，"
        "然后重新开始。",
    ),
    "obstacle.bus_bit": (
        "Process data rule the brake (60FEh), or the drive by itself: the manual's excerpt does "
        "not say which output, nor how to change its function. Disconnect the brake's supply, "
        "state that, and start again.",
        "抱闸由过程数据 (60FEh) 或驱动器自身控制：手册节选未说明是哪个输出，"
        "也未说明如何更改其功能。"
        "请断开抱闸电源并声明，然后重新开始。",
    ),
    "obstacle.no_output": (
        "No output of the drive has the function of a brake. Where the drive does not control the "
        "brake, disconnect the brake's supply, state that, and start again.",
        "驱动器没有具有抱闸功能的输出。若抱闸不由驱动器控制，请断开抱闸电源并声明，然后重新开始。",
    ),
    "obstacle.output_inverted": (
        "The brake's output has inverted logic, so that another function might open the brake. "
        "Disconnect the brake's supply, state that, and start again.",
        "抱闸输出为反逻辑，改为其他功能可能会松开抱闸。请断开抱闸电源并声明，然后重新开始。",
    ),
    "obstacle.output_forced": (
        "60FEh would switch the brake's output on as soon as it has another function. Release the "
        "forced outputs first.",
        "一旦改为其他功能，60FEh 会接通抱闸输出。请先释放强制输出。",
    ),
    "obstacle.no_torque_mode": (
        "The drive takes no torque with every cycle over this bus (cyclic synchronous torque).",
        "该驱动器在此总线上不能逐周期接收转矩（周期同步转矩模式，CST）。",
    ),
    "obstacle.windup_beyond_limit": (
        "The shaft twisted elastically by the slip limit, without any slip. Raise the slip limit, "
        "or test with less torque.",
        "轴的弹性扭转已达到打滑限值，但未打滑。请提高打滑限值，或以较小转矩测试。",
    ),
    "obstacle.samples_lost": (
        "Samples were lost on the bus during the test, so that nothing is known of the brake. "
        "Secure the load, and repeat the test.",
        "测试期间总线上丢失了采样，无法判断抱闸状况。请固定负载，然后重新测试。",
    ),
    "crept": (
        "The shaft moved by {value} rev and did not come back: less than the slip limit.",
        "轴移动了 {value} 圈且未返回：低于打滑限值。",
    ),
    "torque_short": (
        "The drive reached only {value} % of the motor's rated torque: look at its torque limits.",
        "驱动器仅达到电机额定转矩的 {value} %：请检查其转矩限值。",
    ),
    "by.output": (
        "The brake was kept closed by its output, which had another function meanwhile.",
        "抱闸由其输出保持抱紧，该输出在测试期间改为其他功能。",
    ),
    "by.supply": (
        "Somebody stated that the brake's supply was disconnected.",
        "操作人员声明已断开抱闸电源。",
    ),
    "measured_at": ("Tested at {at} (UTC).", "测试时间 {at} (UTC)。"),
    "test_torque": ("Test torque", "测试转矩"),
    "torque.forward": ("Torque carried, forwards", "承受转矩，正向"),
    "torque.backward": ("Torque carried, backwards", "承受转矩，反向"),
    "of_brake": ("Torque carried, of the brake's rating", "承受转矩，占抱闸额定值"),
    "travel.forward": ("Travel, forwards", "行程，正向"),
    "travel.backward": ("Travel, backwards", "行程，反向"),
    "windup.forward": ("of it elastic windup, forwards", "其中弹性扭转，正向"),
    "windup.backward": ("of it elastic windup, backwards", "其中弹性扭转，反向"),
    "slip.forward": ("of it slip, forwards", "其中打滑，正向"),
    "slip.backward": ("of it slip, backwards", "其中打滑，反向"),
    "abort.forward": ("Slip limit to torque gone, forwards", "打滑限值至转矩消失，正向"),
    "abort.backward": ("Slip limit to torque gone, backwards", "打滑限值至转矩消失，反向"),
    "chart": ("Travel over torque", "行程-转矩"),
    "chart_torque": ("Torque (% of rated)", "转矩（额定转矩的 %）"),
    "chart_travel": ("Travel (revolutions)", "行程（圈）"),
    "forward": ("forwards", "正向"),
    "backward": ("backwards", "反向"),
}
_TONES: dict[Verdict, Literal["good", "warn"]] = {
    "held": "good",
    "slipped": "warn",
    "not_closed": "warn",
    "cannot_be_tested": "warn",
}


def report(result: BrakeResult) -> Section:
    """Verdict, the figures it rests on, and travel over torque."""
    rated = result.rated_torque_nm
    torque, unit = (0.01 * rated, "N·m") if rated else (1.0, "%")
    rows = [Row("test_torque", torque * result.test_percent, unit)]
    for way in result.ways:
        rows += _rows(way, torque, unit)
    if result.of_brake_percent is not None:
        rows.append(Row("of_brake", result.of_brake_percent, "%"))
    charts = []
    if any(way.curve_torque_percent for way in result.ways):
        lines = tuple(
            Line(_name(way), way.curve_torque_percent, way.curve_travel_rev) for way in result.ways
        )
        charts.append(Chart("chart", "chart_torque", "chart_travel", lines))
    return Section(tuple(notes(result)), tuple(rows), tuple(charts))


def notes(result: BrakeResult) -> list[Note]:
    """Notes on the result, the verdict first."""
    value = result.torque_percent
    if result.verdict == "not_closed":
        value = max(way.torque_ci95_percent[1] for way in result.ways)
    shown = "" if value is None else f"{value:.3g}"
    found = [Note(f"verdict.{result.verdict}", _TONES[result.verdict], {"value": shown})]
    if result.obstacle is not None:
        found.append(Note(f"obstacle.{result.obstacle}", "warn"))
    found += [
        Note("crept", "warn", {"value": f"{way.slip_rev:.2g}"})
        for way in result.ways
        if way.verdict == "held" and way.slip_rev > threshold.CREPT * result.slip_limit_rev
    ]
    least = brake_evaluate.SHORT * result.test_percent
    # Results of older versions call it held.
    reached = result.verdict in ("held", "cannot_be_tested") and result.obstacle is None
    if reached and value is not None and value < least:
        found.append(Note("torque_short", "warn", {"value": shown}))
    if result.means is not None:
        found.append(Note(f"by.{result.means}"))
    found.append(Note("measured_at", "plain", {"at": result.measured_at[:19].replace("T", " ")}))
    return found


def _name(way: BrakeWay) -> str:
    return "forward" if way.direction > 0 else "backward"


def _rows(way: BrakeWay, torque: float, unit: str) -> list[Row]:
    name = _name(way)
    low, high = way.torque_ci95_percent
    rows = [
        Row(f"torque.{name}", torque * way.torque_percent, unit, (torque * low, torque * high)),
        Row(f"travel.{name}", way.travel_rev, "rev"),
        Row(f"windup.{name}", way.windup_rev, "rev"),
        Row(f"slip.{name}", way.slip_rev, "rev"),
    ]
    if way.abort_ms is not None:
        rows.append(Row(f"abort.{name}", way.abort_ms, "ms"))
    return rows
