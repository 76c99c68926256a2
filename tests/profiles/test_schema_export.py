"""The schema for editors is the schema of the code, and every profile passes its checks."""

from __future__ import annotations

import json
import re

import pytest

from drivers.texts.profile_errors import profile_error_text
from profiles import drive_names, load_profile
from profiles.check import check
from profiles.export import SCHEMA_FILE, json_schema, show
from profiles.loader import ProfileError, parse_profile

PARAMETER_FIELDS = {
    "key", "index", "subindex", "number", "name", "group", "type", "access", "pdo", "unit",
    "scale", "offset", "min_raw", "max_raw", "default_raw", "enum", "bits", "effective",
    "settable", "modbus_register", "motor_individual", "motion", "source", "also_printed", "notes",
}  # fmt: skip


def test_schema_file_is_up_to_date() -> None:
    assert SCHEMA_FILE.read_text("utf-8") == json_schema(), (
        "write it again: python -c 'from profiles.export import *; "
        "SCHEMA_FILE.write_text(json_schema())'"
    )


@pytest.mark.parametrize("drive", drive_names())
def test_no_findings(drive: str) -> None:
    assert [str(finding) for finding in check(load_profile(drive))] == []


@pytest.mark.parametrize("drive", drive_names())
def test_shown_form(drive: str) -> None:
    shown = json.loads(json.dumps(show(load_profile(drive))))
    assert set(shown) == {
        "drive", "identity", "parameters", "faults", "procedures", "homing_methods", "quirks",
        "notes", "pdo", "bring_up",
    }  # fmt: skip
    assert all(set(parameter) == PARAMETER_FIELDS for parameter in shown["parameters"])
    assert all(
        set(fault) == {"code", "name", "class", "causes", "remedies", "reset", "source"}
        for fault in shown["faults"]
    )


GOOD = """
drive: sample
title: Sample
manual: "000"
identity: {maker: A, model: B}
links: []
units: {}
supported_modes: [1]
parameters:
  - {key: "6040:00", name: Control word, group: x, type: UINT16, source: "000:1"}
"""


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("name: Control word", "nmae: Control word"), "nmae"),
        (("type: UINT16", "type: WORD"), "6040:00"),
        (("6040:00", "60400"), "60400"),
        (("parameters:", "parameters:\n  - {key: '6040:00', name: a, group: b, type: UINT8, "
          "source: '000:2'}"), "appear twice"),
        (("supported_modes", "signals: [{role: mode, key: '6060:00'}]\nsupported_modes"),
         "unknown parameters referred to: 6060:00"),
        (("drive: sample", "drive: [sample"), "p.yaml"),
    ],
)  # fmt: skip
def test_slips_are_named(change: tuple[str, str], words: str) -> None:
    with pytest.raises(ProfileError) as refused:
        parse_profile({"p.yaml": GOOD.replace(*change)})
    said = profile_error_text(refused.value)
    assert words in said.words()
    assert re.search("[\u4e00-\u9fff]", said.words("zh"))
