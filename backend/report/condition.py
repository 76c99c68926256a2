"""The chapter on the axis' condition: its baseline, and changes since."""

from __future__ import annotations

from backend.report.document import Block, Note, Table
from backend.report.texts import Words
from backend.tools.measuring.numbers import moment
from backend.tools.watching.trend.records import Baseline, Condition
from backend.tools.watching.trend.words import message_of


def condition(found: Condition, baseline: Baseline, words: Words) -> list[Block]:
    """The baseline with its signature, then each quantity compared with it, with the next step."""
    rows = (
        ("person", baseline.person),
        ("health.when", f"{moment(baseline.signed)} ({words('utc')})"),
        ("health.rounds", str(len(baseline.rounds))),
        ("health.hash", baseline.sha256),
        ("health.checks", str(found.checks)),
    )
    blocks: list[Block] = [Table((), tuple((words(name), text) for name, text in rows))]
    if not baseline.intact:
        return [*blocks, Note(words("health.changed"), "warn")]
    for each in found.findings:
        message = message_of(each)
        remedy = message.remedy()
        text = message.words(words.language)
        if each.code in ("changed", "not_seen", "suspected"):
            step = "" if remedy is None else f" {words('health.next')}: "
            blocks.append(
                Note(f"{text}.{step}{remedy.words(words.language) if remedy else ''}", "warn")
            )
        else:
            blocks.append(Note(text))
    return blocks
