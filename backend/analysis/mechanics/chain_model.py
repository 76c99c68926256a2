"""Mechanics as a chain of inertias, driven and measured at the first.

Any load on a motor has the same response there as such a chain (Gladwell, *Inverse Problems in
Vibration*, 2004, ch. 4: a spectrum and the residues at one end determine it), so inertias,
stiffnesses and dampings are the smallest parameter set that covers all possible responses and no
others. Parameters x: log J of the motor, log of its viscous friction, two delays and log of the
speed filter's corner (these belong to the path), and per load log J, log k and log d.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from backend.analysis.mechanics.mechanical_model import (
    MODE_PARAMETERS,
    RIGID_PARAMETERS,
    TURN,
    MechanicalModel,
    Mode,
)
from backend.analysis.signals.arrays import ComplexArray, FloatArray

LOAD_PARAMETERS = 3


def loads_of(x: FloatArray) -> FloatArray:
    """Return inertia, stiffness and damping [loads, 3] of the parameters."""
    return np.asarray(np.exp(x[RIGID_PARAMETERS:]).reshape(-1, LOAD_PARAMETERS))


def chain_response_and_slopes(
    x: FloatArray, frequency_hz: FloatArray
) -> tuple[ComplexArray, Callable[[], ComplexArray]]:
    """Return the response from torque to velocity [...], and a function for its slopes
    [n parameters, ...] (zero for the path), which are often not needed.

    Calculated from the far end towards the motor by impedances: an inertia is sJ, a coupling k/s +
    d in series with everything behind it.
    """
    s = 1j * TURN * np.asarray(frequency_hz, dtype=np.float64)
    per_s = 1.0 / s
    loads = loads_of(x)
    behind = np.zeros_like(s)
    parts: list[tuple[ComplexArray, ComplexArray]] = []
    for inertia, stiffness, damping in loads[::-1]:
        coupling = stiffness * per_s + damping
        inertial = s * inertia
        hanging = inertial + behind
        through = coupling / (coupling + hanging)
        parts.append((through, inertial))
        behind = through * hanging
    motor, viscous = np.exp(x[0]), np.exp(x[1])
    response = 1.0 / (s * motor + viscous + behind)

    def slopes() -> ComplexArray:
        out = np.zeros((x.size, *s.shape), dtype=np.complex128)
        outwards = -(response**2)
        out[0] = outwards * s * motor
        out[1] = outwards * viscous
        for i, (through, inertial) in enumerate(reversed(parts)):
            place = RIGID_PARAMETERS + LOAD_PARAMETERS * i
            by_coupling = outwards * (1.0 - through) ** 2
            outwards = outwards * through**2
            out[place] = outwards * inertial
            out[place + 1] = by_coupling * loads[i, 1] * per_s
            out[place + 2] = by_coupling * loads[i, 2]
        return out

    return np.asarray(response), slopes


def model_of_chain(x: FloatArray) -> MechanicalModel:
    """Return the chain's poles and residues at the motor (passive, so residues are positive)."""
    loads, motor, viscous = loads_of(x), float(np.exp(x[0])), float(np.exp(x[1]))
    n = len(loads)
    size = 1 + 2 * n  # speed of the motor, then per load twist and speed
    a = np.zeros((size, size))
    a[0, 0] = -viscous / motor
    inertias = [motor, *loads[:, 0]]
    speeds = [0, *(2 + 2 * i for i in range(n))]
    for i, (_, stiffness, damping) in enumerate(loads):
        twist, before, behind = 1 + 2 * i, speeds[i], speeds[i + 1]
        a[twist, before], a[twist, behind] = 1.0, -1.0
        for row, sign, inertia in ((before, -1, inertias[i]), (behind, 1, inertias[i + 1])):
            a[row, twist] += sign * stiffness / inertia
            a[row, before] += sign * damping / inertia
            a[row, behind] -= sign * damping / inertia
    poles, right = (part.astype(np.complex128) for part in np.linalg.eig(a))
    left = np.linalg.inv(right)
    residues = right[0, :] * left[:, 0] / motor
    return _from_poles(poles, residues)


def _from_poles(poles: ComplexArray, residues: ComplexArray) -> MechanicalModel:
    """Pole pairs as modes; real poles as the rigid part (the slowest) and as overdamped modes."""
    real = np.abs(poles.imag) <= 1e-9 * np.maximum(np.abs(poles), 1e-12)
    order = np.flatnonzero(real)[np.argsort(-poles[real].real)]
    rigid, rest = order[0], order[1:]
    modes = [
        _mode(poles[i], np.conj(poles[i]), residues[i], np.conj(residues[i]))
        for i in np.flatnonzero(~real)
        if poles[i].imag > 0
    ]
    pairs = zip(rest[::2], rest[1::2], strict=True)
    modes += [_mode(poles[i], poles[j], residues[i], residues[j]) for i, j in pairs]
    return MechanicalModel(
        float(residues[rigid].real),
        float(-poles[rigid].real),
        tuple(sorted(modes, key=lambda m: m.frequency_hz)),
    )


def _mode(p: complex, q: complex, a: complex, b: complex) -> Mode:
    """a/(s - p) + b/(s - q) as one mode."""
    w = float(np.sqrt((p * q).real))
    top = (a + b).real
    return Mode(
        w / TURN, float(-(p + q).real / (2 * w)), float(top), float(-(a * q + b * p).real / top)
    )


def modal_start(x: FloatArray) -> FloatArray:
    """Return a chain's parameters in the modal form (:func:`mechanical_model.model_of`)."""
    model = model_of_chain(x)
    out = [np.log(model.gain), np.log(max(model.pole_rad_s, 1e-6)), *x[2:RIGID_PARAMETERS]]
    for m in model.modes:
        part = m.zero_rad_s / (TURN * m.frequency_hz)
        out += [
            np.log(m.frequency_hz),
            np.log(min(m.damping, 0.99)),
            np.log(max(m.residue, 1e-12)),
            part,
        ]
    assert (len(out) - RIGID_PARAMETERS) % MODE_PARAMETERS == 0
    return np.array(out)


def with_load(x: FloatArray, place: int, new: tuple[float, float, float, float]) -> FloatArray:
    """Return the parameters with one more load.

    ``new`` contains the new inertia at ``place`` (0 is the motor), and J, k and d of the load that
    is attached to it; everything that was attached there is attached to the new load.
    """
    loads = [tuple(row) for row in loads_of(x)]
    motor = float(np.exp(x[0]))
    if place == 0:
        motor = new[0]
    else:
        loads[place - 1] = (new[0], *loads[place - 1][1:])
    loads.insert(place, new[1:])
    return np.concatenate([[np.log(motor)], x[1:RIGID_PARAMETERS], np.log(loads).ravel()])


def responses_with_load(
    x: FloatArray, place: int, new: FloatArray, frequency_hz: FloatArray
) -> ComplexArray:
    """Return the responses [n, lines] of `with_load` for many ``new`` [n, 4] at once.

    The precision is that of ``frequency_hz``: single precision suffices for ranking many
    candidates.
    """
    frequency_hz = np.asarray(frequency_hz)
    s = 1j * TURN * frequency_hz
    loads = [tuple(float(v) for v in row) for row in loads_of(x)]
    inertias = [float(np.exp(x[0])), *(load[0] for load in loads)]

    def hung(
        inertia: FloatArray | float,
        stiffness: FloatArray | float,
        damping: FloatArray | float,
        behind: ComplexArray,
    ) -> ComplexArray:
        coupling, hanging = stiffness / s + damping, s * inertia + behind
        return np.asarray(coupling * hanging / (coupling + hanging))

    behind: ComplexArray = np.zeros_like(s)
    for i in range(len(loads), place, -1):
        behind = hung(inertias[i], loads[i - 1][1], loads[i - 1][2], behind)
    columns = np.asarray(new.T, dtype=frequency_hz.dtype)
    kept, inertia, stiffness, damping = (column[:, None] for column in columns)
    front = s * kept + hung(inertia, stiffness, damping, behind)
    for i in range(place, 0, -1):
        coupling = loads[i - 1][1] / s + loads[i - 1][2]
        front = s * inertias[i - 1] + coupling * front / (coupling + front)
    return np.asarray(1.0 / (front + float(np.exp(x[1]))))


def chain_of_modes(
    gain: float, frequency_hz: FloatArray, residue: FloatArray, viscous: float, damping: float
) -> FloatArray:
    """Return the parameters (path left zero) of the chain with these undamped modes.

    All couplings get the same damping ratio.

    Lanczos' recursion from the motor gives the tridiagonal matrix that has these poles and
    residues (Gladwell, section 4.3); its entries are k and J of one coupling after the other.

    Raises:
        ValueError: modes that coincide, or that have no part in the response.
    """
    order = np.argsort(frequency_hz)
    poles = np.concatenate([[0.0], (TURN * frequency_hz[order]) ** 2])
    weights = np.concatenate([[gain], residue[order]])
    if np.any(weights <= 0):
        raise ValueError("a mode without any part in the response")
    v = np.sqrt(weights / np.sum(weights))
    inertia = 1.0 / float(np.sum(weights))
    before, beta, stiffness = np.zeros_like(v), 0.0, 0.0
    out = [np.log(inertia), np.log(viscous), *np.zeros(RIGID_PARAMETERS - 2)]
    for _ in range(frequency_hz.size):
        alpha = float(v @ (poles * v))
        rest = poles * v - alpha * v - beta * before
        beta = float(np.linalg.norm(rest))
        stiffness = alpha * inertia - stiffness
        if beta <= 0 or stiffness <= 0 or inertia <= 0:
            raise ValueError("two modes are one, as far as numbers go")
        before, v = v, rest / beta
        inertia = stiffness**2 / (beta**2 * inertia)
        d = 2.0 * damping * np.sqrt(stiffness * inertia)
        out += [np.log(inertia), np.log(stiffness), np.log(d)]
    return np.array(out)
