"""The term base: one record per term, rendered as the glossary and used by the lint of texts."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

import yaml

ROOT = Path(__file__).resolve().parents[2]
FILE = ROOT / "docs" / "glossary" / "terms.yaml"

HEAD = """# Glossary

The terms of servodeck in English and Chinese. Pages, messages and documentation use these words
and no others; `python .ci/docs --check` (part of `make test`) refuses the words in the last column.
The data are in `docs/glossary/terms.yaml`.

Sources: *CiA* 301, 305, 306 and 402 (CANopen, LSS, EDS, drives), *IEC 61800-7* (drive interfaces),
*ETG* 1000, 2000 and 2100 (EtherCAT), *ISO 3864* and *ANSI Z535* (safety signs), *IEC 60204-1* and
*IEC 61800-5-2* (stop categories, safety functions), *GB/T* where a national standard is known.
*Usage* marks a usual term of the field without a standard that defines it here; *servodeck* one of
ours.
"""


class Term(NamedTuple):
    """A term with its definition; ``avoid`` and ``avoid_zh`` are words that texts must not use."""

    field: str
    en: str
    zh: str
    definition: str
    source: str
    avoid: tuple[str, ...] = ()
    avoid_zh: tuple[str, ...] = ()


class Banned(NamedTuple):
    """A word that a text must not use, and what stands in its place."""

    pattern: re.Pattern[str]
    word: str
    better: str


def load(file: Path = FILE) -> list[Term]:
    """The terms in the order of the file.

    Raises:
        ValueError: a record lacks a field, or two records have the same English or term.
    """
    terms: list[Term] = []
    for field, records in yaml.safe_load(file.read_text("utf-8")).items():
        for record in records:
            avoid, avoid_zh = (tuple(record.pop(name, ())) for name in ("avoid", "avoid_zh"))
            try:
                terms.append(Term(field=field, avoid=avoid, avoid_zh=avoid_zh, **record))
            except TypeError as error:
                raise ValueError(f"{file.name}: {record}: {error}") from error
    names = [term.en.lower() for term in terms]
    double = {name for name in names if names.count(name) > 1}
    if double:
        raise ValueError(f"{file.name}: two records of {sorted(double)}")
    return terms


def banned(terms: Sequence[Term], *, chinese: bool) -> list[Banned]:
    """What texts of one language must not use."""
    found = []
    for term in terms:
        for word in term.avoid_zh if chinese else term.avoid:
            pattern = re.escape(word) if chinese else rf"\b{re.escape(word)}s?\b"
            found.append(
                Banned(re.compile(pattern, re.IGNORECASE), word, term.zh if chinese else term.en)
            )
    return found


def page(terms: Sequence[Term]) -> str:
    """The glossary."""
    return "\n".join([HEAD, *_tables(terms)])


def _tables(terms: Sequence[Term]) -> Iterator[str]:
    for field, members in groupby(terms, key=lambda term: term.field):
        yield f"## {field}\n"
        yield "| English | Chinese | definition | source | not |"
        yield "| --- | --- | --- | --- | --- |"
        for term in members:
            avoid = ", ".join((*term.avoid, *term.avoid_zh))
            yield f"| {term.en} | {term.zh} | {term.definition} | {term.source} | {avoid} |"
        yield ""
