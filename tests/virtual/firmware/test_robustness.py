"""Whatever a master writes and whatever trouble comes, the drive answers and stays finite."""

from __future__ import annotations

import random
import struct

import numpy as np
import pytest

from drivers.virtual.device import SdoAbort
from drivers.virtual.firmware.servo import VirtualServo
from drivers.virtual.mechanics import FrictionSpec, LoadSpec, TravelSpec

from .servo_bench import Bench, rigid

SPEC = rigid(
    friction=FrictionSpec(coulomb_nm=0.02, viscous_nms=1e-4),
    travel=TravelSpec(min_rev=-5, max_rev=5),
    load=(
        LoadSpec(
            inertia_kgm2=1e-4,
            stiffness_nm_per_rad=40,
            damping_nms_per_rad=0.01,
            backlash_rad=0.01,
        ),
    ),
)
WORDS = ((0, 6, 15), (15, 31), (0x10F,), (2,), (0, 0x80), (7,), (0x80F,), (0x4F, 0x5F))
TROUBLE = ("overload", "watchdog", "sensor", "encoder_loss", "power_off")


def act(servo: VirtualServo, chance: random.Random) -> None:
    """One random access. Only SdoAbort may come back."""
    codes = list(servo.od.entries)
    index, subindex = divmod(chance.choice(codes), 256)
    entry = servo.od.find(index, subindex)
    kind = chance.random()
    if kind < 0.5 and entry.storage is not None and entry.parameter.type != "REAL32":
        low, high = (int(limit or 0) for limit in entry.parameter.raw_limits)
        value = chance.choice((low, high, chance.randint(low, high), max(low, min(high, 1))))
        servo.write(index, subindex, entry.storage.pack(value))
    elif kind < 0.8:
        for word in chance.choice(WORDS):
            servo.write(0x6040, 0, struct.pack("<H", word))
    elif kind < 0.9:
        servo.write(0x6060, 0, struct.pack("<b", chance.choice((1, 3, 4, 6, 8, 9, 10, -4))))
    elif kind < 0.93:
        servo.inject(chance.choice(TROUBLE), chance.choice((0.0, 0.05)))
    else:
        servo.read(index, subindex)


@pytest.mark.parametrize("seed", range(6))
def test_random_accesses(bench, seed: int) -> None:
    chance = random.Random(seed)
    b: Bench = bench(SPEC)
    for _ in range(400):
        try:
            act(b.servo, chance)
        except SdoAbort:
            continue
        if chance.random() < 0.2:
            b.run(chance.randint(1, 100) * 1e-3)
    assert np.isfinite(b.servo.axis.s).all()
    assert np.isfinite(b.servo.axis._x).all()
    assert abs(b.servo.axis._x[0]) < 40  # the end stops hold
    for code in b.servo.od.entries:
        b.servo.read(*divmod(code, 256))
