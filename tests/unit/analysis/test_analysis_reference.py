"""A speed loop's reference as the excitation: its torque, its gains, and what samples show."""

from dataclasses import replace

import numpy as np
import pytest
from drive_sim import TURN, Drive, Mechanics, simulate
from random_axes import errors
from test_analysis_path import case_of, records_of

from backend.analysis.response.frf import Frf
from backend.analysis.response.signal_path.reference_gain import reference_gain
from backend.analysis.response.signal_path.sampling import (
    SignalPath,
    rising_command,
    sampled_command,
    sampled_integral_response,
)
from backend.analysis.response.stated_band import ended_where_unknown
from backend.analysis.signals.excitation import choose_lines, multisine, scaled
from backend.analysis.signals.line_spectra import Record
from backend.axes.axis.axis import Envelope
from backend.tools.measuring import excite
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.measuring.recording import Recording
from backend.tools.measuring.waveform import Band
from backend.tools.tuning.sweep import speed_injection
from backend.tools.tuning.sweep.evaluation import SweepSettings, evaluate

RATE, FINE = 1000.0, 1000
PATHS = [
    SignalPath(RATE, current_bandwidth_hz=hz, command_delay_s=late)
    for hz in (1000.0, 300.0, None)
    for late in (0.0, 0.25e-3, 1e-3, 1.3e-3)
]


def integral_of_held(values: np.ndarray, path: SignalPath) -> np.ndarray:
    """Samples of the integral of a held sequence behind delay and lag, by 1 µs steps."""
    step_s = 1.0 / RATE / FINE
    # From the middle of each step, so that the sum is the integral at its end.
    integral = (np.cumsum(np.repeat(values, FINE)) - 0.5 * np.repeat(values, FINE)) * step_s
    late = round(path.command_delay_s / step_s)
    integral = np.concatenate([np.zeros(late), integral])[: integral.size]
    if path.current_bandwidth_hz is not None:
        a = np.exp(-TURN * path.current_bandwidth_hz * step_s)
        out, lagged = np.empty_like(integral), 0.0
        for n, value in enumerate(integral):
            lagged = a * lagged + (1 - a) * value
            out[n] = lagged
        integral = out
    # What is sampled with a setpoint is the state just before it takes effect.
    return np.concatenate([[0.0], integral[FINE - 1 :: FINE]])[: values.size]


@pytest.mark.parametrize("path", PATHS)
def test_an_integral_rises_between_two_samples(path):
    values = np.random.default_rng(1).normal(size=40)
    mean = (np.concatenate([[0.0], np.cumsum(values)[:-1]]) + 0.5 * values) / RATE
    shown = sampled_command(mean, path) + rising_command(values, path)
    true = integral_of_held(values, path)
    assert np.max(np.abs(shown - true)) < 2e-3 * np.max(np.abs(true))
    # Its mean alone would be off by up to half a cycle of the value that is held.
    if path.command_delay_s == 1e-3 and path.current_bandwidth_hz != 300.0:
        assert np.max(np.abs(sampled_command(mean, path) - true)) > 0.2e-3 * np.max(np.abs(values))


@pytest.mark.parametrize("path", PATHS)
def test_its_response_is_that_of_the_sequence(path):
    period = np.random.default_rng(2).normal(size=50)
    period -= period.mean()
    values = np.tile(period, 3)
    mean = (np.concatenate([[0.0], np.cumsum(values)[:-1]]) + 0.5 * values) / RATE
    out = (sampled_command(mean, path) + rising_command(values, path))[-50:]
    f = np.fft.rfftfreq(50, 1 / RATE)[1:-1]
    ratio = (np.fft.rfft(out) / np.fft.rfft(period))[1:-1]
    assert np.allclose(ratio, sampled_integral_response(f, path), atol=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("loop_hz", [15.0, 60.0])
def test_the_gain_of_a_speed_loop_is_read_from_what_it_makes_of_its_reference(loop_hz):
    """A light axis answers fast: its own speed makes much of the torque, far up."""
    mechanics = Mechanics(loads=())
    kp = TURN * loop_hz * mechanics.total_kgm2
    corner = TURN * loop_hz / 8
    drive = Drive(0.64, 1.92, 1000.0, kp_nms=kp, ki_nm=kp * corner, speed_filter_hz=1000.0)
    lines = choose_lines(5.0, 400.0, 1000 / 650, count=150)
    records = []
    for number in range(4):
        e = scaled(
            multisine(
                sample_rate_hz=1000.0, period_samples=650, lines=lines, realisation=number // 2,
                invert=bool(number % 2), iterations=40, integrations=1, ramp_samples=80,
            ), 3.0,
        )  # fmt: skip
        run = simulate(mechanics, drive, 1000.0, velocity=e.samples)
        records.append(Record(e, run.velocity, run.torque))
    loop = reference_gain(tuple(records), SignalPath(1000.0), None, hold_known=False).controller
    assert loop.c0 == pytest.approx(kp, rel=0.02)
    assert loop.c1 == pytest.approx(kp * corner, rel=0.05)
    known = reference_gain(tuple(records), SignalPath(1000.0), corner, hold_known=False).controller
    assert known.c0 == pytest.approx(kp, rel=0.01)
    assert known.c1 == pytest.approx(corner * known.c0, rel=1e-9)


@pytest.mark.long
def test_a_torque_that_does_not_follow_its_reference_has_no_gain():
    records = tuple(
        replace(r, torque=-r.torque) for r in records_of(case_of(1000.0, late_steps=20))
    )
    with pytest.raises(ValueError, match="does not follow"):
        reference_gain(records, SignalPath(1000.0), 0.0, hold_known=False)


#: Gains of a DS_C as shipped: 100 Hz of 2e-5 kg·m², and an integral of 20 ms.
SHIPPED = Drive(
    1.27, 1.27, 1000.0, kp_nms=0.0125664, ki_nm=0.62832, speed_filter_hz=1000.0,
    counts_per_rev=2**20, noise_counts=0.0,
)  # fmt: skip
ROOM = excite.Room(1.27, 157.0, 25.0)


@pytest.mark.long
@pytest.mark.parametrize(
    "mechanics",
    [
        Mechanics(),
        Mechanics(loads=((1e-4, 20.0, 0.002),)),
        Mechanics(loads=((3e-3, 300.0, 0.05),), viscous_nms=1e-3, coulomb_nm=0.06),
    ],
    ids=["motor alone", "one resonance", "ratio 60"],
)
@pytest.mark.parametrize("hold", ["zero", "linear"])
def test_mechanics_by_a_speed_loops_reference_have_their_size(mechanics, hold):
    """Loops of 40, 13 and 1 Hz: what the integral does within a cycle is 1.1 % of the torque."""
    drive = replace(SHIPPED, holds_motion=hold == "zero")
    peak = 12.0 if mechanics.total_kgm2 < 1e-3 else 15.0
    sequences = speed_injection.sequences(
        RATE, Band(5.0, 400.0), ROOM, peak, 2, "multisine", base=True
    )
    records = []
    for number, s in enumerate(sequences):
        e = replace(s.excitation, samples=s.excitation.samples + s.base)
        run = simulate(mechanics, replace(drive, seed=number), RATE, velocity=e.samples)
        zero, valid = np.zeros(e.samples.size), np.ones(e.samples.size, bool)
        reported = Recording(RATE, run.position, run.velocity, run.torque, zero, zero, valid)
        records.append((replace(s, excitation=e), reported))
    facts = AxisFacts(1.27, True, 3000.0, None, None, None, None, False)
    settings = SweepSettings(Envelope(4.0, 1500.0, 100.0, 60.0), hold=hold)
    found = evaluate(tuple(records), RATE, facts, settings, "speed", dc=True, by_speed=True)
    assert found.trusted
    part = errors(found.direct, mechanics, 5.0, 200.0)
    f = found.direct.frequency_hz
    low = (f >= 20.0) & (f <= 200.0) & (found.direct.coherence >= 0.9)
    ratio = found.direct.response[low] / mechanics.response(f[low])
    assert abs(float(np.median(20 * np.log10(np.abs(ratio))))) < 0.06
    assert part.phase_deg < 3.0
    assert part.covered >= 0.9
    above = errors(found.frf, mechanics, 250.0, 400.0)
    assert above.magnitude_db < 0.6
    assert above.phase_deg < 4.0


def reported(std_deg: np.ndarray) -> Frf:
    f = np.linspace(5.0, 400.0, std_deg.size)
    zero = np.zeros(f.size)
    return Frf(
        f, np.ones(f.size, np.complex128), zero, std_deg, zero, zero, zero, RATE, (5.0, 400.0), 8, 0
    )


def test_a_band_ends_where_the_model_alone_no_longer_tells_the_lines():
    known, rough = np.full(80, 3.0), np.full(80, 9.0)
    assert ended_where_unknown(reported(known)).valid_band_hz == (5.0, 400.0)
    # 95 of 100 cases within 15° are 7.65° of deviation; below 0.25 fs lines are measured.
    assert ended_where_unknown(reported(rough)).valid_band_hz == (5.0, 250.0)
    f = np.linspace(5.0, 400.0, 80)
    beside_a_valley = np.where((f > 260) & (f < 300), 9.0, 3.0)
    assert ended_where_unknown(reported(beside_a_valley)).valid_band_hz == (5.0, 400.0)
    upper_end = np.where(f > 320, 9.0, 3.0)
    assert ended_where_unknown(reported(upper_end)).valid_band_hz[1] == pytest.approx(318, abs=6)
