"""Load, Coulomb, viscous and Stribeck friction from torques at constant speeds.

T(v) = Tg + sign(v)·(Tc + Ts·exp(-(|v|/vs)^δ)) + b·v (Armstrong-Hélouvry, Dupont, Canudas de Wit,
"A survey of models, analysis tools and compensation methods for the control of machines with
friction", 1994). For each vs and δ of a grid it is linear; the interval of a value spans all
pairs that the data do not distinguish from the best one. Any units: torque and speed as given.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from backend.analysis.signals.arrays import FloatArray
from backend.analysis.thresholds import stribeck as threshold


@dataclass(frozen=True)
class Fit:
    """Load, Coulomb, viscous and, where ``speed`` (vs) is not None, Stribeck torque; deviations."""

    values: FloatArray
    deviations: FloatArray
    squares: float
    speed: float | None = None
    exponent: float = 1.0

    def at(self, speed: FloatArray) -> FloatArray:
        """Return the torque [n] at signed speeds."""
        return np.asarray(_columns(speed, self.speed, self.exponent) @ self.values)

    def slope(self, speed: float) -> float:
        """Return the slope of torque over speed at a signed speed other than 0, over 2 % of it."""
        near = self.at(speed * np.array([0.99, 1.01]))
        return float((near[1] - near[0]) / (0.02 * speed))


@dataclass(frozen=True)
class SpeedModel:
    """Points [n] with half their intervals, the best fit, and all fits that are equally good."""

    speed: FloatArray
    torque: FloatArray
    half: FloatArray
    best: Fit
    alike: tuple[Fit, ...]
    speeds: int

    @property
    def enough(self) -> bool:
        """Whether there are enough speeds to look for a Stribeck curve."""
        return self.speeds >= threshold.FEWEST

    @property
    def reached(self) -> bool:
        """Whether the speeds were low enough to determine the height of the Stribeck curve."""
        if self.best.speed is None:
            return False
        least = float(np.min(np.abs(self.speed)))
        return bool(np.exp(-((least / self.best.speed) ** self.best.exponent)) >= threshold.NEAR)

    def value(self, index: int) -> tuple[float, float, float]:
        """Return load, Coulomb, viscous or Stribeck torque (0 to 3) with its 95 % interval."""
        freedom = max(self.speed.size - self.best.values.size, 1)
        times = float(scipy.special.stdtrit(freedom, 0.975))
        values = np.array([each.values[index] for each in self.alike])
        spread = times * np.array([each.deviations[index] for each in self.alike])
        return (
            float(self.best.values[index]),
            float(np.min(values - spread)),
            float(np.max(values + spread)),
        )

    def stribeck_speed(self) -> tuple[float, float, float]:
        """Return the speed at which the Stribeck curve has fallen to 1/e, with its 95 % interval.

        Raises:
            ValueError: no Stribeck curve was found.
        """
        if self.best.speed is None:
            raise ValueError("no Stribeck curve was found")
        speeds = [each.speed for each in self.alike if each.speed is not None]
        # Half a step of the grid is not distinguished.
        size = np.abs(self.speed)
        half = (size.max() / size.min()) ** (0.5 / (threshold.GRID - 1))
        return self.best.speed, float(min(speeds) / half), float(max(speeds) * half)

    def misfit(self) -> float:
        """Return the largest relative torque error of a point beyond chance; 0 if none."""
        off = np.abs(self.torque - self.best.at(self.speed))
        size = np.abs(self.torque)
        beyond = off > np.maximum(threshold.BEYOND * self.half, threshold.SHARE * size)
        return float(np.max(off[beyond] / np.maximum(size[beyond], 1e-12))) if beyond.any() else 0.0

    def curve(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return signed speeds and torques of a curve through all points, over the measured speeds
        only.

        Between two points it follows the model.
        """
        left, speeds, values = self.torque - self.best.at(self.speed), [], []
        for sign in (-1.0, 1.0):
            side = np.sign(self.speed) == sign
            size = np.abs(self.speed[side])
            order = np.argsort(size)
            at = np.geomspace(size.min(), size.max(), threshold.CURVE)
            remainder = np.interp(np.log(at), np.log(size[order]), left[side][order])
            back = slice(None, None, -1 if sign < 0 else 1)
            speeds += (sign * at)[back].tolist()
            values += (self.best.at(sign * at) + remainder)[back].tolist()
        return tuple(speeds), tuple(values)


def speed_model(speed: FloatArray, torque: FloatArray, half: FloatArray) -> SpeedModel:
    """Return the model of torques [n] at signed speeds [n], ``half`` [n] half their 95 % intervals.

    It includes a Stribeck curve only where the points support it (F test, 99 %).
    """
    weight = 1.96 / half
    plain, speeds = _fit(speed, torque, weight, None, 1.0), speed.size // 2
    without = SpeedModel(speed, torque, half, plain, (plain,), speeds)
    freedom = speed.size - 6
    if speeds < threshold.FEWEST or freedom < 1:
        return without
    size = np.abs(speed)
    grid = np.geomspace(0.5 * size.min(), 0.5 * size.max(), threshold.GRID)
    fits = [
        _fit(speed, torque, weight, vs, exponent) for vs in grid for exponent in threshold.EXPONENTS
    ]
    fits = [each for each in fits if each.values[3] > 0.0]
    if not fits:
        return without
    best = min(fits, key=lambda each: each.squares)
    gained = (plain.squares - best.squares) / 3.0 / max(best.squares / freedom, 1e-12)
    if gained < float(scipy.special.fdtri(3, freedom, 0.99)):
        return without
    limit = best.squares + threshold.ALIKE * max(1.0, best.squares / freedom)
    alike = tuple(each for each in fits if each.squares <= limit)
    return SpeedModel(speed, torque, half, best, alike, speeds)


def _columns(speed: FloatArray, stribeck: float | None, exponent: float) -> FloatArray:
    sign = np.sign(speed)
    columns = [np.ones(speed.size), sign, speed]
    if stribeck is not None:
        columns.append(sign * np.exp(-((np.abs(speed) / stribeck) ** exponent)))
    return np.column_stack(columns)


def _fit(
    speed: FloatArray,
    torque: FloatArray,
    weight: FloatArray,
    stribeck: float | None,
    exponent: float,
) -> Fit:
    columns = _columns(speed, stribeck, exponent) * weight[:, None]
    scale = np.max(np.abs(columns), axis=0)
    values = np.linalg.lstsq(columns / scale, torque * weight, rcond=None)[0]
    left = torque * weight - columns / scale @ values
    squares = float(left @ left)
    freedom = max(speed.size - values.size, 1)
    spread = np.linalg.pinv((columns / scale).T @ (columns / scale)) * max(1.0, squares / freedom)
    return Fit(values / scale, np.sqrt(np.diag(spread)) / scale, squares, stribeck, exponent)
