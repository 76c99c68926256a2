"""One axis tuned automatically: what was guaranteed, what was measured, and what notches gain."""

from __future__ import annotations

import time

import numpy as np

from backend.analysis.loop.design import Candidate
from backend.analysis.loop.measured_plant import measured_plant
from backend.axes.axis.axis import Axis
from backend.axes.axis.cyclic import CyclicSession
from backend.foundation.work.jobs import Progress
from backend.tools.measuring.axis_facts import read_facts
from backend.tools.measuring.recording import cycle_s
from backend.tools.measuring.temporary import put_back
from backend.tools.mechanics.inertia.evaluation import Scheme
from backend.tools.tuning.autotune.design.candidates import candidates_for
from backend.tools.tuning.autotune.run import AutotuneResult, AutotuneSettings, autotune
from backend.tools.tuning.sweep.evaluation import completed
from benchmarks._tune_figures import marked, true_modes
from drivers.virtual.mechanics import MechanicsSpec
from tests.virtual.tools.rig import WIDE


async def tuned(
    axis: Axis, session: CyclicSession, spec: MechanicsSpec, scheme: Scheme, budget_s: float
) -> str:
    """Tune an axis and print the figures; the axis is as before in the end.

    ``×a/×b`` compares with the same design without notches and with the filters as they were: of
    the speed gain, and of the -3 dB point of the motor's speed. Of each margin the guaranteed
    value, what was predicted for the axis as measured, and what was verified.
    """
    began = time.monotonic()
    # Counted in multiples of the motor by families that do not report the motor's inertia.
    rotor = None if axis.drive.profile.drive == "mms7" else spec.motor.inertia_kgm2
    settings = AutotuneSettings(WIDE, scheme=scheme, motor_inertia_kgm2=rotor, budget_s=budget_s)
    found = await autotune(axis, session, settings, Progress(lambda: None))
    took_s = time.monotonic() - began
    plain = await _without_notches(axis, session, found)
    applied, verified = found.applied, found.verified
    if applied is None or verified is None:
        return "nothing applied"
    m, p, n = verified.sweep.margins, verified.guaranteed, applied.nominal
    pm, gm = m.get("phase_margin_deg"), m.get("gain_margin_db")
    assert found.expected is not None
    deg, db = found.expected.phase_margin_deg, found.expected.gain_margin_db
    now = applied.gains.speed_bandwidth_hz
    predicted, measured = verified.predicted_bandwidth_hz, verified.measured_bandwidth_hz
    off = abs(measured / predicted - 1) if measured and predicted else np.inf
    limiting = [hz for hz, _ in true_modes(spec) if 5.0 < hz < 400.0]
    gain = ""
    if plain is not None:
        gains, widths = now / plain.gains.speed_bandwidth_hz, 0.0
        if measured and plain.bandwidth_hz:
            widths = measured / plain.bandwidth_hz
        gain = f"×{gains:.1f}/×{widths:.1f}{'!' if limiting and gains < 2 else ' '}"
    return (
        f"{found.load:9} {','.join(f'{hz:.0f}' for hz in limiting) or '–':12} "
        f"{len(applied.notches)} notches {_corners(applied):12} {now:5.1f} Hz {gain:12} bandwidth "
        f"{_hz(predicted)}→{_hz(measured)}{' ' if off <= 0.1 else '!'} "
        f"PM {_kept(p.phase_margin_deg, n.phase_margin_deg, pm, 1.0, 6.0, deg)}° "
        f"GM {_kept(p.gain_margin_db, n.gain_margin_db, gm, 1.0, 3.0, db)} dB "
        f"Ms {_kept(-p.ms, -n.ms, m.get('ms'), 0.03 * p.ms, np.inf)} "
        f"{marked(_moving_s(found), 60.0, '.0f')}s of motion, {took_s:.0f} s in all  "
        f"{'; '.join(str(each) for each in found.notes + found.tried)}"
    )


async def _without_notches(
    axis: Axis, session: CyclicSession, found: AutotuneResult
) -> Candidate | None:
    """The same design with no notch and the filters that the drive came with."""
    if found.mechanics.model is None or found.applied is None:
        return None
    await put_back(axis, found.before)
    facts = completed(await read_facts(axis), found.mechanics)
    plant = measured_plant(found.mechanics.frf, found.mechanics.model)
    table = candidates_for(
        axis.drive,
        facts,
        plant,
        found.inertia.result.inertia_kgm2.value,
        found.load,
        1.0 / cycle_s(session),
        notches=False,
    )
    return next((c for c in table if set(c.marks) & set(found.applied.marks)), None)


def _corners(applied: Candidate) -> str:
    """The filters that a design counts on, in Hz."""
    corners = (applied.filters.speed_hz, applied.filters.torque_hz)
    return "/".join("–" if hz is None else f"{hz:.0f}" for hz in corners)


def _kept(
    guaranteed: float,
    predicted: float | None,
    found: float | bool | None,
    slack: float,
    off: float,
    here: float | None = None,
) -> str:
    """Guarantee, prediction and measurement; the smaller a number is the worse.

    The prediction is that of the whole loop, and in brackets where it is another one the prediction
    ``here``, on the lines that were verified, which the measurement is held to. ``!``: the promise
    is missed by more than ``slack``; ``?``: the prediction by more than ``off``.
    """
    before = f"{abs(guaranteed):.3g}→{'–' if predicted is None else f'{abs(predicted):.3g}'}"
    if here is not None:
        if predicted is None or abs(here - predicted) > 0.5:
            before += f" ({here:.3g})"
        predicted = here
    if not isinstance(found, float):
        return f"{before}→–"
    found = found if guaranteed > 0 else -found
    missed = "!" if found < guaranteed - slack else ""
    if predicted is not None and abs(found - predicted) > off:
        missed += "?"
    return f"{before}→{abs(found):.3g}{missed}"


def _moving_s(found: AutotuneResult) -> float:
    """Seconds in which the axis is moved, by what was played."""
    motion = found.inertia.motion_s + found.mechanics.motion_s
    if found.again is not None and found.again.verified_anew:
        motion += found.again.motion_s
    if found.verified is not None:
        motion += found.verified.sweep.motion_s
    return motion + (found.step.time_s.size * float(found.step.time_s[1]) if found.step else 0.0)


def _hz(value: float | None) -> str:
    return "–" if value is None else f"{value:.0f} Hz"
