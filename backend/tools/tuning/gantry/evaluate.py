"""Results of a gantry from recordings of both axes. Pure: also works on stored raw data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
import scipy

from backend.analysis.coupled.modes import (
    CoupledModes,
    common_and_differential,
    find_modes,
)
from backend.analysis.coupled.response import Controllers, CoupledResponse, PairRecord, estimate
from backend.analysis.coupled.stability import (
    Design,
    JointMargins,
    coupling,
    design,
    interaction,
    joint_margins,
    shows_coupling,
)
from backend.analysis.signals.arrays import magnitude_db, phase_deg
from backend.analysis.signals.excitation import Excitation
from backend.tools.thresholds import gantry_evaluate as threshold
from backend.tools.tool import Arrays, Meta
from backend.tools.tuning.gantry.result import (
    GantryEntry,
    GantryFinding,
    GantryMargins,
    GantryMode,
    GantryMotion,
    GantryResult,
    GantryValue,
)
from backend.tools.tuning.gantry.settings import GantrySettings
from drivers.errors import NotAllowed

FloatArray = npt.NDArray[np.float64]
_TURN = 2 * np.pi
_KINDS: tuple[Literal["common", "skew"], ...] = ("common", "skew")


@dataclass(frozen=True)
class Shape:
    """Position of the periods in every experiment; the excited bins are stored separately."""

    sample_rate_hz: float
    period_samples: int
    periods: int
    transient_periods: int
    first_sample: int


@dataclass(frozen=True)
class Experiments:
    """Raw data of e experiments, ordered as pairs of common phases.

    ``sent``, ``torque``, ``speed`` [e, 2, n] in rad/s and Nm, with equal signs for equal motion of
    the beam; ``valid`` [e, n]; ``direction`` [e] of the steady motion; ``skew_rad`` [e, n].
    ``controllers`` [lines, 2] are the responses from the error of the reported speed to torque,
    ``at_image`` the same at fs - f; both are empty where unknown. ``filters`` [lines, 2] are the
    responses of the speed filters, 1 where unknown. ``interpolates``: the drives interpolate
    linearly between setpoints.
    """

    shape: Shape
    lines: npt.NDArray[np.int64]
    sent: FloatArray
    torque: FloatArray
    speed: FloatArray
    valid: npt.NDArray[np.bool_]
    direction: FloatArray
    skew_rad: FloatArray
    controllers: npt.NDArray[np.complex128]
    at_image: npt.NDArray[np.complex128]
    filters: npt.NDArray[np.complex128]
    interpolates: bool
    rated_torque_nm: tuple[float, float]
    torque_known: bool
    partner: str

    def arrays(self) -> dict[str, npt.NDArray[np.generic]]:
        """The samples as arrays for storage; complex numbers as real and imaginary parts."""
        return {
            "lines": self.lines, "sent": self.sent, "torque": self.torque, "speed": self.speed,
            "valid": self.valid, "direction": self.direction, "skew_rad": self.skew_rad,
            "controllers": _pairs(self.controllers), "at_image": _pairs(self.at_image),
            "filters": _pairs(self.filters),
        }  # fmt: skip

    def records(self) -> tuple[PairRecord, ...]:
        """Records in the form that the estimate takes."""
        s = self.shape
        found = []
        for number in range(self.direction.size):
            e = Excitation(
                "multisine", self.sent[number, 0], s.sample_rate_hz, s.first_sample,
                s.period_samples, s.periods, s.transient_periods, self.lines,
            )  # fmt: skip
            found.append(
                PairRecord(
                    e,
                    self.sent[number],
                    self.torque[number],
                    self.speed[number],
                    self.valid[number],
                )
            )
        return tuple(found)


@dataclass(frozen=True)
class _Steady:
    """Mean torque of both directions that each axis needs, and its friction.

    ``fight`` is half the difference of the two holding torques, in % of the smaller rated torque.
    The others are in % of the rated torque of their axis. All with intervals.
    """

    holding: tuple[GantryValue, GantryValue]
    friction: tuple[GantryValue, GantryValue]
    fight: GantryValue


def evaluate(data: Experiments, settings: GantrySettings) -> GantryResult:
    """Evaluate the recordings.

    Raises:
        NotAllowed: too many samples were lost.
    """
    records = data.records()
    try:
        response = _response(data, records)
        modes = find_modes(response)
    except ValueError as error:
        raise NotAllowed("gantry.few-samples") from error
    # The modes are limited in this way by themselves.
    response = response.not_better_than_known()
    steady = _steady(data, records, _stiffness(modes))
    margins, best = None, None
    if data.controllers.size > 0:
        # The loops contain the filters, wherever they are placed in the loop.
        loops = data.controllers * data.filters
        goals = {"ms": threshold.MS, "phase_margin_deg": threshold.PHASE_MARGIN_DEG}
        margins, best = joint_margins(response, loops), design(response, loops, **goals)
    ratio, deviation = coupling(response)
    half = response.spread * deviation
    # Two uncoupled machines have neither squareness nor skew modes nor opposing torques.
    joined = shows_coupling(ratio, half)
    square = _square_rev(data, steady, modes) if joined else None
    lead = settings.lead_mm
    in_mm = None if lead is None or square is None else _scaled(square, lead)
    return GantryResult(
        partner=data.partner,
        frequency_hz=_tuple(response.frequency_hz),
        entries=_entries(response),
        motions=_motions(response),
        coupling=_tuple(ratio),
        coupling_half=_tuple(half),
        relative_gain=_tuple(interaction(response.response)),
        modes=tuple(
            GantryMode(
                kind=m.kind, frequency_hz=m.frequency_hz, frequency_ci95_hz=m.frequency_ci95_hz,
                damping=m.damping, damping_ci95=m.damping_ci95, skew_share=m.skew_share,
            )
            for m in (modes.modes if joined else ())
        ),
        inertia_kgm2=GantryValue(value=modes.inertia_kgm2, ci95=modes.inertia_ci95_kgm2)
        if joined and modes.inertia_kgm2 > 0 and data.torque_known else None,
        skew_stiffness_nm_per_rad=_stiffness(modes) if joined and data.torque_known else None,
        holding_percent=steady.holding,
        friction_percent=steady.friction,
        fight_percent=steady.fight if joined else None,
        out_of_square_rev=square,
        out_of_square_mm=in_mm,
        largest_skew_rev=float(np.max(np.abs(data.skew_rad))) / _TURN,
        margins=None if margins is None else _margins(margins),
        gain_factor=None if best is None else best.factor,
        findings=(
            *(
                _machine_findings(data, steady, square, in_mm, modes)
                if joined else _apart(response, float(np.max(ratio + half)))
            ),
            *_loop_findings(response, margins, best),
            *_distortion_findings(response),
        ),
        periods_used=response.periods_used,
        periods_dropped=response.periods_dropped,
        motion_s=data.sent.shape[0] * data.sent.shape[2] / data.shape.sample_rate_hz,
    )  # fmt: skip


def reevaluate(arrays: Arrays, meta: Meta) -> GantryResult:
    """Evaluate stored raw data again.

    Raises:
        ValueError: not the raw data of a gantry.
    """
    given, shape = meta.get("settings"), meta.get("shape")
    rated = meta.get("rated_torque_nm")
    if not isinstance(shape, dict) or not isinstance(rated, list) or "controllers" not in arrays:
        raise ValueError("not the raw data of a gantry")
    data = Experiments(
        Shape(**shape), np.asarray(arrays["lines"], np.int64),
        np.asarray(arrays["sent"], np.float64), np.asarray(arrays["torque"], np.float64),
        np.asarray(arrays["speed"], np.float64), np.asarray(arrays["valid"], np.bool_),
        np.asarray(arrays["direction"], np.float64),
        np.asarray(arrays["skew_rad"], np.float64),
        _complex(arrays["controllers"]), _complex(arrays["at_image"]),
        _complex(arrays["filters"]), bool(meta["interpolates"]),
        (float(rated[0]), float(rated[1])), bool(meta["torque_known"]), str(meta["partner"]),
    )  # fmt: skip
    return evaluate(data, GantrySettings.model_validate(given))


def _pairs(values: npt.NDArray[np.complex128]) -> FloatArray:
    return np.stack([values.real, values.imag], axis=-1)


def _complex(pairs: npt.NDArray[np.generic]) -> npt.NDArray[np.complex128]:
    real = np.asarray(pairs, np.float64)
    return np.asarray(real[..., 0] + 1j * real[..., 1])


def _response(data: Experiments, records: tuple[PairRecord, ...]) -> CoupledResponse:
    """Response from torque to motor speed, corrected for setpoint images and speed filters."""
    found = estimate(records)
    rate, f = data.shape.sample_rate_hz, found.frequency_hz
    # With linear interpolation between setpoints; a setpoint held for a cycle has half a cycle of
    # delay.
    if data.interpolates:
        share, x = (f / (rate - f)) ** 2, np.pi * f / rate
        # All images of linear interpolation together are 1/sinc² - 1 of the amplitude at f.
        beyond = (x / np.sin(x)) ** 2 - 1.0 - share
    else:
        # The images of held setpoints alternate in sign: their sum is less than the second one.
        share, beyond = -f / (rate - f), f / (rate + f)
    known = data.controllers.size > 0
    controllers = Controllers(data.controllers, data.at_image) if known else None
    return found.without_images(share, beyond, controllers).without_filter(data.filters)


def _steady(
    data: Experiments, records: tuple[PairRecord, ...], stiffness: GantryValue | None
) -> _Steady:
    """Holding torque and friction: only friction changes its sign with the direction.

    The axes are disabled between experiments, and the beam may then settle at another skew: with
    the stiffness between the axes, every torque is corrected for the skew that it was measured at.
    """
    n = data.shape.period_samples
    rated = np.array(data.rated_torque_nm)
    per_rad = np.zeros(2)
    off_rad = 0.0
    if stiffness is not None:
        low, high = _ends(stiffness)
        per_rad = 100.0 * stiffness.value * np.array([1.0, -1.0]) / rated
        off_rad = 0.5 * (high - low) / stiffness.value
    rows: dict[float, list[FloatArray]] = {1.0: [], -1.0: []}
    skews: list[float] = []
    for number, (record, direction) in enumerate(zip(records, data.direction, strict=True)):
        for period in record.good_periods():
            cut = slice(record.excitation.first_sample + period * n, None)
            torque = record.torque[:, cut][:, :n].mean(axis=1)
            skews.append(float(data.skew_rad[number, cut][:n].mean()))
            rows[float(np.sign(direction))].append(100.0 * torque / rated - per_rad * skews[-1])
    if min(len(each) for each in rows.values()) < 2:
        raise NotAllowed("gantry.few-samples")
    forwards, backwards = np.array(rows[1.0]), np.array(rows[-1.0])
    freedom = len(forwards) + len(backwards) - 2
    spread = float(scipy.special.stdtrit(freedom, 0.975))
    moved = off_rad * abs(float(np.mean(skews)))

    def value(weights: FloatArray, sign: float) -> GantryValue:
        a, b = forwards @ weights, backwards @ weights
        mean = 0.5 * (float(a.mean()) + sign * float(b.mean()))
        variance = 0.25 * (float(a.var(ddof=1)) / a.size + float(b.var(ddof=1)) / b.size)
        by_stiffness = moved * abs(float(per_rad @ weights)) if sign > 0 else 0.0
        # Of each torque, as far as the sum contains it.
        least = threshold.TORQUE_PERCENT * float(np.sum(np.abs(weights)))
        half = np.hypot(np.hypot(spread * np.sqrt(variance), least), by_stiffness)
        return GantryValue(value=mean, ci95=(mean - float(half), mean + float(half)))

    first, second = np.array([1.0, 0.0]), np.array([0.0, 1.0])
    # The sides oppose each other with equal torques, which are unequal shares of unequal motors.
    opposed = 0.5 * np.array([1.0, -1.0]) * rated / np.min(rated)
    return _Steady(
        (value(first, 1.0), value(second, 1.0)),
        (value(first, -1.0), value(second, -1.0)),
        value(opposed, 1.0),
    )


def _square_rev(data: Experiments, steady: _Steady, modes: CoupledModes) -> GantryValue | None:
    """Skew at which no torques oppose each other [rev]; None where the stiffness is unknown."""
    stiffness = _stiffness(modes)
    if stiffness is None or not data.torque_known:
        return None
    rated = min(data.rated_torque_nm)
    value = steady.fight.value / 100.0 * rated / stiffness.value / _TURN
    low, high = _ends(steady.fight)
    of_torque = 0.5 * (high - low) / 100.0 * rated / stiffness.value / _TURN
    low, high = _ends(stiffness)
    of_stiffness = 0.5 * (high - low) / stiffness.value * abs(value)
    half = float(np.hypot(of_torque, of_stiffness))
    return GantryValue(value=value, ci95=(value - half, value + half))


def _machine_findings(
    data: Experiments,
    steady: _Steady,
    square: GantryValue | None,
    in_mm: GantryValue | None,
    modes: CoupledModes,
) -> list[GantryFinding]:
    found = [_square_finding(steady, square, in_mm)]
    if square is None and found[0].code == "out_of_square":
        code = "no_skew_stiffness" if data.torque_known else "rated_torque_unknown"
        found.append(GantryFinding(code=code))
    skew = next((m for m in modes.modes if m.kind == "skew"), None)
    if skew is not None:
        values = {"frequency": f"{skew.frequency_hz:.3g}", "damping": f"{100 * skew.damping:.2g}"}
        found.append(GantryFinding(code="skew_mode", values=values))
    return found


def _apart(response: CoupledResponse, most: float) -> list[GantryFinding]:
    """Finding that no coupling is visible; ``most`` is the highest upper limit of its intervals."""
    low, top = response.frequency_hz[[0, -1]]
    values = {"most": f"{most:.2g}", "low": f"{low:.3g}", "top": f"{top:.3g}"}
    return [GantryFinding(code="not_coupled", values=values)]


def _distortion_findings(response: CoupledResponse) -> list[GantryFinding]:
    large = float(np.median(response.distortion)) > threshold.DISTORTED
    return [GantryFinding(code="distortion")] if large else []


def _square_finding(
    steady: _Steady, square: GantryValue | None, in_mm: GantryValue | None
) -> GantryFinding:
    low, high = _ends(steady.fight)
    least = 0.0 if low <= 0.0 <= high else min(abs(low), abs(high))
    values = {"fight": f"{abs(steady.fight.value):.3g}", "limit": f"{threshold.FIGHT_PERCENT:g}"}
    if square is None:
        values["way"] = ""
    elif in_mm is None:
        values["way"] = f"{abs(square.value):.3g} rev"
    else:
        values["way"] = f"{abs(square.value):.3g} rev ({abs(in_mm.value):.3g} mm)"
    values["ahead"], values["behind"] = ("1", "2") if steady.fight.value > 0 else ("2", "1")
    if least > threshold.FIGHT_PERCENT:
        return GantryFinding(code="out_of_square", values=values)
    if max(abs(low), abs(high)) <= threshold.FIGHT_PERCENT:
        return GantryFinding(code="square", values=values)
    return GantryFinding(code="square_uncertain", values=values)


def _loop_findings(
    response: CoupledResponse, margins: JointMargins | None, best: Design | None
) -> list[GantryFinding]:
    if margins is None:
        return [GantryFinding(code="controllers_unknown")]
    top = f"{response.frequency_hz[-1]:.3g}"
    if margins.stable is None:
        return [GantryFinding(code="margins_beyond_band", values={"top": top})]
    values = {
        "ms": f"{margins.ms:.3g}",
        "ms_high": f"{margins.ms_ci95[1]:.3g}",
        "hz": f"{margins.ms_hz:.3g}",
        "goal": f"{threshold.MS:g}",
        "alone": f"{max(margins.ms_alone):.3g}",
        "top": top,
    }
    if not margins.stable:
        found = [GantryFinding(code="pair_unstable", values=values)]
    elif margins.ms_ci95[1] <= threshold.MS:
        found = [GantryFinding(code="pair_sound", values=values)]
    else:
        found = [GantryFinding(code="pair_margin_low", values=values)]
    if best is None:
        found.append(GantryFinding(code="no_factor"))
    else:
        factor = {"factor": f"{best.factor:.2g}", "ms": f"{best.margins.ms_ci95[1]:.3g}"}
        found.append(GantryFinding(code="factor", values=factor))
    return found


def _entries(response: CoupledResponse) -> tuple[GantryEntry, ...]:
    g, std = response.response, response.std
    made = []
    for i in (0, 1):
        for j in (0, 1):
            half = response.spread * std[:, i, j] / np.maximum(np.abs(g[:, i, j]), 1e-300)
            made.append(
                GantryEntry(
                    speed=1 if i == 0 else 2,
                    torque=1 if j == 0 else 2,
                    magnitude_db=_tuple(magnitude_db(g[:, i, j])),
                    half_db=_tuple(20.0 / np.log(10.0) * half),
                    phase_deg=_tuple(phase_deg(g[:, i, j])),
                    coherence=_tuple(response.coherence[:, i, j]),
                )
            )
    return tuple(made)


def _motions(response: CoupledResponse) -> tuple[GantryMotion, GantryMotion]:
    # The motions are no better known than the entries that they are computed from.
    found = common_and_differential(response).not_better_than_known()
    both = np.einsum("kii->ki", found.response)
    half = found.spread * np.einsum("kii->ki", found.std) / np.maximum(np.abs(both), 1e-300)
    common, skew = (
        GantryMotion(
            kind=kind,
            magnitude_db=_tuple(magnitude_db(both[:, i])),
            half_db=_tuple(20.0 / np.log(10.0) * half[:, i]),
            phase_deg=_tuple(phase_deg(both[:, i])),
        )
        for i, kind in enumerate(_KINDS)
    )
    return common, skew


def _margins(found: JointMargins) -> GantryMargins:
    return GantryMargins(
        stable=found.stable,
        ms=found.ms,
        ms_ci95=found.ms_ci95,
        ms_hz=found.ms_hz,
        ms_alone=found.ms_alone,
        phase_margin_deg=found.phase_margin_deg,
        crossover_hz=found.crossover_hz,
    )


def _stiffness(modes: CoupledModes) -> GantryValue | None:
    if modes.skew_stiffness_nm_per_rad is None or modes.skew_stiffness_ci95 is None:
        return None
    return GantryValue(value=modes.skew_stiffness_nm_per_rad, ci95=modes.skew_stiffness_ci95)


def _scaled(found: GantryValue, factor: float) -> GantryValue:
    low, high = _ends(found)
    return GantryValue(value=factor * found.value, ci95=(factor * low, factor * high))


def _ends(found: GantryValue) -> tuple[float, float]:
    low, high = found.ci95
    assert low is not None, "made here with both ends"
    assert high is not None, "made here with both ends"
    return low, high


def _tuple(values: npt.NDArray[np.floating]) -> tuple[float, ...]:
    return tuple(float(each) for each in values)
