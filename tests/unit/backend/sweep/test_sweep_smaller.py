"""What is played after an axis came to its envelope: less, while it still moves."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest

from backend.axes.axis.axis import Envelope
from backend.tools.measuring import excite
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.measuring.interrupted import Interrupted
from backend.tools.tuning.sweep.evaluation import SweepSettings
from backend.tools.tuning.sweep.plan import Setup, sequences_of
from backend.tools.tuning.sweep.play import _smaller, _too_much
from drivers.errors import NotAllowed, motion_halted
from drivers.halt import HaltCause, Halted, Quantity

RATED_NM, COULOMB_NM = 1.27, 0.08
SETTINGS = SweepSettings(Envelope(4.0, 1500.0, 100.0, 60.0), realisations=1)
FREE = Setup(
    1000.0,
    AxisFacts(RATED_NM, True, 3000.0, None, None, None, None, True),
    "none",
    excite.Room(RATED_NM, 157.0, 25.0),
    excite.Rigid(3e-4, COULOMB_NM),
    1e-3 * RATED_NM,
)


def base_nm(sequence: excite.Sequence) -> float:
    """Amplitude of the base motion's torque, by its line of one period."""
    played = sequence.excitation
    period = played.samples[played.first_sample : played.first_sample + played.period_samples]
    return 2.0 * float(np.abs(np.fft.rfft(period)[played.base_line])) / played.period_samples


def test_without_a_loop_the_axis_becomes_slower_but_still_overcomes_friction() -> None:
    before = sequences_of(FREE, SETTINGS)
    for attempt in (1, 2, 3):
        after = _smaller(before, FREE, SETTINGS, attempt)
        peaks = [float(np.max(np.abs(s[0].excitation.samples))) for s in (before, after)]
        assert peaks[1] < peaks[0]
        # A sinusoid of 4/π·Tc is what friction takes of a motion to and fro.
        assert 4 / np.pi * COULOMB_NM < base_nm(after[0]) < base_nm(before[0])
        before = after


def test_where_no_speed_is_left_for_a_base_motion_nothing_is_played() -> None:
    narrow = replace(FREE, room=replace(FREE.room, speed_rad_s=3.0))
    assert _smaller((), narrow, SETTINGS, 3) == ()


@pytest.mark.parametrize(
    ("loop", "quantity", "again"),
    [
        ("none", "speed", True),
        ("none", "torque", False),
        ("none", "position", False),
        ("speed", "torque", True),
        ("speed", "speed", False),
        ("speed", "position", False),
        ("position", "torque", True),
    ],
)
def test_what_less_excitation_may_mend(
    loop: Literal["none", "speed", "position"], quantity: Quantity, again: bool
) -> None:
    error = motion_halted("station 1", Halted.beyond(quantity, 1600, 1500))
    assert _too_much(error, replace(FREE, loop=loop)) is again


def test_nothing_is_played_again_for_the_words_of_an_error() -> None:
    """Only what the loop ended is: not what another error happens to be worded like."""
    words = "station 1: torque and speed 1600 is beyond the limit of 1500"
    fault = motion_halted("station 1", Halted(HaltCause.LEFT_ENABLED, note=words))
    for error in (NotAllowed(words), Interrupted(words), fault):
        for loop in ("none", "speed"):
            assert not _too_much(error, replace(FREE, loop=loop))
