"""Written notches change the measured response as predicted, in every encoding.

The truth is not the encoder's own: responses are measured with and without the notches, and the
ratio is compared with what the tool says the drive makes of them.
"""

from __future__ import annotations

import numpy as np
import pytest

from backend.analysis.loop.loop_structure import Gains
from backend.analysis.loop.margins import open_from_closed
from backend.analysis.loop.notch import Notch
from backend.analysis.response.signal_path.sampling import Hold
from backend.foundation.work.jobs import Progress
from backend.tools.measuring import excite
from backend.tools.measuring.axis_facts import read_facts
from backend.tools.measuring.temporary import write_settings
from backend.tools.tuning.autotune.design.gains import plan_gains
from backend.tools.tuning.notch import effect as notch_effect
from backend.tools.tuning.notch import filters as notch
from backend.tools.tuning.notch.meaning import meaning_of, remember
from backend.tools.tuning.sweep.evaluation import SweepSettings, completed
from backend.tools.tuning.sweep.run import sweep
from tests.virtual.tools.direct import DirectBench, direct
from tests.virtual.tools.rig import WIDE, mechanics

# Without a resonance: what is seen is the notches.
STIFF = mechanics((1e-4, 2000.0, 0.02))


def silent() -> Progress:
    return Progress(lambda: None)


async def learned(b: DirectBench, *, still: bool) -> Hold | None:
    """What autotune does between the mechanics and the design; how the drive holds setpoints."""
    axis = b.axis
    facts = await read_facts(axis)
    found = await sweep(axis, b.session, SweepSettings(WIDE, realisations=1), silent())
    facts = completed(facts, found)
    path = notch_effect.path_of(found.frf.sample_rate_hz, facts, found.hold, found.delay_s)
    rigid = excite.Rigid(1.5e-4, 0.03)
    envelope = WIDE
    begun = await axis.position_raw()
    units = await axis.units()
    if still:
        at_rev = units.position(begun)
        room = notch_effect.room_to_tremble(WIDE, at_rev, (at_rev - 0.5, at_rev + 0.35))
        assert room is not None
        envelope = room
        assert envelope.travel_rev == pytest.approx(0.28)
        b.link.highest.update(low=begun, high=begun)
    meaning = await notch_effect.measure_meaning(
        axis, b.session, envelope, facts, rigid, path, silent(), still=still
    )
    if still:
        low, high = (units.position(b.link.highest[end] - begun) for end in ("low", "high"))
        assert max(-low, high) < 0.2, "it only trembles where it stands"
    remember(axis.drive, meaning)
    return found.hold


def test_too_near_to_an_end_nothing_trembles() -> None:
    assert notch_effect.room_to_tremble(WIDE, 0.4, (-0.5, 0.5)) is None
    assert notch_effect.room_to_tremble(WIDE, -0.51, (-0.5, 0.5)) is None
    assert notch_effect.room_to_tremble(WIDE, 0.0, None) is not None


@pytest.mark.long
@pytest.mark.parametrize(
    ("drive", "still"),
    [("mms7", False), ("m6l", False), ("m6l", True), ("r6l", False)],
)
async def test_the_response_changes_as_predicted(drive: str, still: bool) -> None:
    # Below 150 Hz of centre the coefficients' steps of MMS7 show.
    wanted = (Notch(90.0, 40.0, -14.0), Notch(180.0, 120.0, -8.0))
    async with direct(STIFF, drive=drive) as b:
        hold = await learned(b, still=still) if notch_effect.unknown(b.axis.drive) else None
        meaning = meaning_of(b.axis.drive)
        # A loop that is fast enough to be measured up to the notches and beyond.
        fast = plan_gains(b.axis.drive, Gains(0.0, 4.0, 20.0, 50.0), 1.5e-4, 5e-5)
        await write_settings(b.axis, fast)
        settings = SweepSettings(WIDE, kind="speed_loop", realisations=2, hold=hold)
        plain = await sweep(b.axis, b.session, settings, silent())
        await notch.write_notches(b.axis, wanted, meaning)
        with_them = await sweep(b.axis, b.session, settings, silent())
        shown = await notch.read_notches(b.axis.drive, meaning)
    f = plain.frf.frequency_hz
    predicted = notch.combined(b.axis.drive.profile, wanted, f, meaning)
    # The open loop changes by the notches and by nothing else.
    loops = [open_from_closed(found.frf.response) for found in (with_them, plain)]
    error = loops[0] / loops[1] / predicted
    # Where the loop's gain is so low that noise rules, nothing is said.
    clear = np.maximum(with_them.frf.std_db, plain.frf.std_db) < 0.7
    use = (f > 15) & (f < 220) & clear
    assert np.count_nonzero(use) > 25
    assert np.max(f[use]) > 100
    db, deg = 20 * np.log10(np.abs(error[use])), np.degrees(np.angle(error[use]))
    reported = f"{np.median(np.abs(db)):.2f} dB {np.median(np.abs(deg)):.2f} deg"
    assert np.percentile(np.abs(db), 90) < 1.0, reported
    assert np.percentile(np.abs(deg), 90) < 5.0, reported
    # What is read back is what was asked, as near as the encoding allows.
    assert [s.enabled for s in shown] == [True, True] + [False] * (len(shown) - 2)
    for slot, asked in zip(shown, wanted, strict=False):
        assert slot.realised is not None
        assert slot.realised.center_hz == pytest.approx(asked.center_hz, rel=0.02)
        assert drive == "m6l" or slot.realised.depth_db == pytest.approx(asked.depth_db, abs=1.0)
