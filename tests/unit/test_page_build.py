"""The build hook's choice of Node. Vite 8 asks for ^20.19.0 or >=22.12.0."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

HOOK = Path(__file__).resolve().parents[2] / "hatch_build.py"


@pytest.fixture(scope="module")
def hook() -> ModuleType:
    spec = importlib.util.spec_from_file_location("hatch_build", HOOK)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["hatch_build"] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("version", ["v20.19.0", "v20.20.2", "v22.12.0", "v22.13.1", "v24.0.0"])
def test_new_enough(hook: ModuleType, version: str) -> None:
    assert hook.node_is_suitable(version)


@pytest.mark.parametrize(
    "version", ["v18.20.0", "v20.18.9", "v21.7.0", "v22.11.0", "v22.2.0", "", "nonsense"]
)
def test_too_old_or_no_version(hook: ModuleType, version: str) -> None:
    assert not hook.node_is_suitable(version)


def test_no_node_in_the_path(
    hook: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    assert hook.system_node() is None


def test_a_node_that_is_too_old(
    hook: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for name in ("node", "npm"):
        program = tmp_path / name
        program.write_text("#!/bin/sh\necho v18.0.0\n")
        program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert hook.system_node() is None
