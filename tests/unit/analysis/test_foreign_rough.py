"""Imported responses of axes that are simulated here alone: other structure, other recorder.

Linear axes of two masses, stepped exactly (matrix exponential) at a fine step; the truth is the
transfer function. The recorder has a clock, a loop or digits of its own.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import lfilter, ss2tf

from backend.analysis.response.foreign_recordings.collocated import (
    contradiction,
    path_delay_s,
    rigid_part,
)
from backend.analysis.response.foreign_recordings.foreign import ForeignResponse, evaluate
from backend.analysis.response.foreign_recordings.product_model import (
    Pair,
    ProductFit,
    ProductModel,
)

MOTOR, LOAD = 8e-4, 1.5e-3
STIFF = LOAD * (2 * np.pi * 45.0) ** 2
DAMP, VISCOUS = 0.02, 8e-3
Array = np.ndarray


def axis() -> tuple[Array, Array]:
    """States: turn of the motor, its speed, turn of the load, its speed."""
    a = np.array(
        [
            [0, 1, 0, 0],
            [-STIFF / MOTOR, -(DAMP + VISCOUS) / MOTOR, STIFF / MOTOR, DAMP / MOTOR],
            [0, 0, 0, 1],
            [STIFF / LOAD, DAMP / LOAD, -STIFF / LOAD, -DAMP / LOAD],
        ]
    )
    return a, np.array([[0.0], [1 / MOTOR], [0.0], [0.0]])


def moved(torque: Array, step_s: float, state: int) -> Array:
    """One state under a torque that is constant for each step."""
    a, b = axis()
    whole = expm(np.block([[a, b], [np.zeros((1, 5))]]) * step_s)
    pick = np.zeros((1, 4))
    pick[0, state] = 1.0
    numerator, denominator = ss2tf(whole[:4, :4], whole[:4, 4:], pick, np.zeros((1, 1)))
    return np.asarray(lfilter(numerator[0], denominator, torque))


def truth(f: Array, state: int) -> Array:
    a, b = axis()
    eye = np.eye(4)
    return np.array([np.linalg.solve(2j * np.pi * x * eye - a, b)[state, 0] for x in f])


def periods(rate: int, top: int, count: int, seed: int) -> Array:
    """Lines 1 Hz apart from 5 Hz, random phases, one second a period."""
    spectrum = np.zeros(rate // 2 + 1, dtype=complex)
    phases = np.random.default_rng(seed).random(top - 4)
    spectrum[5 : top + 1] = np.exp(2j * np.pi * phases)
    one = np.fft.irfft(spectrum, rate)
    return np.tile(one / np.std(one), count)


def held(found: ForeignResponse, true: Array) -> float:
    """Share of lines whose truth lies within the band, of size or phase the lower one."""
    left = np.log(found.response / true)
    size = np.abs(left.real) <= 1.96 * found.band.real
    turn = np.abs(left.imag) <= 1.96 * found.band.imag
    return float(min(np.mean(size), np.mean(turn)))


def test_a_position_that_wanders_keeps_its_lines() -> None:
    """A disturbance moves an axis without a position loop on, by another way in each period."""
    rate, fine = 2000, 4
    torque = np.repeat(periods(rate, 300, 8, 1), fine)
    drawn = np.random.default_rng(2).normal(size=torque.size)
    push = lfilter([1 - 0.98], [1, -0.98], drawn)
    place = moved(torque + 0.02 * push / np.std(push), 1 / rate / fine, 0)[::fine]
    # The torque acts from its sample on: half a step later in the mean.
    found = evaluate(torque[::fine], place, rate, (5.0, 280.0))
    f = found.frequency_hz
    true = truth(f, 0) * np.sinc(f / rate) * np.exp(-1j * np.pi * f / rate)
    assert held(found, true) >= 0.9
    # 2 % of disturbance: without the wander the band is no wider than that of a speed.
    assert np.median(1.96 * found.std_db) < 2.0


@pytest.mark.long
def test_what_lies_above_the_band_does_not_count_within_it() -> None:
    """A speed of the load falls below the digits of its file; up to 250 Hz all is exact."""
    rate = 8000
    rng = np.random.default_rng(5)
    torque = np.tile(np.repeat(np.sign(rng.normal(size=1000)), 8), 6)
    speed = np.round(moved(torque, 1 / rate, 3), 9)
    found = evaluate(torque, speed, rate, (5.0, 250.0))
    f = found.frequency_hz
    true = truth(f, 3) * np.sinc(f / rate) * np.exp(-1j * np.pi * f / rate)
    assert held(found, true) >= 0.9
    assert np.median(1.96 * found.std_db) < 2.0


def test_distortion_at_one_end_does_not_widen_the_other() -> None:
    """Odd lines alone; a third harmonic of one strong low line lies next to the low ones."""
    rate = 2000
    t = np.arange(2 * rate) / rate
    spectrum = np.zeros(rate + 1, dtype=complex)
    lines = np.arange(11, 601, 2)
    spectrum[lines] = np.exp(2j * np.pi * np.random.default_rng(3).random(lines.size))
    one = np.fft.irfft(spectrum, 2 * rate)
    answer = np.zeros_like(spectrum)
    answer[lines] = spectrum[lines] * truth(lines / 2.0, 1)
    y = np.fft.irfft(answer, 2 * rate)
    high = sum(np.sin(2 * np.pi * k * t + k) for k in range(240, 300))
    y = y + high * 0.3 * np.std(y) / np.std(high)
    noise = 1e-4 * np.std(y) * np.random.default_rng(4).normal(size=6 * y.size)
    found = evaluate(np.tile(one, 6), np.tile(y, 6) + noise, rate)
    low, upper = found.frequency_hz < 150, found.frequency_hz > 245
    assert np.median(found.band.scatter[low]) < 0.02
    assert np.median(found.band.scatter[upper]) > 0.2


def test_what_turns_slowly_from_period_to_period_counts_as_fewer_periods() -> None:
    """What a recorder of another clock folds turns against the lines: a third in 12 periods.

    The mean of such errors falls by far less than by the root of their number.
    """
    rate, count, turn = 1000, 12, 0.03
    torque = periods(rate, 300, count, 7)
    spectrum = np.fft.rfft(torque[:rate])
    lines = np.arange(5, 301)
    true = 1.0 / (1.0 + 1j * lines / 20.0)
    phases = np.exp(2j * np.pi * np.random.default_rng(8).random(lines.size))
    rows = []
    for p in range(count):
        answer = np.zeros_like(spectrum)
        folded = 0.1 * phases * np.exp(2j * np.pi * turn * p)
        answer[lines] = spectrum[lines] * true * (1.0 + folded)
        rows.append(np.fft.irfft(answer, rate))
    found = evaluate(torque, np.concatenate(rows), rate, (5.0, 299.0))
    assert found.periods_used >= 6
    off = np.abs(np.log(found.response / true[: found.response.size])) / np.sqrt(2)
    # Root mean square of one component: no more than twice what is stated as noise.
    assert np.sqrt(np.mean(off**2)) < 2.0 * np.median(found.noise)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("bandwidth_hz", [10.0, 40.0])
def test_a_closed_loop_with_noise_has_a_band_for_its_feedback(bandwidth_hz: float) -> None:
    """A PI loop answers a disturbance of a tenth of the excitation."""
    rate, n = 1000.0, 12000
    inertia, friction = 1e-3, 9.4e-3
    kp = inertia * 2 * np.pi * bandwidth_hz
    ki = kp * 2 * np.pi * bandwidth_hz / 6
    rng = np.random.default_rng(1)
    reference = rng.normal(size=n)
    push = lfilter([0.17], [1, -0.83], rng.normal(size=n))
    push *= 0.1 / np.std(push)
    decay = np.exp(-friction / inertia / rate)
    gain = (1 - decay) / friction
    u, y = np.empty(n), np.empty(n)
    speed = integral = 0.0
    for i in range(n):
        y[i] = speed
        integral -= ki * speed / rate
        u[i] = reference[i] - kp * speed + integral
        speed = decay * speed + gain * (u[i] + push[i])
    found = evaluate(u, y, rate, (3.0, 250.0))
    assert found.excitation == "noise"
    z = np.exp(2j * np.pi * found.frequency_hz / rate)
    assert held(found, gain / (z - decay)) >= 0.99


def test_a_lead_beside_a_fast_pole_does_not_refute_one_shaft() -> None:
    """A fit put -0.19 ms beside a pole at 872 Hz: together they are nothing within the lines."""
    model = ProductModel(12.0, -0.19e-3, (5.8, 872.0))
    assert path_delay_s(model, None) == pytest.approx(-0.19e-3 + 1 / (2 * np.pi * 872.0))
    # With the filter stated its pole is no part of the path.
    assert path_delay_s(model, 872.0) == pytest.approx(-0.19e-3)
    assert path_delay_s(ProductModel(12.0, 0.3e-3, (5.8, 872.0)), None) == pytest.approx(0.3e-3)


@pytest.mark.long
def test_torque_and_speed_of_one_shaft_are_never_refuted_by_the_fit_alone() -> None:
    """Torque behind a lag, sampled: all lines lie within ±90°, whatever model describes them."""
    rate, fine = 2500, 8
    rng = np.random.default_rng(11)
    torque = lfilter([0.12], [1, -0.88], np.repeat(rng.normal(size=12 * rate), fine))
    speed = moved(torque, 1 / rate / fine, 1)
    u, y = torque[::fine], speed[::fine]
    found = evaluate(u, y, rate, (5.0, 380.0))
    assert np.max(np.abs(np.degrees(np.angle(found.response)))) < 95.0
    assert found.fit is not None
    assert contradiction(found, None, path_delay_s(found.fit.model, None)) is None


@pytest.mark.long
def test_a_resonance_below_the_load_is_no_part_of_the_inertia() -> None:
    """A fit put 5.10 and 6.24 Hz into the noise of the lowest lines: 33 % of the inertia."""
    rate = 1000
    torque = periods(rate, 200, 6, 9)
    speed = moved(np.repeat(torque, 4), 1 / rate / 4, 1)[::4]
    found = evaluate(torque, speed, rate, (5.0, 200.0))
    plain = rigid_part(found, None)
    assert plain is not None
    assert found.fit is not None
    model = found.fit.model
    added = (Pair("resonance", 3.10, 0.02), Pair("antiresonance", 3.79, 0.02))
    # Above both the pair multiplies the response by (3.10 / 3.79)²; the gain makes up for it.
    other = ProductModel(
        model.gain * (3.79 / 3.10) ** 2, model.delay_s, model.poles_hz, (*model.pairs, *added)
    )
    size = found.fit.covariance.shape[0]
    covariance = np.pad(found.fit.covariance, (0, 4))
    covariance[size:, size:] = np.eye(4) * 1e-4
    fit = ProductFit(other, covariance, found.fit.residual, found.fit.scatter)
    rigid = rigid_part(replace(found, fit=fit), None)
    assert rigid is not None
    assert rigid.inertia == pytest.approx(plain.inertia)
    assert rigid.inertia_ci95[0] < plain.inertia_ci95[0]
    assert plain.inertia == pytest.approx(MOTOR + LOAD, rel=0.05)
