"""No axis moves by setpoints while the process data cannot be trusted."""

from __future__ import annotations

import array
import struct
from types import SimpleNamespace
from typing import Any

from drivers.cia402 import Mode, State
from drivers.ethercat.exchange.cyclic import DISTRUST_S, CyclicLoop, Image
from drivers.halt import HaltCause
from drivers.motion.playback import AxisLoop
from drivers.motion.setpoint_plan import (
    ACTUAL_POSITION,
    CONTROL,
    MODE_SHOWN,
    POSITION,
    STATUS,
    Limits,
    Motion,
    Phase,
)

CYCLE_NS = 1_000_000
INPUTS, OUTPUTS = struct.Struct("<Hib"), struct.Struct("<Hi")


class Master:
    """A master whose frames come back with this working counter."""

    def __init__(self) -> None:
        self.wkc = 3

    def send_processdata(self) -> None: ...

    def receive_processdata(self, _wait_us: int, **_how: bool) -> int:
        return self.wkc


def loop_of(master: Master, axis: AxisLoop) -> CyclicLoop:
    slave = SimpleNamespace(input=INPUTS.pack(0x0237, 0, int(Mode.CSP)), output=b"")
    segment: Any = SimpleNamespace(
        master=master,
        slaves=[slave],
        socket_fd=None,
        in_step=lambda: True,
        note_process_data=lambda **_how: None,
        wait_for_frames=lambda _waits: None,
        set_output=lambda _station, _data: None,
    )
    ring: Any = SimpleNamespace(put=lambda _header, _payload: None)
    image = Image(1, axis, INPUTS.unpack, OUTPUTS.pack, OUTPUTS.size, INPUTS.size, 3)
    return CyclicLoop(segment, ring, [image], CYCLE_NS, dc=False)


def test_a_motion_that_begins_without_valid_process_data_is_braked() -> None:
    axis = AxisLoop(
        1,
        inputs={STATUS: 0, ACTUAL_POSITION: 1, MODE_SHOWN: 2},
        outputs={CONTROL: 0, POSITION: 1},
        output_count=2,
        cycle_s=CYCLE_NS / 1e9,
        report=lambda _station, _why: None,
    )
    master = Master()
    loop = loop_of(master, axis)
    loop.start()
    axis.drive_to(State.OPERATION_ENABLED, None)
    for _ in range(5):
        loop.cycle()
    master.wkc = 1
    for _ in range(round(DISTRUST_S * 1e9 / CYCLE_NS) + 10):
        loop.cycle()
    axis.play(Motion(POSITION, array.array("q", range(5000)), Limits(), 10_000, 1))
    for _ in range(5):
        loop.cycle()
    assert axis.phase is Phase.BRAKING
    assert axis.halted is not None
    assert axis.halted.cause is HaltCause.LOST
