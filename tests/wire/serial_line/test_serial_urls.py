"""Bus URLs; the examples are those of design/architecture.md."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.bus import BusUrl
from drivers.errors import NotAllowed, OutOfRange
from drivers.modbus.line_url import line_settings
from drivers.urls import link_for, parse_url


def test_examples() -> None:
    assert parse_url("ethercat://eth0") == BusUrl("ethercat", "eth0")
    assert parse_url("canopen://slcan//dev/ttyACM0?bitrate=500000") == BusUrl(
        "canopen", "slcan//dev/ttyACM0", (("bitrate", "500000"),)
    )
    modbus = parse_url("modbus:///dev/ttyUSB0?baudrate=115200&parity=N")
    assert (modbus.scheme, modbus.place) == ("modbus", "/dev/ttyUSB0")
    assert parse_url("mlink://COM3").place == "COM3"
    assert parse_url("mlink://virtual0").is_virtual
    assert not parse_url("mlink:///tmp/virtual0").is_virtual


@pytest.mark.parametrize(
    "text",
    [
        "ethercat://eth0",
        "mlink:///dev/ttyUSB0?baudrate=9600&parity=E",
        "canopen://virtual/x",
    ],
)
def test_url_reads_back_as_written(text: str) -> None:
    assert str(parse_url(text)) == text


def test_mlink_defaults_are_the_manuals() -> None:
    # 004:1457-1464: even parity, 2.5 Mbaud. 11 bits a character.
    settings = line_settings(parse_url("mlink:///dev/ttyUSB0"))
    assert (settings.baudrate, settings.parity, settings.device) == (2_500_000, "E", "/dev/ttyUSB0")
    assert settings.char_s == pytest.approx(4.4e-6)
    assert settings.pause_s == pytest.approx(15.4e-6)


def test_modbus_keeps_the_standards_pause() -> None:
    # MODBUS over Serial Line V1.02, clause 2.5.1.1: 3.5 characters, from 19200 baud on 1.75 ms.
    assert line_settings(parse_url("modbus:///x")).pause_s == 0.00175
    slow = line_settings(parse_url("modbus:///x?baudrate=9600&parity=E"))
    assert slow.pause_s == pytest.approx(3.5 * 11 / 9600)
    assert line_settings(parse_url("modbus:///x?silence_us=100")).pause_s == pytest.approx(1e-4)


def test_options() -> None:
    settings = line_settings(
        parse_url("modbus:///x?baudrate=57600&parity=o&stopbits=2&timeout_ms=250&retries=0")
    )
    assert (settings.baudrate, settings.parity, settings.stopbits) == (57600, "O", 2)
    assert (settings.timeout_s, settings.retries) == (0.25, 0)
    assert settings.bits_per_char == 12


@pytest.mark.parametrize(("text", "complaint"), [
    ("", "not a bus URL"), ("/dev/ttyUSB0", "not a bus URL"), ("http://x", "not a bus URL"),
    ("mlink://", "names no adapter"), ("modbus:///", "names no adapter"),
    ("mlink:///x?parity=E&parity=N", "twice"), ("mlink:///x?parity=Q", "N \\(none\\)"),
    ("mlink:///x?baudrate=fast", "whole number"), ("mlink:///x?baudrate=-1", "whole number"),
    ("mlink:///x?stopbits=3", "from 1 to 2"), ("mlink:///x?speed=1", "no option 'speed'"),
])  # fmt: skip
def test_bad_urls(text: str, complaint: str) -> None:
    with pytest.raises(OutOfRange, match=complaint):
        link_for(text)


@pytest.mark.parametrize(
    ("text", "kinds"),
    [
        ("http://x", ["ethercat", "canopen", "modbus", "mlink"]),
        ("modbus:///x?speed=1", ["modbus"]),
        ("mlink:///x?stopbits=3", ["mlink"]),
        ("ethercat://", ["ethercat"]),
    ],
)
def test_the_remedy_is_an_example_of_that_bus(text: str, kinds: list[str]) -> None:
    with pytest.raises(OutOfRange) as refused:
        link_for(text)
    reported = refused.value.remedy
    assert [
        kind for kind in ("ethercat", "canopen", "modbus", "mlink") if f"{kind}:" in reported
    ] == (kinds)
    # An example that would be refused itself were no help.
    for example in reported.removeprefix("write it like ").split(", "):
        parse_url(example)


def test_virtual_wires_need_a_demo() -> None:
    with pytest.raises(NotAllowed, match="exists only while the demo runs"):
        link_for("mlink://virtual0")


@given(st.text(max_size=40))
def test_any_text_is_a_url_or_refused(text: str) -> None:
    for prefix in ("", "mlink://", "modbus:///x?"):
        try:
            link = link_for(prefix + text)
        except (OutOfRange, NotAllowed):
            continue
        assert link.kind in ("mlink", "modbus", "canopen", "ethercat")


@pytest.mark.parametrize(("url", "kind"), [("mlink:///x", "mlink"), ("modbus:///x", "modbus")])
def test_links_know_their_kind(url: str, kind: str) -> None:
    link = link_for(url)
    assert (link.kind, link.url, link.cyclic) == (kind, url, None)
