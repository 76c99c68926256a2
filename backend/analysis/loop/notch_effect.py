"""Identifies a notch in the torque path from the reported torque.

With no loop closed the same torque is played with and without the notch. The ratio of the two
reported torques is the notch, blurred by aliasing: the held setpoints contain images of every line
above half the sample rate, which pass the notch unchanged, so that a deep notch looks shallow. The
shape is therefore fitted through hold and sampling.

With a closed speed loop the reference causes the torque. There 1/T = 1/(N·C) + P, where T is the
torque per reference, C the controller, N the notch and P the mechanics (Åström & Murray, *Feedback
Systems*, 2nd ed. 2021, section 12.1). With P read as speed over torque that is T = N·C·(1 - V): the
speed V is measured, friction included, so that no model of the mechanics is needed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from backend.analysis.loop.notch import Notch
from backend.analysis.response.signal_path.sampled_model import LoopModel
from backend.analysis.response.signal_path.sampling import (
    SignalPath,
    command_response,
    delay_response,
    lag_response,
)
from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.analysis.thresholds import notch_effect as threshold


@dataclass(frozen=True)
class NotchEffect:
    """The notch that explains a measured ratio, and the residual (median, relative).

    ``deviation`` is the median standard deviation of the lines that were used; 0 where the
    measurement does not state it.
    """

    notch: Notch
    error: float
    deviation: float = 0.0


@dataclass(frozen=True)
class LoopLines:
    """Torque (Nm) and speed (rad/s) of a closed loop per unit of its reference, [lines].

    Means with their standard deviations.
    """

    torque: ComplexArray
    velocity: ComplexArray
    torque_deviation: FloatArray
    velocity_deviation: FloatArray

    @staticmethod
    def of(sent: ComplexArray, torque: ComplexArray, velocity: ComplexArray) -> LoopLines:
        """Return the means from spectra of periods: ``sent`` [lines], the others [periods, lines].

        Raises:
            ValueError: fewer than two periods, from which no noise can be estimated.
        """
        if len(torque) < 2:
            raise ValueError("fewer than two whole periods were recorded")
        (t, dt), (v, dv) = (_mean_and_deviation(x / sent) for x in (torque, velocity))
        return LoopLines(t, v, dt, dv)


def _mean_and_deviation(blocks: ComplexArray) -> tuple[ComplexArray, FloatArray]:
    count, lines = blocks.shape
    variance = np.var(blocks, axis=0, ddof=1) / count
    window = np.ones(min(threshold.ALIKE_LINES, lines))
    pooled = np.convolve(variance, window, "same") / np.convolve(np.ones(lines), window, "same")
    return np.asarray(np.mean(blocks, axis=0)), np.asarray(np.sqrt(pooled))


def seen_ratio(notch: Notch, frequency_hz: FloatArray, path: SignalPath) -> ComplexArray:
    """Return the ratio of the sampled torques with and without a notch."""
    orders = np.arange(-threshold.IMAGES, threshold.IMAGES + 1)[:, None] * path.sample_rate_hz
    f = frequency_hz[None, :] + orders
    direct = command_response(f, path)
    # The image k of a line has the phase of the line itself: the sequence is the same.
    return np.asarray(np.sum(direct * notch.response(f), axis=0) / np.sum(direct, axis=0))


def fit_effect(frequency_hz: FloatArray, ratio: ComplexArray, path: SignalPath) -> NotchEffect:
    """Fit centre, width and depth to a measured ratio of sampled torques, with no loop closed.

    Raises:
        ValueError: the ratio shows no notch.
    """
    f = np.asarray(frequency_hz, np.float64)
    one, nothing = np.ones(f.shape, np.complex128), np.zeros(f.shape, np.complex128)
    return _fitted(_Seen(f, ratio, one, nothing, ratio, np.zeros(f.shape)), path)


def fit_effect_in_loop(
    frequency_hz: FloatArray,
    plain: LoopLines,
    notched: LoopLines,
    loop: LoopModel,
    path: SignalPath,
) -> NotchEffect:
    """Fit the notch as `fit_effect` with a closed speed loop; ``loop`` is its controller without
    it.

    The torque that the reference alone causes is the torque without the notch plus the part that
    the loop subtracted for the speed. Most accurate above the crossover frequency, where that part
    is small.

    Raises:
        ValueError: the ratio shows no notch, or too few lines are accurate enough.
    """
    f = np.asarray(frequency_hz, np.float64)
    controller = (
        loop.response(f)
        * lag_response(f, path.current_bandwidth_hz)
        * delay_response(f, path.loop_delay_s)
    )
    forward = plain.torque + controller * plain.velocity
    own = controller * notched.velocity
    driven = forward - own
    size = np.abs(controller)
    noise = np.sqrt(
        plain.torque_deviation**2
        + notched.torque_deviation**2
        + size**2 * (plain.velocity_deviation**2 + notched.velocity_deviation**2)
    )
    deviation = noise / np.maximum(np.abs(driven), 1e-12)
    good = deviation < threshold.KNOWN_TO
    if np.count_nonzero(good) < threshold.LEAST_LINES:
        raise ValueError(
            f"only {np.count_nonzero(good)} lines are known to {threshold.KNOWN_TO:.0%} "
            "with the loop closed"
        )
    scale = np.abs(forward[good])
    seen = _Seen(
        f[good],
        notched.torque[good] / scale,
        forward[good] / scale,
        own[good] / scale,
        notched.torque[good] / driven[good],
        deviation[good],
    )
    found = _fitted(seen, path)
    centre = found.notch.center_hz
    about = np.count_nonzero((seen.frequency_hz > centre / 2) & (seen.frequency_hz < centre * 2))
    if about < threshold.LEAST_LINES:
        raise ValueError(
            f"only {about} lines about {centre:.0f} Hz are known to {threshold.KNOWN_TO:.0%}"
        )
    if found.error > threshold.EXPLAINED:
        raise ValueError(f"a notch leaves {found.error:.0%} of what is seen unexplained")
    return found


@dataclass(frozen=True)
class _Seen:
    """Lines of a notched torque: N·forward through hold and sampling, minus N·own of the loop.

    ``ratio`` is approximately the notch itself and gives the start values.
    """

    frequency_hz: FloatArray
    torque: ComplexArray
    forward: ComplexArray
    own: ComplexArray
    ratio: ComplexArray
    deviation: FloatArray

    def rest(self, notch: Notch, path: SignalPath) -> ComplexArray:
        """Return what a notch leaves unexplained, relative to the torque without it."""
        f = self.frequency_hz
        made = seen_ratio(notch, f, path) * self.forward - notch.response(f) * self.own
        return np.asarray(made - self.torque)


def _fitted(seen: _Seen, path: SignalPath) -> NotchEffect:
    lowest = int(np.argmin(np.abs(seen.ratio)))
    if abs(seen.ratio[lowest]) > threshold.NO_EFFECT:
        raise ValueError("the notch has no effect that can be seen in the torque")
    centre = float(seen.frequency_hz[lowest])
    # Lines that the notch attenuates strongly get more weight, noisy ones less.
    weight = 1.0 / (np.hypot(np.abs(seen.ratio), seen.deviation / 0.05) + 0.05)

    def notch_of(x: FloatArray) -> Notch:
        depth = max(-float(np.exp(x[2])), threshold.DEEPEST_DB)
        return Notch(float(np.exp(x[0])), float(np.exp(x[1])), depth)

    def rest(x: FloatArray) -> FloatArray:
        error = seen.rest(notch_of(x), path) * weight
        return np.concatenate([error.real, error.imag])

    low = np.log([0.7 * centre, 0.01 * centre, 0.3])
    high = np.log([1.4 * centre, 4.0 * centre, -threshold.DEEPEST_DB])
    fits = [
        scipy.optimize.least_squares(
            rest,
            np.log([centre, share * centre, depth]),
            bounds=(low, high),
            loss="soft_l1",
            f_scale=0.1,
            max_nfev=60,
        )
        for share in (0.05, 0.3, 1.0)
        for depth in (8.0, 25.0)
    ]
    found = notch_of(min(fits, key=lambda fit: float(fit.cost)).x)
    error = float(np.median(np.abs(seen.rest(found, path))))
    return NotchEffect(found, error, float(np.median(seen.deviation)))
