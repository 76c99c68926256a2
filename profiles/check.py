"""Checks of a profile beyond its schema, and its coverage of each manual chapter."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import get_args

from profiles.motion.rule import Motion, place_of
from profiles.schema import INTEGER_RANGE, Chapter, Fault, HomingMethod, Parameter, Profile


@dataclass(frozen=True, slots=True)
class Finding:
    """Something a reviewer must check: the place, and a message of the catalogue with its facts.

    Words are generated where it is shown (`drivers.texts.checks`).
    """

    key: str
    code: str
    params: Mapping[str, str | int | float]

    def __str__(self) -> str:
        facts = ", ".join(f"{name}={fact}" for name, fact in self.params.items())
        return f"{self.key}: {self.code} ({facts})"


def found(key: str, code: str, /, **params: str | int | float) -> Finding:
    """Return a finding with its facts by name."""
    return Finding(key, code, params)


def check(profile: Profile) -> list[Finding]:
    """Return what is wrong or unlikely; empty for a correct profile.

    A default outside its range is allowed if a note or a second printing states it.
    """
    findings: list[Finding] = []
    for parameter in profile.parameters:
        findings += _check_parameter(profile, parameter)
    codes = Counter(fault.code for fault in profile.faults)
    findings += [found(code, "profile-check.fault-twice") for code, n in codes.items() if n > 1]
    methods = Counter(method.method for method in profile.homing_methods)
    findings += [found(f"{m}", "profile-check.homing-twice") for m, n in methods.items() if n > 1]
    return findings + _check_motion(profile) + _check_chapters(profile)


def motion_counts(profile: Profile) -> dict[Motion, int]:
    """Return how many writable parameters have each motion class, all three listed."""
    counts = Counter(p.motion for p in profile.parameters if p.motion is not None)
    return {motion: counts[motion] for motion in get_args(Motion)}


def unclassified(profile: Profile) -> list[Parameter]:
    """Return writable parameters without a motion class: they count as ``energises``."""
    return [p for p in profile.parameters if p.motion_origin == "unclassified"]


def _check_motion(profile: Profile) -> list[Finding]:
    """Check that every writable object has its class from one rule, and that all rules are used.

    A profile made from a manufacturer's file has objects without a class; that is its normal state,
    and the count shows how many.
    """
    findings: list[Finding] = []
    if not profile.from_description:
        findings += [
            found(p.key, "profile-check.no-motion-class", name=p.name)
            for p in unclassified(profile)
        ]
    writable = [p.key for p in profile.parameters if p.access != "ro"]
    own = [rule for rule in profile.motion_rules if rule.origin == "profile"]
    for key in writable:
        if sum(rule.covers(key) for rule in own) > 1:
            findings.append(found(key, "profile-check.two-motion-rules"))
    places = [place_of(key) for key in writable]
    for rule in profile.motion_rules:
        for text, (first, last) in zip(rule.keys, rule.spans, strict=True):
            if not any(first <= place <= last for place in places):
                findings.append(found(text, "profile-check.motion-rule-left-over"))
    return findings


def _check_chapters(profile: Profile) -> list[Finding]:
    """Check that every line of the manual is in a chapter with records or a reason."""
    findings: list[Finding] = []
    expected = 1
    for chapter in profile.manual_chapters:
        if chapter.first_line != expected:
            findings.append(found(chapter.title, "profile-check.chapter-begin", line=expected))
        expected = chapter.last_line + 1
        if not sum(counts_of(profile, chapter).values()) and not chapter.empty:
            findings.append(found(chapter.title, "profile-check.chapter-empty"))
    if not profile.manual_chapters and not profile.partial and profile.manual.isdigit():
        findings.append(found(profile.drive, "profile-check.no-chapters"))
    return findings


def counts_of(profile: Profile, chapter: Chapter) -> dict[str, int]:
    """Return how many records of each kind refer to a line of this chapter, including notes."""
    lines = range(chapter.first_line, chapter.last_line + 1)

    def inside(*texts: str) -> bool:
        return any(
            int(line) in lines
            for text in texts
            for line in re.findall(rf"{profile.manual}:(\d+)", text)
        )

    def of(records: Iterable[Parameter | Fault | HomingMethod]) -> int:
        return sum(inside(r.source, r.notes, *getattr(r, "also_printed", ())) for r in records)

    pdo = () if profile.pdo is None else (profile.pdo, *profile.pdo.sets)
    others = (
        profile.identity, profile.units, *profile.links, *(link.watchdog for link in profile.links),
        *profile.procedures, *profile.terminals, *profile.quirks, *profile.notes,
        *profile.conflicts, *pdo,
        *profile.stiffness,
    )  # fmt: skip
    found = {
        "parameters": of(profile.parameters),
        "faults": of(profile.faults),
        "homing methods": of(profile.homing_methods),
        "other records": sum(
            inside(getattr(record, "source", ""), getattr(record, "notes", "")) for record in others
        ),
    }
    return {name: number for name, number in found.items() if number}


def _check_parameter(profile: Profile, p: Parameter) -> list[Finding]:
    findings: list[Finding] = []
    low, high = p.raw_limits
    explained = bool(p.notes or p.also_printed)
    if isinstance(p.default_raw, (int, float)) and not explained:
        below = low is not None and p.default_raw < low
        if below or (high is not None and p.default_raw > high):
            findings.append(
                found(
                    p.key,
                    "profile-check.default-outside",
                    default=p.default_raw,
                    limits=f"{low}…{high}",
                )
            )
    bounds = INTEGER_RANGE.get(p.type)
    if bounds is not None:
        for name, value in (("min_raw", p.min_raw), ("max_raw", p.max_raw)):
            if value is not None and not bounds[0] <= value <= bounds[1]:
                findings.append(
                    found(p.key, "profile-check.does-not-fit", name=name, value=value, type=p.type)
                )
    outside = [
        code
        for code in p.enum
        if (low is not None and code < low) or (high is not None and code > high)
    ]
    if outside and not explained:
        findings.append(
            found(
                p.key,
                "profile-check.enum-outside",
                values=", ".join(map(str, outside)),
                limits=f"{low}…{high}",
            )
        )
    if not p.source.startswith(f"{profile.manual}:"):
        findings.append(
            found(p.key, "profile-check.other-manual", source=p.source, manual=profile.manual)
        )
    findings += _check_number(p)
    return findings


def _check_number(p: Parameter) -> list[Finding]:
    """Check that Pgg.nn is object 2000h + gg, subindex nn + 1 (002 and 000, on parameters)."""
    numbered = re.fullmatch(r"P(\d+)\.(\d+)", p.number or "")
    if numbered is None:
        return []
    group, number = map(int, numbered.groups())
    expected = f"{0x2000 + group:04X}:{number + 1:02X}"
    if p.key == expected:
        return []
    return [found(p.key, "profile-check.number", number=p.number or "", expected=expected)]


def coverage(profile: Profile) -> list[str]:
    """Return a line per chapter of the manual: what of it is in the profile."""
    lines = [_chapter_line(profile, chapter) for chapter in profile.manual_chapters]
    lines += [f"{chapter}: {text}" for chapter, text in profile.chapters.items()]
    groups = Counter(p.group for p in profile.parameters)
    lines += [f"group {group}: {count} parameters" for group, count in groups.items()]
    return lines


def _chapter_line(profile: Profile, chapter: Chapter) -> str:
    counts = ", ".join(f"{n} {name}" for name, n in counts_of(profile, chapter).items())
    place = f"lines {chapter.first_line}-{chapter.last_line}"
    return f"{chapter.title} ({place}): {counts or 'no records'}. {chapter.taken}"
