"""From facts to a document in one language."""

from __future__ import annotations

from dataclasses import dataclass

from backend.report.chapters import chapter
from backend.report.condition import condition
from backend.report.document import (
    Block,
    Document,
    Heading,
    Language,
    Note,
    Signatures,
    Table,
    Tone,
)
from backend.report.facts import Facts, Measured
from backend.report.handed_over import handed_over
from backend.report.numbers import NONE, fixed, hertz, margin, milliseconds, moment, significant
from backend.report.texts import Words
from backend.report.tools import kind_title, tool_verdict
from backend.report.views import SweepView
from backend.tools.autotune.result import VerdictInfo
from backend.tools.step.result import StepAnswer
from backend.tools.tool import ToolResult

#: docs/tuning.md: 45° or more is calm, 8 dB or more, Ms below 2; and what is no longer sound.
_SOUND = (45.0, 8.0, 2.0)
_POOR = (30.0, 6.0, 2.5)


def compose(facts: Facts, language: Language) -> Document:
    """The whole report."""
    words = Words(language)
    blocks: list[Block] = [
        Heading(words("identity")), _identity(facts, words),
        Heading(words("verdict")), *_verdicts(facts, words),
        Heading(words("warnings")), *_warnings(facts, words),
        Heading(words("settings")), *_settings(facts, words),
        Heading(words("measurements")),
    ]  # fmt: skip
    if not facts.measured:
        blocks.append(Note(words("measurements.none")))
    for measured in facts.measured:
        blocks += chapter(measured, words)
    if facts.handed_over:
        blocks += [Heading(words("handover")), *handed_over(facts.handed_over, words)]
    if facts.condition is not None and facts.condition.baseline is not None:
        found = facts.condition
        blocks += [Heading(words("health")), *condition(found, facts.condition.baseline, words)]
    if facts.notes:
        blocks += [Heading(words("notes")), *(Note(line) for line in facts.notes.splitlines())]
    blocks += [
        Heading(words("signatures")),
        Signatures(
            (words("sign.commissioned"), words("sign.accepted")),
            (words("sign.name"), words("sign.date"), words("sign.signature")),
        ),
    ]
    name = facts.identity.axis if not facts.machine else f"{facts.machine} · {facts.identity.axis}"
    made = f"{words('made')}: {moment(facts.made)} ({words('utc')})"
    return Document(
        words("title"), name, language, f"{name} · {made}", words("page"), tuple(blocks)
    )


def _identity(facts: Facts, words: Words) -> Table:
    who = facts.identity
    rows = [
        ("machine", facts.machine), ("axis", who.axis), ("drive", who.drive),
        ("manual", who.manual), ("vendor_id", _hex(who.vendor_id)),
        ("product_code", _hex(who.product_code)), ("revision", _hex(who.revision)),
        ("serial", "" if who.serial is None else str(who.serial)), ("firmware", who.firmware),
        ("buses", ", ".join(who.buses)), ("person", facts.person),
        ("program", f"servodeck {facts.program}"), ("profile_version", who.profile_version),
        ("made", f"{moment(facts.made)} ({words('utc')})"),
    ]  # fmt: skip
    return Table((), tuple((words(name), text or words("unknown")) for name, text in rows))


def _hex(value: int | None) -> str:
    return "" if value is None else f"0x{value:08X}"


# --- verdicts --------------------------------------------------------------------------


def _verdicts(facts: Facts, words: Words) -> list[Block]:
    found: list[Block] = [_verdict(measured, words) for measured in facts.measured]
    if not found:
        return [Note(words("no_verdict"), "warn")]
    if any(_is_loop(measured) for measured in facts.measured):
        found.append(Note(words("loop.rule")))
    return found


def _is_loop(measured: Measured) -> bool:
    return isinstance(measured.view, SweepView) and measured.view.kind != "mechanics"


def _verdict(measured: Measured, words: Words) -> Note:
    view, kind = measured.view, kind_title(measured.kind, words)
    if isinstance(view, StepAnswer):
        return _step_verdict(view, kind, words)
    if isinstance(view, ToolResult):
        return tool_verdict(measured.kind, view, words)
    if view.kind == "mechanics":
        peaks = [hertz(r.frequency_hz) for r in view.resonances if r.kind == "resonance"]
        if not view.trusted:
            return Note(f"{kind}: {words('untrusted')}", "warn")
        reported = f"{words('resonances')} {', '.join(peaks)}" if peaks else words("no_resonance")
        return Note(f"{kind}: {reported}", "good")
    if measured.verdict is not None:
        return _tuned_verdict(measured.verdict, view, kind, words)
    return _loop_verdict(view, kind, words)


def _tuned_verdict(verdict: VerdictInfo, view: SweepView, kind: str, words: Words) -> Note:
    """Of what was measured and what is predicted above it, the worse one."""
    if not verdict.stable or verdict.contradicted:
        return Note(words("loop.unstable", kind=kind), "fault")
    worst = verdict.stated
    loop = _Loop(worst.phase_margin_deg, worst.gain_margin_db, worst.ms)
    tone, name = _judged(loop)
    if verdict.coverage == "predicted" and tone == "good":
        tone, name = "warn", "incomplete"
    text = words(
        "loop.verdict.bands", kind=kind, verdict=words(name), pm=fixed(loop.phase_deg, 0, "°"),
        gm=fixed(loop.gain_db, 1, "dB"), ms=fixed(loop.ms, 2),
        bw=hertz(margin(view.margins, "bandwidth_hz")),
    )  # fmt: skip
    return Note(text, tone)


def _step_verdict(view: StepAnswer, kind: str, words: Words) -> Note:
    numbers = view.step or view.move
    settled = numbers is not None and numbers.settling_s is not None
    settling = milliseconds(numbers.settling_s) if numbers and settled else words("not_reached")
    # Nobody prints how much overshoot a machine can bear: numbers, and no judgement.
    tone: Tone = "plain" if settled else "warn"
    if view.move is not None:
        peak = significant(view.move.following_peak, view.unit)
        return Note(words("move.verdict", kind=kind, following=peak, settling=settling), tone)
    over = fixed(view.step.overshoot_percent if view.step else None, 1, "%")
    return Note(words("step.verdict", kind=kind, overshoot=over, settling=settling), tone)


@dataclass(frozen=True)
class _Loop:
    phase_deg: float | None
    gain_db: float | None
    ms: float | None

    def within(self, limits: tuple[float, float, float]) -> bool:
        """What was not seen within the measured band breaks no limit, and keeps none either."""
        phase, gain, ms = limits
        return (
            (self.phase_deg is None or self.phase_deg >= phase)
            and (self.gain_db is None or self.gain_db >= gain)
            and (self.ms is None or self.ms <= ms)
        )

    @property
    def complete(self) -> bool:
        """Whether every figure was seen; a missing one never counts as passed."""
        return None not in (self.phase_deg, self.gain_db, self.ms)


def _judged(loop: _Loop) -> tuple[Tone, str]:
    """Tone and word for a loop; where a figure is missing it is not called sound."""
    tone: Tone = "good" if loop.within(_SOUND) else "warn" if loop.within(_POOR) else "fault"
    if tone == "good" and not loop.complete:
        return "warn", "incomplete"
    return tone, {"good": "sound", "warn": "close"}.get(tone, "poor")


def _loop_verdict(view: SweepView, kind: str, words: Words) -> Note:
    found = view.margins
    if found.get("stable") is False:
        return Note(words("loop.unstable", kind=kind), "fault")
    loop = _Loop(
        margin(found, "phase_margin_deg"), margin(found, "gain_margin_db"), margin(found, "ms")
    )
    if loop.phase_deg is None and loop.gain_db is None and loop.ms is None:
        return Note(words("loop.unknown", kind=kind), "warn")
    tone, verdict = _judged(loop)
    text = words(
        "loop.verdict", kind=kind, verdict=words(verdict), pm=fixed(loop.phase_deg, 0, "°"),
        gm=fixed(loop.gain_db, 1, "dB"), ms=fixed(loop.ms, 2),
        bw=hertz(margin(found, "bandwidth_hz")), low=hertz(margin(found, "from_hz")),
        high=hertz(margin(found, "to_hz")),
    )  # fmt: skip
    return Note(text, tone)


# --- warnings and settings -------------------------------------------------------------


def _warnings(facts: Facts, words: Words) -> list[Block]:
    found = [Note(each, "fault") for each in facts.trouble]
    if facts.unsaved:
        found.append(Note(words("warn.unsaved", keys=", ".join(facts.unsaved)), "warn"))
    if facts.pending:
        found.append(Note(words("warn.pending", keys=", ".join(facts.pending)), "warn"))
    found += [
        Note(words("warn.now", key=f"{c.key} {c.name}", now=c.now, after=c.after), "warn")
        for c in facts.changes
        if c.now
    ]
    found += _stale(facts, words)
    found += [Note(words("warn.unusable", why=each), "warn") for each in facts.unusable]
    return list(found) or [Note(words("none"))]


def _stale(facts: Facts, words: Words) -> list[Note]:
    """What was measured before the last change tells nothing of the axis as it is."""
    last = facts.last_change
    if last is None:
        return []
    shown = [m for m in facts.measured if _is_loop(m) or isinstance(m.view, StepAnswer)]
    old = [m for m in shown if m.saved < last]
    if not facts.changes and not old:
        # What was tried and taken back needs no proof.
        return []
    if not any(_is_loop(m) and m.saved >= last for m in shown):
        return [Note(words("warn.unverified"), "warn")]
    return [Note(words("warn.stale", kind=kind_title(m.kind, words)), "warn") for m in old]


def _settings(facts: Facts, words: Words) -> list[Block]:
    if not facts.live:
        return [Note(words("settings.files"))]
    if not facts.changes:
        return [Note(words("settings.none"))]
    head = tuple(words(name) for name in ("parameter", "name", "before", "after", "when"))
    rows = tuple((c.key, c.name, c.before or NONE, c.after, moment(c.time)) for c in facts.changes)
    return [Note(words("settings.lead")), Table(head, rows, (False, False, True, True, False))]
