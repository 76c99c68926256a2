"""Settings of a tool are numbers that a limit can be compared with."""

from __future__ import annotations

import types
import typing
from typing import Any

import pytest
from pydantic import ValidationError

from backend.tools.moving.step.settings import StepRequest
from backend.tools.registry import TOOLS
from backend.tools.tool import AnyTool

LIMITS = {"travel_limit": 0.1, "speed_limit": 100.0, "torque_limit": 5.0}


def _is_number(kind: Any) -> bool:
    if typing.get_origin(kind) in (typing.Union, types.UnionType):
        return any(_is_number(each) for each in typing.get_args(kind))
    return kind is float


def given(tool: AnyTool, **changed: object) -> dict[str, object]:
    known = {"partner": "b"} if tool.pair else {}
    return {**(LIMITS if tool.motion else {}), **known, **changed}


@pytest.mark.parametrize("tool", TOOLS, ids=lambda tool: tool.kind)
@pytest.mark.parametrize("number", [float("nan"), float("inf"), float("-inf")])
def test_what_is_no_number_is_refused(tool: AnyTool, number: float) -> None:
    tool.settings.model_validate(given(tool))
    names = [
        name for name, each in tool.settings.model_fields.items() if _is_number(each.annotation)
    ]
    assert names
    for name in names:
        with pytest.raises(ValidationError, match=name):
            tool.settings.model_validate(given(tool, **{name: number}))


@pytest.mark.parametrize("kind", ["speed", "move"])
def test_a_step_of_no_size_is_refused_before_anything_moves(kind: str) -> None:
    with pytest.raises(ValidationError, match="size must not be 0"):
        StepRequest.model_validate({**LIMITS, "kind": kind, "size": 0.0})
