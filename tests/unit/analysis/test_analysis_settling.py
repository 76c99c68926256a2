"""Free swings that outlast the wait, against a simulated axis that rings for seconds."""

import numpy as np
import pytest
from drive_sim import TURN, Drive, Mechanics
from random_axes import RATED_NM, Case, errors, played, result_of

from backend.analysis.response.frf import estimate_periodic
from backend.analysis.response.signal_path.sampling import SignalPath
from backend.analysis.signals.excitation import choose_lines, multisine
from backend.analysis.signals.line_spectra import Record
from backend.analysis.signals.transient_removal import settled

#: 30 Hz by the reduced inertia of both masses, damping ratio 0.002: it rings for 3 s.
_REDUCED = 1.0 / (1 / 5e-5 + 1 / 1.5e-4)
RINGING = Mechanics(
    loads=((1.5e-4, (TURN * 30.0) ** 2 * _REDUCED, 2 * 0.002 * TURN * 30.0 * _REDUCED),),
    coulomb_nm=0.0,
)


@pytest.mark.long
@pytest.mark.parametrize("rate", [1000.0, 4000.0])
def test_a_ringing_axis_is_measured_as_if_it_had_settled(rate):
    drive = Drive(RATED_NM, 3 * RATED_NM, 1000.0, speed_filter_hz=1000.0)
    case = Case("ringing", RINGING, drive, rate)
    found = result_of(case, played(case))
    e = errors(found.frf, RINGING, 5.0, 0.25 * rate)
    assert e.magnitude_db < 0.05
    assert e.phase_deg < 0.3
    assert e.covered >= 0.9
    peak = next(r for r in found.resonances if r.kind == "resonance")
    hz, damping = RINGING.modes()[0][0]
    assert peak.frequency_hz == pytest.approx(hz, rel=0.01)
    assert peak.damping == pytest.approx(damping, rel=0.15)


def swinging(swing):
    lines = choose_lines(5.0, 400.0, 1.0)
    e = multisine(sample_rate_hz=1000.0, period_samples=1000, lines=lines, iterations=8)
    n = np.arange(e.samples.size)
    noise = np.random.default_rng(2).normal(0, 1e-3, n.size)
    return Record(e, 2.0 * e.samples + swing(n) + noise), e


def test_the_swing_is_taken_out_and_nothing_else():
    record, e = swinging(lambda n: 3.0 * np.exp(-0.6e-3 * n) * np.cos(TURN * 0.0377 * n + 0.4))
    path = SignalPath(1000.0, command_delay_s=-0.5e-3)
    spoiled = estimate_periodic((record,), path, "closed_loop")
    clean = estimate_periodic(settled((record,)), path, "closed_loop")
    truth = 2.0 / np.sinc(e.line_hz / 1000.0)  # samples over samples: no hold
    worst = np.max(np.abs(np.abs(spoiled.response) / truth - 1))
    left = np.abs(np.abs(clean.response) / truth - 1)
    assert worst > 0.3
    assert np.max(left) < 0.03 * worst
    assert np.median(left) < 0.002


def test_a_record_without_a_swing_stays_as_it_is():
    record, _ = swinging(lambda n: 0.0 * n)
    assert settled((record,))[0] is record
    # What does not decay was not caused by the start: a hum, for instance.
    humming, _ = swinging(lambda n: 0.1 * np.cos(TURN * 0.05003 * n))
    assert settled((humming,))[0] is humming
