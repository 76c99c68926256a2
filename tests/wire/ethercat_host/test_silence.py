"""A mailbox that is dead: how much of a list is asked for before the rest is given up."""

from __future__ import annotations

from typing import Any

import pytest

from drivers.errors import LinkTimeout, NotAsked
from drivers.ethercat.link import EthercatLink
from drivers.ethercat.process.protocol import Message, error_to_wire
from drivers.link import Address


@pytest.mark.parametrize(("answering", "asked", "left_out"), [((), 2, 224), ((0,), 3, 192)])
async def test_a_dead_mailbox_is_not_asked_for_a_whole_list(
    monkeypatch: pytest.MonkeyPatch, answering: tuple[int, ...], asked: int, left_out: int
) -> None:
    """288 objects go in nine parts of 32, two of them under way."""
    link = EthercatLink("eth9")
    parts: list[int] = []

    async def call(message: Message, *_: Any, **__: Any) -> list[Any]:
        parts.append(len(message["items"]))
        if len(parts) - 1 in answering:
            return [b"\1\0"] * len(message["items"])
        return [error_to_wire(LinkTimeout("the drive did not answer in time"))] * 32

    monkeypatch.setattr(link, "_call", call)
    answers = await link.read_many(1, [Address(0x2000 + n, 0, "UINT16") for n in range(288)])
    assert parts == [32] * asked
    assert sum(isinstance(answer, NotAsked) for answer in answers) == left_out
    assert sum(answer == b"\1\0" for answer in answers) == 32 * len(answering)
