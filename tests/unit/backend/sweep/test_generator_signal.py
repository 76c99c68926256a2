"""The test signals of the generator."""

from __future__ import annotations

from dataclasses import replace

import pytest

from backend.axes.axis.axis import Envelope
from backend.tools.moving.jog.cyclic import GeneratorSettings, signal
from drivers.errors import OutOfRange

CYCLE_S = 1e-3
SINE = GeneratorSettings("CSV", "sine", 100.0, 1.0, Envelope(4.0, 1500.0, 100.0, 60.0), 20.0)


def test_the_end_frequency_is_that_of_a_chirp_alone() -> None:
    """A quarter of the cycle rate, 250 Hz, is the highest frequency that is played."""
    beyond = replace(SINE, frequency_end_hz=400.0)
    assert len(signal(beyond, CYCLE_S)) == 1000
    with pytest.raises(OutOfRange):
        signal(replace(beyond, shape="chirp"), CYCLE_S)
    with pytest.raises(OutOfRange):
        signal(replace(SINE, frequency_hz=300.0), CYCLE_S)
