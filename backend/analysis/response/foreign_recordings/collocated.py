"""Evaluation of a response whose torque and speed belong to the same shaft (collocated).

From a torque to the speed of the same shaft a passive mechanism stays within ±90° at every
frequency (positive real); a recorded speed that lags more was filtered, or is that of another
shaft.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from backend.analysis.mechanics.mechanical_model import MechanicalModel, Mode
from backend.analysis.response.foreign_recordings.foreign import ForeignResponse
from backend.analysis.response.foreign_recordings.product_model import TURN, ProductModel
from backend.analysis.response.frf import Frf
from backend.analysis.signals.arrays import FloatArray
from backend.analysis.thresholds import collocated as threshold

_CI95 = 1.96


@dataclass(frozen=True)
class RigidPart:
    """``inertia`` of the whole axis with its interval, and ``viscous`` friction, in units of the
    input.

    The viscous part includes the equivalent of Coulomb friction at this level.
    """

    inertia: float
    inertia_ci95: tuple[float, float]
    viscous: float


@dataclass(frozen=True)
class Contradiction:
    """Where the response lags or leads more than a collocated one can."""

    phase_deg: float
    frequency_hz: float
    filter_hz: float | None
    """A real pole that the fit found in addition to friction: possibly a filter of the output."""


def without_filter(found: ForeignResponse, filter_hz: float | None) -> ForeignResponse:
    """Return the response without a first-order low-pass of the recorded output."""
    if filter_hz is None:
        return found
    from dataclasses import replace

    lag = 1.0 + 1j * found.frequency_hz / filter_hz
    return replace(found, response=np.asarray(found.response * lag))


def path_delay_s(model: ProductModel, filter_hz: float | None) -> float:
    """Return the delay between both recorded signals, s; negative where the input is recorded
    later.

    A fit may combine a lead (negative delay) with a fast real pole whose lag cancels it: within the
    lines neither exists, and only their difference is a delay.
    """
    if model.delay_s >= 0.0:
        return model.delay_s
    own = _friction_pole(model, filter_hz)
    fast = [
        c for i, c in enumerate(model.poles_hz) if i != own and c != _filter_pole(model, filter_hz)
    ]
    return min(0.0, model.delay_s + sum(1.0 / (TURN * corner) for corner in fast))


def contradiction(
    found: ForeignResponse, filter_hz: float | None, delay_s: float
) -> Contradiction | None:
    """Return where the lines refute that torque and speed belong to one shaft; None if nowhere."""
    bare = without_filter(found, filter_hz)
    f = bare.frequency_hz
    turned = np.degrees(np.angle(bare.response * np.exp(2j * np.pi * f * delay_s)))
    over = np.abs(turned) - 90.0 - threshold.TOLERATED_DEG - _CI95 * found.std_deg
    # A single line may be beyond by chance, and what is not known refutes nothing.
    window = np.ones(threshold.IN_A_ROW, dtype=np.int64)
    whole = np.convolve(over > 0, window, "valid") == threshold.IN_A_ROW
    refutes = np.flatnonzero(np.convolve(whole, window) > 0)
    if not refutes.size:
        return None
    worst = int(refutes[np.argmax(over[refutes])])
    poles = sorted(found.fit.model.poles_hz) if found.fit else []
    other = poles[1] if filter_hz is None and len(poles) > 1 else None
    return Contradiction(float(turned[worst]), float(f[worst]), other)


def rigid_part(found: ForeignResponse, filter_hz: float | None) -> RigidPart | None:
    """Return inertia and friction of the fitted model; None where no friction pole is found."""
    fit = found.fit
    if fit is None:
        return None
    pole = _friction_pole(fit.model, filter_hz)
    if pole is None or fit.model.poles_hz[pole] > threshold.HIGHEST_POLE * found.frequency_hz[0]:
        return None
    corner = fit.model.poles_hz[pole]
    gain = abs(fit.model.gain) * TURN * corner
    pick = np.zeros(fit.covariance.shape[0])
    pick[0] = pick[2 + pole] = 1.0
    for i, sign in _below_the_load(fit.model):
        # Log of (resonance / antiresonance)², by which the gain above both exceeds that below.
        gain *= fit.model.pairs[i].frequency_hz ** (2 * sign)
        pick[2 + len(fit.model.poles_hz) + 2 * i] = 2.0 * sign
    spread = float(np.sqrt(max(float(pick @ fit.covariance @ pick), 0.0)))
    # The uncertainty common to all lines, as included in the band.
    common = float(np.median(found.band.level))
    factor = float(np.exp(_CI95 * np.hypot(spread, common)))
    return RigidPart(1.0 / gain, (1.0 / (gain * factor), factor / gain), 1.0 / abs(fit.model.gain))


def _below_the_load(model: ProductModel) -> list[tuple[int, int]]:
    """Pairs (index, 1 or -1) below the first antiresonance that a load can have.

    From a torque to the speed of the same shaft an antiresonance comes first. A resonance before
    it, with its antiresonance, is an artefact of friction or noise at the lowest lines: the inertia
    is the one seen above both.
    """
    order = sorted(range(len(model.pairs)), key=lambda i: model.pairs[i].frequency_hz)
    found: list[tuple[int, int]] = []
    for one, two in zip(order[::2], order[1::2], strict=False):
        kinds = (model.pairs[one].kind, model.pairs[two].kind)
        if kinds != ("resonance", "antiresonance"):
            break
        found += [(one, 1), (two, -1)]
    return found


def _filter_pole(model: ProductModel, filter_hz: float | None) -> float | None:
    """Corner of the real pole that belongs to the stated filter."""
    if filter_hz is None or len(model.poles_hz) < 2:
        return None
    return min(model.poles_hz, key=lambda corner: abs(float(np.log(corner / filter_hz))))


def _friction_pole(model: ProductModel, filter_hz: float | None) -> int | None:
    """Index of the lowest real pole that does not belong to the filter."""
    of_filter = _filter_pole(model, filter_hz)
    rows = [(corner, i) for i, corner in enumerate(model.poles_hz) if corner != of_filter]
    return min(rows)[1] if rows else None


def mechanical_model(found: ForeignResponse, filter_hz: float | None) -> MechanicalModel | None:
    """Return the sum of a rigid part and modes that equals the product of the pairs that are modes.

    None where the pairs do not alternate as those of a collocated response do.
    """
    fit = found.fit
    rigid = rigid_part(found, filter_hz)
    if fit is None or rigid is None:
        return None
    pole = _friction_pole(fit.model, filter_hz)
    assert pole is not None
    rate = TURN * fit.model.poles_hz[pole]
    pairs = [fit.model.pairs[mode.pair] for mode in found.modes]
    poles = [p for p in pairs if p.kind == "resonance"]
    zeros = [p for p in pairs if p.kind == "antiresonance"][: len(poles)]
    order = [p.kind for p in sorted([*poles, *zeros], key=lambda p: p.frequency_hz)]
    if any(a == b for a, b in pairwise(order)) or (order and order[0] != "antiresonance"):
        return None

    def value(s: complex, skip: int) -> complex:
        out: complex = complex(1.0 / (rigid.inertia * rate))
        for zero in zeros:
            w = TURN * zero.frequency_hz
            out *= (s * s + 2 * zero.damping * w * s + w * w) / w**2
        for i, other in enumerate(poles):
            w = TURN * other.frequency_hz
            root = _root(other.frequency_hz, other.damping)
            factor = (
                (s - root.conjugate()) if i == skip else (s * s + 2 * other.damping * w * s + w * w)
            )
            out *= w**2 / factor
        return out

    modes = []
    for i, each in enumerate(poles):
        root = _root(each.frequency_hz, each.damping)
        residue = value(root, i) * rate / (root + rate)
        alpha = 2.0 * residue.real
        beta = -2.0 * (residue * root.conjugate()).real / alpha
        modes.append(Mode(each.frequency_hz, each.damping, alpha, beta))
    gain = (value(complex(-rate), -1) * rate).real
    if gain <= 0 or any(m.residue <= 0 for m in modes):
        return None
    return MechanicalModel(gain, rate, tuple(modes))


def _root(frequency_hz: float, damping: float) -> complex:
    w = TURN * frequency_hz
    return complex(-damping * w, w * float(np.sqrt(max(1.0 - damping**2, 0.0))))


def as_frf(found: ForeignResponse, filter_hz: float | None, delay_s: float, rate: float) -> Frf:
    """Return the form that designs use: without the output's filter and the delay of the path."""
    bare = without_filter(found, filter_hz)
    f: FloatArray = bare.frequency_hz
    return Frf(
        frequency_hz=f,
        response=np.asarray(bare.response * np.exp(2j * np.pi * f * delay_s)),
        std_db=found.std_db, std_deg=found.std_deg, coherence=found.coherence,
        noise=found.noise, distortion=found.distortion, sample_rate_hz=rate,
        valid_band_hz=found.valid_band_hz, periods_used=found.periods_used, periods_dropped=0,
    )  # fmt: skip
