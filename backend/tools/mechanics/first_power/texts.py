"""Texts of the first power, English and Chinese, and its section of a report.

Signal words as in ISO 3864-2: danger is death or serious injury if it is not avoided, warning is
where either could result.
"""

from __future__ import annotations

from typing import Literal

from backend.tools.mechanics.first_power.result import Check, FirstPowerResult, Status, Verdict
from backend.tools.tool import Chart, Line, Note, Row, Section

TEXTS: dict[str, tuple[str, str]] = {
    "help": (
        "Before the first closed loop: supply, counts, direction, switches, brake and phase order. "
        "The axis is energised: at most 10 % of torque and 0.1 rev.",
        "首次闭环之前：电源、计数、方向、开关、抱闸和相序。"
        "轴将通电：转矩不超过 10 %，行程不超过 0.1 圈。",
    ),
    "lead": (
        "A checklist for a motor that no loop has been closed over yet. Small pulses of torque "
        "turn the shaft some degrees forwards and back; no loop is closed, and a stop takes the "
        "power off.",
        "用于尚未闭环运行过的电机的检查表。小转矩脉冲使轴正反各转动几度；不闭合任何控制环，"
        "停止时直接关断功率级。",
    ),
    "danger": (
        "DANGER. The holding brake opens and nothing holds the axis: a hanging load falls. Support "
        "it so that it can neither fall nor be lifted off its support, and let nobody be below it "
        "or within its reach.",
        "危险。抱闸松开后，没有任何力保持该轴：悬挂负载会坠落。请将负载支撑牢固，"
        "使其既不能坠落也不会被抬离支撑，其下方及运动范围内不得有人。",
    ),
    "warning": (
        "WARNING. The shaft may turn suddenly, in either direction. Keep away from everything that "
        "it drives. Turn it by hand only while you are asked to, before the motor is energised.",
        "警告。轴可能突然向任一方向转动，请远离其驱动的所有部件。仅在提示时、电机通电之前用手转动轴。",
    ),
    "state_first": (
        "State first what hangs at the axis, or leave the motor without power.",
        "请先声明轴上的悬挂情况，或不给电机通电。",
    ),
    "start": ("Go through the checklist", "执行检查表"),
    "field.hand_turn": ("I turn the shaft by hand when asked", "我会在提示时用手转动轴"),
    "field.hand_revolutions": ("Whole revolutions to the mark", "转至标记的整圈数"),
    "field.hand_time_s": ("Time for what is done by hand (s)", "手动操作时间 (s)"),
    "field.hand_switches": (
        "I operate both limit switches by hand",
        "我会用手操作两个限位开关",
    ),
    "field.powered": ("Energise the motor", "给电机通电"),
    "field.pole_pairs": ("Pole pairs of the motor", "电机极对数"),
    "field.nothing_hangs": ("No load pulls at this axis", "没有负载对此轴施力（如重力、弹簧力）"),
    "field.load_supported": (
        "The hanging load is supported and nobody is below it",
        "悬挂负载已支撑，且其下方无人",
    ),
    "verdict.passed": (
        "Everything on the checklist was found right. A loop may be closed, with low gains first.",
        "检查表各项均正确。可以闭环运行，请先使用低增益。",
    ),
    "verdict.failed": (
        "Do not close a loop over this motor yet: see what failed below.",
        "请勿对该电机闭环：见下方未通过的项目。",
    ),
    "verdict.incomplete": (
        "Nothing wrong was found, but the checklist is not complete.",
        "未发现错误，但检查表尚未完成。",
    ),
    "supply.ok": (
        "Supply: {value} V, and the drive reports no fault.",
        "电源：{value} V，驱动器未报故障。",
    ),
    "supply.low": (
        "Supply: the drive measures only {value} V. Switch the power supply on and look at its "
        "wiring.",
        "电源：驱动器仅测得 {value} V。请接通动力电源并检查接线。",
    ),
    "supply.fault": (
        "Supply: the drive reports {value} fault(s). Read them, remove their cause and reset them.",
        "电源：驱动器报告 {value} 个故障。请查看、排除原因并复位。",
    ),
    "supply.not_told": (
        "Supply: the drive does not tell its voltage, and reports no fault.",
        "电源：驱动器不提供电压，且未报故障。",
    ),
    "resolution.ok": (
        "Resolution: {value} increments per revolution.",
        "分辨率：每圈 {value} 个增量。",
    ),
    "resolution.uncertain": (
        "Resolution: what an increment is, is not certain. State the scales on the Overview page.",
        "分辨率：增量的含义不确定。请在“概览”页面声明标度。",
    ),
    "counts.ok": (
        "Counts: {value} rev were counted for the marked turn.",
        "计数：标记转动计得 {value} 圈。",
    ),
    "counts.wrong": (
        "Counts: {value} rev were counted, which is not what was turned. Correct the encoder's "
        "resolution, the gear ratio or the number of poles; nothing was energised.",
        "计数：计得 {value} 圈，与实际转动不符。请修正编码器分辨率、齿轮比或极数；未通电。",
    ),
    "counts.not_turned": (
        "Counts: the shaft was not turned in time.",
        "计数：未在规定时间内转动轴。",
    ),
    "counts.not_done": ("Counts: not compared with a hand turn.", "计数：未与手动转动比较。"),
    "direction.ok": (
        "Direction: forwards counts up.",
        "方向：正向转动计数增加。",
    ),
    "direction.backwards": (
        "Direction: turning forwards counted down. Where the phases are right, invert the "
        "direction of the axis (607Eh or the maker's parameter); else see the phases.",
        "方向：正向转动计数减少。若相序正确，请反转轴方向（607Eh 或厂家参数）；否则见相序。",
    ),
    "direction.not_turned": ("Direction: the shaft was not turned.", "方向：未转动轴。"),
    "direction.not_done": (
        "Direction: not compared with the machine.",
        "方向：未与机器比较。",
    ),
    "switches.ok": (
        "Limit switches: both were seen on and off.",
        "限位开关：两个开关的通断均已观察到。",
    ),
    "switches.only_positive": (
        "Limit switches: only the positive one was seen on and off.",
        "限位开关：仅观察到正限位通断。",
    ),
    "switches.only_negative": (
        "Limit switches: only the negative one was seen on and off.",
        "限位开关：仅观察到负限位通断。",
    ),
    "switches.none_seen": (
        "Limit switches: neither changed although they were operated. Look at their wiring and at "
        "the functions of the inputs.",
        "限位开关：操作后均无变化。请检查接线和输入功能。",
    ),
    "switches.no_input": (
        "Limit switches: no inputs have the functions of both.",
        "限位开关：没有输入同时分配这两个功能。",
    ),
    "switches.not_done": ("Limit switches: not operated.", "限位开关：未操作。"),
    "brake.ok": (
        "Brake: the shaft moved under the pulses, so nothing holds it.",
        "抱闸：轴在脉冲下移动，未被保持。",
    ),
    "brake.not_seen": (
        "Brake: the shaft did not move. Listen whether the brake opens.",
        "抱闸：轴未移动。请听抱闸是否松开。",
    ),
    "brake.not_done": ("Brake: not energised.", "抱闸：未通电。"),
    "phases.right": (
        "Phases and feedback: the shaft went with the torque, forwards and backwards.",
        "相序与反馈：轴随转矩正反转动。",
    ),
    "phases.not_excluded": (
        "Phases and feedback: the shaft went with the torque, but with so few pole pairs two "
        "exchanged phases could look the same within this travel. Use the drive's own procedure.",
        "相序与反馈：轴随转矩转动，但极对数过少，在此行程内两相接反也可能表现相同。"
        "请使用驱动器自身的程序。",
    ),
    "phases.reversed": (
        "Phases and feedback: the shaft went against the torque, so that a loop would run away. "
        "Turn the shaft by hand to learn which it is: the phases are shifted, the commutation "
        "angle is wrong by more than 90°, or the feedback counts backwards.",
        "相序与反馈：轴逆转矩方向转动，闭环会飞车。请手动转动轴以判断原因：相序错位、"
        "换相角误差超过 90° 或反馈计数反向。",
    ),
    "phases.phases_reversed": (
        "Phases: the feedback counts forwards and the torque acts backwards: a loop would run "
        "away. The phases are shifted by one place, or the commutation angle is wrong by more than "
        "90°. Correct the wiring U V W, or find the angle by the drive's own procedure.",
        "相序：反馈计数正确而转矩反向，闭环会飞车。相序错位一位，或换相角误差超过 90°。"
        "请修正 U V W 接线，或用驱动器自身程序确定换相角。",
    ),
    "phases.feedback_inverted": (
        "Feedback: turning forwards counts down, and the torque acts against the counts: a loop "
        "would run away. Exchange the encoder's channels A and B, or invert the feedback in the "
        "drive.",
        "反馈：正向转动计数减少，且转矩与计数方向相反，闭环会飞车。"
        "请对调编码器 A、B 通道，或在驱动器中反转反馈。",
    ),
    "phases.locks": (
        "Phases: the torque turned the shaft to a place and vanished there. Two motor phases are "
        "exchanged, or the feedback by which the drive commutates counts backwards. Exchange two "
        "phases or invert the feedback, and repeat. Where something blocks the shaft on both "
        "sides, remove it.",
        "相序：转矩将轴转到某处后消失。电机两相接反，或用于换相的反馈计数反向。"
        "请对调两相或反转反馈后重试。若轴两侧被阻挡，请先排除。",
    ),
    "phases.blocked": (
        "Phases: the shaft went its way in one direction only. Something blocks it on one side, or "
        "a load pulls at it: move it away from there and repeat.",
        "相序：轴仅在一个方向移动。一侧受阻或有负载施力：请移开后重试。",
    ),
    "phases.pulled": (
        "Phases: the shaft went the same way for both signs of the torque: a load pulls at it. "
        "Support the load and repeat.",
        "相序：转矩正负时轴均朝同一方向移动：有负载对轴施力。请支撑负载后重试。",
    ),
    "phases.no_motion": (
        "Phases: the strongest permitted pulse moved nothing. The brake is closed, something "
        "blocks the shaft, friction is higher, a phase is open, or two phases are exchanged and "
        "the rotor stands where they make no torque: turn it by hand by a sixteenth of a "
        "revolution and repeat.",
        "相序：允许的最大脉冲未使轴移动。抱闸抱紧、轴受阻、摩擦过大、缺相，"
        "或两相接反且转子恰处于无转矩位置：请用手转动 1/16 圈后重试。",
    ),
    "phases.short": (
        "Phases: the test ended on its way, by a limit or after too many pulses.",
        "相序：测试因限值或脉冲过多而中途结束。",
    ),
    "phases.no_torque_mode": (
        "Phases: the drive takes no torque with every cycle over this bus (cyclic synchronous "
        "torque), so that no motion without a closed loop is possible. Nothing was energised: jog "
        "at the lowest speed with the drive's torque limit at 10 % and a hand on the emergency "
        "stop.",
        "相序：该驱动器在此总线上不能逐周期接收转矩（循环同步转矩模式），无法在不闭环的情况下运动。"
        "未通电：请将驱动器转矩限值设为 10 %，手放在急停上，以最低速度点动。",
    ),
    "phases.counts_first": (
        "Phases: not energised, as the counts are wrong and travel would not be what it seems.",
        "相序：计数错误，行程不可信，未通电。",
    ),
    "phases.supply_first": (
        "Phases: not energised before the supply is right.",
        "相序：电源正常之前不通电。",
    ),
    "phases.resolution_first": (
        "Phases: not energised before the resolution is certain.",
        "相序：分辨率确定之前不通电。",
    ),
    "phases.not_done": ("Phases: not energised.", "相序：未通电。"),
    "covers": (
        "Two exchanged phases are found with {value} pole pairs or more. An error of the "
        "commutation angle below 90° only weakens the torque and is not found here.",
        "极对数不少于 {value} 时可发现两相接反。小于 90° 的换相角误差仅减弱转矩，此处无法发现。",
    ),
    "guide.pole_identification": (
        "This drive finds phase order and commutation angle by itself: Setup, magnetic pole "
        "identification. It moves outside the limits of this test.",
        "该驱动器可自行确定相序和换相角：设置页面“磁极辨识”。其运动不受本测试限值约束。",
    ),
    "guide.identification": (
        "This drive finds its commutation angle by its own identification (Setup, identification). "
        "It moves outside the limits of this test.",
        "该驱动器可通过自身辨识（设置页面“辨识”）确定换相角。其运动不受本测试限值约束。",
    ),
    "measured_at": ("Made at {at} (UTC).", "执行时间 {at} (UTC)。"),
    "travel": ("Farthest from the start", "离起点最远"),
    "torque": ("Highest torque sent", "发送的最大转矩"),
    "chart": ("Place of the shaft after each pulse", "每个脉冲后的轴位置"),
    "chart_torque": ("Torque of the pulse (% of rated)", "脉冲转矩（额定的 %）"),
    "chart_place": ("Place (revolutions)", "位置（圈）"),
    "chart_number": ("Pulse", "脉冲"),
    "forward": ("torque forwards", "正向转矩"),
    "backward": ("torque backwards", "反向转矩"),
    "check": ("Check", "检查"),
    "status.passed": ("passed", "通过"),
    "status.failed": ("failed", "未通过"),
    "status.open": ("open", "未完成"),
}
_TONES: dict[Status, Literal["good", "warn", "plain"]] = {
    "passed": "good",
    "failed": "warn",
    "open": "plain",
}
_VERDICTS: dict[Verdict, Literal["good", "warn", "plain"]] = {
    "passed": "good",
    "failed": "warn",
    "incomplete": "warn",
}


def report(result: FirstPowerResult) -> Section:
    """Verdict, the checklist, and the shaft positions of the pulses."""
    rows = []
    charts: tuple[Chart, ...] = ()
    if result.pulses:
        rows = [
            Row("travel", result.travel_rev, "rev"),
            Row("torque", result.torque_percent, "%"),
        ]
        charts = (Chart("chart", "chart_number", "chart_place", _lines(result)),)
    return Section(tuple(notes(result)), tuple(rows), charts)


def notes(result: FirstPowerResult) -> list[Note]:
    """Notes on the result: the verdict first, then one line for each check."""
    found = [Note(f"verdict.{result.verdict}", _VERDICTS[result.verdict])]
    found += [
        Note(f"{each.name}.{each.finding}", _TONES[each.status], {"value": shown(each)})
        for each in result.checks
    ]
    if result.covers_pole_pairs is not None:
        found.append(Note("covers", "plain", {"value": str(result.covers_pole_pairs)}))
    if result.guide is not None:
        found.append(Note(f"guide.{result.guide}"))
    found.append(Note("measured_at", "plain", {"at": result.measured_at[:19].replace("T", " ")}))
    return found


def shown(check: Check) -> str:
    """Value of a check as text, whole numbers in full."""
    value = check.value
    if value is None:
        return ""
    return f"{value:.0f}" if value == round(value) else f"{value:.4g}"


def _lines(result: FirstPowerResult) -> tuple[Line, ...]:
    numbered = list(enumerate(result.pulses, start=1))
    return tuple(
        Line(
            name,
            tuple(float(number) for number, each in numbered if each.direction == way),
            tuple(each.to_rev for _, each in numbered if each.direction == way),
        )
        for name, way in (("forward", 1), ("backward", -1))
    )
