"""The reference that measures a tuned loop: as large as the axis bears in the predicted loop."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from backend.analysis.loop.loop_structure import Gains, speed_loop
from backend.tools.measuring import excite
from backend.tools.measuring.excite import Room, band_for, loop_reference
from backend.tools.measuring.waveform import grid
from backend.tools.tuning.autotune.verification.reference import larger
from backend.tools.tuning.sweep.plan import reference_speed

RATE = 1000.0
ROOM = Room(torque_nm=1.27, speed_rad_s=157.0, travel_rad=25.0)
MOTOR, LOAD = 3e-5, 3e-4
Response = npt.NDArray[np.complex128]
Lines = npt.NDArray[np.float64]


def lines() -> Lines:
    return grid("multisine", RATE, band_for(RATE, 5.0, None)).line_hz


def plant(f: Lines, load: float = LOAD) -> Response:
    """A motor that a coupling at 80 Hz decouples from its load; 0 of load: the motor alone."""
    s = 2j * np.pi * f
    alone = 1.0 / (MOTOR * s)
    if not load:
        return np.asarray(alone)
    w2 = (2 * np.pi * 80.0) ** 2 * MOTOR / (MOTOR + load)
    held = (s**2 + 0.02 * np.sqrt(w2) * s + w2) / (
        s**2 + 0.02 * np.sqrt(w2) * s + w2 * (MOTOR + load) / MOTOR
    )
    return np.asarray(alone * held)


def loop(f: Lines, response: Response, gain_nms: float) -> Response:
    late = np.exp(-2j * np.pi * f * 150e-6)
    return speed_loop(f, response, late, Gains(gain_nms, 0.5, 10.0, 1.0))


def sent(f: Lines, peak_rad_s: float, corner_hz: float | None) -> tuple[Response, Lines]:
    """Spectrum of the real reference on all bins, without its base motion, and their frequency."""
    (first, _) = loop_reference(
        RATE, band_for(RATE, 5.0, None), ROOM, 0.0, amplitude=peak_rad_s, realisations=1,
        position=False, base=False, corner_hz=corner_hz,
    )  # fmt: skip
    period = first.excitation.one_period
    spectrum = np.fft.rfft(period)
    hz = np.fft.rfftfreq(period.size, 1.0 / RATE)
    keep = (hz >= f[0] - 0.1) & (hz <= f[-1] + 0.1)
    return np.where(keep, spectrum, 0.0), hz


def test_a_slow_loop_is_measured_with_larger_lines_within_its_torque_and_speed() -> None:
    f, inertia = lines(), MOTOR + LOAD
    gain_nms = 2 * np.pi * 8.0 * inertia
    response = plant(f)
    found = larger(f, loop(f, response, gain_nms)[None], response[None], ROOM, inertia)
    assert found is not None
    before, hz = sent(f, reference_speed(ROOM, inertia), None)
    after, _ = sent(f, found.peak_rad_s, found.corner_hz)
    at = np.argmin(np.abs(hz - 80.0))
    assert abs(after[at]) > 3.0 * abs(before[at])
    inner = np.flatnonzero(np.abs(before) > 1e-6 * np.max(np.abs(before)))
    # The optimised phases leave the lines as they were asked for.
    assert np.all(np.abs(after[inner]) > 0.8 * np.abs(before[inner]))
    # Torque and speed of this reference, in the loop that was predicted.
    dense = plant(np.maximum(hz, 1.0))
    open_ = loop(np.maximum(hz, 1.0), dense, gain_nms)
    closed = open_ / (1.0 + open_)
    torque = np.fft.irfft(after * closed / dense)
    speed = np.fft.irfft(after * closed)
    assert np.max(np.abs(torque)) < 0.4 * ROOM.torque_nm
    assert np.max(np.abs(speed)) < 1.1 * 8.0
    assert found.peak_rad_s < 0.31 * ROOM.speed_rad_s


def test_the_worst_plant_limits_the_reference() -> None:
    f, inertia = lines(), MOTOR + LOAD
    gain_nms = 2 * np.pi * 8.0 * inertia
    one, other = plant(f), plant(f, 0.0)
    alone = larger(f, loop(f, one, gain_nms)[None], one[None], ROOM, inertia)
    rows = np.array([one, other])
    both = larger(f, np.array([loop(f, row, gain_nms) for row in rows]), rows, ROOM, inertia)
    assert alone is not None
    assert both is None or both.peak_rad_s < alone.peak_rad_s


@pytest.mark.parametrize("gain_hz", [80.0, 200.0])
def test_a_fast_loop_keeps_the_usual_reference(gain_hz: float) -> None:
    f = lines()
    response = plant(f, 0.0)
    loops = loop(f, response, 2 * np.pi * gain_hz * MOTOR)
    assert larger(f, loops[None], response[None], ROOM, MOTOR) is None


def test_a_loop_without_a_crossover_keeps_the_usual_reference() -> None:
    f = lines()
    response = plant(f)
    nothing = 1e-3 * loop(f, response, 2 * np.pi * MOTOR)
    assert larger(f, nothing[None], response[None], ROOM, MOTOR + LOAD) is None


def test_the_usual_size_is_that_of_the_sweep_tool() -> None:
    assert reference_speed(ROOM, 1e-6) == 8.0
    assert reference_speed(replace(ROOM, speed_rad_s=20.0), 1e-6) == pytest.approx(3.0)
    heavy = reference_speed(ROOM, 1e-3)
    assert heavy == pytest.approx(1.27 / 8 / 1e-3 / (2 * np.pi * excite.SPEED_CORNER_HZ))
