"""Speeds and torques that are reported otherwise than an estimate takes them to be."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from drive_sim import TURN, Drive, simulate
from measured_axes import ONE, tuned_drive

from backend.analysis.response.reported import commanded, current_uncertainty, mean_cycles
from backend.analysis.response.sampling import SignalPath, lag_response
from backend.analysis.signals.excitation import BaseMotion, choose_lines, multisine, scaled
from backend.analysis.signals.line_spectra import Record
from backend.axes.axis.axis import Envelope
from backend.tools.autotune.axis_facts import AxisFacts
from backend.tools.measuring import excite
from backend.tools.measuring.recording import Recording
from backend.tools.sweep.evaluation import SweepSettings, evaluate

RATE = 1000.0


@cache
def recorded(loop_hz=0.0, filter_hz=0.0):
    """Two pairs of realisations with their positions, with no loop or next to the speed loop."""
    period = 750
    lines = choose_lines(5.0, 400.0, RATE / period, count=150)
    drive = replace(tuned_drive(ONE, loop_hz) if loop_hz else Drive(), speed_filter_hz=filter_hz)
    found = []
    for i in range(4):
        e = multisine(
            sample_rate_hz=RATE, period_samples=period, lines=lines, realisation=i // 2,
            invert=bool(i % 2), integrations=0 if loop_hz else 2, iterations=40,
            base=None if loop_hz else BaseMotion(0.5), ramp_samples=period // 8,
        )  # fmt: skip
        e = scaled(e, 0.35 * drive.rated_nm, drive.torque_step * drive.rated_nm)
        moving = 20.0 * np.sin(TURN * np.arange(e.samples.size) / period)
        given = {"velocity": moving} if loop_hz else {}
        run = simulate(ONE, drive, RATE, torque=e.samples, **given)
        found.append(Record(e, run.velocity, run.torque, None, run.position))
    return tuple(found)


def averaged(records, cycles):
    def mean(r):
        before = np.concatenate([np.full(cycles, r.position[0]), r.position[:-cycles]])
        return (r.position - before) * RATE / cycles

    return tuple(replace(r, response=mean(r)) for r in records)


@pytest.mark.parametrize("loop_hz", [0.0, 40.0])
@pytest.mark.parametrize("cycles", [1, 2, 4, 16])
def test_a_mean_of_cycles_is_recognised(loop_hz, cycles):
    assert mean_cycles(averaged(recorded(loop_hz), cycles)) == cycles


@pytest.mark.parametrize("filter_hz", [0.0, 300.0, 1000.0])
def test_a_filtered_speed_is_no_mean(filter_hz):
    assert mean_cycles(recorded(40.0, filter_hz)) is None
    assert mean_cycles(tuple(replace(r, position=None) for r in recorded())) is None


@pytest.mark.parametrize(("loop", "loop_hz"), [("none", 0.0), ("speed", 40.0)])
def test_nothing_is_concluded_from_a_mean(loop, loop_hz):
    records = averaged(recorded(loop_hz), 4)
    taken = tuple(
        (
            excite.Sequence(r.excitation),
            Recording(RATE, r.position, r.response, r.torque, r.torque, r.torque,
                      np.ones(r.torque.size, dtype=bool)),
        )
        for r in records
    )  # fmt: skip
    facts = AxisFacts(1.27, True, 3000.0, 1000.0, None, 5e-5, None, False)
    settings = SweepSettings(Envelope(4.0, 1500.0, 100.0, 60.0))
    with pytest.raises(ValueError, match="mean of 4 cycles"):
        evaluate(taken, RATE, facts, settings, loop, True)


def test_a_torque_that_is_the_command_hides_the_current_loop():
    assert commanded(SignalPath(RATE, current_bandwidth_hz=5900.0))
    assert not commanded(SignalPath(RATE, current_bandwidth_hz=2000.0))
    assert not commanded(SignalPath(RATE))
    f = np.geomspace(5.0, 400.0, 100)
    uncertainty = current_uncertainty(f)
    assert uncertainty.real == pytest.approx(np.log(np.abs(lag_response(f, 1000.0))))
    # A delay is found anyway: what is left of the phase is its curvature.
    assert np.max(np.abs(uncertainty.imag)) < 0.1 * np.max(
        np.abs(np.angle(lag_response(f, 1000.0)))
    )
