"""Conformance of a node over a CAN bus, by the command that the user runs."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from backend import cli
from backend.commands.buses.conformance import checked
from drivers.canopen.link import CanopenLink
from drivers.texts.message import speaking
from tests.wire.canopen.conftest import Bench


async def failed(link: CanopenLink, url: str) -> dict[str, list[dict[str, object]]]:
    (result,) = await checked(link, url, 5)
    assert result["station"] == 5
    return {r["code"]: r["facts"] for r in result["rules"] if r["verdict"] == "failed"}


async def test_a_node_and_a_broken_one(bench: Bench, link: CanopenLink) -> None:
    before = dict(bench.device._values)
    assert await failed(link, bench.url) == {}
    assert bench.device._values == before
    assert bench.device.value(0x6040) == 0
    read = bench.device.read

    def careless(index: int, subindex: int) -> bytes:
        return b"\0" if index == 0x0FFF else read(index, subindex)

    bench.device.read = careless  # type: ignore[method-assign]
    found = await failed(link, bench.url)
    assert set(found) == {"sdo-no-object"}
    assert found["sdo-no-object"][0]["expected"] == "06020000h"


@pytest.mark.long
def test_the_command_line_shows_verdicts_in_both_languages(bench: Bench) -> None:
    run = CliRunner().invoke
    good = run(cli.app, ["conformance", bench.url, "--station", "5"])
    assert good.exit_code == 0, good.output
    assert "passed: writing a read-only object is aborted with 06010002h" in good.output
    assert "station 5:" in good.output
    assert " 0 failed" in good.output
    bench.node.device.read = lambda index, subindex: b"\0"  # type: ignore[method-assign]
    wrong = run(cli.app, ["conformance", bench.url, "--json"])
    assert wrong.exit_code == 1, wrong.output
    (result,) = json.loads(wrong.output)
    rules = {rule["code"]: rule for rule in result["rules"]}
    assert rules["sdo-no-object"]["verdict"] == "failed"
    assert rules["sdo-no-object"]["facts"][0]["expected"] == "06020000h"
    with speaking("en"):  # A command leaves its language behind in this process.
        chinese = run(cli.app, ["--language", "zh", "conformance", bench.url, "--station", "5"])
    assert "未通过: 读取不存在的对象时以 06020000h 中止" in chinese.output, chinese.output


def test_another_bus_is_refused_in_words() -> None:
    refused = CliRunner().invoke(cli.app, ["conformance", "modbus:///dev/ttyUSB9"])
    assert refused.exit_code == 1
    assert "EtherCAT and CANopen only" in refused.output
