"""The second encoder of a virtual drive, as 60E4h reports it (CiA 402-2, object 60E4h)."""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING

import numpy as np

from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.mechanics.load_encoder import LoadEncoderSpec
from profiles.schema import Profile

if TYPE_CHECKING:
    from drivers.virtual.firmware.axis import VirtualAxis

KEY = "60E4:01"
_KEPT = 64


def without_load_encoder(profile: Profile, encoder: LoadEncoderSpec | None) -> Profile:
    """Return the profile without 60E4h, for a drive without a second encoder."""
    if encoder is not None:
        return profile
    kept = tuple(p for p in profile.parameters if p.index != 0x60E4)
    if len(kept) == len(profile.parameters):
        return profile
    keys = {p.key for p in kept}
    signals = tuple(signal for signal in profile.signals if signal.key in keys)
    return profile.model_copy(update={"parameters": kept, "signals": signals})


class LoadEncoder:
    """Counts of the last inertia, with error over a revolution, noise and quantisation."""

    def __init__(self, axis: VirtualAxis, spec: LoadEncoderSpec) -> None:
        self._axis, self._spec = axis, spec
        self._random = np.random.default_rng(0x10AD)
        self._step = -1.0
        self._past: deque[tuple[float, int]] = deque(maxlen=_KEPT)
        self._counts = 0

    def __call__(self) -> int:
        """Return the present 60E4h; constant within one step of 50 µs."""
        step = self._axis.s.item(k.S_STEP)
        if step == self._step:
            return self._counts
        self._step = step
        self._past.append((step, self._sampled()))
        oldest = step - self._spec.late_s / k.STEP_S
        self._counts = next(
            (counts for at, counts in reversed(self._past) if at <= oldest), self._past[0][1]
        )
        return self._counts

    def _sampled(self) -> int:
        spec = self._spec
        angle = self._axis.load_angle_rad / spec.gear
        angle += spec.eccentricity_rad * math.sin(angle + spec.phase_rad)
        angle += spec.second_rad * math.sin(2.0 * angle + spec.phase_rad)
        counts = angle * spec.counts_per_rev / (2.0 * math.pi)
        if spec.noise_counts:
            counts += spec.noise_counts * float(self._random.standard_normal())
        sense = -1 if spec.inverted else 1
        return sense * math.floor(counts) + spec.offset_counts
