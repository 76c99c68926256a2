"""The preview of an excitation shows what the tool would play, within the same envelope."""

from __future__ import annotations

import numpy as np
import pytest

from backend.axes.axis.axis import Envelope
from backend.tools.measuring import excite
from backend.tools.measuring.waveform import Band, Waveform, stepped, tones_hz
from backend.tools.tuning.sweep.evaluation import Kind, Loop, SweepSettings
from backend.tools.tuning.sweep.preview import _extremes, _seen, _sequences

RATE_HZ, INERTIA = 1000.0, 2e-4
ROOM = excite.Room(torque_nm=1.0, speed_rad_s=125.0, travel_rad=19.0)


def made(kind: Kind, loop: Loop = "auto", room: excite.Room = ROOM) -> tuple[excite.Sequence, ...]:
    settings = SweepSettings(Envelope(3, 1200, 80, 60), kind, loop, realisations=2)
    band = excite.band_for(RATE_HZ, 5.0, None)
    return _sequences(settings, RATE_HZ, band, room, INERTIA)


@pytest.mark.parametrize(
    ("kind", "loop"),
    [
        ("mechanics", "auto"),
        ("mechanics", "speed"),
        ("mechanics", "position"),
        ("speed_loop", "auto"),
        ("position_loop", "auto"),
    ],
)
def test_every_kind_has_a_preview(kind: Kind, loop: Loop) -> None:
    shown = _seen(made(kind, loop), "x", 1.0, INERTIA)
    # Realisations come in pairs of opposite sign; lines up to 0.4 of the sample rate.
    assert shown.realisations == 4
    assert 4.9 <= shown.frequency_hz[0] <= 7.0
    assert shown.frequency_hz[-1] <= 0.4 * RATE_HZ
    assert shown.frequency_hz.shape == shown.amplitude.shape
    assert shown.time_s.shape == shown.value.shape
    assert shown.time_s.size <= 802
    assert np.all(np.diff(shown.time_s) > 0)
    # The multisine of tuning.md, section 2; a base motion on top of it makes it no spikier.
    assert shown.crest <= 2.2


@pytest.mark.parametrize("waveform", ["chirp", "prbs", "stepped"])
@pytest.mark.parametrize("kind", ["mechanics", "speed_loop", "position_loop"])
def test_every_waveform_has_a_preview(kind: Kind, waveform: Waveform) -> None:
    settings = SweepSettings(Envelope(3, 1200, 80, 60), kind, excitation=waveform)
    band = excite.band_for(RATE_HZ, 5.0, None)
    sequences = _sequences(settings, RATE_HZ, band, ROOM, INERTIA)
    shown = _seen(sequences, "x", 1.0, INERTIA)
    # A stepped sine is one pair, the others two; every pair has opposite signs.
    assert shown.realisations == (2 if waveform == "stepped" else 4)
    assert 4.9 <= shown.frequency_hz[0] <= 7.0
    assert 350 <= shown.frequency_hz[-1] <= 0.4 * RATE_HZ + 1
    assert np.all(shown.amplitude > 0)
    assert kind != "mechanics" or shown.peak <= 0.9
    # From rest to rest: a realisation begins and ends without a jump.
    first = sequences[0].excitation.samples
    assert max(abs(first[0]), abs(first[-1])) < 0.2 * shown.peak


def test_a_stepped_sine_repeats_its_tones_in_both_halves() -> None:
    e = stepped(RATE_HZ, tones_hz(Band(20.0, 320.0)), np.ones(40), invert=False)
    assert len(e.segments) == 40
    for tone in e.segments:
        half = tone.samples // 2
        one, two = (e.samples[tone.start + k * half :][:half] for k in (0, 1))
        # Whole cycles in each half: a mean of zero, and the amplitude of the tone.
        assert abs(np.mean(one)) < 0.05
        assert np.max(np.abs(two)) == pytest.approx(1.0, abs=0.1)
        assert np.sqrt(2 * np.mean(one**2)) == pytest.approx(1.0, abs=0.05)


def test_a_stepped_sine_from_too_low_a_frequency_is_refused() -> None:
    with pytest.raises(ValueError, match="begin at a higher frequency"):
        tones_hz(Band(0.5, 10.0))


def test_the_curve_hides_no_peak() -> None:
    sequences = made("mechanics")
    shown = _seen(sequences, "%", 100.0, INERTIA)
    samples = sequences[0].excitation.samples * 100.0
    assert shown.peak == np.max(np.abs(samples))
    assert np.max(np.abs(shown.value)) == shown.peak
    assert np.min(shown.value) == np.min(samples)
    # 1 Nm is what the envelope permits.
    assert shown.peak <= 100.0


def test_too_little_room_is_an_error_and_no_curve() -> None:
    with pytest.raises(ValueError, match="too little for the base motion"):
        made("mechanics", room=excite.Room(1.0, 125.0, 0.01))


def test_extremes_of_every_stretch() -> None:
    values = np.zeros(10_000)
    values[1234], values[8765] = 5.0, -7.0
    chosen = _extremes(values, 100)
    assert {1234, 8765} <= set(chosen.tolist())
    assert chosen.size <= 100
    assert _extremes(np.arange(5.0), 100).tolist() == [0, 1, 2, 3, 4]
