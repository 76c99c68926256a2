"""The interface description holds every message of the live connection, for clients of others."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from backend.api.app import make_app
from backend.api.live import messages, people_messages
from backend.api.messages.models import Message
from backend.station.bench import Bench


@pytest.fixture(scope="module")
def schemas(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    folder: Path = tmp_path_factory.mktemp("state")
    described: dict[str, Any] = make_app(Bench(folder), hosts=frozenset()).openapi()
    return dict(described["components"]["schemas"])


def types_of(schema: dict[str, Any]) -> set[str]:
    return set(schema["discriminator"]["mapping"])


@pytest.mark.long
def test_both_directions_are_described(schemas: dict[str, Any]) -> None:
    assert {"jog_start", "stop", "chat"} <= types_of(schemas["FromPage"])
    assert {"hello", "stop_result", "chat_said"} <= types_of(schemas["ToPage"])
    assert types_of(schemas["FromPage"]).isdisjoint(types_of(schemas["ToPage"]))


@pytest.mark.parametrize("module", [messages, people_messages], ids=lambda one: one.__name__)
def test_no_message_is_left_out(module: ModuleType, schemas: dict[str, Any]) -> None:
    known = types_of(schemas["FromPage"]) | types_of(schemas["ToPage"])
    made = [
        one.model_fields["type"].default
        for one in vars(module).values()
        if isinstance(one, type) and issubclass(one, Message) and "type" in one.model_fields
    ]
    assert made
    assert [each for each in made if each not in known] == []


@pytest.mark.parametrize("press", [None, 7, "7", -1, 1.5, True, [], {"a": 1}, 2**70, "x" * 1000])
def test_no_number_of_a_press_makes_a_stop_invalid(press: object) -> None:
    request = messages.from_page.validate_python({"type": "stop", "press": press})
    assert isinstance(request, messages.StopAll)
    assert request.press == (7 if press == 7 else None)
