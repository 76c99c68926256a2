"""How large a speed loop's reference becomes, and which lines further realisations favour."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from backend.axes.axis.axis import Envelope
from backend.tools.measuring import excite
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.measuring.recording import Recording
from backend.tools.measuring.waveform import Band
from backend.tools.tuning.sweep import speed_injection
from backend.tools.tuning.sweep.adaptive import _more_informative
from backend.tools.tuning.sweep.evaluation import SweepSettings
from backend.tools.tuning.sweep.plan import Setup

RATE, BAND = 1000.0, Band(5.0, 400.0)
#: 1.27 Nm and 1500 rpm, of which 35 % of the torque are wanted for the excitation.
ROOM, WANTED_NM = excite.Room(1.27, 157.0, 25.0), 0.4445
#: Encoder with 10000 steps to the revolution.
STEP_RAD = 2 * np.pi / 10000
GAIN = 0.0127


def sequences(peak: float, realisations: int = 1) -> tuple[excite.Sequence, ...]:
    """As they are sent: the base motion is part of them."""
    made = speed_injection.sequences(RATE, BAND, ROOM, peak, realisations, "multisine", base=True)
    return tuple(
        replace(s, excitation=replace(s.excitation, samples=s.excitation.samples + s.base))
        for s in made
        if s.base is not None
    )


def played(
    sequence: excite.Sequence,
    inertia: float,
    gain: float = GAIN,
    corner_hz: float = 0.0,
    noise_rad_s: float = 0.0,
) -> Recording:
    """A rigid axis under a PI speed loop, its speed taken from the steps of the encoder."""
    reference = sequence.excitation.samples
    n = reference.size
    position, speed, total = 0.0, 0.0, 0.0
    rows = np.zeros((n, 3))
    # Between two cycles the drive sees single steps of the encoder come.
    noise = np.random.default_rng(1).normal(0.0, noise_rad_s, n)
    for k in range(n):
        place = np.floor(position / STEP_RAD) * STEP_RAD
        seen = (place - rows[k - 1, 0]) * RATE + noise[k] if k else 0.0
        error = reference[k - 1] - seen if k else 0.0
        total += error / RATE * 2 * np.pi * corner_hz
        torque = gain * (error + total)
        rows[k] = place, seen, torque
        speed += (torque - 2e-3 * speed) / inertia / RATE
        position += speed / RATE
    return Recording(
        RATE, rows[:, 0], rows[:, 1], rows[:, 2], reference, np.zeros(n), np.ones(n, np.bool_)
    )


def sized(
    inertia: float,
    gain: float = GAIN,
    corner_hz: float = 0.0,
    noise_rad_s: float = 0.0,
    *,
    watched: bool = False,
) -> speed_injection.Size:
    trial = sequences(speed_injection.FIRST_RAD_S)[0]
    recording = played(trial, inertia, gain, corner_hz, noise_rad_s)
    return speed_injection.fitting_size(trial, recording, ROOM, WANTED_NM, watched=watched)


def test_steps_of_the_encoder_are_not_taken_for_torque_of_the_reference() -> None:
    assert sized(1.5e-3).peak_rad_s == pytest.approx(WANTED_NM / GAIN, rel=0.25)
    # A trial with too much noise leads to less, never to much more.
    noisy = sized(1.5e-3, noise_rad_s=0.5).peak_rad_s
    assert 0.6 < noisy * GAIN / WANTED_NM < 1.1


def test_a_soft_loop_gets_more_reference_than_the_axis_may_turn() -> None:
    """A heavy axis hardly follows; its setpoints stay below half of the permitted speed."""
    soft = sized(1.5e-3, 0.5 * GAIN)
    assert soft.peak_rad_s > 2 * 0.15 * ROOM.speed_rad_s
    assert soft.peak_rad_s + soft.base_rad_s <= 0.5 * ROOM.speed_rad_s + 1e-9


def test_a_drive_that_ends_a_motion_without_computer_gets_more() -> None:
    soft = sized(1.5e-3, 0.2 * GAIN, watched=True)
    assert soft.peak_rad_s + soft.base_rad_s == pytest.approx(0.9 * ROOM.speed_rad_s)
    follows = sized(2e-5, watched=True).peak_rad_s
    assert 0.15 * ROOM.speed_rad_s < follows <= 0.3 * ROOM.speed_rad_s


def test_an_axis_that_follows_gets_its_share_of_the_speed() -> None:
    assert sized(2e-5).peak_rad_s == pytest.approx(0.15 * ROOM.speed_rad_s)


def test_a_base_motion_that_takes_most_of_the_torque_becomes_slower() -> None:
    """Its turn per period lies near the resonance of a soft loop with an integral."""
    assert sized(1.5e-3).base_rad_s == pytest.approx(20.0, rel=0.01)
    swinging = sized(3e-3, corner_hz=8.0)
    assert 0.39 * 20.0 < swinging.base_rad_s < 16.0


def test_lines_that_a_first_pair_tells_less_get_more() -> None:
    records = tuple((s, played(s, 1.5e-3)) for s in sequences(30.0))
    weight = speed_injection.informative_weight(records, RATE)
    f = records[0][0].excitation.line_hz
    assert weight.shape == f.shape
    assert float(np.median(weight[f > 200])) > 1.5 * float(np.median(weight[f < 40]))
    shaped = speed_injection.sequences(
        RATE, BAND, ROOM, 30.0, 2, "multisine", base=True, weight=weight
    )[2]
    e = shaped.excitation
    lines = np.abs(np.fft.rfft(e.one_period)[e.lines])
    assert lines / lines[0] == pytest.approx(weight / weight[0])
    assert e.realisation == 1


def test_the_second_pair_is_as_large_as_the_first_became_and_has_other_lines() -> None:
    facts = AxisFacts(1.27, True, 3000.0, None, None, None, None, False)
    setup = Setup(RATE, facts, "speed", ROOM, excite.Rigid(1.5e-3), 1e-3, by_speed=True)
    settings = SweepSettings(Envelope(4.0, 1500.0, 100.0, 60.0))
    first = tuple((s, played(s, 1.5e-3)) for s in sequences(30.0))
    further = _more_informative(first, (), settings, setup)
    assert [s.excitation.realisation for s in further] == [1, 1]
    for s in further:
        assert np.max(np.abs(s.excitation.samples)) == pytest.approx(30.0, rel=0.1)
        assert s.base is not None
        assert np.max(np.abs(s.base)) == pytest.approx(20.0, rel=0.01)
    e = further[0].excitation
    lines = np.abs(np.fft.rfft(e.one_period)[e.lines])
    assert float(np.max(lines) / np.min(lines)) > 2.0
