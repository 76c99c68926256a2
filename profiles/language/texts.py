"""The texts of a profile, kind by kind, and their translations from an overlay."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from profiles.check import Finding, found
from profiles.functions import Functions
from profiles.language.overlay import Overlay, Place
from profiles.schema import ConfirmStep, Fault, Parameter, Procedure, Profile

#: ``safety``: warnings and the texts that a person must confirm before anything moves. ``pages``:
#: texts on the family in the pages of gains, motion, mechanics, I/O and alarms.
Kind = Literal[
    "safety", "faults", "procedures", "homing", "terminals", "groups", "parameter names",
    "parameter help", "parameter notes", "values", "pages", "notes on the drive",
]  # fmt: skip


@dataclass(frozen=True, slots=True)
class Text:
    """A text of the profile in English. Terminals and groups have no place: records share them."""

    kind: Kind
    place: Place
    english: str


def texts_of(profile: Profile) -> Iterator[Text]:
    """Iterate over every text of a profile that can be translated; empty ones are left out."""
    for text in _all(profile):
        if text.english.strip():
            yield text


def _all(profile: Profile) -> Iterator[Text]:
    for fault in profile.faults:
        yield from _of_fault(fault)
    for procedure in profile.procedures:
        yield from _of_procedure(procedure)
    for method in profile.homing_methods:
        place = ("homing_methods", str(method.method))
        yield Text("homing", (*place, "name"), method.name)
        yield Text("homing", (*place, "help"), method.help)
        yield Text("homing", (), method.notes)
    yield from _of_functions(profile)
    for terminal in profile.terminals:
        for function in terminal.functions:
            yield Text("terminals", (), function.name)
            yield Text("terminals", (), function.help)
        yield Text("terminals", (), terminal.notes)
    for group in dict.fromkeys(parameter.group for parameter in profile.parameters):
        yield Text("groups", (), group)
    for parameter in profile.parameters:
        yield from _of_parameter(parameter)
    for quirk in profile.quirks:
        yield Text("notes on the drive", ("quirks", quirk.kind), quirk.help)
    for note in profile.notes:
        yield Text("notes on the drive", (), note.help)
    for link in profile.links:
        yield Text("notes on the drive", ("watchdogs", link.kind), link.watchdog.help)
        yield Text("notes on the drive", ("wiring", link.kind), link.wiring)


def _of_fault(fault: Fault) -> Iterator[Text]:
    place = ("faults", fault.code)
    yield Text("faults", (*place, "name"), fault.name)
    for number, cause in enumerate(fault.causes):
        yield Text("faults", (*place, "causes", str(number)), cause)
    for number, remedy in enumerate(fault.remedies):
        yield Text("faults", (*place, "remedies", str(number)), remedy)
    yield Text("faults", (*place, "reset"), fault.reset)


def _of_procedure(procedure: Procedure) -> Iterator[Text]:
    place = ("procedures", procedure.name)
    yield Text("procedures", (*place, "title"), procedure.title)
    yield Text("procedures", (*place, "help"), procedure.help)
    yield Text("safety", (*place, "warning"), procedure.warning)
    agreed = (step.text for step in procedure.steps if isinstance(step, ConfirmStep))
    for number, text in enumerate(agreed):
        yield Text("safety", (*place, "confirm", str(number)), text)
    yield Text("procedures", (), procedure.notes)


def _of_functions(profile: Profile) -> Iterator[Text]:
    functions = profile.functions
    for forcing in functions.terminals.forcing:
        place: Place = ("forcing", forcing.name)
        yield Text("notes on the drive", (*place, "title"), forcing.title)
        yield Text("notes on the drive", (*place, "help"), forcing.help)
        yield Text("safety", (*place, "warning"), forcing.warning)
        yield Text("pages", (), forcing.notes)
    for guide in functions.guides:
        place = ("guides", guide.name)
        yield Text("notes on the drive", (*place, "title"), guide.title)
        yield Text("safety", (*place, "warning"), guide.warning)
        yield Text("pages", (), guide.notes)
        for step in guide.steps:
            yield Text("pages", (), step.title)
            yield Text("pages", (), step.text)
    if functions.identification is not None:
        yield Text("safety", ("identification", "warning"), functions.identification.warning)
    for english in _page_texts(functions):
        yield Text("pages", (), english)


def _page_texts(functions: Functions) -> Iterator[str]:
    """Iterate over titles, help and notes of the pages, by their English text alone."""
    for group in functions.groups:
        yield from (group.title, group.help)
    for block in functions.gain_blocks:
        yield block.help
    if (history := functions.history) is not None:
        yield history.notes
        yield from (slot.name for slot in history.slots if slot.name)
    yield functions.terminals.notes
    if functions.probe is not None:
        yield functions.probe.notes
        for probe in functions.probe.probes:
            yield from probe.sources.values()
    if functions.brake is not None:
        yield from (functions.brake.fault, functions.brake.notes)
    if functions.regeneration is not None:
        yield functions.regeneration.notes
    yield from (functions.gear.acts, functions.gear.notes)


def _of_parameter(parameter: Parameter) -> Iterator[Text]:
    place = ("parameters", parameter.key)
    yield Text("parameter names", (*place, "name"), parameter.name)
    yield Text("parameter help", (*place, "help"), parameter.help)
    yield Text("parameter notes", (), parameter.notes)
    for note in (*parameter.also_printed, parameter.motion_reason):
        yield Text("parameter notes", (), note)
    for code, meaning in parameter.enum.items():
        yield Text("values", (*place, "enum", str(code)), meaning)
    for bits, meaning in parameter.bits.items():
        yield Text("values", (*place, "bits", bits), meaning)


def translation(text: Text, overlay: Overlay, placed: dict[Place, str]) -> str | None:
    """Return the translation of one text: the record's, the family's, that of all, or None."""
    return (
        placed.get(text.place)
        or overlay.common.get(text.english)
        or overlay.shared.get(text.english)
    )


def translations(profile: Profile, overlay: Overlay) -> dict[str, str]:
    """Map English text to its translation, for everything that is translated.

    By the English text, so that a text corrected later is shown in English rather than with the
    translation of its old version.
    """
    placed = overlay.placed()
    found: dict[str, str] = {}
    for text in texts_of(profile):
        said = translation(text, overlay, placed)
        if said is not None:
            found.setdefault(text.english, said)
    return found


def untranslated(profile: Profile, overlay: Overlay, *kinds: Kind) -> list[Text]:
    """Return the texts of these kinds (default: all) without a translation."""
    placed = overlay.placed()
    return [
        text
        for text in texts_of(profile)
        if (not kinds or text.kind in kinds) and translation(text, overlay, placed) is None
    ]


def check_overlay(profile: Profile, overlay: Overlay) -> list[Finding]:
    """Find texts of records that no longer exist, and English texts with two translations."""
    texts = list(texts_of(profile))
    placed = overlay.placed()
    places = {text.place for text in texts}
    english = {text.english for text in texts}
    findings = [
        found(".".join(place), "profile-check.translation-of-nothing")
        for place in placed
        if place not in places
    ]
    findings += [
        found(repr(text), "profile-check.common-translation-of-nothing")
        for text in overlay.common
        if text not in english
    ]
    said: dict[str, str] = {}
    for text in texts:
        now = translation(text, overlay, placed)
        if now is not None and said.setdefault(text.english, now) != now:
            findings.append(
                found(".".join(text.place), "profile-check.two-translations", english=text.english)
            )
    return findings


def overlay_coverage(profile: Profile, overlay: Overlay) -> list[str]:
    """Return a line per kind of text: how many of how many are translated."""
    every = Counter(text.kind for text in texts_of(profile))
    missing = Counter(text.kind for text in untranslated(profile, overlay))
    return [f"{kind} {count - missing[kind]} of {count}" for kind, count in every.items()]
