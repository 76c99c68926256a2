"""What the response of an axis with backlash truly is: its best linear approximation.

With backlash no linear system is the truth. What a measurement with random phases converges to is
the best linear approximation for its class of excitations, E{Y·R*}/E{U·R*} over realisations with
the same amplitudes (Pintelon & Schoukens, *System Identification*, 2012, section 3.4). Here it
comes from a simulation without noise, bus, encoder or drive, made of nothing that the product uses:
the chain by Runge-Kutta in steps of 12.5 µs, contacts that cannot pull, friction as a short bristle
(Dahl), and U as the torque that friction leaves of the motor's.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from numba import njit

from backend.analysis.signals.excitation import BaseMotion, Excitation, multisine, scaled
from drivers.virtual.mechanics import MechanicsSpec

_FloatArray = npt.NDArray[np.float64]
#: Arrays and facts of a sweep, as its tool keeps them.
Raw = tuple[dict[str, npt.NDArray[np.generic]], dict[str, object]]

_STEP_S = 12.5e-6
#: Torque and speed are averaged over so many steps; their ratio does not care.
_AVERAGED = 4
#: Twist over which dry friction builds up, in rad; short next to all motion.
_BRISTLE_RAD = 2e-6
_CURRENT_RAD_S = 2 * np.pi * 1000.0
#: Pairs of realisations, numbered from where no measurement gets to.
_PAIRS, _FIRST = 16, 1000


@dataclass(frozen=True)
class Chain:
    """Inertias [n], and per coupling stiffness, damping and the whole gap [n - 1]."""

    inertia: _FloatArray
    stiffness: _FloatArray
    damping: _FloatArray
    gap: _FloatArray
    viscous: float
    coulomb: float

    @staticmethod
    def of(spec: MechanicsSpec) -> Chain:
        """What hangs on a virtual drive, without gravity and end stops."""
        loads = spec.load
        return Chain(
            np.array([spec.motor.inertia_kgm2, *(load.inertia_kgm2 for load in loads)]),
            np.array([load.stiffness_nm_per_rad for load in loads]),
            np.array([load.damping_nms_per_rad for load in loads]),
            np.array([load.backlash_rad for load in loads]),
            spec.friction.viscous_nms,
            spec.friction.coulomb_nm,
        )


def played_of(
    arrays: dict[str, npt.NDArray[np.generic]], meta: dict[str, object]
) -> tuple[Excitation, ...]:
    """What a sweep played."""
    structure, rate = meta["excitation"], float(str(meta["sample_rate_hz"]))
    assert isinstance(structure, list)
    return tuple(
        Excitation(
            samples=np.asarray(arrays[f"{number}/excitation"], np.float64),
            sample_rate_hz=rate,
            lines=np.asarray(arrays[f"{number}/lines"], np.int64),
            **{name: value for name, value in part.items() if name != "segments"},
        )
        for number, part in enumerate(structure)
    )


def best_linear(
    spec: MechanicsSpec, played: tuple[Excitation, ...], pairs: int = _PAIRS
) -> npt.NDArray[np.complex128]:
    """Torque to velocity on the lines of a multisine that was played without any loop, in Nm."""
    chain = Chain.of(spec)
    output = np.zeros(played[0].lines.size, dtype=np.complex128)
    source = output.copy()
    for number in range(2 * pairs):
        e = _alike(played, number)
        torque, speed = _moved(chain, e)
        sent = np.fft.rfft(e.one_period)[e.lines]
        output = output + speed * sent.conj()
        source = source + torque * sent.conj()
    return np.asarray(output / source, dtype=np.complex128)


def _alike(played: tuple[Excitation, ...], number: int) -> Excitation:
    """Another realisation with the amplitudes of those that were played."""
    e = played[0]
    spectra = np.array([np.fft.rfft(p.one_period) for p in played])
    sizes = np.sqrt(np.mean(np.abs(spectra[:, e.lines]) ** 2, axis=0))
    slow_nm = float(np.mean(np.abs(spectra[:, e.base_line]))) * 2 / e.period_samples
    plain = multisine(
        sample_rate_hz=e.sample_rate_hz, period_samples=e.period_samples, lines=e.lines,
        realisation=_FIRST + number // 2, invert=bool(number % 2), amplitude=sizes, iterations=80,
        integrations=2, ramp_samples=e.first_sample,
    )  # fmt: skip
    unit = float(np.linalg.norm(np.fft.rfft(plain.one_period)[e.lines]))
    size_nm = float(np.linalg.norm(sizes)) / unit
    slow_hz = e.base_line * e.sample_rate_hz / e.period_samples
    whole = multisine(
        sample_rate_hz=e.sample_rate_hz, period_samples=e.period_samples, lines=e.lines,
        realisation=_FIRST + number // 2, invert=bool(number % 2), amplitude=sizes, iterations=80,
        integrations=2, ramp_samples=e.first_sample, base=BaseMotion(slow_nm / size_nm, slow_hz),
    )  # fmt: skip
    return replace(scaled(whole, size_nm), realisation=number)


def _moved(chain: Chain, e: Excitation) -> tuple[npt.NDArray[np.complex128], ...]:
    """Spectra on the lines of the torque that friction leaves and of the motor's speed."""
    cycle = round(1.0 / (e.sample_rate_hz * _STEP_S))
    out = np.zeros((e.samples.size * cycle // _AVERAGED, 2))
    _run(
        np.asarray(e.samples, np.float64), cycle, chain.inertia, chain.stiffness, chain.damping,
        chain.gap, chain.viscous, chain.coulomb, out,
    )  # fmt: skip
    per = cycle // _AVERAGED
    first = (e.first_sample + e.transient_periods * e.period_samples) * per
    last = (e.first_sample + e.periods * e.period_samples) * per
    blocks = out[first:last].reshape(-1, e.period_samples * per, 2)
    torque, speed = np.moveaxis(np.fft.rfft(blocks, axis=1).mean(axis=0)[e.lines], 1, 0)
    return torque, speed


@njit(cache=True)
def _slopes(x, torque, inertia, stiffness, damping, gap, viscous, out):  # type: ignore[no-untyped-def]
    n = inertia.shape[0]
    for i in range(n):
        out[i] = x[n + i]
        out[n + i] = 0.0
    out[n] = torque - viscous * x[n]
    for i in range(n - 1):
        twist, half = x[i] - x[i + 1], 0.5 * gap[i]
        pull = 0.0
        if twist >= half or twist <= -half:
            side = half if twist > 0 else -half
            pull = stiffness[i] * (twist - side) + damping[i] * (x[n + i] - x[n + i + 1])
            if gap[i] > 0 and pull * twist < 0:
                pull = 0.0
        out[n + i] -= pull
        out[n + i + 1] += pull
    for i in range(n):
        out[n + i] /= inertia[i]


@njit(cache=True)
def _run(sent, cycle, inertia, stiffness, damping, gap, viscous, coulomb, out):  # type: ignore[no-untyped-def]
    n = inertia.shape[0]
    x, y = np.zeros(2 * n), np.zeros(2 * n)
    k = np.zeros((4, 2 * n))
    lag = 1.0 - np.exp(-_CURRENT_RAD_S * _STEP_S)
    torque, bend = 0.0, 0.0
    for step in range(sent.shape[0] * cycle):
        torque += lag * (sent[step // cycle] - torque)
        # The bristle's bend, exact for a speed that stays over the step; full at 1.
        before, path = bend, x[n] * _STEP_S / _BRISTLE_RAD
        end = 1.0 if path > 0 else -1.0
        bend = end + (bend - end) * np.exp(-abs(path))
        net = torque - coulomb * 0.5 * (before + bend)
        speed = x[n]
        _slopes(x, net, inertia, stiffness, damping, gap, viscous, k[0])
        for i in range(1, 4):
            part = 1.0 if i == 3 else 0.5
            for j in range(2 * n):
                y[j] = x[j] + part * _STEP_S * k[i - 1, j]
            _slopes(y, net, inertia, stiffness, damping, gap, viscous, k[i])
        for j in range(2 * n):
            x[j] += _STEP_S / 6.0 * (k[0, j] + 2.0 * (k[1, j] + k[2, j]) + k[3, j])
        place = step // _AVERAGED
        if place < out.shape[0]:
            out[place, 0] += net / _AVERAGED
            out[place, 1] += 0.5 * (speed + x[n]) / _AVERAGED
