"""Texts of a gantry measurement, English and Chinese, and its section of a report."""

from __future__ import annotations

from typing import Literal

from backend.tools.tool import Chart, Line, Note, Row, Section
from backend.tools.tuning.gantry.result import Code, GantryFinding, GantryResult, GantryValue

TEXTS: dict[str, tuple[str, str]] = {
    "help": (
        "Measure two coupled axes together: response, skew and the margins of both loops. Both "
        "axes move.",
        "同时测量两个耦合轴：频率响应、歪斜以及两个环路的共同裕度。两个轴都会运动。",
    ),
    "lead": (
        "Both axes move at one slow speed in both directions, with a small excitation on top: "
        "alike, and against each other. When one axis stops, both stop; a skew beyond its limit "
        "stops both.",
        "两轴以同一低速双向运动，并叠加小幅激励：先同向，再反向。任一轴停止时两轴都停止；"
        "歪斜超出限值时两轴都停止。",
    ),
    "danger": (
        "WARNING: {first} and {second} are enabled and move several times together, each within "
        "±{travel} rev of its present position, with at most {speed} rpm and {torque} % of rated "
        "torque. Both are disabled afterwards. STOP of one stops both. Keep everyone clear of the "
        "machine.",
        "警告：{first} 与 {second} 将使能并一起运动多次，各限制在当前位置 ±{travel} 转、"
        "{speed} rpm、{torque}% 额定转矩内，之后两轴断使能。停止其中一轴时两轴都停止。"
        "请确保无人靠近。",
    ),
    "start": ("Measure both axes", "测量两个轴"),
    "field.partner": ("The other axis", "另一轴"),
    "field.mirrored": ("The other motor turns the other way", "另一电机反向转动"),
    "field.skew_limit_rev": ("Skew limit", "歪斜限值"),
    "field.resolution_hz": ("Distance of the lines", "谱线间隔"),
    "field.highest_hz": ("Highest line", "最高谱线"),
    "field.lead_mm": ("Way per motor revolution", "电机每转行程"),
    "unit.skew_limit_rev": ("rev", "圈"),
    "unit.resolution_hz": ("Hz", "Hz"),
    "unit.highest_hz": ("Hz", "Hz"),
    "unit.lead_mm": ("mm", "mm"),
    "fight": ("Torque with which both sides press against each other", "两侧相互对抗的转矩"),
    "holding": ("Mean torque of both directions, axis {axis}", "双向平均转矩，轴 {axis}"),
    "friction": ("Friction, axis {axis}", "摩擦，轴 {axis}"),
    "square_rev": ("Out of square: axis 1 ahead by", "不垂直度：轴 1 超前"),
    "square_mm": ("Out of square: axis 1 ahead by", "不垂直度：轴 1 超前"),
    "skew": ("Largest skew of the measurement", "测量中的最大歪斜"),
    "stiffness": ("Stiffness between the axes at rest", "静止时两轴之间的刚度"),
    "inertia": ("Inertia of the whole machine", "整机惯量"),
    "mode.skew": ("Skew mode, damping {damping} %", "歪斜模态，阻尼 {damping} %"),
    "mode.common": ("Common mode, damping {damping} %", "同向模态，阻尼 {damping} %"),
    "ms": ("Joint peak of the sensitivity, Ms", "共同灵敏度峰值 Ms"),
    "ms_alone": ("Ms of axis {axis} by itself", "轴 {axis} 单独的 Ms"),
    "phase_margin": ("Smallest phase margin of both eigenloci", "两条特征轨迹的最小相位裕度"),
    "factor": ("Factor for both speed gains that keeps Ms", "保持 Ms 的两轴速度增益系数"),
    "response": ("Response from torque to speed", "从转矩到速度的频率响应"),
    "motions": ("Motion alike and skew, from torque to speed", "同向运动与歪斜：从转矩到速度"),
    "motion.common": ("alike: mean speed by both torques", "同向：平均速度 / 转矩之和"),
    "motion.skew": ("skew: difference of speeds", "歪斜：速度差 / 转矩差的一半"),
    "coupling": ("Coupling of both axes", "两轴的耦合"),
    "frequency": ("Frequency (Hz)", "频率 (Hz)"),
    "magnitude": ("Magnitude (dB)", "幅值 (dB)"),
    "ratio": ("√|G12 G21 / (G11 G22)|", "√|G12 G21 / (G11 G22)|"),
    "entry.11": ("axis 1 by axis 1", "轴 1 转矩到轴 1"),
    "entry.12": ("axis 1 by axis 2", "轴 2 转矩到轴 1"),
    "entry.21": ("axis 2 by axis 1", "轴 1 转矩到轴 2"),
    "entry.22": ("axis 2 by axis 2", "轴 2 转矩到轴 2"),
    "finding.not_coupled": (
        "No coupling of both axes shows from {low} to {top} Hz: at most {most}, where one rigid "
        "body has 1. Check whether both axes move the same machine. Nothing is stated of "
        "squareness, skew and modes.",
        "在 {low} 至 {top} Hz 之间未见两轴的耦合：至多 {most}，而同一刚体为 1。"
        "请检查两轴是否驱动同一机器。不给出垂直度、歪斜和模态的结论。",
    ),
    "finding.square": (
        "The gantry is square where it stands: both sides press against each other with at most "
        "{limit} % of rated torque.",
        "龙门在当前位置是垂直的：两侧相互对抗的转矩不超过额定转矩的 {limit} %。",
    ),
    "finding.out_of_square": (
        "The gantry is out of square: both sides press against each other with {fight} % of rated "
        "torque, also at standstill. Axis {ahead} is ahead of axis {behind} {way}. Correct the "
        "reference (homing offset) of one axis by that, or align the beam, and measure again.",
        "龙门不垂直：两侧以额定转矩的 {fight} % 相互对抗，静止时也是如此。轴 {ahead} 超前轴 "
        "{behind} {way}。请按此修正其中一轴的参考点（回零偏置）或校正横梁，然后重新测量。",
    ),
    "finding.square_uncertain": (
        "Whether the gantry is out of square cannot be known: the torque of both sides against "
        "each other, {fight} %, is not certain to be above or below {limit} % of rated torque. "
        "Allow more travel and time, and measure again.",
        "无法判断龙门是否垂直：两侧相互对抗的转矩 {fight} % 不能确定高于或低于额定转矩的 "
        "{limit} %。请允许更大行程和更长时间，然后重新测量。",
    ),
    "finding.no_skew_stiffness": (
        "By how much it is out of square cannot be known: no stiffness between the axes shows at "
        "rest.",
        "无法得知偏差多少：静止时未见两轴之间的刚度。",
    ),
    "finding.rated_torque_unknown": (
        "By how much it is out of square cannot be known: nobody states the rated torque that "
        "100 % means.",
        "无法得知偏差多少：未给出与 100 % 对应的额定转矩。",
    ),
    "finding.skew_mode": (
        "The beam skews at {frequency} Hz with a damping of {damping} %.",
        "横梁在 {frequency} Hz 处歪斜振动，阻尼 {damping} %。",
    ),
    "finding.pair_sound": (
        "Both speed loops together keep Ms {goal}: {ms}, at most {ms_high}, at {hz} Hz (measured "
        "up to {top} Hz; each axis alone {alone}).",
        "两个速度环共同保持 Ms {goal}：{ms}，至多 {ms_high}，位于 {hz} Hz（测量至 {top} Hz；"
        "单轴为 {alone}）。",
    ),
    "finding.pair_margin_low": (
        "Both speed loops together have little margin: Ms {ms}, up to {ms_high}, at {hz} Hz, where "
        "{goal} is asked for (each axis alone {alone}). Lower both speed gains.",
        "两个速度环共同的裕度不足：Ms {ms}，至多 {ms_high}，位于 {hz} Hz，要求 {goal}（单轴为 "
        "{alone}）。请降低两轴的速度增益。",
    ),
    "finding.pair_unstable": (
        "By the measured response both speed loops together are not stable. Lower both speed "
        "gains now.",
        "按测得的响应，两个速度环共同不稳定。请立即降低两轴的速度增益。",
    ),
    "finding.margins_beyond_band": (
        "The margins of the pair cannot be stated: the loops are still near 1 at {top} Hz, the "
        "highest line. Measure with a shorter cycle.",
        "无法给出两轴共同的裕度：在最高谱线 {top} Hz 处环路仍接近 1。请用更短的周期测量。",
    ),
    "finding.controllers_unknown": (
        "The margins of the pair cannot be known: gains, notches or the rated torque of a drive "
        "have no known meaning.",
        "无法得知两轴共同的裕度：某个驱动器的增益、陷波器或额定转矩没有已知含义。",
    ),
    "finding.factor": (
        "Both speed gains times {factor} keep the goals for the pair (Ms at most {ms}).",
        "两轴速度增益乘以 {factor} 可使两轴共同满足目标（Ms 至多 {ms}）。",
    ),
    "finding.no_factor": (
        "No common factor of the present speed gains keeps the goals for the pair on all lines.",
        "对现有速度增益，没有共同系数能在所有谱线上满足两轴的目标。",
    ),
    "finding.distortion": (
        "The response differs between realisations by more than noise: friction, backlash or a "
        "limit takes part. The intervals contain that.",
        "各次实现之间的差异大于噪声：摩擦、间隙或限幅参与其中。区间已包含该影响。",
    ),
}
_TONES: dict[Code, Literal["good", "warn", "fault"]] = {
    "not_coupled": "warn",
    "square": "good",
    "out_of_square": "warn",
    "square_uncertain": "warn",
    "pair_sound": "good",
    "pair_margin_low": "warn",
    "pair_unstable": "fault",
    "margins_beyond_band": "warn",
}


def report(result: GantryResult) -> Section:
    """Findings, figures and curves."""
    rows = [_row("fight", result.fight_percent, "%")]
    for number in (0, 1):
        place = {"axis": str(number + 1)}
        rows.append(_row("holding", result.holding_percent[number], "%", place))
        rows.append(_row("friction", result.friction_percent[number], "%", place))
    rows.append(_row("square_rev", result.out_of_square_rev, "rev"))
    if result.out_of_square_mm is not None:
        rows.append(_row("square_mm", result.out_of_square_mm, "mm"))
    rows.append(Row("skew", result.largest_skew_rev, "rev"))
    rows.append(_row("stiffness", result.skew_stiffness_nm_per_rad, "N·m/rad"))
    rows.append(_row("inertia", result.inertia_kgm2, "kg·m²"))
    rows += [
        Row(
            f"mode.{m.kind}",
            m.frequency_hz,
            "Hz",
            m.frequency_ci95_hz,
            {"damping": f"{100.0 * m.damping:.2g}"},
        )
        for m in result.modes
    ]
    rows += _margin_rows(result)
    lines = tuple(
        Line(f"entry.{e.speed}{e.torque}", result.frequency_hz, e.magnitude_db, e.half_db)
        for e in result.entries
    )
    ratio = Line("coupling", result.frequency_hz, result.coupling, result.coupling_half)
    motions = tuple(
        Line(f"motion.{m.kind}", result.frequency_hz, m.magnitude_db, m.half_db)
        for m in result.motions
    )
    charts = (
        Chart("motions", "frequency", "magnitude", motions),
        Chart("response", "frequency", "magnitude", lines),
        Chart("coupling", "frequency", "ratio", (ratio,)),
    )
    return Section(tuple(_note(each) for each in result.findings), tuple(rows), charts)


def _margin_rows(result: GantryResult) -> list[Row]:
    found = result.margins
    if found is None or found.stable is None:
        return [Row("ms", None, "")]
    rows = [Row("ms", found.ms, "", found.ms_ci95)]
    rows += [
        Row("ms_alone", each, "", None, {"axis": str(number)})
        for number, each in enumerate(found.ms_alone, 1)
    ]
    rows.append(Row("phase_margin", found.phase_margin_deg, "°"))
    rows.append(Row("factor", result.gain_factor, ""))
    return rows


def _note(finding: GantryFinding) -> Note:
    values = dict(finding.values)
    if finding.code == "out_of_square":
        values["way"] = f"({values['way']})" if values["way"] else ""
    return Note(f"finding.{finding.code}", _TONES.get(finding.code, "plain"), values)


def _row(
    name: str, found: GantryValue | None, unit: str, places: dict[str, str] | None = None
) -> Row:
    if found is None:
        return Row(name, None, unit)
    return Row(name, found.value, unit, found.ci95, places or {})
