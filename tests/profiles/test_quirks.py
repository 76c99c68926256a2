"""A quirk is what code acts upon; what only informs is a note."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import get_args

from profiles.loader import drive_names, is_own, load_profile, parse_profile
from profiles.schema import Quirk

ROOT = Path(__file__).parents[2]
KINDS = set(get_args(Quirk.model_fields["kind"].annotation))


def _strings_of_readers() -> set[str]:
    """Strings in expressions that name a quirk: ``quirk("kind")``, ``quirk.kind != "kind"``."""
    found: set[str] = set()
    for folder in ("backend", "drivers"):
        for path in (ROOT / folder).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text("utf-8"))):
                if isinstance(node, ast.Call) and getattr(node.func, "attr", "") == "quirk":
                    found |= {a.value for a in node.args if isinstance(a, ast.Constant)}
                elif isinstance(node, ast.Compare) and getattr(node.left, "attr", "") == "kind":
                    found |= {a.value for a in node.comparators if isinstance(a, ast.Constant)}
    return found


def test_every_kind_of_quirk_has_a_reader() -> None:
    assert KINDS - _strings_of_readers() == set()


def test_every_kind_of_quirk_has_a_drive() -> None:
    profiles = [load_profile(name) for name in drive_names() if not is_own(name)]
    assert {quirk.kind for profile in profiles for quirk in profile.quirks} == KINDS


def test_an_own_profile_of_version_0_2_0_is_still_read() -> None:
    profile = parse_profile(
        {
            "profile.yaml": """
drive: mine
title: Mine
manual: "000"
identity: {maker: A, model: B}
links: []
units: {}
supported_modes: [1]
parameters:
  - {key: "6040:00", name: Control word, group: x, type: UINT16, source: "000:1"}
quirks:
  - {kind: gear_on_init, key: "6040:00", help: Acts at start., source: "000:2"}
  - {kind: warning_bit_7, key: "6040:00", help: Bit 7., source: "000:3"}
"""
        }
    )
    assert [quirk.kind for quirk in profile.quirks] == ["warning_bit_7"]
    assert [(note.key, note.help) for note in profile.notes] == [("6040:00", "Acts at start.")]
