"""Texts of a safety acceptance record, English and Chinese, and its section of a report."""

from __future__ import annotations

from typing import Literal, get_args

from backend.tools.tool import Chart, Line, Note, Row, Section
from backend.tools.watching.safety_check.result import SafetyResult, Verdict
from backend.tools.watching.safety_check.settings import Function

TEXTS: dict[str, tuple[str, str]] = {
    "help": (
        "Watch what the axis does when you trigger a safety function by hand: torque, stop and "
        "speed. It records and does not certify. The axis moves.",
        "观察手动触发安全功能时轴的反应：转矩、停止和速度。仅作记录，不作认证。轴会运动。",
    ),
    "lead": (
        "The axis runs at the test speed, and you trigger the safety function by hand. The trace "
        "is stored, with times and ways from the first sign of it on the bus. Each check is "
        "started by a person: after one nothing moves by itself.",
        "轴以测试速度运行，由您手动触发安全功能。记录曲线，以及从总线上首个征兆起的时间和行程。"
        "每项检查都由人启动：检查之后轴不会自行运动。",
    ),
    "no_certificate": (
        "This is a record and no certificate: the values are what the drive reports over a bus "
        "that is not safety-rated. Validation to ISO 13849-2 or IEC 62061 remains with the "
        "machine's builder.",
        "这是记录，不是证书：数值是驱动器经由非安全总线报告的。"
        "按 ISO 13849-2 或 IEC 62061 的确认仍由机器制造商负责。",
    ),
    "danger": (
        "DANGER. With STO no torque holds the axis: a hanging load falls. Support it so that it "
        "can neither fall nor be lifted off its support, and let nobody be below it.",
        "危险。STO 后没有转矩保持轴：悬挂负载会坠落。请将其支撑牢固，"
        "使其既不能坠落也不会被抬离支撑，其下方不得有人。",
    ),
    "warning": (
        "WARNING. Expect that the function does not act: keep everybody out of the danger zone, "
        "and have a second way to stop the axis at hand.",
        "警告。请考虑到该功能可能不起作用：请使所有人离开危险区域，并备好另一种停轴手段。",
    ),
    "state_first": ("State first what hangs at the axis.", "请先声明轴上的悬挂情况。"),
    "name_first": ("Say first what you trigger it with.", "请先填写触发装置。"),
    "start": ("Start, then trigger it by hand", "启动，然后手动触发"),
    "field.function": ("Function", "功能"),
    "field.device": ("Triggered with", "触发装置"),
    "field.person": ("Triggered by", "触发人"),
    "field.speed_rpm": ("Test speed (rpm)", "测试速度 (rpm)"),
    "field.wait_s": ("Time to trigger it (s)", "触发时限 (s)"),
    "field.watch_s": ("Time watched after it (s)", "之后观察的时间 (s)"),
    "field.limited_rpm": ("Speed limit (rpm)", "速度限值 (rpm)"),
    "field.torque_free_limit_ms": ("Torque gone within (ms)", "转矩消失时限 (ms)"),
    "field.stop_limit_ms": ("Standstill within (ms)", "静止时限 (ms)"),
    "field.stop_limit_rev": ("Standstill within (revolutions)", "到静止的行程限值（圈）"),
    "field.nothing_hangs": ("No load pulls at this axis", "没有负载对此轴施力（如重力、弹簧力）"),
    "field.load_supported": (
        "The hanging load is supported and nobody is below it",
        "悬挂负载已支撑，且其下方无人",
    ),
    "function.sto": ("Safe torque off (STO)", "安全转矩关断 (STO)"),
    "function.ss1": ("Safe stop 1 (SS1)", "安全停止 1 (SS1)"),
    "function.limit_positive": ("Positive limit switch", "正限位开关"),
    "function.limit_negative": ("Negative limit switch", "负限位开关"),
    "function.speed_limit": ("Safely-limited speed (SLS)", "安全限速 (SLS)"),
    "verdict.not_triggered": (
        "Nothing happened within the time. If you triggered it, it does not act: put "
        "the axis out of use and look at its wiring and its configuration.",
        "时限内没有任何反应。若您已触发，则该功能不起作用：请停用该轴，并检查其接线和配置。",
    ),
    "verdict.torque_remains": (
        "The drive still reports torque at the end. Put the axis out of use, and look "
        "at the wiring of both channels.",
        "结束时驱动器仍报告有转矩。请停用该轴，并检查两个通道的接线。",
    ),
    "verdict.still_turning": (
        "The axis still turns at the end of the time watched. Watch it for longer, or "
        "look why it does not stop.",
        "观察时间结束时轴仍在转动。请延长观察时间，或查明其不停止的原因。",
    ),
    "verdict.restarted": (
        "The axis was enabled again while it was watched. Put it out of use, and find "
        "what enables it.",
        "观察期间轴再次被使能。请停用该轴，并查明使能的来源。",
    ),
    "verdict.power_off_at_speed": (
        "The torque went while the axis still ran at {value} rpm, as with STO. Look "
        "at the drive's settings of the ramp and of its delay.",
        "轴仍以 {value} rpm 运行时转矩即消失，与 STO 相同。请检查驱动器的斜坡及其延时设置。",
    ),
    "verdict.no_reaction": (
        "The axis ran up to {value} rpm without a reaction. Put it out of use, and "
        "look whether the limit is switched on and set.",
        "轴加速到 {value} rpm 而无反应。请停用该轴，并检查限速是否已启用和设置。",
    ),
    "verdict.beyond_limits": (
        "What was seen is beyond the given limits.",
        "所测结果超出给定限值。",
    ),
    "verdict.not_shown": (
        "It acted, and not all that it must do could be shown.",
        "已起作用，但未能证实其全部要求。",
    ),
    "verdict.within_limits": (
        "What was seen is within the given limits.",
        "所测结果在给定限值之内。",
    ),
    "verdict.recorded": (
        "It acted, and was recorded. No limit was given, so that nothing is judged.",
        "已起作用并已记录。未给出限值，因此不作判定。",
    ),
    "exceeded.torque_free": (
        "The torque was gone later than permitted.",
        "转矩消失晚于允许时间。",
    ),
    "exceeded.stop_time": ("It stopped later than permitted.", "停止晚于允许时间。"),
    "exceeded.stop_distance": ("It ran on further than permitted.", "停止行程超过允许值。"),
    "exceeded.speed": ("It ran faster than the limit.", "速度超过限值。"),
    "obstacle.torque_in_noise": (
        "The torque before the trigger ({value} %) is not above what the drive reports without "
        "power, so that its end cannot be seen. Trigger it at a higher speed or with a load.",
        "触发前的转矩（{value} %）不高于驱动器未得电时的报告值，因此无法看出其消失。"
        "请在更高速度或带负载时触发。",
    ),
    "obstacle.too_slow": (
        "It was triggered at {value} rpm, below 80 % of the test speed: it stops sooner from "
        "there. Repeat it, and trigger while the axis runs at full speed.",
        "触发时速度为 {value} rpm，低于测试速度的 80 %：从该速度停止更快。请重复，并在全速时触发。",
    ),
    "obstacle.samples_lost": (
        "Samples were lost on the bus while it acted. Repeat it.",
        "起作用时总线丢失了采样。请重复。",
    ),
    "obstacle.stayed_enabled": (
        "The drive stayed in Operation enabled all the time: it does not say that its torque is "
        "off. Look at how this function is wired and set.",
        "驱动器始终处于“运行使能（Operation enabled）”：未表明其转矩已关断。"
        "请检查该功能的接线和设置。",
    ),
    "obstacle.quick_stop_cut": (
        "The drive braked in its state Quick stop active, and the exchange of this program then "
        "took its power away, as it does with every axis that leaves Operation enabled. SS1 of "
        "this drive is not shown here: record it under the machine's controller.",
        "驱动器在“快速停止有效（Quick stop active）”状态下制动，随后本程序的周期通信关断其功率级"
        "（对每个离开“运行使能（Operation enabled）”的轴都如此）。"
        "此处无法证实该驱动器的 SS1：请在机器控制器下记录。",
    ),
    "sign.state": (
        "Times count from when the drive was first seen to leave Operation enabled. What passed "
        "from the hand to that is not on the bus and not in them.",
        "时间从首次检测到驱动器离开“运行使能（Operation enabled）”起算。"
        "从手动触发到此刻的时间总线上无法得知，也未计入。",
    ),
    "sign.speed": (
        "Times count from when the speed first left the commanded one: the drive stayed enabled. "
        "What passed from the hand to that is not in them.",
        "时间从速度首次偏离给定速度起算：驱动器保持使能。从手动触发到此刻的时间未计入。",
    ),
    "reports": (
        "The drive reports: {faults}. Where that is no sign of this function, something else "
        "stopped the axis: repeat the check.",
        "驱动器报告：{faults}。若其并非此功能的征兆，则是其他原因使轴停止：请重复检查。",
    ),
    "made": (
        "Triggered with {device} by {person}, {at} (UTC).",
        "{person} 用 {device} 触发，{at} (UTC)。",
    ),
    "signed": (
        "Signed by {person}, {at} (UTC), SHA-256 {sha256}. {notes}",
        "{person} 签署，{at} (UTC)，SHA-256 {sha256}。{notes}",
    ),
    "signature_broken": (
        "It is not what was signed: its checksum differs.",
        "与签署时不同：校验和不一致。",
    ),
    "unsigned": ("Not signed.", "未签署。"),
    "signature.person": ("Signed by", "签署人"),
    "signature.notes": ("Notes", "备注"),
    "signature.do": ("Sign this record", "签署此记录"),
    "speed": ("Speed when it was triggered", "触发时的速度"),
    "torque_before": ("Torque before", "之前的转矩"),
    "torque_noise": ("Smallest torque that can be distinguished", "可分辨的转矩"),
    "torque_free": ("Time until the torque was gone", "转矩消失的时间"),
    "torque_after": ("Greatest torque after that", "之后的最大转矩"),
    "speed_at_free": ("Speed when the torque was gone", "转矩消失时的速度"),
    "stop_time": ("Time to standstill", "到静止的时间"),
    "stop_distance": ("Way to standstill", "到静止的行程"),
    "highest": ("Highest speed", "最高速度"),
    "limited": ("Speed limit", "速度限值"),
    "watched": ("Time watched", "观察时间"),
    "chart": ("Speed over time", "速度-时间"),
    "chart_torque": ("Torque over time", "转矩-时间"),
    "chart_ms": ("Time from the first sign (ms)", "自首个征兆起的时间 (ms)"),
    "chart_rpm": ("Speed (rpm)", "速度 (rpm)"),
    "chart_percent": ("Torque (% of rated)", "转矩（额定转矩的 %）"),
    "line_speed": ("measured", "实测"),
    "line_commanded": ("commanded", "给定"),
    "line_torque": ("torque", "转矩"),
}
#: Names of the functions in the verdicts, in each language.
TEXTS |= {
    f"verdict.{function}.{verdict}": (
        f"{TEXTS[f'function.{function}'][0]}: {TEXTS[f'verdict.{verdict}'][0]}",
        f"{TEXTS[f'function.{function}'][1]}：{TEXTS[f'verdict.{verdict}'][1]}",
    )
    for function in get_args(Function)
    for verdict in get_args(Verdict)
}
_TONES: dict[Verdict, Literal["good", "warn", "plain"]] = {
    "within_limits": "good",
    "recorded": "plain",
}


def report(result: SafetyResult) -> Section:
    """Verdict, disclaimer of certification, figures, signature, and the trace."""
    return Section(tuple(notes(result)), tuple(_rows(result)), _charts(result))


def notes(result: SafetyResult) -> list[Note]:
    """Notes on the result: the verdict first, then that it is no certificate."""
    value = result.highest_rpm
    if result.verdict == "power_off_at_speed":
        value = abs(result.speed_at_torque_free_rpm or 0.0)
    tone, name = _TONES.get(result.verdict, "warn"), f"{result.function}.{result.verdict}"
    found = [Note(f"verdict.{name}", tone, {"value": f"{value:.3g}"})]
    found += [Note(f"exceeded.{each}", "warn") for each in result.exceeded]
    if result.obstacle is not None:
        number = result.torque_before_percent
        if result.obstacle == "too_slow":
            number = abs(result.speed_rpm or 0.0)
        found.append(Note(f"obstacle.{result.obstacle}", "warn", {"value": f"{number or 0.0:.3g}"}))
    found.append(Note("no_certificate", "warn"))
    if result.sign is not None:
        found.append(Note(f"sign.{result.sign}"))
    if result.reports:
        found.append(Note("reports", "plain", {"faults": ", ".join(result.reports)}))
    at = result.measured_at[:19].replace("T", " ")
    made = {"device": result.device or "–", "person": result.person or "–", "at": at}
    found.append(Note("made", "plain", made))
    return [*found, *_signature(result)]


def _signature(result: SafetyResult) -> list[Note]:
    signed = result.signature
    if signed is None:
        return [Note("unsigned", "warn")]
    values = {
        "person": signed.person,
        "at": signed.signed[:19].replace("T", " "),
        "sha256": signed.sha256,
        "notes": signed.notes,
    }
    broken = [] if signed.intact else [Note("signature_broken", "warn")]
    return [Note("signed", "plain", values), *broken]


def _rows(result: SafetyResult) -> list[Row]:
    rows = [
        Row("speed", result.speed_rpm, "rpm"),
        Row("torque_free", result.torque_free_ms, "ms", result.torque_free_ci95_ms),
        Row("stop_time", result.stop_ms, "ms"),
        Row("stop_distance", result.stop_rev, "rev"),
        Row("torque_before", result.torque_before_percent, "%"),
        Row("torque_after", result.torque_after_percent, "%"),
        Row("torque_noise", result.torque_noise_percent, "%"),
        Row("speed_at_free", result.speed_at_torque_free_rpm, "rpm"),
        Row("highest", result.highest_rpm, "rpm"),
        Row("watched", result.watched_ms, "ms"),
    ]
    if result.limited_rpm is not None:
        rows.append(Row("limited", result.limited_rpm, "rpm"))
    if result.function not in ("sto", "ss1"):
        gone = ("torque_free", "torque_before", "torque_after", "torque_noise", "speed_at_free")
        rows = [row for row in rows if row.name not in gone]
    return rows


def _charts(result: SafetyResult) -> tuple[Chart, ...]:
    if not result.trace_ms:
        return ()
    speed = Line("line_speed", result.trace_ms, result.trace_rpm)
    commanded = Line("line_commanded", result.trace_ms, result.trace_commanded_rpm)
    torque = Line("line_torque", result.trace_ms, result.trace_torque_percent)
    return (
        Chart("chart", "chart_ms", "chart_rpm", (speed, commanded)),
        Chart("chart_torque", "chart_ms", "chart_percent", (torque,)),
    )
