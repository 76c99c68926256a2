"""What a verdict states of a loop whose margins are known in closed form.

L = w_c e^(-s d)/s crosses 0 dB at w_c with a phase margin of 90° - w_c d, and reaches -180° at
pi/(2 d), where its gain margin is 20 log10(pi / (2 d w_c)).
"""

from __future__ import annotations

import numpy as np
import pytest

from backend.analysis.loop.loop_goals import Goals, each_of, keeps, worst_of
from backend.analysis.loop.loop_verdict import Lines, LoopVerdict, excluding_db, judge
from backend.analysis.response.signal_path.reference_path import reference_paths
from backend.analysis.response.signal_path.sampling import hold_response

DENSE = np.geomspace(1.0, 6000.0, 3000)
GUARANTEED = Goals(9.0, 48.0, 1.8)


def loop_of(f: np.ndarray, crossover_hz: float, delay_s: float) -> np.ndarray:
    s = 2j * np.pi * f
    return 2 * np.pi * crossover_hz * np.exp(-s * delay_s) / s


def verdict_of(
    crossover_hz: float,
    delay_s: float,
    top_hz: float,
    *,
    predicted_s: float | None = None,
    shown_db: float | None = None,
    deviation: float = 0.01,
) -> LoopVerdict:
    f = np.linspace(5.0, top_hz, 100)
    loop = loop_of(f, crossover_hz, delay_s)
    lines = Lines(f, loop / (1 + loop), np.full(f.size, deviation))
    nominal = loop_of(DENSE, crossover_hz, delay_s if predicted_s is None else predicted_s)
    late = None if predicted_s is None else (delay_s - predicted_s, 5e-6)
    return judge(
        lines,
        DENSE,
        nominal[None, :],
        nominal,
        shown_gain_db=shown_db,
        late_s=late or (0.0, 5e-6),
        size=(0.0, 0.01),
    )


def test_margins_within_the_band_are_those_of_the_loop() -> None:
    found = verdict_of(60.0, 1e-3, 400.0)
    assert found.measured is not None
    assert found.measured.phase_margin_deg is not None
    assert found.measured.gain_margin_db is not None
    phase = found.measured.phase_margin_deg
    assert phase.value == pytest.approx(90 - 360 * 60 * 1e-3, abs=0.5)
    # S = 1 - T: at the crossover the phase of L is known to 1/|1 - T| of what T is known to.
    t = loop_of(np.array([60.0]), 60.0, 1e-3)
    steep = 1 / np.abs(1 - t / (1 + t))[0]
    assert phase.high - phase.value == pytest.approx(1.96 * np.degrees(0.01 * steep), rel=0.1)
    expected = 20 * np.log10(1 / (4 * 60.0 * 1e-3))
    assert found.measured.gain_margin_db.value == pytest.approx(expected, abs=0.2)
    assert found.coverage == "measured"
    assert not found.missed(Goals(9.0, 60.0, 1.8), 1.0, 1.0, 1.03)


def test_a_loop_whose_crossover_is_not_seen_is_predicted_by_what_its_lines_tell() -> None:
    """L = w e^(-s d)/s with 100 Hz and 0.5 ms: 72°; a delay known to 5 µs costs 30 µs, 1.1°."""
    nominal = loop_of(DENSE, 100.0, 0.5e-3)
    known = judge(None, DENSE, nominal[None, :], nominal, late_s=(0.0, 5e-6), size=(0.0, 0.01))
    unknown = judge(None, DENSE, nominal[None, :], nominal)
    assert known.coverage == unknown.coverage == "predicted"
    assert known.worst.phase_margin_deg == pytest.approx(72.0 - 1.1 - 0.9, abs=0.4)
    # Nothing known: 200 µs and 1.5 dB, with which it crosses at 118 Hz: 90 - 118 * 0.7 ms * 360.
    assert unknown.worst.phase_margin_deg == pytest.approx(90.0 - 0.36 * 118.5 * 0.7, abs=0.5)


def test_a_gain_margin_far_above_the_band_is_less_certain_down_to_what_was_shown() -> None:
    """It passes -180° at 1 kHz, with 31.6 µs more delay at 888 Hz: 1.83 octaves above 250 Hz.

    0.3 for each octave are e^0.55, 4.76 dB. The true gain margin is 24.4 dB.
    """
    found = verdict_of(60.0, 0.25e-3, 250.0)
    assert found.predicted is not None
    assert found.designed is not None
    stated, counted = found.predicted.gain_margin_db, found.designed.gain_margin_db
    assert stated is not None
    assert counted is not None
    assert stated.value == counted.value == pytest.approx(20 * np.log10(1000 / 60), abs=0.2)
    assert counted.low - stated.low == pytest.approx(4.76, abs=0.05)
    assert found.worst.gain_margin_db == stated.low
    shown = verdict_of(60.0, 0.25e-3, 250.0, shown_db=21.0).predicted
    assert shown is not None
    assert shown.gain_margin_db is not None
    assert shown.gain_margin_db.low == 21.0


def test_a_crossover_above_the_band_keeps_no_design() -> None:
    found = verdict_of(474.0, 0.1e-3, 246.0)
    assert found.coverage == "predicted"
    assert found.last_crossover_hz == pytest.approx(474.0, rel=0.1)
    assert [m.what for m in found.missed(GUARANTEED, 1.0, 1.0, 1.03)] == ["coverage"]


def test_a_crossover_below_the_band_is_not_measured() -> None:
    """4 Hz with 20 ms: 61° that no line from 5 Hz on shows, and 9.9 dB that they do."""
    found = verdict_of(4.0, 20e-3, 246.0)
    assert found.coverage == "predicted"
    assert found.measured is not None
    assert found.measured.phase_margin_deg is None
    assert found.uncovered_hz == pytest.approx((4.0, 5.0), rel=0.1)
    assert [m.what for m in found.missed(Goals(9.0, 48.0, 1.8), 1.0, 1.0, 1.03)] == ["coverage"]
    true_deg = 90 - 360 * 4.0 * 20e-3
    assert found.stated.phase_margin_deg == pytest.approx(true_deg, abs=1.0)
    assert found.worst.phase_margin_deg < true_deg
    assert found.stated.gain_margin_db == pytest.approx(20 * np.log10(12.5 / 4.0), abs=0.3)
    # What the lines show still counts: of 30 ms here, 20 ms were predicted.
    late = verdict_of(4.0, 30e-3, 246.0, predicted_s=20e-3)
    assert late.stated.gain_margin_db == pytest.approx(20 * np.log10(25.0 / 12.0), abs=0.4)
    assert verdict_of(4.0, 20e-3, 246.0, shown_db=6.0).coverage == "gain_steps"
    # One that crosses just above the first line is measured, whatever its uncertainty.
    just = verdict_of(5.2, 20e-3, 246.0)
    assert just.coverage == "measured"
    assert just.measured is not None


def test_a_crossover_between_the_last_line_and_the_grid_is_not_lost() -> None:
    """100 Hz with 1 ms: 54°. The last line lies in the segment of the dense grid that crosses."""
    before = float(DENSE[np.searchsorted(DENSE, 100.0) - 1])
    found = verdict_of(100.0, 1e-3, 0.5 * (before + 100.0))
    assert found.stated.phase_margin_deg == pytest.approx(54.0, abs=1.0)
    assert found.worst.phase_margin_deg < 54.0


def test_a_crossover_that_was_predicted_below_the_end_of_the_band_is_not_lost() -> None:
    """The loop has 6 % more gain than predicted: it crosses at 106 Hz, above the lines."""
    f = np.linspace(5.0, 104.0, 100)
    loop = loop_of(f, 106.0, 1e-3)
    lines = Lines(f, loop / (1 + loop), np.full(f.size, 0.01))
    nominal = loop_of(DENSE, 100.0, 1e-3)
    found = judge(lines, DENSE, nominal[None, :], nominal, late_s=(0.0, 5e-6), size=(0.0, 0.001))
    assert found.coverage == "predicted"
    assert found.uncovered_hz == pytest.approx((105.0, 104.0), rel=0.02)
    assert found.stated.phase_margin_deg == pytest.approx(54.0, abs=2.0)
    assert found.worst.phase_margin_deg < 52.0


def test_lines_that_begin_above_the_crossover_still_count_where_they_are() -> None:
    """A resonance at 150 Hz that the design does not know is measured, 4 Hz of crossover is not."""
    f = np.linspace(5.0, 246.0, 242)
    s, w = 2j * np.pi * f, 2 * np.pi * 150.0
    loop = loop_of(f, 4.0, 5e-3) * (1.0 + 0.6 * w * s / (s**2 + 0.02 * w * s + w**2))
    lines = Lines(f, loop / (1 + loop), np.full(f.size, 0.01))
    nominal = loop_of(DENSE, 4.0, 5e-3)
    found = judge(lines, DENSE, nominal[None, :], nominal, late_s=(0.0, 5e-6), size=(0.0, 0.01))
    assert found.coverage == "predicted"
    assert found.predicted is not None
    assert found.predicted.phase_margin_deg is not None
    assert found.predicted.phase_margin_deg.value == pytest.approx(90 - 7.2, abs=1.0)
    assert found.stated.ms == pytest.approx(float(np.max(np.abs(1 / (1 + loop)))), rel=0.01)


@pytest.mark.parametrize("apart", [0.9985, 0.9995])
def test_a_crossover_just_above_the_last_line_has_a_phase_margin(apart: float) -> None:
    """Between the last line and the next frequency of the prediction, which are 0.3 % apart."""
    for crossover in np.geomspace(100.0, 104.0, 9):
        for shown in (None, 6.0):
            found = verdict_of(crossover, 0.5e-3, apart * crossover, shown_db=shown)
            true_deg = 90 - 360 * crossover * 0.5e-3
            assert found.stated.phase_margin_deg == pytest.approx(true_deg, abs=1.5)
            assert found.worst.phase_margin_deg < true_deg


def test_a_crossover_that_is_predicted_below_lines_that_do_not_show_it_counts() -> None:
    """The lines still have 0 dB and more at their end; the prediction crosses below it."""
    f = np.linspace(5.0, 100.0, 100)
    loop, nominal = loop_of(f, 110.0, 1e-3), loop_of(DENSE, 85.0, 1e-3)
    lines = Lines(f, loop / (1 + loop), np.full(f.size, 0.01))
    found = judge(lines, DENSE, nominal[None, :], nominal, late_s=(0.0, 5e-6), size=(0.0, 0.01))
    assert found.stated.phase_margin_deg == pytest.approx(90 - 360 * 85.0 * 1e-3, abs=1.5)
    assert found.stated.phase_margin_deg < 90.0


def test_a_raised_gain_covers_it() -> None:
    found = verdict_of(474.0, 0.1e-3, 246.0, shown_db=6.5)
    assert found.coverage == "gain_steps"
    assert not found.missed(GUARANTEED, 1.0, 1.0, 1.03)


def test_a_delay_that_lines_show_counts_beyond_them() -> None:
    """Predicted without it the loop keeps 73°; with 0.25 ms more it has 30°."""
    found = verdict_of(474.0, 0.35e-3, 246.0, predicted_s=0.1e-3, shown_db=3.0)
    assert found.predicted is not None
    assert found.predicted.phase_margin_deg is not None
    true_deg = 90 - 360 * 474 * 0.35e-3
    assert found.predicted.phase_margin_deg.value == pytest.approx(true_deg, abs=1.5)
    assert found.predicted.phase_margin_deg.low < true_deg
    assert "phase_margin" in [m.what for m in found.missed(GUARANTEED, 1.0, 1.0, 1.03)]


def test_the_worst_end_of_an_interval_counts_as_well() -> None:
    """90° - 360° x 60 Hz x 1.85 ms = 50.0°, known to +-1.96 x 4°/|S|: 3° below 48° is allowed."""
    guaranteed = Goals(4.0, 48.0, 2.5)
    sharp = verdict_of(60.0, 1.85e-3, 400.0, deviation=0.01)
    assert not sharp.missed(guaranteed, 1.0, 1.0, 1.03)
    blurred = verdict_of(60.0, 1.85e-3, 400.0, deviation=0.1)
    found = [(m.what, m.end) for m in blurred.missed(guaranteed, 1.0, 1.0, 1.03)]
    assert ("phase_margin", "measured") in found


def test_a_worst_gain_margin_below_the_promise_keeps_no_design() -> None:
    """A set that holds a loop of 6.8 dB next to the nominal 10 dB; 8 dB were guaranteed."""
    crossover_hz, guaranteed = 60.0, Goals(8.0, 30.0, 2.5)

    def delay_for(gain_db: float) -> float:
        return float(1 / (4 * crossover_hz * 10 ** (gain_db / 20)))

    f = np.linspace(5.0, 100.0, 100)
    loop = loop_of(f, crossover_hz, delay_for(10.0))
    lines = Lines(f, loop / (1 + loop), np.full(f.size, 0.01))
    every = np.stack([loop_of(DENSE, crossover_hz, delay_for(db)) for db in (10.0, 6.8)])
    known = {"late_s": (0.0, 1e-6), "size": (0.0, 1e-3)}
    found = judge(lines, DENSE, every, every[0], **known)
    assert found.coverage == "measured"
    assert found.worst.gain_margin_db < 6.8
    missed = found.missed(guaranteed, 1.0, 1.0, 1.03)
    assert ("gain_margin", "predicted") in [(m.what, m.end) for m in missed]
    # Stable with 7.2 dB more: the loop of 6.8 dB is none of those that are left.
    shown = judge(lines, DENSE, every, every[0], shown_gain_db=7.2, **known)
    assert not shown.missed(guaranteed, 1.0, 1.0, 1.03)


def test_a_raised_gain_that_contradicts_all_that_is_possible_keeps_no_design() -> None:
    """A delay of 0.35 ms leaves 3.6 dB at 474 Hz: stable with 6 dB more it is another loop."""
    found = verdict_of(474.0, 0.35e-3, 246.0, shown_db=6.0)
    assert found.contradicted
    low = Goals(1.0, 10.0, 6.0)
    assert [m.what for m in found.missed(low, 1.0, 1.0, 1.03)] == ["contradiction"]
    assert not verdict_of(474.0, 0.1e-3, 246.0, shown_db=6.0).contradicted


def test_peak_sensitivity_over_all_frequencies_is_never_below_one() -> None:
    """Bode's integral: what is seen of |S| within a band may be below 1, the loop's peak is not."""
    found = verdict_of(474.0, 0.1e-3, 100.0, shown_db=6.0)
    assert found.measured is not None
    assert found.measured.peak_sensitivity is not None
    assert found.measured.peak_sensitivity.value < 1.0
    assert found.stated.ms >= 1.0


def test_nothing_measured_is_predicted_only() -> None:
    nominal = loop_of(DENSE, 60.0, 1e-3)
    found = judge(None, DENSE, nominal[None, :], nominal)
    assert found.measured is None
    assert found.coverage == "predicted"


@pytest.mark.parametrize(("true", "assumed"), [("zero", "linear"), ("linear", "zero")])
def test_a_wrong_hold_of_the_reference_is_found(true: str, assumed: str) -> None:
    f = np.linspace(5.0, 246.0, 100)
    loop = loop_of(f, 60.0, 0.5e-3)
    rng = np.random.default_rng(3)
    noise = np.exp(0.005 * (rng.normal(size=f.size) + 1j * rng.normal(size=f.size)))
    closed = loop / (1 + loop) * noise
    seen = closed * hold_response(f, 1000.0, true) / hold_response(f, 1000.0, assumed)
    best, *_ = reference_paths(f, seen, np.full(f.size, 0.005), loop, rate_hz=1000.0, hold=assumed)
    assert best.hold == true
    assert np.max(np.abs(np.angle(best.closed / closed, deg=True))) < 3.0


def test_delay_of_loop_and_of_reference_are_distinguished() -> None:
    f = np.linspace(5.0, 246.0, 100)
    predicted, true = loop_of(f, 60.0, 0.5e-3), loop_of(f, 60.0, 0.7e-3)
    closed = true / (1 + true) * np.exp(-2j * np.pi * f * 150e-6)
    best, *_ = reference_paths(
        f, closed, np.full(f.size, 0.003), predicted, rate_hz=1000.0, hold="zero", holds=("zero",)
    )
    assert best.late_s == pytest.approx(150e-6, abs=40e-6)
    assert best.loop_late_s[0] == pytest.approx(200e-6, abs=40e-6)


def test_a_motor_that_may_be_alone_above_the_band_widens_what_is_stated() -> None:
    """Three times the loop's size from 400 Hz on: its gain margin is 9.5 dB less."""
    nominal = loop_of(DENSE, 60.0, 0.35e-3)
    alone = nominal * np.where(DENSE > 400.0, 3.0, 1.0)

    def judged(shown_gain_db: float | None) -> LoopVerdict:
        return judge(
            None, DENSE, nominal[None, :], nominal, shown_gain_db=shown_gain_db,
            late_s=(0.0, 5e-6), size=(0.0, 0.01), alternatives=alone[None, :],
        )  # fmt: skip

    raised = judged(7.0)
    assert raised.predicted is not None
    assert raised.designed is not None
    stated, designed = raised.predicted.gain_margin_db, raised.designed.gain_margin_db
    assert stated is not None
    assert designed is not None
    assert designed.low - stated.low == pytest.approx(20 * np.log10(3.0), abs=0.3)
    assert raised.worst.gain_margin_db == stated.low
    # 20 log10(1/(4 · 60 Hz · 0.35 ms)) is 21.5 dB: the design is kept by that, not by the motor's.
    assert not raised.missed(Goals(15.0, 48.0, 1.8), 1.0, 1.0, 1.03)
    # A gain that was raised by 14 dB excludes it.
    far = judged(14.0)
    assert far.predicted == far.designed
    # Without a raised gain the loop is not kept, and nothing is widened.
    unseen = judged(None)
    assert unseen.predicted == unseen.designed


def delayed(crossover_hz: float, late_s: float, factor: float) -> tuple[float, float, float]:
    """Gain margin in dB, phase margin and Ms of L = w_c e^(-s (0.5 ms + late))/s."""
    d, f = 0.5e-3 + late_s, crossover_hz * factor
    peak = np.max(1.0 / np.abs(1.0 + loop_of(DENSE, f, d)))
    return float(20 * np.log10(1.0 / (4 * f * d))), 90.0 - 360.0 * f * d, float(peak)


@pytest.mark.long
def test_a_raised_gain_keeps_only_loops_that_no_line_told_but_are_sound() -> None:
    """A loop late by up to 200 µs and 1.5 dB stronger: no line shows it, its gain is raised.

    It oscillates above its true gain margin. 300 loops, of which most miss the goals.
    """
    rng = np.random.default_rng(11)
    sound = kept = unsound = 0
    for _ in range(300):
        crossover = float(rng.uniform(90.0, 170.0))
        late, factor = float(rng.uniform(0.0, 200e-6)), float(rng.uniform(0.96, 1.18))
        true_db, true_deg, true_ms = delayed(crossover, late, factor)
        nominal = loop_of(DENSE, crossover, 0.5e-3)
        before = judge(None, DENSE, nominal[None, :], nominal)
        wanted = max(8.0, excluding_db(before, DENSE, nominal[None, :], GUARANTEED) + 0.2)
        shown = min(wanted, true_db)
        found = judge(None, DENSE, nominal[None, :], nominal, shown_gain_db=shown)
        missed = found.missed(GUARANTEED, 1.0, 1.0, 1.03) or shown < 7.0
        meets = true_db >= 9.0 and true_deg >= 48.0 and true_ms <= 1.8
        holds = true_db >= 7.8 and true_deg >= 42.5 and true_ms <= 1.8 * 10 ** (1.2 / 20)
        unsound += not holds
        sound += meets and true_db >= wanted
        kept += meets and true_db >= wanted and not missed
        assert holds or missed, (crossover, late, factor, true_db, true_deg, true_ms)
    assert unsound > 30
    assert sound > 60
    assert kept >= 0.95 * sound


def test_delays_between_the_ends_count_where_a_raised_gain_excludes_the_ends() -> None:
    """130 Hz, 0.5 ms, shown 9.5 dB: 643 µs would leave 9.5 dB, with 60° of phase margin."""
    nominal = loop_of(DENSE, 130.0, 0.5e-3)
    found = judge(None, DENSE, nominal[None, :], nominal, shown_gain_db=9.5, size=(0.0, 1e-6))
    assert found.worst.gain_margin_db >= 9.5
    # The grid of delays ends at 600 µs: 63°, of 67° of the loop without any.
    assert found.worst.phase_margin_deg < 64.0


def test_margins_of_each_loop_are_those_of_it_alone() -> None:
    rng = np.random.default_rng(5)
    loops = np.stack(
        [loop_of(DENSE, rng.uniform(20.0, 400.0), rng.uniform(1e-4, 2e-3)) for _ in range(60)]
    )
    each = each_of(loops)
    for number, loop in enumerate(loops):
        alone = worst_of(loop[None, :])
        assert each.gain_margin_db[number] == pytest.approx(alone.gain_margin_db)
        assert each.phase_margin_deg[number] == pytest.approx(alone.phase_margin_deg)
        assert each.ms[number] == pytest.approx(alone.ms)
        assert each.stable[number] == alone.stable
        for goals in (GUARANTEED, Goals(6.0, 20.0, 2.5), Goals(3.0, 50.0, 9.0)):
            assert keeps(loop[None, :], goals) is alone.meets(goals)
            assert keeps(loops[: number + 1], goals) is worst_of(loops[: number + 1]).meets(goals)
    assert 10 < np.count_nonzero(each.stable) < 60


def uncertain(shown_gain_db: float | None, late_std_s: float = 150e-6) -> LoopVerdict:
    """A loop of 150 Hz that may be late by up to 0.7 ms: some of these loops are not stable."""
    nominal = loop_of(DENSE, 150.0, 0.35e-3)
    return judge(
        None, DENSE, nominal[None, :], nominal, shown_gain_db=shown_gain_db,
        late_s=(400e-6, late_std_s), size=(0.0, 0.01),
    )  # fmt: skip


def test_a_possible_loop_that_is_not_stable_is_excluded_by_a_raised_gain() -> None:
    before = uncertain(None, 600e-6)
    assert not before.stable
    missed = before.missed(GUARANTEED, 1.0, 1.0, 1.03)
    assert {(m.what, m.end) for m in missed if m.what != "coverage"} == {
        ("stability", "predicted"),
        ("phase_margin", "predicted"),
        ("gain_margin", "predicted"),
        ("peak_sensitivity", "predicted"),
    }
    # At 9.5 dB a loop of 150 Hz is late by 0.56 ms, and has 60° left.
    after = uncertain(9.5, 600e-6)
    assert after.stable
    assert not after.missed(GUARANTEED, 1.0, 1.0, 1.03)


def test_what_lines_show_is_not_left_to_a_raised_gain() -> None:
    found = verdict_of(60.0, 2.2e-3, 400.0)
    assert {(m.what, m.end) for m in found.missed(GUARANTEED, 1.0, 1.0, 1.03)} >= {
        ("phase_margin", "stated")
    }


def test_a_stated_loop_that_a_raised_gain_excludes_is_the_mean_of_what_it_leaves() -> None:
    """A delay of 0.75 ms leaves 6.9 dB: with 8 dB more it is another one, of 0.66 ms at most."""
    assert uncertain(None).stated.gain_margin_db == pytest.approx(6.9, abs=0.1)
    after = uncertain(8.0)
    assert after.stated.gain_margin_db > 8.0
    longest_s = 1.0 / (4 * 150.0 * 10 ** (8.0 / 20))
    assert after.stated.phase_margin_deg > 90.0 - 360.0 * 150.0 * longest_s
    # Not the most favourable of those that are left either.
    assert after.stated.phase_margin_deg < 90.0 - 360.0 * 150.0 * 0.45e-3


def test_every_loop_that_a_raised_gain_leaves_is_as_good_as_stated() -> None:
    """Delays between those that are looked at: by 107 µs apart they would hide up to 6° at 150 Hz.

    A chain whose gain margin says little of its phase: a second crossing at 450 Hz.
    """

    def loop(late_s: float) -> np.ndarray:
        return loop_of(DENSE, 450.0, 0.1e-3 + late_s)

    nominal = loop(0.0)
    for shown_db in (2.0, 4.0, 6.0, 8.0):
        found = judge(
            None, DENSE, nominal[None, :], nominal, shown_gain_db=shown_db,
            late_s=(200e-6, 130e-6), size=(0.0, 1e-6),
        )  # fmt: skip
        low, high = found.delay_s.low, found.delay_s.high
        left = each_of(np.stack([loop(late) for late in np.linspace(low, high, 400)]))
        kept = left.stable & (left.gain_margin_db > shown_db)
        assert np.any(kept)
        assert found.worst.phase_margin_deg <= np.min(left.phase_margin_deg[kept]) + 3.5
