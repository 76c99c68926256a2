"""2×2 response from torque to speed of two axes, each within its closed speed loop.

With the setpoints as instruments, S_yr S_ur⁻¹ = Y U⁻¹ on every line, where the columns of Y and U
are the spectra of two experiments whose setpoints are independent: noise that the loops feed back
into the torques is uncorrelated with the setpoints, so it does not bias G (Pintelon & Schoukens,
*System Identification*, 2012, sections 2.7 and 7.2). Differences between periods are noise; its
covariance is propagated to the four entries.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy

from backend.analysis.signals.arrays import BoolArray, ComplexArray, FloatArray, neighbour_mean
from backend.analysis.signals.excitation import Excitation
from backend.analysis.thresholds import coupled_response as threshold


@dataclass(frozen=True)
class PairRecord:
    """One recorded experiment; arrays [2, n] by axis, ``valid`` [n] for both together.

    ``sent`` are the speed setpoints as sent, without the part that is constant over a period.
    """

    excitation: Excitation
    sent: FloatArray
    torque: FloatArray
    speed: FloatArray
    valid: BoolArray | None = None

    def good_periods(self) -> list[int]:
        """Return the numbers of the evaluated periods without a gap."""
        e = self.excitation
        numbers = range(e.transient_periods, e.periods)
        if self.valid is None:
            return list(numbers)
        n = e.period_samples
        return [p for p in numbers if np.all(self.valid[e.first_sample + p * n :][:n])]

    def spectra(self, signal: FloatArray, periods: list[int]) -> ComplexArray:
        """Return the spectra of a signal [2, n] on the excited lines: [periods, lines, 2]."""
        e = self.excitation
        n = e.period_samples
        starts = [e.first_sample + p * n for p in periods]
        cut = np.stack([signal[:, start : start + n] for start in starts])
        return np.moveaxis(np.fft.rfft(cut)[:, :, e.lines], 1, 2) * (2.0 / n)


@dataclass(frozen=True)
class Controllers:
    """Response from the error of the reported speed to the torque of each axis [n, 2], on the lines
    f and at their images fs - f.
    """

    at_line: ComplexArray
    at_image: ComplexArray


@dataclass(frozen=True)
class CoupledResponse:
    """The 2×2 response on its lines [n]; ``response`` [n, 2, 2] from torque of axis j to speed of
    axis i, in (rad/s)/Nm.

    ``covariance`` [n, 4, 4] is that of the complex entries in the order 11, 12, 21, 22 (circular:
    half of a variance is that of the real part), ``freedom`` its real degrees of freedom.
    ``distortion`` [n] is the variance between realisations relative to what the noise between
    periods explains (1 where they agree); it is contained in ``covariance``. ``unmodelled`` [n, 2,
    2] is the part of each entry's deviation that is not noise; it is contained in the diagonal of
    ``covariance`` as well. Its correlation between entries is unknown.
    """

    frequency_hz: FloatArray
    response: ComplexArray
    covariance: ComplexArray
    freedom: int
    coherence: FloatArray
    distortion: FloatArray
    periods_used: int
    periods_dropped: int
    unmodelled: FloatArray | None = None

    @cached_property
    def spread(self) -> float:
        """Factor from one deviation to half the 95 % interval of one real quantity."""
        return float(scipy.special.stdtrit(max(self.freedom, 1), 0.975))

    @property
    def std(self) -> FloatArray:
        """Standard deviation of the real (or imaginary) part of each entry [n, 2, 2]."""
        variance = np.einsum("kii->ki", self.covariance).real
        return np.asarray(np.sqrt(np.maximum(variance, 0.0) / 2.0).reshape(-1, 2, 2))

    def slope_std(self, slope: ComplexArray) -> FloatArray:
        """Return the deviation [n] of a real function of the entries with differential Re(slope ·
        dG).

        ``slope`` has the shape [n, 2, 2].
        """
        flat = slope.reshape(-1, 4)
        variance = np.einsum("ki,kij,kj->k", flat, self.covariance, flat.conj()).real
        return np.asarray(np.sqrt(np.maximum(variance, 0.0) / 2.0))

    def without_images(
        self, share: FloatArray, beyond: FloatArray, controllers: Controllers | None
    ) -> CoupledResponse:
        """Return the response without the effect of the setpoints' images on the sampled torques.

        Between two cycles the setpoints are interpolated linearly; their image at fs - f is
        ``share`` [n] of their value at f, the further images ``beyond`` [n] at most. Each loop
        converts them into torque that samples cannot distinguish from torque at f: of the sampled
        torque u', (1 + q/C) u = u' - q y with q = share C*(fs - f), as the setpoint is u/C + y.
        With ``controllers`` that is subtracted. The response of the loops to the further images is
        not known: their possible effect, G q (1/C + G) with their q, widens the covariance.
        """
        g, covariance = self.response, self.covariance
        if controllers is None:
            left = np.abs(g) * (np.abs(share) + beyond)[:, None, None]
        else:
            q = share[:, None] * controllers.at_image.conj()
            p = 1.0 / (1.0 + q / controllers.at_line)
            q = q * p
            right = np.linalg.inv(p[:, :, None] * np.eye(2) - q[:, :, None] * self.response)
            g = self.response @ right
            before = np.eye(2) + g * q[:, None, :]
            each = np.einsum("kil,kmj->kijlm", before, right).reshape(-1, 4, 4)
            covariance = each @ covariance @ np.conj(np.swapaxes(each, 1, 2))
            setpoint = np.eye(2) / controllers.at_line[:, :, None] + g
            images = np.abs(beyond[:, None] * controllers.at_image)
            left = np.sqrt(np.abs(g * images[:, None, :]) ** 2 @ np.abs(setpoint) ** 2)
        deviation = left / self.spread
        return replace(
            self, response=g, covariance=covariance + _diagonal(deviation), unmodelled=deviation
        )

    def not_better_than_known(self) -> CoupledResponse:
        """Return the response with a covariance that includes a small shift of all frequencies and
        a share of each entry: residues of images and filters are not noise.
        """
        g, f = self.response, self.frequency_hz
        shift = threshold.SHIFTED * f[:, None, None] * np.gradient(g, f, axis=0)
        left = np.hypot(np.abs(shift), threshold.FLOOR * np.abs(g))
        return replace(self, covariance=self.covariance + _diagonal(left / self.spread))

    def without_filter(self, rows: ComplexArray) -> CoupledResponse:
        """Return the response without filters [n, 2] in the speed path of each axis."""
        each = np.repeat(1.0 / rows, 2, axis=1)
        return replace(
            self,
            response=self.response / rows[:, :, None],
            covariance=self.covariance * each[:, :, None] * each.conj()[:, None, :],
            unmodelled=(
                None if self.unmodelled is None else self.unmodelled / np.abs(rows)[:, :, None]
            ),
        )

    def transformed(self, rows: FloatArray, columns: FloatArray) -> CoupledResponse:
        """Return ``rows`` G ``columns`` with its covariance; the coherence is omitted (NaN).

        Unmodelled deviations of the entries may add up: they are summed, not averaged.
        """
        each = np.kron(rows, columns.T)
        before = np.zeros(self.response.shape) if self.unmodelled is None else self.unmodelled
        after = np.abs(rows) @ before @ np.abs(columns)
        noise = self.covariance - _diagonal(before)
        return CoupledResponse(
            self.frequency_hz,
            rows @ self.response @ columns,
            each @ noise @ each.T + _diagonal(after),
            self.freedom,
            np.full_like(self.coherence, np.nan),
            self.distortion,
            self.periods_used,
            self.periods_dropped,
            after,
        )


def _diagonal(deviation: FloatArray) -> FloatArray:
    """Covariance [n, 4, 4] of complex entries with these deviations [n, 2, 2] per component."""
    return np.asarray(2.0 * (deviation.reshape(-1, 4) ** 2)[:, :, None] * np.eye(4))


def estimate(records: tuple[PairRecord, ...]) -> CoupledResponse:
    """Estimate the response from consecutive pairs of experiments with the same phases.

    Raises:
        ValueError: no pair, or a realisation has fewer than two whole periods in an experiment.
    """
    if len(records) < 2 or len(records) % 2:
        raise ValueError("a 2x2 response needs pairs of experiments")
    pairs = [_Pair.of(records[i : i + 2]) for i in range(0, len(records), 2)]
    e = records[0].excitation
    f = e.lines * (e.sample_rate_hz / e.period_samples)
    # Realisations differ in phase: each is referred to its own setpoints before the sum.
    to_speed = np.sum([pair.y @ pair.to_reference for pair in pairs], axis=0)
    to_torque = np.sum([pair.u @ pair.to_reference for pair in pairs], axis=0)
    g = to_speed @ np.linalg.inv(to_torque)
    weight = np.linalg.inv(to_torque)
    noise, freedom = _noise(pairs, g)
    covariance = np.zeros((f.size, 4, 4), np.complex128)
    for pair in pairs:
        rows = pair.to_reference @ weight
        for experiment in (0, 1):
            w = rows[:, experiment, :]
            each = np.einsum("kil,kj,km->kijlm", noise, w, w.conj()) / pair.counts[experiment]
            covariance += each.reshape(f.size, 4, 4)
    distortion = _distortion(pairs, g, noise)
    covariance *= distortion[:, None, None]
    used = sum(sum(pair.counts) for pair in pairs)
    wanted = sum((r.excitation.periods - r.excitation.transient_periods) for r in records)
    power = np.abs(g.reshape(-1, 4)) ** 2
    own = np.einsum("kii->ki", covariance).real * used
    return CoupledResponse(
        f, g, covariance, freedom, (power / np.maximum(power + own, 1e-300)).reshape(-1, 2, 2),
        distortion, used, wanted - used,
    )  # fmt: skip


@dataclass(frozen=True)
class _Pair:
    """Both experiments of one realisation: means [lines, 2 axes, 2 experiments], and all periods
    of each experiment [periods, lines, 2].
    """

    y: ComplexArray
    u: ComplexArray
    to_reference: ComplexArray
    speeds: tuple[ComplexArray, ComplexArray]
    torques: tuple[ComplexArray, ComplexArray]

    @property
    def counts(self) -> tuple[int, int]:
        """Number of periods of each experiment."""
        return self.speeds[0].shape[0], self.speeds[1].shape[0]

    @staticmethod
    def of(records: tuple[PairRecord, ...]) -> _Pair:
        """Return the spectra of a pair.

        Raises:
            ValueError: fewer than two whole periods.
        """
        good = [record.good_periods() for record in records]
        if min(len(each) for each in good) < threshold.PERIODS:
            raise ValueError("too few periods without a gap")
        both = list(zip(records, good, strict=True))
        speeds = [record.spectra(record.speed, periods) for record, periods in both]
        torques = [record.spectra(record.torque, periods) for record, periods in both]
        sent = [record.spectra(record.sent, periods) for record, periods in both]
        r = np.stack([each.mean(axis=0) for each in sent], axis=2)
        return _Pair(
            np.stack([each.mean(axis=0) for each in speeds], axis=2),
            np.stack([each.mean(axis=0) for each in torques], axis=2),
            np.linalg.inv(r),
            (speeds[0], speeds[1]),
            (torques[0], torques[1]),
        )


def _noise(pairs: list[_Pair], g: ComplexArray) -> tuple[ComplexArray, int]:
    """Covariance [lines, 2, 2] of speed minus G times torque in one period, and its freedom."""
    total = np.zeros(g.shape, np.complex128)
    count = 0
    for pair in pairs:
        for speeds, torques in zip(pair.speeds, pair.torques, strict=True):
            left = speeds - np.einsum("kij,pkj->pki", g, torques)
            left = left - left.mean(axis=0)
            total += np.einsum("pki,pkj->kij", left, left.conj())
            count += left.shape[0] - 1
    return total / count, 2 * count


def _distortion(pairs: list[_Pair], g: ComplexArray, noise: ComplexArray) -> FloatArray:
    """Variance between realisations relative to what the noise explains, at least 1 [lines].

    Nonlinear distortion repeats in every period and differs with the phases (Pintelon & Schoukens
    section 4.3). A single realisation cannot show it.
    """
    lines = g.shape[0]
    if len(pairs) < 2:
        return np.ones(lines)
    inverse = np.linalg.inv(noise)
    total, count = np.zeros(lines), 0
    for experiment in (0, 1):
        left = []
        for pair in pairs:
            mean = pair.y[:, :, experiment] - np.einsum("kij,kj->ki", g, pair.u[:, :, experiment])
            # Referred to the phase of the setpoint of axis 1, which both experiments share.
            turn = pair.to_reference[:, experiment, 0]
            scaled = np.sqrt(pair.counts[experiment]) * turn / np.abs(turn)
            left.append(mean * scaled[:, None])
        rows = np.array(left)
        rows = rows - rows.mean(axis=0)
        total += np.einsum("pki,kij,pkj->k", rows.conj(), inverse, rows).real
        count += 2 * (len(pairs) - 1)
    return np.maximum(neighbour_mean(total / count, threshold.REACH), 1.0)
