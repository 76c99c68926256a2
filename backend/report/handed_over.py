"""The chapter on the hand-over to the machine's controller."""

from __future__ import annotations

from collections.abc import Sequence

from backend.report.document import Block, Heading, Note, Table
from backend.report.facts import HandedOverFile
from backend.report.texts import Words
from backend.tools.measuring.numbers import moment


def handed_over(made: Sequence[HandedOverFile], words: Words) -> list[Block]:
    """Format, file, hash, person and date of each list, with its values and changes since."""
    blocks: list[Block] = [Note(words("handover.lead"))]
    for each in made:
        rows = (
            ("handover.format", each.format),
            ("handover.file", each.file),
            ("handover.hash", each.sha256),
            ("handover.set", each.set_file),
            ("person", each.person),
            ("handover.when", f"{moment(each.time)} ({words('utc')})"),
        )
        blocks += [
            Heading(each.file, 3),
            Table((), tuple((words(name), text or words("unknown")) for name, text in rows)),
            Table(
                (words("parameter"), words("name"), words("handover.value")),
                each.values,
                (False, False, True),
            ),
        ]
        blocks += [
            Note(words("handover.changed", key=key, what=name, before=before, now=now), "warn")
            for key, name, before, now in each.changed
        ]
    return blocks
