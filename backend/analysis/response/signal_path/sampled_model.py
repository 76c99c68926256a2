"""Response of continuous mechanics as an estimate from sampled signals shows it.

A sampled signal contains the true response plus its images folded back at multiples of the sample
rate. Before a continuous model is compared with a measurement it is passed through the same hold,
current loop, delay, speed or position loop and sampling (sum of images), so that images are part of
the model instead of biasing it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from backend.analysis.mechanics.mechanical_model import MechanicalModel
from backend.analysis.response.signal_path.sampling import (
    SignalPath,
    delay_response,
    hold_response,
    lag_response,
    reported_response,
)
from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.analysis.thresholds import sampled_model as threshold

TURN = 2.0 * np.pi


@dataclass(frozen=True)
class LoopModel:
    """Torque that the drive's own loop makes from the reported velocity: c0 + c1/s + c2/s²."""

    c0: float = 0.0
    c1: float = 0.0
    c2: float = 0.0

    def response(self, frequency_hz: FloatArray) -> ComplexArray:
        """Return the response from velocity to torque reference (without the current loop)."""
        s = 1j * TURN * np.asarray(frequency_hz, dtype=np.float64)
        return np.asarray(self.c0 + self.c1 / s + self.c2 / s**2, dtype=np.complex128)

    @property
    def closed(self) -> bool:
        """Whether there is a loop at all."""
        return bool(self.c0 or self.c1 or self.c2)


@dataclass(frozen=True)
class Sampler:
    """The fixed part of `seen`: everything but the mechanics, at the lines and their images.

    Arrays [images, lines]; the true lines are row ``true``. ``integrated`` is for estimates from
    the position: its spectrum times jω, so that each image is weaker by f over its own frequency.
    """

    frequency_hz: FloatArray
    true: int
    torque: ComplexArray
    reported: ComplexArray
    controller: ComplexArray
    seen_as: ComplexArray
    command: ComplexArray
    as_reported: ComplexArray

    @staticmethod
    def of(
        frequency_hz: FloatArray, path: SignalPath, loop: LoopModel, *, integrated: bool = False
    ) -> Sampler:
        """Return the sampler for these lines."""
        f = np.asarray(frequency_hz, dtype=np.float64)
        images = int(np.clip(np.ceil(threshold.HIGHEST_IMAGE_HZ / path.sample_rate_hz), 2, 6))
        all_f = f[None, :] + np.arange(-images, images + 1)[:, None] * path.sample_rate_hz
        lag = lag_response(all_f, path.current_bandwidth_hz)
        delay = delay_response(all_f, path.command_delay_s)
        controller = lag * loop.response(all_f) * delay_response(all_f, path.loop_delay_s)
        filtered = reported_response(all_f, path)
        # The loop acts on the filtered speed whichever signal is evaluated.
        seen_as = filtered
        if integrated:
            weaker = f[None, :] / all_f
            seen_as = np.asarray(weaker * delay_response(all_f, path.response_delay_s))
        command = hold_response(f, path.sample_rate_hz, path.hold) * lag[images] * delay[images]
        as_reported = seen_as[images] if integrated else filtered[images]
        return Sampler(
            all_f, images, hold_response(all_f, path.sample_rate_hz, path.hold) * lag * delay,
            filtered, controller * filtered, seen_as, command, as_reported,
        )  # fmt: skip

    def thinned(self, lines: npt.NDArray[np.int64]) -> Sampler:
        """Return the sampler for some of the lines."""
        return Sampler(
            self.frequency_hz[:, lines],
            self.true,
            self.torque[:, lines],
            self.reported[:, lines],
            self.controller[:, lines],
            self.seen_as[:, lines],
            self.command[lines],
            self.as_reported[lines],
        )

    def nearest(self, images: int) -> Sampler:
        """Return a sampler with only this number of images on each side; further ones are weak."""
        rows = slice(max(self.true - images, 0), self.true + images + 1)
        return Sampler(
            self.frequency_hz[rows],
            min(self.true, images),
            self.torque[rows],
            self.reported[rows],
            self.controller[rows],
            self.seen_as[rows],
            self.command,
            self.as_reported,
        )

    def single(self) -> Sampler:
        """Return the sampler in single precision, for ranking very many candidates."""
        parts = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "true"}
        small = {
            name: part.astype(np.float32 if name == "frequency_hz" else np.complex64)
            for name, part in parts.items()
        }
        return replace(self, **small)

    def shown(self, plants: ComplexArray, further: ComplexArray | None = None) -> ComplexArray:
        """Return the estimate [n, lines] as `seen`, for many plants [n, images,
        lines], no slopes.
        """
        seen_as = self.seen_as if further is None else self.seen_as * further
        driven = self.torque / (1.0 + self.controller * plants)
        measured = np.sum(seen_as * plants * driven, axis=-2)
        own = -np.sum(self.controller * plants * driven, axis=-2)
        return np.asarray(measured / ((self.command + own) * self.as_reported))

    def late(self, delay_s: float) -> ComplexArray:
        """Return the response of a pure delay [images, lines], by its parts of both axes."""
        lines = self.frequency_hz[self.true]
        turns = self.frequency_hz[:, 0] - lines[0]
        return np.asarray(
            delay_response(turns, delay_s)[:, None] * delay_response(lines, delay_s)[None, :]
        )

    @cached_property
    def _controlled(self) -> bool:
        """Whether a loop is closed at all."""
        return bool(np.any(self.controller))

    def seen(
        self, plant: ComplexArray, further: ComplexArray | None = None
    ) -> tuple[ComplexArray, Callable[[], tuple[ComplexArray, ComplexArray]]]:
        """Return what the direct estimate gives for this plant [images, lines].

        Also a function for its slopes [images, lines] by the plant and by ``further``, a factor in
        the path of the evaluated signal alone; they are often not needed.
        """
        seen_as = self.seen_as if further is None else self.seen_as * further
        if not self._controlled:
            command = self.command * self.as_reported
            shown = seen_as * self.torque / command
            value = np.einsum("il,il->l", shown, plant)

            def by_both() -> tuple[ComplexArray, ComplexArray]:
                return shown, np.asarray(self.seen_as * plant * self.torque / command)

            return np.asarray(value), by_both
        inner = 1.0 / (1.0 + self.controller * plant)
        driven = self.torque * inner
        moved = plant * driven
        measured = np.einsum("il,il->l", seen_as, moved)
        own = -np.einsum("il,il->l", self.controller, moved)
        whole = (self.command + own) * self.as_reported

        def slopes() -> tuple[ComplexArray, ComplexArray]:
            by_own = self.controller * (measured / whole**2 * self.as_reported)
            by_plant = driven * inner * (seen_as / whole + by_own)
            return np.asarray(by_plant), np.asarray(self.seen_as * moved / whole)

        return np.asarray(measured / whole), slopes


def seen_response(
    frequency_hz: FloatArray,
    model: MechanicalModel,
    delay_s: float,
    path: SignalPath,
    loop: LoopModel,
    *,
    position_delay_s: float | None = None,
) -> ComplexArray:
    """Return what the direct estimate (torque_mode, or torque_injection in a closed loop) would
    give.

    ``delay_s`` is the delay from torque to reported velocity beyond the one in ``path``; with
    ``position_delay_s``, that to the position, the estimate is the one from the position.
    """
    integrated = position_delay_s is not None
    sampler = Sampler.of(frequency_hz, path, loop, integrated=integrated)
    f = sampler.frequency_hz
    further = delay_response(f, (position_delay_s or 0.0) - delay_s) if integrated else None
    return sampler.seen(model.response(f) * delay_response(f, delay_s), further)[0]


@dataclass(frozen=True)
class SampledFit:
    """Mechanics and delay that explain an estimate, images included.

    ``delay_s`` [s] was found beyond the delays that the estimate already had, to the velocity and
    (``position_delay_s``) to the position; each has a standard deviation. ``error`` is the median
    relative misfit of the fitted lines, ``noise`` their median relative deviation; ``score`` is
    the information criterion, less is better, comparable between fits of the same recording.
    """

    model: MechanicalModel
    loop: LoopModel
    path: SignalPath
    delay_s: float
    delay_std_s: float
    position_delay_s: float
    position_delay_std_s: float
    error: float
    noise: float
    score: float
    valid_band_hz: tuple[float, float]

    def image_factor(self, frequency_hz: FloatArray, *, integrated: bool = False) -> ComplexArray:
        """Return what an estimate that ignores images gives, relative to the true response."""
        late = self.position_delay_s if integrated else self.delay_s
        seen = seen_response(
            frequency_hz,
            self.model,
            self.delay_s,
            self.path,
            self.loop,
            position_delay_s=late if integrated else None,
        )
        true = self.model.response(frequency_hz) * delay_response(frequency_hz, late)
        return np.asarray(seen / true, dtype=np.complex128)

    def loop_image_factor(self, frequency_hz: FloatArray) -> ComplexArray:
        """Return the sampled over the true ratio of the loop's own torque to the velocity."""
        sampler = Sampler.of(frequency_hz, self.path, self.loop)
        plant = self.model.response(sampler.frequency_hz) * delay_response(
            sampler.frequency_hz, self.delay_s
        )
        torque = sampler.torque / (1.0 + sampler.controller * plant)
        own = np.sum(sampler.controller * plant * torque, axis=0)
        velocity = np.sum(sampler.reported * plant * torque, axis=0)
        true = sampler.controller[sampler.true] / sampler.reported[sampler.true]
        return np.asarray(own / velocity / true, dtype=np.complex128)
