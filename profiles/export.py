"""A profile in a stable form for reviewers and scripts, and the schema for editors."""

from __future__ import annotations

import json
from pathlib import Path

from profiles.schema import Fault, Parameter, Profile

SCHEMA_FILE = Path(__file__).with_name("profile.schema.json")


def show(profile: Profile) -> dict[str, object]:
    """Return the whole profile as printed by `servodeck profile show --json`."""
    return {
        "drive": profile.drive,
        "identity": profile.identity.model_dump(mode="json"),
        "parameters": [_parameter(p) for p in profile.parameters],
        "faults": [_fault(f) for f in profile.faults],
        "procedures": [p.model_dump(mode="json") for p in profile.procedures],
        "homing_methods": [m.model_dump(mode="json") for m in profile.homing_methods],
        "pdo": None if profile.pdo is None else profile.pdo.model_dump(mode="json"),
        "bring_up": None if profile.bring_up is None else profile.bring_up.model_dump(mode="json"),
        "quirks": [q.model_dump(mode="json") for q in profile.quirks],
        "notes": [note.model_dump(mode="json") for note in profile.notes],
    }


def _parameter(p: Parameter) -> dict[str, object]:
    return {
        "key": p.key,
        "index": p.index,
        "subindex": p.subindex,
        "number": p.number,
        "name": p.name,
        "group": p.group,
        "type": p.type,
        "access": p.access,
        "pdo": p.pdo,
        "unit": p.unit,
        "scale": p.scale,
        "offset": p.offset,
        "min_raw": p.min_raw,
        "max_raw": p.max_raw,
        "default_raw": p.default_raw,
        "enum": {str(code): text for code, text in p.enum.items()},
        "bits": dict(p.bits),
        "effective": p.effective,
        "settable": p.settable,
        "modbus_register": p.modbus_register,
        "motor_individual": p.motor_individual,
        "motion": p.motion,
        "source": p.source,
        "also_printed": list(p.also_printed),
        "notes": " ".join(text for text in (p.help, p.notes) if text),
    }


def _fault(f: Fault) -> dict[str, object]:
    return {
        "code": f.code,
        "name": f.name,
        "class": f.severity or f.kind,
        "causes": list(f.causes),
        "remedies": list(f.remedies),
        "reset": f.reset,
        "source": f.source,
    }


def json_schema() -> str:
    """Return the JSON Schema of a whole profile, for editors."""
    return json.dumps(Profile.model_json_schema(), indent=1, ensure_ascii=False) + "\n"
