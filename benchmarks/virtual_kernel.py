"""How many virtual drives run in real time on one core.

    python benchmarks/virtual_kernel.py [seconds]

Prints µs per 50 µs step (aim: at most 2.5, which is 20 drives) for chains of 0 to 3 loads, and
µs per 1 ms cycle of process data in and out (aim: at most 150).
"""

from __future__ import annotations

import struct
import sys
import time

from drivers.virtual.firmware import VirtualServo, make_device
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.mechanics import EncoderSpec, FrictionSpec, LoadSpec, MechanicsSpec, MotorSpec
from profiles.loader import load_profile


def mechanics(loads: int, backlash_rad: float = 0.0) -> MechanicsSpec:
    return MechanicsSpec(
        motor=MotorSpec(inertia_kgm2=5e-5, rated_torque_nm=1.27, rated_speed_rpm=3000),
        friction=FrictionSpec(viscous_nms=2e-4, coulomb_nm=0.03),
        encoder=EncoderSpec(noise_counts=2.0),
        load=tuple(
            LoadSpec(
                inertia_kgm2=2e-5,
                stiffness_nm_per_rad=200.0 * (i + 1),
                damping_nms_per_rad=0.005,
                backlash_rad=backlash_rad,
            )
            for i in range(loads)
        ),
    )


def running(spec: MechanicsSpec) -> VirtualServo:
    """An MMS7 in CSP with four notches."""
    servo = make_device(load_profile("mms7"), spec)
    assert isinstance(servo, VirtualServo)
    servo.advance(0)
    # Notches that pass everything (a = b), so that the loop stays stable on any chain.
    for sub in range(2, 18, 4):
        for offset, raw in enumerate((13000, 42600, 13000, 42600)):
            servo.write(0x2008, sub + offset, struct.pack("<H", raw))
    servo.write(0x2008, 1, b"\x0f")
    servo.write(0x200D, 0, struct.pack("<I", 0xAAB555AA))
    servo.write(0x6060, 0, struct.pack("<b", 8))
    for word in (6, 15):
        servo.write(0x6040, 0, struct.pack("<H", word))
    return servo


def main() -> None:
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 5.0
    for loads, backlash in ((0, 0.0), (1, 0.0), (2, 0.0), (3, 0.0), (3, 0.01)):
        servo = running(mechanics(loads, backlash))
        servo.advance(10_000_000)
        start = time.perf_counter()
        servo.advance(round(seconds * 1e9) + 10_000_000)
        per_step = (time.perf_counter() - start) / (seconds / k.STEP_S) * 1e6
        gaps = " with backlash" if backlash else ""
        print(
            f"{loads} loads{gaps}: {per_step:.2f} µs per step, "
            f"{k.STEP_S * 1e6 / per_step:.0f} drives per core"
        )
    servo = running(mechanics(1))
    rx = servo.map_process_data([0x60400010, 0x60600008, 0x607A0020, 0x60B20010], "rx")
    tx = servo.map_process_data(
        [0x603F0010, 0x60410010, 0x60610008, 0x60640020, 0x606C0020, 0x60770010, 0x60FD0020], "tx"
    )
    cycles = 3000
    start = time.perf_counter()
    for cycle in range(cycles):
        rx.unpack(struct.pack("<Hbih", 15, 8, cycle * 20, 0))
        servo.advance((cycle + 1) * 1_000_000)
        tx.pack()
    per_cycle = (time.perf_counter() - start) / cycles * 1e6
    print(f"1 ms cycle with process data: {per_cycle:.0f} µs")


if __name__ == "__main__":
    main()
