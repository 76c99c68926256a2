"""Stored measurements of an axis whose answer is known: a first-order loop, and a rigid load."""

from __future__ import annotations

import math
from dataclasses import asdict
from datetime import datetime
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.signal import lfilter

from backend.axes.axis.axis import Envelope
from backend.axes.drive.drive import Drive
from backend.records.library.measurements import pack
from backend.tools.measuring import excite
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.mechanics.inertia.evaluation import InertiaSettings
from backend.tools.moving.step.evaluate import StepSettings
from backend.tools.moving.step.run import _demand
from backend.tools.tuning.sweep.evaluation import SweepSettings

RATE_HZ = 1000.0
#: Corner of the loop: its −3 dB bandwidth, and a rise time of ln 9 / (2π · 60 Hz).
CORNER_HZ = 60.0
RISE_S = math.log(9.0) / (2 * math.pi * CORNER_HZ)


def bandwidth_hz() -> float:
    """Where the *sampled* lag, with its hold divided out, has fallen by 3 dB.

    Folding lets a first-order loop look two per cent faster than it is: |(1−a)/(z−a)| / sinc.
    """
    a = math.exp(-2 * math.pi * CORNER_HZ / RATE_HZ)
    f = np.linspace(0.5 * CORNER_HZ, 2 * CORNER_HZ, 20_001)
    z = np.exp(2j * math.pi * f / RATE_HZ)
    size = np.abs((1 - a) / (z - a)) / np.sinc(f / RATE_HZ)
    return float(np.interp(-math.sqrt(0.5), -size, f))


INERTIA, VISCOUS, COULOMB = 2e-4, 3e-4, 0.05

FACTS = AxisFacts(1.27, True, 3000.0, None, None, 5e-5, 5e-5, False)
ENVELOPE = Envelope(3.0, 1200.0, 80.0, 60.0)
Arrays = dict[str, npt.NDArray[np.generic]]


def _first_order(values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """A held sequence behind a first-order lag, sampled: exact for a zero-order hold."""
    a = math.exp(-2 * math.pi * CORNER_HZ / RATE_HZ)
    return np.asarray(lfilter([0.0, 1.0 - a], [1.0, -a], values))


def _columns(velocity: npt.NDArray[np.float64], **more: Any) -> Arrays:
    n = velocity.size
    return {
        "position_rad": np.cumsum(velocity) / RATE_HZ,
        "velocity_rad_s": velocity,
        "torque_nm": np.zeros(n),
        "sent": np.zeros(n),
        "offset": np.zeros(n),
        "valid": np.ones(n, dtype=np.bool_),
    } | more


def step(size_rpm: float = 100.0) -> tuple[str, Arrays, dict[str, object]]:
    """Kind, arrays and head of a step of speed."""
    settings = StepSettings(ENVELOPE, size=size_rpm)
    demand = _demand(settings, RATE_HZ)
    velocity = _first_order(demand) * 2 * math.pi / 60.0
    return "step", _columns(velocity) | {"demand": demand}, {
        "tool": "step", "sample_rate_hz": RATE_HZ, "facts": asdict(FACTS),
        "settings": asdict(settings),
    }  # fmt: skip


def speed_loop() -> tuple[str, Arrays, dict[str, object]]:
    """The response of the closed speed loop."""
    settings = SweepSettings(ENVELOPE, kind="speed_loop", realisations=1)
    room = excite.Room(1.0, 125.0, 19.0)
    sequences = excite.loop_reference(
        RATE_HZ,
        excite.band_for(RATE_HZ, 5.0, None),
        room,
        0.0,
        amplitude=4.0,
        realisations=1,
        position=False,
    )
    arrays: Arrays = {}
    structure = []
    for number, sequence in enumerate(sequences):
        e = sequence.excitation
        assert sequence.base is not None
        found = _columns(_first_order(e.samples + sequence.base))
        arrays |= {f"{number}/{name}": values for name, values in found.items()}
        arrays |= {f"{number}/excitation": e.samples, f"{number}/lines": e.lines}
        structure.append(
            {name: getattr(e, name) for name in (
                "kind", "first_sample", "period_samples", "periods", "transient_periods",
                "base_line", "realisation",
            )}
        )  # fmt: skip
    return "sweep-speed_loop", arrays, {
        "tool": "sweep", "sample_rate_hz": RATE_HZ, "loop": "speed", "dc": False,
        "facts": asdict(FACTS), "settings": asdict(settings), "excitation": structure,
    }  # fmt: skip


def inertia() -> tuple[str, Arrays, dict[str, object]]:
    """Moves forth and back of a rigid load with friction."""
    t = np.arange(4000) / RATE_HZ
    # Half a second of constant acceleration each way, four times.
    acceleration = 200.0 * np.sign(np.sin(2 * math.pi * t / 1.0 + 1e-9))
    velocity = np.cumsum(acceleration) / RATE_HZ - 50.0
    rng = np.random.default_rng(6)
    torque = INERTIA * acceleration + VISCOUS * velocity + COULOMB * np.sign(velocity)
    torque = torque + rng.normal(0.0, 1e-3, t.size)
    settings = InertiaSettings(ENVELOPE)
    return "inertia", _columns(velocity, torque_nm=torque), {
        "tool": "inertia", "sample_rate_hz": RATE_HZ, "facts": asdict(FACTS),
        "settings": asdict(settings),
    }  # fmt: skip


def file_of(
    drive: Drive,
    made: tuple[str, Arrays, dict[str, object]],
    saved: datetime,
    result: dict[str, object] | None = None,
) -> bytes:
    """The contents of a ``.sdmeas`` file."""
    kind, arrays, meta = made
    return pack(kind, drive, arrays, meta, saved, result)
