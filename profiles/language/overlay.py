"""Reads the translated texts of a drive family: ``profiles/<drive>/<language>/*.yaml``.

An overlay contains the texts of a profile in another language: by the key of their record, or under
``common`` by the English text. Texts common to several families, such as the objects of CiA 402,
are translated once in ``profiles/language/<language>/*.yaml`` and apply to every family, including
the user's own; a family's own translation takes precedence. A text without translation is left out:
a reader then sees the English text, marked as not translated.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, Literal, NamedTuple, get_args

import yaml
from pydantic import Field, ValidationError

from profiles.loader import YAML_ERRORS, ProfileError, Refused, user_folder
from profiles.record import Frozen

_PROFILES = Path(__file__).parents[1]
_SafeLoader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)

Language = Literal["zh"]
LANGUAGES: tuple[Language, ...] = get_args(Language)
#: Place of a text: ``("faults", "0x2300", "causes", "0")``.
Place = tuple[str, ...]


class ParameterWords(Frozen):
    """Translated texts of a parameter."""

    name: str = ""
    help: str = ""
    enum: dict[int, str] = Field(default_factory=dict)
    bits: dict[str, str] = Field(default_factory=dict)


class FaultWords(Frozen):
    """Translated texts of a fault; causes and remedies one by one in the profile's order."""

    name: str = ""
    causes: tuple[str, ...] = ()
    remedies: tuple[str, ...] = ()
    reset: str = ""


class ProcedureWords(Frozen):
    """Translated texts of a procedure; ``confirm`` in the order of its confirm steps."""

    title: str = ""
    help: str = ""
    warning: str = ""
    confirm: tuple[str, ...] = ()


class NamedWords(Frozen):
    """Translated name and help of a homing method."""

    name: str = ""
    help: str = ""


class FunctionWords(Frozen):
    """Translated texts of forcing, of a guide, or of the drive's own identification."""

    title: str = ""
    help: str = ""
    warning: str = ""


class Overlay(Frozen):
    """The translated texts of one family in one language."""

    common: dict[str, str] = Field(
        default_factory=dict,
        description="English text to its translation, for what several records say alike",
    )
    parameters: dict[str, ParameterWords] = Field(default_factory=dict)
    faults: dict[str, FaultWords] = Field(default_factory=dict)
    procedures: dict[str, ProcedureWords] = Field(default_factory=dict)
    homing_methods: dict[int, NamedWords] = Field(default_factory=dict)
    forcing: dict[str, FunctionWords] = Field(default_factory=dict)
    guides: dict[str, FunctionWords] = Field(default_factory=dict)
    identification: FunctionWords = FunctionWords()
    quirks: dict[str, str] = Field(default_factory=dict, description="by the quirk's kind")
    watchdogs: dict[str, str] = Field(default_factory=dict, description="by the kind of link")
    wiring: dict[str, str] = Field(default_factory=dict, description="by the kind of link")
    shared: dict[str, str] = Field(
        default_factory=dict,
        exclude=True,
        description="English text to its translation for all families; no family's file gives it",
    )

    def placed(self) -> dict[Place, str]:
        """Return every translated text that belongs to one record, by its place."""
        found = dict(_walk((), self.model_dump(exclude={"common", "shared"})))
        return {place: text for place, text in found.items() if text}


def _walk(place: Place, node: Any) -> Iterator[tuple[Place, str]]:
    if isinstance(node, str):
        yield place, node
    elif isinstance(node, dict):
        for key, value in node.items():
            yield from _walk((*place, str(key)), value)
    else:
        for number, value in enumerate(node):
            yield from _walk((*place, str(number)), value)


class _Version(NamedTuple):
    path: Path
    mtime_ns: int


def load_overlay(drive: str, language: Language) -> Overlay:
    """Load the translated texts of a family and those of all families.

    Raises:
        ProfileError: broken YAML, or an unknown key.
    """
    own = not (_PROFILES / drive / "profile.yaml").exists()
    folder = (user_folder() if own else _PROFILES) / drive / language
    overlay = _load(f"{drive}/{language}", _versions(folder))
    return overlay.model_copy(update={"shared": load_shared(language)})


def load_shared(language: Language) -> dict[str, str]:
    """Map English text to its translation, for texts common to several families.

    Raises:
        ProfileError: broken YAML, or anything but common texts.
    """
    folder = Path(__file__).parent / language
    shared = _load(f"language/{language}", _versions(folder))
    if shared.placed():
        raise ProfileError("profile.shared-record", folder=str(folder))
    return shared.common


def _versions(folder: Path) -> tuple[_Version, ...]:
    return tuple(_Version(p, p.stat().st_mtime_ns) for p in sorted(folder.glob("*.yaml")))


@cache
def _load(label: str, versions: tuple[_Version, ...]) -> Overlay:
    return parse_overlay(
        label, {version.path.name: version.path.read_text("utf-8") for version in versions}
    )


def parse_overlay(label: str, texts: dict[str, str]) -> Overlay:
    """Join YAML texts (file name to content) and check them.

    Raises:
        ProfileError: with file name for broken YAML or a duplicate text, with the place for an
            unknown key.
    """
    merged: dict[str, Any] = {}
    for name, text in texts.items():
        try:
            data = yaml.load(text, Loader=_SafeLoader)  # noqa: S506 - both loaders are safe
        except YAML_ERRORS as error:
            raise ProfileError(
                "profile.no-yaml", file=f"{label}/{name}", detail=str(error)
            ) from error
        if not isinstance(data, dict):
            raise ProfileError("profile.no-overlay-mapping", file=f"{label}/{name}")
        for field, value in data.items():
            before = merged.setdefault(field, {})
            if field == "shared":
                raise ProfileError("profile.shared-field", file=f"{label}/{name}")
            if not isinstance(value, dict) or not isinstance(before, dict):
                raise ProfileError(
                    "profile.field-no-mapping", file=f"{label}/{name}", field=str(field)
                )
            if twice := before.keys() & value.keys():
                raise ProfileError(
                    "profile.text-twice",
                    file=f"{label}/{name}",
                    field=str(field),
                    keys=", ".join(map(str, sorted(twice, key=str))),
                )
            merged[field] = before | value
    try:
        return Overlay.model_validate(merged)
    except ValidationError as error:
        found = [Refused(".".join(map(str, e["loc"])), "", e) for e in error.errors()[:20]]
        raise ProfileError("profile.overlay-refused", name=label, refused=found) from error
