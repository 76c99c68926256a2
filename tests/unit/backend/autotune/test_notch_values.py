"""Notch values at the edges, computed by hand, and values whose meaning was measured.

Coefficients by the formulas of tuning.md, section 4, with ts = 50 µs: w = 2π·f_c·ts, g = 2π·f_b·ts,
d = 10^(dB/20); a1 = w² + d·g − 2, a2 = 1 − d·g, b1 = w² + g − 2, b2 = 1 − g; stored as
round(c·10000) + 32768.
"""

from __future__ import annotations

import numpy as np
import pytest

from backend.analysis.loop.notch import LevelCalibration, Notch
from backend.analysis.loop.notch_effect import fit_effect, seen_ratio
from backend.analysis.response.signal_path.sampling import SignalPath
from backend.api.tuning.design import preview_notches
from backend.api.tuning.models import NotchPreviewRequest
from backend.axes.axis.axis import Axis
from backend.axes.drive.drive import Drive
from backend.axes.drive.ports import Port
from backend.station.drives.connected_drive import ConnectedDrive
from backend.tools.tuning.notch.filters import encode, off_raw, response
from backend.tools.tuning.notch.meaning import NotchMeaning
from drivers.errors import OutOfRange
from profiles.loader import load_profile
from profiles.schema import Parameter, Profile
from tests.support.memory_link import MemoryLink

MMS7, M6L, R6L, DSC = (load_profile(name) for name in ("mms7", "m6l", "r6l", "ds_c"))
COEFFICIENTS = ("2008:02", "2008:03", "2008:04", "2008:05")


@pytest.mark.parametrize(
    ("notch", "raw"),
    [
        # w² = 0.00024674, g = 0.00628319, d·g = 0.00198692: b1 = −1.99347, one step is 20 % of w².
        (Notch(50.0, 20.0, -10.0), (12790, 42748, 12833, 42705)),
        # w² = 3.55305758, g = 0.03141593, d·g = 0.00314159.
        (Notch(6000.0, 100.0, -20.0), (48330, 42737, 48613, 42454)),
        # Depth 0 is no notch: both polynomials are the same. w² = 0.00986960, g = 0.0314159.
        (Notch(316.2278, 100.0, 0.0), (13181, 42454, 13181, 42454)),
    ],
)
def test_coefficients_at_the_edges(notch: Notch, raw: tuple[int, ...]) -> None:
    made = encode(MMS7, "X", 0, notch, 0)
    assert tuple(made.raw[key] for key in COEFFICIENTS) == raw
    # The enable word gets the first bit.
    assert made.raw["2008:01"] == 1
    assert made.realised is not None
    assert made.realised.stable


def test_the_lowest_centre_moves_by_what_a_step_is() -> None:
    made = encode(MMS7, "X", 0, Notch(50.0, 20.0, -10.0), 0).realised
    # 1 + b1 + b2 = 0.0002: f_c = sqrt(0.0002)/(2π·50 µs) = 45.0 Hz instead of 50.
    assert made is not None
    assert made.center_hz == pytest.approx(45.0, abs=1.0)


@pytest.mark.parametrize(
    "notch",
    [
        Notch(6400.0, 100.0, -20.0),  # w² = 4.0426 > 4 − 2·g: a pole left of −1
        Notch(12.0, 100.0, -20.0),  # w² = 1.4e-5 rounds away: a pole on 1
        Notch(2000.0, 7000.0, -20.0),  # g = 2.2: b2 = −1.2, a pole left of −1
    ],
)
def test_what_the_drive_cannot_make_is_refused(notch: Notch) -> None:
    with pytest.raises(OutOfRange, match=r"stable|16 bits"):
        encode(MMS7, "X", 0, notch, 0)


def test_notches_are_switched_off_as_each_family_has_it() -> None:
    # Bit 2 of the enable word; 0 Hz, the default of P09.10; 4000 Hz, the default of P07.12.
    assert encode(MMS7, "X", 1, None, 0b1111).raw == {"2008:01": 0b1101}
    assert encode(M6L, "X", 0, None, None).raw == {"2009:0B": 0}
    assert encode(R6L, "X", 0, None, None).raw == {"2007:0D": 4000}
    assert off_raw(M6L, "2009:0D") == 0


def test_ds_c_has_whole_hertz_and_decibels() -> None:
    made = encode(DSC, "X", 0, Notch(433.4, 86.5, -17.6), 0)
    assert made.raw == {"PA_50": 433, "PA_51": 87, "PA_52": 18, "PA_4B": 0x10}
    assert made.realised is not None
    assert (made.realised.center_hz, made.realised.depth_db) == (433.0, -18.0)


def _dsc(**changes: dict[str, object]) -> Profile:
    """DS_C with other units, scales and limits of frequency PA_50, width PA_51, depth PA_52."""
    parameters = tuple(
        p.model_copy(update=changes[p.key]) if p.key in changes else p for p in DSC.parameters
    )
    return _with(DSC, parameters)


def _with(profile: Profile, parameters: tuple[Parameter, ...]) -> Profile:
    fields = {name: getattr(profile, name) for name in Profile.model_fields}
    return Profile.model_construct(**fields | {"parameters": parameters})


def test_scale_and_sign_of_a_notch_are_those_of_the_profile() -> None:
    """Steps of 0.1 Hz and 0.5 Hz, and a gain at the centre in steps of -0.1 dB."""
    profile = _dsc(
        PA_50={"scale": 0.1}, PA_51={"scale": 0.5}, PA_52={"scale": -0.1, "max_raw": 600}
    )
    made = encode(profile, "X", 0, Notch(433.4, 86.5, -17.6), 0)
    assert made.raw == {"PA_50": 4334, "PA_51": 173, "PA_52": 176, "PA_4B": 0x10}
    assert made.realised is not None
    assert (made.realised.center_hz, made.realised.width_hz) == (433.4, 86.5)
    assert made.realised.depth_db == -17.6
    seen = np.abs(response(profile, Notch(433.4, 86.5, -17.6), np.array([433.4])))
    assert 20 * np.log10(seen[0]) == pytest.approx(-17.6, abs=0.01)
    # A gain that is stored as it is: raw -18 is -18 dB.
    signed = {"type": "INT16", "min_raw": -60, "max_raw": 0}
    made = encode(_dsc(PA_52=signed), "X", 0, Notch(433.0, 86.0, -18.0), 0)
    assert made.raw["PA_52"] == -18
    # Kilohertz, as attenuation.
    made = encode(_dsc(PA_50={"unit": "kHz", "scale": 1e-3}), "X", 0, Notch(433.0, 86.0, -18.0), 0)
    assert (made.raw["PA_50"], made.raw["PA_52"]) == (433, 18)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"PA_52": {"type": "INT16", "min_raw": -60, "max_raw": 60}}, "sign-of-depth"),
        ({"PA_50": {"unit": "%"}}, "unit-of-frequency"),
        ({"PA_52": {"unit": "%"}}, "unit-of-depth"),
    ],
)
def test_a_notch_of_unknown_unit_or_sign_is_refused(
    changes: dict[str, dict[str, object]], said: str
) -> None:
    with pytest.raises(OutOfRange) as refused:
        encode(_dsc(**changes), "X", 0, Notch(433.0, 86.0, -18.0), 0)
    assert said in repr(refused.value.text)


def test_a_notch_that_would_be_off_is_not_written() -> None:
    """M6-L: where its highest frequency means off, the notch would vanish in silence."""
    parameters = tuple(
        p.model_copy(update={"default_raw": 300, "max_raw": 300}) if p.key == "2009:0B" else p
        for p in M6L.parameters
    )
    profile = _with(M6L, parameters)
    with pytest.raises(OutOfRange) as refused:
        encode(profile, "X", 0, Notch(300.0, 80.0, -40.0), None)
    assert refused.value.code == "notch.read-back-other"


def test_levels_become_what_was_measured() -> None:
    meaning = NotchMeaning(
        120.0, LevelCalibration(((3, 0.15), (10, 0.5), (20, 1.0)), ((10, -20.0), (30, -10.5)))
    )
    made = encode(R6L, "X", 0, Notch(150.0, 75.0, -20.0), None, meaning)
    assert made.raw == {"2007:0D": 150, "2007:0E": 10, "2007:0F": 10}
    assert made.realised is not None
    assert (made.realised.width_hz, made.realised.depth_db) == (75.0, -20.0)
    # Depths that were not tried are not guaranteed.
    deeper = encode(R6L, "X", 0, Notch(150.0, 75.0, -40.0), None, meaning)
    assert deeper.raw["2007:0F"] == 10
    with pytest.raises(OutOfRange, match="measure their effect first"):
        encode(R6L, "X", 0, Notch(150.0, 75.0, -20.0), None)


def test_widths_become_what_was_measured() -> None:
    # The drive's width counts twice what it says, and every notch is 30 dB deep.
    meaning = NotchMeaning(120.0, None, 2.0, -30.0)
    made = encode(M6L, "X", 0, Notch(150.0, 80.0, -12.0), None, meaning)
    assert made.raw == {"2009:0B": 150, "2009:0C": 40}
    f = np.array([150.0, 600.0])
    seen = np.abs(response(M6L, Notch(150.0, 80.0, -12.0), f, meaning))
    assert 20 * np.log10(seen[0]) == pytest.approx(-30.0, abs=0.01)
    assert seen[1] == pytest.approx(1.0, abs=0.02)


@pytest.mark.long
@pytest.mark.parametrize("hold", ["zero", "linear"])
@pytest.mark.parametrize(
    "truth", [Notch(120.0, 60.0, -40.0), Notch(122.0, 6.0, -9.0), Notch(118.0, 240.0, -3.0)]
)
def test_a_notch_is_read_from_the_sampled_torque(hold: str, truth: Notch) -> None:
    """The sampled torque is made in the time domain, 20 steps per cycle, not from the formula."""
    from scipy.signal import cont2discrete, lfilter

    n, per, rate = 650, 20, 1000.0
    rng = np.random.default_rng(3)
    sent = np.tile(rng.normal(size=n), 6)
    fine = np.repeat(sent, per)
    if hold == "linear":
        fine = np.interp(np.arange(fine.size), np.arange(sent.size + 1)[1:] * per, sent, left=0.0)
    w, g = 2 * np.pi * truth.center_hz, 2 * np.pi * truth.width_hz
    d = 10 ** (truth.depth_db / 20)

    def through(num: list[float], den: list[float], u: np.ndarray, method: str) -> np.ndarray:
        b, a, _ = cont2discrete((num, den), 1.0 / rate / per, method)
        return np.asarray(lfilter(b.ravel(), a, u))

    lag = through([1.0], [1 / (2 * np.pi * 800.0), 1.0], fine, "zoh" if hold == "zero" else "foh")
    notched = through([1.0, d * g, w * w], [1.0, g, w * w], lag, "foh")
    last = slice(5 * n * per, 6 * n * per)
    lines = np.arange(4, 260)
    ratio = np.fft.rfft(notched[last][::per])[lines] / np.fft.rfft(lag[last][::per])[lines]
    path = SignalPath(rate, hold=hold, current_bandwidth_hz=800.0)  # type: ignore[arg-type]
    found = fit_effect(lines * rate / n, ratio, path).notch
    assert found.center_hz == pytest.approx(truth.center_hz, rel=0.005)
    assert found.width_hz == pytest.approx(truth.width_hz, rel=0.05)
    assert found.depth_db == pytest.approx(truth.depth_db, abs=4.0 if truth.depth_db < -30 else 0.4)


def test_nothing_like_a_notch_is_said() -> None:
    f = np.linspace(5.0, 400.0, 200)
    with pytest.raises(ValueError, match="no effect"):
        fit_effect(f, np.ones(200, np.complex128), SignalPath(1000.0))
    shallow = seen_ratio(Notch(100.0, 50.0, 0.0), f, SignalPath(1000.0))
    assert np.allclose(shallow, 1.0)


@pytest.mark.parametrize("hz", [1e5, 1e200, 1e308, float("inf")])
def test_figures_beyond_every_range_are_refused_with_the_limit(hz: float) -> None:
    for notch in (Notch(hz, 100.0, -20.0), Notch(1000.0, hz, -20.0)):
        with pytest.raises(OutOfRange) as refused:
            encode(MMS7, "X", 0, notch, 0)
        assert "10000 Hz" in str(refused.value)
        assert "10000 Hz" in str(refused.value.limit)
        assert "陷波器" in refused.value.text.words("zh")
        with pytest.raises(ValueError, match="10000 Hz"):
            response(MMS7, notch, np.array([100.0]))
    levels = LevelCalibration(((3, 0.15), (20, 1.0)), ((10, -20.0), (30, -10.5)))
    tenths = _dsc(PA_50={"scale": 0.1}, PA_51={"scale": 0.1}, PA_52={"scale": 0.1})
    for profile in (DSC, tenths, M6L, R6L):
        meaning = NotchMeaning(500.0, levels) if profile is R6L else None
        with pytest.raises(OutOfRange, match="is outside"):
            encode(profile, "X", 0, Notch(hz, 100.0, -20.0), 0, meaning)
    # Width and depth are moved to the nearest that the drive has.
    made = encode(tenths, "X", 0, Notch(433.0, hz, -1e308), 0)
    assert made.raw["PA_51"] == tenths.by_key["PA_51"].raw_limits[1]
    assert made.raw["PA_52"] == tenths.by_key["PA_52"].raw_limits[1]


@pytest.mark.parametrize("profile", [MMS7, M6L, DSC], ids=lambda each: each.drive)
@pytest.mark.parametrize(
    ("notch", "hz"),
    [
        ((1e308, 80.0, -20.0), 100.0),
        ((433.0, 1e308, -20.0), 100.0),
        ((433.0, 80.0, -float("inf")), 100.0),
        ((433.0, 80.0, -20.0), 1e308),
        ((433.0, 80.0, -20.0), float("nan")),
    ],
)
async def test_the_preview_refuses_what_no_number_can_hold(
    profile: Profile, notch: tuple[float, float, float], hz: float
) -> None:
    drive = Drive("x", "X", profile, [Port(MemoryLink({}), 1, profile.links[0])])
    connected = ConnectedDrive(drive, Axis(drive), None)  # type: ignore[arg-type]
    shape = dict(zip(("center_hz", "width_hz", "depth_db"), notch, strict=True))
    request = NotchPreviewRequest.model_validate({"notches": [shape], "frequency_hz": [hz]})
    with pytest.raises(OutOfRange) as refused:
        await preview_notches(connected, request)
    assert refused.value.limit is not None
    fine = NotchPreviewRequest.model_validate(
        {"notches": [{"center_hz": 433, "width_hz": 80, "depth_db": -20}], "frequency_hz": [400]}
    )
    shown = await preview_notches(connected, fine)
    assert np.isfinite(shown.magnitude_db).all()
