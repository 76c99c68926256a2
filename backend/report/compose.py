"""Composition of a document in one language from the facts of a report."""

from __future__ import annotations

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
from backend.report.texts import Words
from backend.report.tools import kind_title, note_of, tool_verdict
from backend.tools.measuring.numbers import (
    NONE,
    fixed,
    milliseconds,
    moment,
    significant,
)
from backend.tools.moving.step.result import StepAnswer
from backend.tools.tuning.sweep.result import SweepAnswer
from backend.tools.tuning.sweep.run import TOOL as SWEEP
from backend.tools.tuning.sweep.texts import tuned_verdict


def compose(facts: Facts, language: Language) -> Document:
    """The whole report."""
    words = Words(language)
    blocks: list[Block] = [
        Heading(words("identity")),
        _identity(facts, words),
        Heading(words("verdict")),
        *_verdicts(facts, words),
        Heading(words("warnings")),
        *_warnings(facts, words),
        Heading(words("settings")),
        *_settings(facts, words),
        Heading(words("measurements")),
    ]
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
    return isinstance(measured.view, SweepAnswer) and measured.view.kind != "mechanics"


def _verdict(measured: Measured, words: Words) -> Note:
    if isinstance(measured.view, StepAnswer):
        return _step_verdict(measured.view, kind_title(measured.kind, words), words)
    if isinstance(measured.view, SweepAnswer) and measured.verdict is not None:
        note = note_of(SWEEP, tuned_verdict(measured.view, measured.verdict), words)
        return Note(f"{kind_title(measured.kind, words)}: {note.text}", note.tone)
    return tool_verdict(measured.kind, measured.view, words)


def _step_verdict(view: StepAnswer, kind: str, words: Words) -> Note:
    numbers = view.step or view.move
    settled = numbers is not None and numbers.settling_s is not None
    settling = milliseconds(numbers.settling_s) if numbers and settled else words("not_reached")
    if "settling_s" in view.unknown:
        settling = words("not_known")
    # The overshoot that a machine tolerates is not known: figures only, without a judgement.
    tone: Tone = "plain" if settled else "warn"
    if view.move is not None:
        peak = significant(view.move.following_peak, view.unit)
        return Note(words("move.verdict", kind=kind, following=peak, settling=settling), tone)
    over = fixed(view.step.overshoot_percent if view.step else None, 1, "%")
    return Note(words("step.verdict", kind=kind, overshoot=over, settling=settling), tone)


# --- warnings and settings -------------------------------------------------------------


def _warnings(facts: Facts, words: Words) -> list[Block]:
    found = [Note(each.words(words.language), "fault") for each in facts.trouble]
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
    found += [
        Note(words("warn.unusable", why=each.words(words.language)), "warn")
        for each in facts.unusable
    ]
    return list(found) or [Note(words("none"))]


def _stale(facts: Facts, words: Words) -> list[Note]:
    """Warnings that measurements from before the last change do not show the present axis."""
    last = facts.last_change
    if last is None:
        return []
    shown = [m for m in facts.measured if _is_loop(m) or isinstance(m.view, StepAnswer)]
    old = [m for m in shown if m.saved < last]
    if not facts.changes and not old:
        # Changes that were all undone need no measurement afterwards.
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
