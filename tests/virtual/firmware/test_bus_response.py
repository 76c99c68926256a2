"""What a master on the bus sees of the mechanics, from 6071h in to 606Ch out, in closed form.

The setpoint is interpolated over the 1 ms cycle in 20 steps of 50 µs, held for a step each,
passes the first-order current loop and the chain; the speed is the difference of the sampled
angle through a first-order low pass, and the bus takes every 20th value. All of that is linear,
so the answer to a sine is the sum over the images that both samplings fold together.
"""

from __future__ import annotations

import math
import struct

import numpy as np
import pytest

from drivers.virtual.mechanics import (
    EncoderSpec,
    FrictionSpec,
    LoadSpec,
    MechanicsSpec,
    analytic_response,
)

from .servo_bench import REV, TURN, rigid

T, TS, RATIO = 1e-3, 50e-6, 20
SPEC = rigid(
    friction=FrictionSpec(viscous_nms=2e-3),
    encoder=EncoderSpec(counts_per_rev=2**26),
    load=(LoadSpec(inertia_kgm2=1e-4, stiffness_nm_per_rad=40, damping_nms_per_rad=0.01),),
)


def expected(spec: MechanicsSpec, f_hz: float) -> complex:
    """Sampled speed [rad/s] over sampled torque setpoint [Nm]."""
    total = 0j
    for m in range(-RATIO // 2, RATIO // 2):
        omega = TURN * (f_hz + m / T)
        z = np.exp(1j * omega * TS)
        upsampled = ((1 - z**-RATIO) / (1 - 1 / z)) ** 2 / RATIO / RATIO
        images = omega + TURN * np.arange(-100, 101) / TS
        hold = (1 - np.exp(-1j * images * TS)) / (1j * images * TS)
        current = 1 / (1 + 1j * images / (TURN * 1000))
        angle = hold * current * analytic_response(spec, images / TURN) / (1j * images)
        a = math.exp(-TURN * 1000 * TS)
        speed = (1 - 1 / z) / TS * (1 - a) / (1 - a / z)
        total += complex(upsampled * angle.sum() * speed)
    return total


@pytest.mark.parametrize("f_hz", [10.0, 50.0, 125.0, 250.0, 400.0])
def test_torque_to_speed_over_process_data(bench, f_hz: float) -> None:
    b = bench(SPEC)
    b.enable(10)
    rx = b.servo.map_process_data([0x60400010, 0x60710010], "rx")
    tx = b.servo.map_process_data([0x606C0020], "tx")
    cycles = 1000
    # A whole number of periods; the transient has died away after the first second.
    for cycle in range(cycles):
        torque = round(300 * math.sin(TURN * f_hz * cycle * T))
        rx.unpack(struct.pack("<Hh", 15, torque))
        b.run(T)
    set_points, speeds = np.zeros(cycles), np.zeros(cycles)
    for cycle in range(cycles):
        speeds[cycle] = struct.unpack("<i", tx.pack())[0] / REV * TURN
        torque = round(300 * math.sin(TURN * f_hz * (cycle + cycles) * T))
        set_points[cycle] = torque * 1.27e-3
        rx.unpack(struct.pack("<Hh", 15, torque))
        b.run(T)
    carrier = np.exp(-1j * TURN * f_hz * T * np.arange(cycles))
    found = (speeds @ carrier) / (set_points @ carrier)
    ratio = found / expected(SPEC, f_hz)
    assert abs(20 * math.log10(abs(ratio))) < 0.05
    assert abs(math.degrees(np.angle(ratio))) < 0.5
