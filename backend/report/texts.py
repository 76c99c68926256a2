"""Texts of the report, in English and Chinese."""

from __future__ import annotations

from backend.report.document import Language

TEXTS: dict[str, tuple[str, str]] = {
    "title": ("Commissioning report", "调试报告"),
    "page": ("page", "第"),
    "made": ("Made", "生成时间"),
    "utc": ("all times in UTC", "所有时间为 UTC"),
    "identity": ("Axis and drive", "轴与驱动器"),
    "axis": ("Axis", "轴"),
    "machine": ("Machine", "机器"),
    "drive": ("Drive", "驱动器"),
    "manual": ("Manual", "手册"),
    "profile_version": ("Profile version", "配置版本"),
    "vendor_id": ("Vendor", "厂商"),
    "product_code": ("Product code", "产品代码"),
    "revision": ("Revision", "修订号"),
    "serial": ("Serial number", "序列号"),
    "firmware": ("Firmware", "固件"),
    "buses": ("Bus", "总线"),
    "person": ("Commissioned by", "调试人员"),
    "program": ("Made with", "软件"),
    "unknown": ("not reported", "未提供"),
    "notes": ("Notes", "备注"),
    "verdict": ("Verdict", "结论"),
    "warnings": ("Warnings", "警告"),
    "none": ("None.", "无。"),
    "settings": ("Settings changed", "已更改的设置"),
    "settings.lead": (
        "What tuning wrote to the drive, from the first value to the last.",
        "整定写入驱动器的参数，从最初值到最终值。",
    ),
    "settings.none": ("Tuning changed no setting.", "整定未更改任何设置。"),
    "settings.files": (
        "This report was made from files alone and does not contain the drive's settings.",
        "本报告仅由文件生成，不含驱动器设置。",
    ),
    "handover": ("Hand-over to the controller", "移交给控制器"),
    "handover.lead": (
        "Start-up lists that were made for the machine's controller, with the values in them.",
        "为机器控制器生成的启动列表及其中的值。",
    ),
    "handover.format": ("Controller format", "控制器格式"),
    "handover.file": ("File", "文件"),
    "handover.hash": ("SHA-256 of the file", "文件的 SHA-256"),
    "handover.set": ("Made from", "来源参数集"),
    "handover.when": ("Date", "日期"),
    "handover.value": ("Value", "值"),
    "handover.changed": (
        "{key} {what} was handed over as {before}; the drive holds {now} now.",
        "{key} {what} 移交时为 {before}；驱动器中现为 {now}。",
    ),
    "health": ("Condition against the baseline", "相对基线的状态"),
    "health.when": ("Baseline signed", "基线签署时间"),
    "health.rounds": ("Rounds of the baseline", "基线轮数"),
    "health.hash": ("SHA-256 of the baseline", "基线的 SHA-256"),
    "health.checks": ("Rounds measured since", "此后测量的轮数"),
    "health.changed": (
        "The stored baseline was changed after it was signed: its checksum differs. "
        "Nothing is compared.",
        "存储的基线与签署时不同：校验和不一致。未作比较。",
    ),
    "health.next": ("Next", "下一步"),
    "parameter": ("Parameter", "参数"),
    "name": ("Name", "名称"),
    "before": ("Before", "之前"),
    "after": ("After", "之后"),
    "when": ("Written", "写入时间"),
    "measurements": ("Measurements", "测量"),
    "measurements.none": ("No measurement is part of this report.", "本报告不含测量。"),
    "kind.sweep-mechanics": ("Frequency response of the mechanics", "机械频率响应"),
    "kind.sweep-speed_loop": ("Frequency response of the speed loop", "速度环频率响应"),
    "kind.sweep-position_loop": ("Frequency response of the position loop", "位置环频率响应"),
    "kind.step-speed": ("Step of speed", "速度阶跃"),
    "kind.step-move": ("Move", "移动"),
    "measured": (
        "Measured {time}, file {file}, servodeck {program}.",
        "测量于 {time}，文件 {file}，servodeck {program}。",
    ),
    "compared": ("Compared with {time}, file {file}.", "对比 {time}，文件 {file}。"),
    "limits": (
        "Limits: ±{travel} rev, {speed} rpm, {torque} % of rated torque.",
        "限制：±{travel} 转，{speed} rpm，{torque}% 额定转矩。",
    ),
    "differs": (
        "Computed again from the raw signals, this measurement gives other results than at the "
        "time ({what}); the new ones are shown.",
        "由原始信号重新计算的结果与当时不同（{what}）；此处为新结果。",
    ),
    "quantity": ("Quantity", "量"),
    "value": ("Value", "值"),
    "interval": ("95 % interval", "95% 置信区间"),
    "inertia": ("Inertia of motor and load", "电机与负载惯量"),
    "magnitude": ("Magnitude", "幅值"),
    "phase": ("Phase", "相位"),
    "coherence": ("Coherence", "相干性"),
    "frequency": ("Frequency in Hz", "频率（Hz）"),
    "time": ("Time in s", "时间（s）"),
    "speed": ("Speed", "速度"),
    "position": ("Position", "位置"),
    "torque": ("Torque", "转矩"),
    "of_rated": ("% of rated", "额定百分比"),
    "demand": ("commanded", "指令"),
    "bode.caption": (
        "Shaded: valid range of the estimate ({low} to {high} Hz at {rate} samples per second). "
        "The pale band around a line holds the true value with 95 % confidence.",
        "阴影：估计有效的频段（{low} 至 {high} Hz，每秒 {rate} 次采样）。"
        "曲线周围浅色带为 95% 置信区间。",
    ),
    "step.caption": (
        "Commanded and actual value over time, and the torque.",
        "指令与实际随时间变化，以及所需转矩。",
    ),
    "kind": ("Kind", "类型"),
    "phase_margin": ("Phase margin", "相位裕度"),
    "gain_margin": ("Gain margin", "增益裕度"),
    "overshoot": ("Overshoot", "超调"),
    "rise": ("Rise (10–90 %)", "上升时间（10–90%）"),
    "settling": ("Settling time", "调节时间"),
    "following": ("Largest following error", "最大跟随误差"),
    "following_rms": ("Following error, RMS", "跟随误差有效值"),
    "torque_peak": ("Torque peak", "转矩峰值"),
    "torque_rms": ("Torque RMS", "转矩有效值"),
    "not_reached": ("not reached", "未达到"),
    "not_known": ("not known", "未知"),
    "samples_lost": ("Samples not received", "未收到的采样"),
    "window_widened": ("Settling window, ten times the noise", "稳定窗口（噪声的十倍）"),
    "verdict.band": ("Margins by band", "各频段裕度"),
    "verdict.measured": ("measured", "测得"),
    "verdict.predicted": ("predicted", "预测"),
    "verdict.peak": ("Largest |S|", "最大 |S|"),
    "verdict.coverage.measured": (
        "All crossovers lie within the measured band.",
        "所有穿越频率均在所测频段内。",
    ),
    "verdict.coverage.gain_steps": (
        "The loop may cross 0 dB up to {last}, outside the measured band: it was stable with "
        "{gain} more gain, which bounds the margins there.",
        "环路最高可能在 {last} 穿越 0 dB，超出所测频段：增益提高 {gain} 时仍稳定，"
        "由此限定该处的裕度。",
    ),
    "verdict.coverage.predicted": (
        "The loop may cross 0 dB up to {last}, outside the measured band: its margins there are "
        "predicted only.",
        "环路最高可能在 {last} 穿越 0 dB，超出所测频段：该处的裕度仅为预测。",
    ),
    "loop.rule": (
        "Sound: phase margin 45° or more, gain margin 8 dB or more, Ms below 2. "
        "Not sound: below 30°, below 6 dB, or Ms above 2.5.",
        "良好：相位裕度 ≥ 45°，增益裕度 ≥ 8 dB，Ms < 2。不合格：< 30°、< 6 dB 或 Ms > 2.5。",
    ),
    "step.verdict": (
        "{kind}: overshoot {overshoot}, settling {settling}.",
        "{kind}：超调 {overshoot}，调节时间 {settling}。",
    ),
    "move.verdict": (
        "{kind}: largest following error {following}, settling {settling}.",
        "{kind}：最大跟随误差 {following}，调节时间 {settling}。",
    ),
    "no_verdict": (
        "Nothing was measured, so nothing is concluded.",
        "未进行测量，无结论。",
    ),
    "warn.stale": (
        "{kind}: measured before the last setting was changed; it does not show the axis in "
        "its present state. Measure again.",
        "{kind}：测量早于最后一次设置更改，不代表轴的当前状态。请重新测量。",
    ),
    "warn.unverified": (
        "Settings were changed, but no loop was measured afterwards.",
        "设置已更改，但之后未测量任何环路。",
    ),
    "warn.unsaved": (
        "In the drive, but not saved in its memory; lost at power-off: {keys}",
        "已写入但未保存到驱动器存储器，断电会丢失：{keys}",
    ),
    "warn.pending": (
        "Written, but without effect until the drive applies them: {keys}",
        "已写入但尚未生效：{keys}",
    ),
    "warn.now": (
        "{key} is {now} now, not {after}: it was changed since.",
        "{key} 现为 {now}，而非 {after}：之后被更改。",
    ),
    "warn.saturated": (
        "The torque was at its limit for {share} of the time.",
        "转矩在 {share} 的时间内达到限制。",
    ),
    "warn.unusable": ("A measurement could not be used: {why}", "某测量无法使用：{why}"),
    "signatures": ("Signatures", "签字"),
    "sign.commissioned": ("Commissioned", "调试"),
    "sign.accepted": ("Accepted", "验收"),
    "sign.name": ("Name", "姓名"),
    "sign.date": ("Place, date", "地点、日期"),
    "sign.signature": ("Signature", "签名"),
    "tone.good": ("Good", "良好"),
    "tone.warn": ("Warning", "警告"),
    "tone.fault": ("Fault", "故障"),
}


class Words:
    """The texts of one language."""

    def __init__(self, language: Language) -> None:
        self.language = language
        self._column = 1 if language == "zh" else 0

    def __call__(self, name: str, **values: str) -> str:
        """A text with its placeholders filled in."""
        text = TEXTS[name][self._column]
        return text.format(**values) if values else text
