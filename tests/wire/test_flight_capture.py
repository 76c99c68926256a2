"""The frames of an interface as the recorder of a segment gets them, on a virtual cable."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import pytest

from drivers.virtual.wires.netns import Namespace, unavailable

#: What every script has: a capture on ec0m, ``play(interface, frames)`` and ``held()``.
_BEGIN = """
import json, socket, sys, time
from drivers.computer.network.sockets import interface_flags, set_interface_flags
from drivers.computer.network.packet_ring import CLOSED_S, PacketRing
from drivers.flight.capture import frames_of_block

def frame(kind, number, size=60):
    head = bytes.fromhex("ffffffffffff020000000001") + kind.to_bytes(2, "big")
    return head + number.to_bytes(4, "big") + bytes(size - 18)

def play(interface, frames):
    for data in frames:
        wires[interface].send(data)

def held():
    time.sleep(3 * CLOSED_S)
    return [frame for _, _, block in capture.take() for frame in frames_of_block(block)]

wires = {}
for interface in ("ec0m", "ec0s"):
    wires[interface] = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, 0)
    wires[interface].bind((interface, 0))
capture = PacketRing("ec0m")
"""
_BOTH_WAYS = """
began = time.time_ns()
for number in range(100):
    play("ec0m", [frame(0x88A4, 2 * number)])
    play("ec0s", [frame(0x88A4, 2 * number + 1), frame(0x0800, 7)])
ended = time.time_ns()
found = held()
print(json.dumps({
    "numbers": [int.from_bytes(f.data[14:18], "big") for f in found],
    "sent": [f.sent for f in found],
    "whole": all(f.data == frame(0x88A4, n) for n, f in enumerate(found)),
    "times": [f.time_ns for f in found],
    "between": [began, ended],
    "lost": capture.lost(),
}))
"""
_TOO_LATE = """
sent = 7000
play("ec0m", [frame(0x88A4, number, 1514) for number in range(sent)])
first = held()
lost = capture.lost()
play("ec0m", [frame(0x88A4, sent)])
then = held()
print(json.dumps({
    "sent": sent, "first": len(first), "lost": lost, "then": len(then), "again": capture.lost(),
}))
"""
_DOWN = """
play("ec0m", [frame(0x88A4, number) for number in range(5)])
set_interface_flags("ec0m", interface_flags("ec0m") & ~1)
found = held()
try:
    capture.lost()
    error = None
except OSError as raised:
    error = raised.errno
print(json.dumps({"found": len(found), "error": error}))
capture.close()
"""


@pytest.fixture
def namespace() -> Iterator[Namespace]:
    why = unavailable()
    if why is not None:
        pytest.skip(why)
    with Namespace.create() as made:
        yield made


def inside(namespace: Namespace, script: str) -> Any:
    """What the script prints, in the namespace."""
    argv = [sys.executable, "-c", _BEGIN + script]
    with namespace.popen(argv, stdout=subprocess.PIPE) as process:
        printed, _ = process.communicate(timeout=60)
    assert process.returncode == 0
    return json.loads(printed)


def test_frames_of_both_directions_in_their_order(namespace: Namespace) -> None:
    found = inside(namespace, _BOTH_WAYS)
    assert found["numbers"] == list(range(200)), "EtherCAT alone, each once"
    assert found["sent"] == [True, False] * 100
    assert found["whole"]
    began, ended = found["between"]
    assert [began, *found["times"], ended] == sorted([began, *found["times"], ended])
    assert found["lost"] == 0


def test_what_finds_no_room_is_counted(namespace: Namespace) -> None:
    found = inside(namespace, _TOO_LATE)
    assert 0 < found["lost"] < found["sent"]
    assert found["first"] + found["lost"] == found["sent"]
    assert (found["then"], found["again"]) == (1, 0)


def test_the_last_frames_before_the_interface_went_down(namespace: Namespace) -> None:
    found = inside(namespace, _DOWN)
    assert found["found"] == 5
    assert found["error"] == 100, "ENETDOWN"
