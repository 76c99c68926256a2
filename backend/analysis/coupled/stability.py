"""Two speed loops on one machine: stability of the pair, and gains that preserve it.

L = G C, with the controllers of both axes on the diagonal of C. The pair is stable if det(I + L)
encircles the origin as often as the open loops require (generalised Nyquist criterion, MacFarlane &
Postlethwaite 1977; Skogestad & Postlethwaite, *Multivariable Feedback Control*, 2nd ed. 2005,
section 4.9). Ms is the peak of the largest singular value of (I + L)⁻¹ (section 6.3). All
statements hold for the measured lines.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.analysis.coupled.response import CoupledResponse
from backend.analysis.loop.margins import margins
from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.analysis.thresholds import coupled_stability as threshold

_TURN = 2.0 * np.pi
Interval = tuple[float, float]


@dataclass(frozen=True)
class JointMargins:
    """Margins of the pair of loops.

    ``stable`` is None where a locus is near 1 or above at the highest line, so that the band cannot
    decide it. ``ms`` is the joint peak sensitivity with its 95 % interval, ``ms_alone`` the peak of
    each axis with the other one without torque. ``phase_margin_deg`` is the smallest of both
    eigenloci, ``crossover_hz`` the highest frequency at which one falls through 1.
    """

    stable: bool | None
    ms: float
    ms_ci95: Interval
    ms_hz: float
    ms_alone: tuple[float, float]
    phase_margin_deg: float | None
    crossover_hz: float | None
    eigenloci: ComplexArray


@dataclass(frozen=True)
class Design:
    """Both axes' speed gains times ``factor``; ``at_end``: the largest factor that was tried."""

    factor: float
    margins: JointMargins
    at_end: bool


def interaction(response: ComplexArray) -> FloatArray:
    """Return |λ₁₁| [n] of the relative gain array, the relative gain of axis 1; 1 without coupling.

    λ₁₁ = 1/(1 - G₁₂G₂₁/(G₁₁G₂₂)) (Bristol 1966): the factor by which the response of an axis
    changes when the other one is held still. It does not depend on the units of either axis.
    """
    own = response[:, 0, 0] * response[:, 1, 1]
    return np.asarray(np.abs(own / (own - response[:, 0, 1] * response[:, 1, 0])))


def coupling(response: CoupledResponse) -> tuple[FloatArray, FloatArray]:
    """Return √|G₁₂G₂₁/(G₁₁G₂₂)| [n] and its deviation: the share of an axis' motion caused by the
    other's torque, 0 without coupling, 1 for one rigid body.
    """
    g = response.response
    ratio = np.sqrt(np.abs(g[:, 0, 1] * g[:, 1, 0] / (g[:, 0, 0] * g[:, 1, 1])))
    # Slope of the logarithm: half of the relative change of each entry.
    slope = 0.5 * np.array([[-1.0, 1.0], [1.0, -1.0]]) / g
    return ratio, ratio * response.slope_std(slope)


def shows_coupling(ratio: FloatArray, half: FloatArray) -> bool:
    """Whether a coupling [n] exceeds what two separate machines may show, judged by the near end of
    its 95 % interval on any line: one rigid body has 1 on the lines below its modes.
    """
    return bool(np.max(ratio - half) > threshold.COUPLED)


def joint_margins(
    response: CoupledResponse, controllers: ComplexArray, factor: float = 1.0
) -> JointMargins:
    """Return the margins of the pair; ``controllers`` [n, 2]: speed error to torque per axis."""
    f = response.frequency_hz
    c = factor * controllers
    loop = response.response * c[:, None, :]
    smallest, low, high = _distance(response, loop, c)
    worst = int(np.argmin(smallest))
    loci = eigenloci(loop)
    each = [margins(f, locus) for locus in loci.T]
    phases = [m.phase_margin_deg for m in each if m.phase_margin_deg is not None]
    crossings = [m.crossover_hz for m in each if m.crossover_hz is not None]
    alone = [float(np.max(1.0 / np.abs(1.0 + loop[:, i, i]))) for i in (0, 1)]
    return JointMargins(
        stable=is_stable(loop),
        ms=1.0 / float(smallest[worst]),
        # Any line may be the nearest one: the far end is that of the worst of them.
        ms_ci95=(1.0 / float(high[worst]), 1.0 / max(float(np.min(low)), 1e-3)),
        ms_hz=float(f[worst]),
        ms_alone=(alone[0], alone[1]),
        phase_margin_deg=min(phases, key=abs) if phases else None,
        crossover_hz=max(crossings) if crossings else None,
        eigenloci=loci,
    )


def design(
    response: CoupledResponse, controllers: ComplexArray, *, ms: float, phase_margin_deg: float
) -> Design | None:
    """Return the largest common factor for both speed gains that meets these goals at the far end
    of the intervals of all lines; None where even the smallest does not.

    Every smaller factor of the tried range is stable as well.
    """
    best: Design | None = None
    factors = np.geomspace(*threshold.FACTORS, threshold.STEPS)
    for number, factor in enumerate(factors):
        found = joint_margins(response, controllers, float(factor))
        if found.stable is False:
            break
        keeps = (
            found.stable is True
            and found.ms_ci95[1] <= ms
            and found.phase_margin_deg is not None
            and found.phase_margin_deg >= phase_margin_deg
        )
        if keeps:
            best = Design(float(factor), found, number == factors.size - 1)
    return best


def eigenloci(loop: ComplexArray) -> ComplexArray:
    """Return both eigenvalues of L [n, 2], tracked from line to line."""
    values = np.linalg.eigvals(loop)
    for k in range(1, values.shape[0]):
        straight = np.abs(np.log(values[k] / values[k - 1])).sum()
        if np.abs(np.log(values[k, ::-1] / values[k - 1])).sum() < straight:
            values[k] = values[k, ::-1]
    return np.asarray(values)


def is_stable(loop: ComplexArray) -> bool | None:
    """Apply the generalised Nyquist criterion to lines [n, 2, 2] in ascending order.

    None where a locus is near 1 or above at the highest line. Followed down from the highest line,
    where I + L is near I, the phase of det(I + L) ends at the sum of the angles of 1 + λ of both
    loci: a locus above 1 within (-270°, 90°), up to two integrators, and one below 1 (a spring
    between the axes) within ±90°.
    """
    values = np.linalg.eigvals(loop)
    if np.max(np.abs(values[-1])) >= threshold.OPEN:
        return None
    if np.max(np.abs(values)) < 1.0:
        return True
    determinant = np.prod(1.0 + values, axis=1)[::-1]
    followed = np.unwrap(np.angle(determinant))
    turned = followed[-1] - followed[0] + np.sum(np.angle(1.0 + values[-1]))
    angles = np.angle(1.0 + values[0])
    expected = np.sum(np.where(angles > 0.5 * np.pi, angles - _TURN, angles))
    return bool(abs(turned - expected) < np.pi)


def _distance(
    response: CoupledResponse, loop: ComplexArray, c: ComplexArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Smallest singular value [n] of I + L, and the ends of its 95 % interval."""
    u, s, v = np.linalg.svd(np.eye(2) + loop)
    left, right = u[:, :, 1].conj(), v[:, 1, :].conj()
    # d σ = Re(u^H dG C v)
    slope = left[:, :, None] * (c * right)[:, None, :]
    off = response.spread * response.slope_std(slope)
    return s[:, 1], s[:, 1] - off, s[:, 1] + off
