"""One page of parameters per drive, from its profile."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby

from profiles.loader import drive_names, load_profile
from profiles.schema import Parameter, Profile

HEAD = """
Generated from the profile. *Takes effect*: at once, at the next enabling, after "Write settings"
or after a power cycle. *Source*: number of the manual and line. Ranges and defaults are
engineering values where the parameter has a unit.
"""


def index() -> str:
    """The list of the drives."""
    rows = [
        f"| [{one.title}]({one.drive}.md) | {len(one.parameters)} | {len(one.faults)} |"
        for one in map(load_profile, drive_names())
    ]
    head = "# Parameters\n\nEvery parameter of each profile. The search finds names and keys.\n"
    return "\n".join([head, "| drive | parameters | faults |", "| --- | --- | --- |", *rows, ""])


def page(profile: Profile) -> str:
    """The page of one drive."""
    return "\n".join([f"# Parameters: {profile.title}", HEAD, *_groups(profile), *_faults(profile)])


def _groups(profile: Profile) -> Iterator[str]:
    for group, members in groupby(
        sorted(profile.parameters, key=lambda p: (p.group, p.key)), key=lambda p: p.group
    ):
        yield f"## {group or 'Other'}\n"
        yield "| key | name | unit | range | default | access | takes effect | source |"
        yield "| --- | --- | --- | --- | --- | --- | --- | --- |"
        yield from (_row(parameter) for parameter in members)
        yield ""


def _row(p: Parameter) -> str:
    number = f" ({p.number})" if p.number else ""
    limits = (
        ""
        if p.min_raw is None and p.max_raw is None
        else (f"{_value(p, p.min_raw)} … {_value(p, p.max_raw)}")
    )
    effect = p.effective.replace("_", " ") if p.access != "ro" else ""
    cells = [
        f"`{p.key}`{number}", p.name, p.unit, limits, _value(p, p.default_raw), p.access, effect,
        p.source,
    ]  # fmt: skip
    return "| " + " | ".join(_cell(str(cell)) for cell in cells) + " |"


def _value(p: Parameter, raw: object) -> str:
    """A raw value in engineering units, with as many digits as its scale can show."""
    if raw is None:
        return ""
    if not isinstance(raw, int) or isinstance(raw, bool):
        return str(raw)
    if p.scale == 1.0 and p.offset == 0.0:
        return str(raw)
    return f"{raw * p.scale + p.offset:.10g}"


def _faults(profile: Profile) -> Iterator[str]:
    if not profile.faults:
        return
    yield "## Faults and warnings\n"
    yield "| code | name | causes | remedies | reset |"
    yield "| --- | --- | --- | --- | --- |"
    for fault in profile.faults:
        cells = [
            f"`{fault.code}`",
            fault.name,
            "; ".join(fault.causes),
            "; ".join(fault.remedies),
            fault.reset,
        ]
        yield "| " + " | ".join(_cell(cell) for cell in cells) + " |"
    yield ""


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;")
