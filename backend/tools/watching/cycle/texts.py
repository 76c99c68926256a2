"""Texts of a cycle load, English and Chinese, and its section of a report."""

from __future__ import annotations

from typing import Literal

from backend.tools.thresholds import cycle_texts as threshold
from backend.tools.tool import Chart, Line, Note, Row, Section
from backend.tools.watching.cycle.result import CycleHeat, CycleResult, Finding, Verdict

TEXTS: dict[str, tuple[str, str]] = {
    "help": (
        "Torque, speed, heat and braking energy of the machine's own cycle, from reading the drive "
        "or from a recording. Nothing is written and nothing is moved.",
        "通过读取驱动器或使用录制，得出机器自身循环的转矩、速度、发热和制动能量。不写入，也不产生运动。",
    ),
    "lead": (
        "The drive is read while the machine's own controller moves it. Nothing is written, and "
        "nobody needs control of the axis. Several whole cycles make the figures certain.",
        "在机器自身控制器驱动轴运动时读取驱动器。不写入任何数据，也不需要轴的控制权。"
        "录到多个完整循环，结果才可靠。",
    ),
    "start": ("Read the cycle", "读取循环"),
    "evaluate": ("Evaluate the recording", "计算该录制"),
    "source": ("Source", "来源"),
    "source.drive": ("the drive, now", "驱动器（现在）"),
    "field.recording": ("Recording", "录制"),
    "field.duration_s": ("Time of reading (s)", "读取时间 (s)"),
    "field.period_s": (
        "Time of one cycle (s), found where empty",
        "单个循环时间 (s)，留空则自动识别",
    ),
    "field.motor_rated_nm": (
        "Rated torque of the motor (N·m), if not the drive's",
        "电机额定转矩 (N·m)，若与驱动器不同",
    ),
    "field.motor_rated_rpm": (
        "Rated speed of the motor (rpm), if not the drive's",
        "电机额定转速 (rpm)，若与驱动器不同",
    ),
    "field.peak_percent": (
        "Peak torque of the motor (% of rated)",
        "电机峰值转矩（额定的 %）",
    ),
    "field.overload_percent": ("Permitted overload (% of rated)", "允许过载（额定的 %）"),
    "field.overload_s": ("… for this time (s)", "……持续时间 (s)"),
    "field.thermal_time_min": (
        "Thermal time constant of the motor (min)",
        "电机热时间常数 (min)",
    ),
    "field.standstill_percent": (
        "Continuous torque at standstill (% of rated)",
        "静止时连续转矩（额定的 %）",
    ),
    "field.ambient_c": ("Temperature about the motor (°C)", "电机环境温度 (°C)"),
    "field.rise_k": (
        "Rise of the winding at rated torque (K), where not 40 °C",
        "额定转矩下绕组温升 (K)，环境非 40 °C 时需要",
    ),
    "verdict.endures": (
        "The motor endures this cycle: it becomes {low} to {high} % as warm as it may at {ambient} "
        "°C.",
        "电机可承受此循环：环境 {ambient} °C 时，温升为允许值的 {low} 至 {high} %。",
    ),
    "verdict.overloads": (
        "This cycle overloads the motor. Reduce accelerations or load, add pauses, or take a "
        "larger motor.",
        "此循环使电机过载。请降低加速度或负载、增加停歇，或选用更大的电机。",
    ),
    "verdict.undecided": (
        "It cannot be decided whether the motor endures this cycle. What follows says what is "
        "missing.",
        "无法判定电机能否承受此循环。缺少的信息见下文。",
    ),
    "verdict.idle": (
        "The axis neither moved nor carried torque meanwhile: let the machine run its cycle.",
        "期间轴既未运动也无转矩：请让机器运行其循环。",
    ),
    "trips.between": (
        "It trips, or is too warm, after about {about} min at {ambient} °C ({low} to {high} min), "
        "from a motor as cold as that; sooner where it is warm already.",
        "从与环境同温的冷态起，环境 {ambient} °C 时约 {about} min（{low} 至 {high} min）"
        "后跳闸或过热；"
        "若电机已热则更早。",
    ),
    "trips.perhaps": (
        "At the earliest it trips, or is too warm, after {low} min at {ambient} °C, from a motor "
        "as cold as that; perhaps never.",
        "从与环境同温的冷态起，环境 {ambient} °C 时最早 {low} min 后跳闸或过热；也可能不会。",
    ),
    "rise": (
        "Of what is permitted, the winding rises by {low} to {high} % at {ambient} °C.",
        "环境 {ambient} °C 时，绕组温升为允许值的 {low} 至 {high} %。",
    ),
    "assumed": (
        "Assumed: rated torque holds at 40 °C and rated speed; losses grow with the square of the "
        "current; the cycle repeats without a pause; current exceeds torque by 0 to 14 % at three "
        "times rated torque; 0 to 35 % of the rated losses depend on the speed "
        "(where the torque at standstill is stated: what follows from it); 15 to 50 % of the "
        "rise lies in the winding; the catalogue's time constant holds to −25/+30 %.",
        "假设：额定转矩在 40 °C 和额定转速下成立；损耗随电流平方增加；循环无停歇重复；"
        "三倍额定转矩时电流比转矩多 0 至 14 %；额定损耗的 0 至 35 % 取决于转速"
        "（给出静止转矩时由其得出）；温升的 15 至 50 % "
        "在绕组；样本中的时间常数误差为 −25/+30 %。",
    ),
    "shaft": (
        "Powers are mechanical, at the shaft. Less comes back to the drive, by the losses.",
        "功率为轴端机械功率。因有损耗，回馈到驱动器的更少。",
    ),
    "finding.no_period": (
        "No repetition shows: the figures are those of the whole recording. State the time of one "
        "cycle, or read for longer.",
        "未发现重复：结果为整段录制的值。请给出单个循环时间，或延长读取时间。",
    ),
    "finding.few_periods": (
        "Only {value} whole cycles: how much they differ cannot be said. Read three or more.",
        "只有 {value} 个完整循环：无法得知其差异。请读取三个以上循环。",
    ),
    "finding.slow_sampling": (
        "One sample comes every {value} {unit}: shorter peaks are not seen, and accelerations that "
        "last less than some samples are rough.",
        "每 {value} {unit} 一个采样：看不到更短的峰值，仅持续几个采样的加速过程不精确。",
    ),
    "finding.gaps": (
        "For up to {value} {unit} no sample came; that time is left out.",
        "最长 {value} {unit} 无采样；该时间未计入。",
    ),
    "finding.peak_beyond": (
        "The torque exceeds the peak of {value} {unit}: look at that figure.",
        "转矩超过峰值 {value} {unit}：请核对该数值。",
    ),
    "finding.peak_reached": (
        "The torque reaches its limit of {value} {unit}: the axis cannot follow its setpoints "
        "there.",
        "转矩达到限值 {value} {unit}：轴在此处无法跟随设定值。",
    ),
    "finding.peak_unknown": (
        "The peak torque of the motor is not known: state it.",
        "电机峰值转矩未知：请给出。",
    ),
    "finding.speed_beyond_rated": (
        "The speed exceeds the rated {value} {unit}: rated torque does not hold there.",
        "速度超过额定值 {value} {unit}：该处额定转矩不成立。",
    ),
    "finding.rated_speed_unknown": (
        "The rated speed is not known: losses by the speed are a guess between two ends. State it.",
        "额定转速未知：与转速有关的损耗只能在两端之间估计。请给出。",
    ),
    "finding.rated_torque_unknown": (
        "The rated torque in N·m is not known: without it there are no powers and no braking "
        "energy. State it.",
        "额定转矩 (N·m) 未知：没有它就无法得出功率和制动能量。请给出。",
    ),
    "finding.time_constant_unknown": (
        "The thermal time constant of the motor is not known: no drive here tells it. State it "
        "from the catalogue to learn after how many minutes it would trip.",
        "电机热时间常数未知：此处的驱动器均不提供。请按样本给出，以得知多少分钟后会跳闸。",
    ),
    "finding.overload_unknown": (
        "The overload rating (I²t) is not known: no manual here prints the drive's curve. State "
        "what the catalogue permits for how long.",
        "过载能力 (I²t) 未知：此处的手册均未给出驱动器的曲线。请按样本给出允许的过载及时间。",
    ),
    "finding.overload_exceeded": (
        "The stated overload is used up after {value} {unit}.",
        "所给的过载能力在 {value} {unit} 后用尽。",
    ),
    "finding.ambient_needs_rise": (
        "Rated torque holds at 40 °C. For {value} {unit} the winding's rise at rated torque must "
        "be stated.",
        "额定转矩在 40 °C 下成立。对于 {value} {unit}，须给出额定转矩下的绕组温升。",
    ),
    "period": ("Time of one cycle", "单个循环时间"),
    "read": ("Time read", "读取时间"),
    "rate": ("Samples", "采样"),
    "rms": ("Effective torque (RMS)", "有效转矩 (RMS)"),
    "rms_of_rated": ("Effective torque, of rated", "有效转矩，占额定值"),
    "peak": ("Highest torque", "最大转矩"),
    "peak_of_limit": ("Highest torque, of the peak", "最大转矩，占峰值"),
    "above_rated": ("Time above rated torque", "超过额定转矩的时间"),
    "fastest": ("Highest speed", "最高速度"),
    "mean_speed": ("Mean speed", "平均速度"),
    "power": ("Highest power", "最大功率"),
    "mean_power": ("Mean power", "平均功率"),
    "braking_peak": ("Highest braking power", "最大制动功率"),
    "braking_energy": ("Braking energy of one cycle", "单个循环的制动能量"),
    "braking_energy_all": ("Braking energy", "制动能量"),
    "braking_mean": ("Mean braking power", "平均制动功率"),
    "voltage_high": ("Highest voltage of the DC bus", "母线电压最高值"),
    "drive_load": ("Load as the drive shows it", "驱动器显示的负载"),
    "i2t": (
        "I²t used, of {percent} % for {seconds} s",
        "I²t 占用（{percent} %，{seconds} s）",
    ),
    "cloud": ("Torque over speed", "转矩-速度"),
    "speed": ("Speed (rpm)", "速度 (rpm)"),
    "torque": ("Torque (% of rated)", "转矩（额定转矩的 %）"),
    "samples": ("samples", "采样"),
    "highest": ("highest", "最大"),
    "lowest": ("lowest", "最小"),
    "rated": ("rated", "额定"),
    "limit": ("peak", "峰值"),
}
_TONES: dict[Verdict, Literal["good", "warn", "plain"]] = {
    "endures": "good",
    "overloads": "warn",
    "undecided": "warn",
    "idle": "warn",
}
_WARN = frozenset(
    {"gaps", "peak_beyond", "peak_reached", "speed_beyond_rated", "overload_exceeded"}
)


def report(result: CycleResult) -> Section:
    """Verdict, time until it trips, what is unknown, figures, and torque over speed."""
    return Section(tuple(notes(result)), tuple(_rows(result)), (_cloud(result),))


def notes(result: CycleResult) -> list[Note]:
    """Notes on the result: the verdict, the time until it trips, assumptions, and findings."""
    warm = result.heat
    places = _places(warm)
    found = [Note(f"verdict.{result.verdict}", _TONES[result.verdict], places)]
    if warm is not None:
        if result.verdict != "endures":
            found.append(Note("rise", "plain", places))
        found += _trip(warm)
        found.append(Note("assumed"))
    if result.power is not None:
        found.append(Note("shaft"))
    return found + [_finding(each) for each in result.findings]


def _places(warm: CycleHeat | None) -> dict[str, str]:
    if warm is None:
        return {"low": "", "high": "", "ambient": ""}
    low, high = (f"{100.0 * end:.3g}" for end in warm.rise_share)
    return {"low": low, "high": high, "ambient": f"{warm.ambient_c:g}"}


def _trip(warm: CycleHeat) -> list[Note]:
    earliest, latest = warm.trip_s
    if earliest is None:
        return []
    places = {"low": f"{earliest / 60.0:.2g}", "ambient": f"{warm.ambient_c:g}"}
    if latest is None or warm.about_s is None:
        return [Note("trips.perhaps", "warn", places)]
    more = {"high": f"{latest / 60.0:.2g}", "about": f"{warm.about_s / 60.0:.2g}"}
    return [Note("trips.between", "warn", {**places, **more})]


def _finding(finding: Finding) -> Note:
    value = "" if finding.value is None else f"{finding.value:.3g}"
    tone: Literal["warn", "plain"] = "warn" if finding.code in _WARN else "plain"
    return Note(f"finding.{finding.code}", tone, {"value": value, "unit": finding.unit})


def _rows(result: CycleResult) -> list[Row]:
    rated = result.rated_torque_nm
    low, high = result.rms_ci95_percent
    rows = [
        Row("period", result.period_s, "s"),
        Row("read", result.duration_s, "s"),
        Row("rate", result.sample_rate_hz, "/s"),
        Row("rms_of_rated", result.rms_percent, "%", (low, high)),
        Row("peak", result.peak_percent, "%"),
    ]
    if rated is not None:
        rows.insert(4, Row("rms", 0.01 * rated * result.rms_percent, "N·m"))
    if result.peak_limit_percent:
        share = 100.0 * result.peak_percent / result.peak_limit_percent
        rows.append(Row("peak_of_limit", share, "%"))
    rows += [
        Row("above_rated", 100.0 * result.above_rated_share, "%"),
        Row("fastest", result.highest_speed_rpm, "rpm"),
        Row("mean_speed", result.mean_speed_rpm, "rpm"),
    ]
    if (budget := result.overload) is not None:
        values = {"percent": f"{budget.percent:g}", "seconds": f"{budget.seconds:g}"}
        rows.append(Row("i2t", 100.0 * budget.used_share, "%", None, values))
    if (power := result.power) is not None:
        energy = "braking_energy_all" if result.period_s is None else "braking_energy"
        rows += [
            Row("power", power.highest_w, "W"),
            Row("mean_power", power.mean_w, "W"),
            Row("braking_peak", power.highest_braking_w, "W"),
            Row(energy, power.braking_j, "J"),
            Row("braking_mean", power.braking_mean_w, "W"),
        ]
    if result.dc_voltage_v is not None:
        rows.append(Row("voltage_high", result.dc_voltage_v[1], "V"))
    if result.drive_load_percent is not None:
        rows.append(Row("drive_load", result.drive_load_percent, "%"))
    return rows


def _cloud(result: CycleResult) -> Chart:
    """Highest and lowest torque by speed, and the limits: a printed report has no scatter plot."""
    lines: list[Line] = []
    if result.cloud_speed_rpm:
        first, last = result.cloud_speed_rpm[0], result.cloud_speed_rpm[-1]
        width = (last - first) / threshold.BINS or 1.0
        bins: dict[int, list[float]] = {}
        for speed, torque in zip(result.cloud_speed_rpm, result.cloud_torque_percent, strict=True):
            bins.setdefault(min(int((speed - first) / width), threshold.BINS - 1), []).append(
                torque
            )
        x = tuple(first + (each + 0.5) * width for each in sorted(bins))
        lines.append(Line("highest", x, tuple(max(bins[each]) for each in sorted(bins))))
        lines.append(Line("lowest", x, tuple(min(bins[each]) for each in sorted(bins))))
        ends = (first, last) if last > first else (first - 1.0, first + 1.0)
        lines += [
            Line(name, ends, (sign * level, sign * level))
            for name, level in (("rated", 100.0), ("limit", result.peak_limit_percent))
            if level is not None
            for sign in (1.0, -1.0)
        ]
    return Chart("cloud", "speed", "torque", tuple(lines))
