"""Checking an export of the whole audit (JSON lines) without its database."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator

from backend.foundation.store.audit_tables import AuditEntry
from backend.records.audit.chain import ZERO, Anchor, Verdict, columns, verify
from drivers.errors import NotAllowed


def check_lines(lines: Iterable[str], anchor: Anchor | None = None) -> Verdict:
    """Check lines as written by `Trail.export`; a missing end is detected only with an anchor.

    Raises:
        NotAllowed: a line is not an entry of an audit.
    """
    entries = list(_entries(lines))
    last = entries[-1] if entries else None
    head = Anchor(last.number, last.hash) if last else Anchor(0, ZERO)
    return verify(entries, head, anchor)


def _entries(lines: Iterable[str]) -> Iterator[AuditEntry]:
    for number, line in enumerate(lines, 1):
        try:
            content = json.loads(line)
            str(content["body"]).encode()  # half a surrogate pair is in no entry
            yield AuditEntry(
                number=int(content["number"]),
                previous=str(content["previous"]),
                hash=str(content["hash"]),
                body=str(content["body"]),
                **columns(str(content["body"])),
            )
        except (ValueError, KeyError, TypeError, OverflowError, RecursionError) as error:
            raise NotAllowed("audit.line-no-entry-audit", value=line[:80], number=number) from error
