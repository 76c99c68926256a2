"""Realisations of a speed loop, each pair weighted by what the first one showed.

A soft loop moves a heavy axis little at high frequencies, and the steps of a coarse encoder mask
it. Lines that are uncertain after the first pair receive more energy in the following ones.
"""

from __future__ import annotations

import asyncio

import numpy as np

from backend.axes.axis.axis import Axis
from backend.axes.axis.cyclic import CyclicSession
from backend.foundation.work.jobs import Progress
from backend.tools.measuring import excite
from backend.tools.measuring.repeats import Repeats
from backend.tools.tuning.sweep import speed_injection
from backend.tools.tuning.sweep.evaluation import SweepSettings
from backend.tools.tuning.sweep.plan import Setup
from backend.tools.tuning.sweep.play import Records, play_fitting, sized

#: Realisations with the same phases and opposite signs.
_PAIR = 2


async def play_informative(
    axis: Axis, session: CyclicSession, settings: SweepSettings, setup: Setup,
    sequences: tuple[excite.Sequence, ...], home: int, progress: Progress, spare: int = 0,
    repeats: Repeats | None = None,
) -> Records:  # fmt: skip
    """Play as `play_fitting`; with an excited reference, the first pair weights the following ones.

    Raises:
        NotAllowed: as `play_fitting`.
    """
    count = len(sequences)
    if not setup.by_speed or count <= _PAIR or settings.excitation == "stepped":
        return await play_fitting(
            axis, session, settings, setup, sequences, home, progress, spare, None, repeats
        )
    pair = sequences[:_PAIR]
    first = await play_fitting(
        axis, session, settings, setup, pair, home, progress, min(spare, _PAIR), (0, count),
        repeats,
    )  # fmt: skip
    further = await asyncio.to_thread(_more_informative, first, sequences[_PAIR:], settings, setup)
    return first + await play_fitting(
        axis, session, settings, setup, further, home, progress, min(spare, count - _PAIR),
        (_PAIR, count), repeats,
    )  # fmt: skip


def _more_informative(
    first: Records, further: tuple[excite.Sequence, ...], settings: SweepSettings, setup: Setup
) -> tuple[excite.Sequence, ...]:
    """Further realisations of the size that the first pair reached, weighted by its result."""
    sent = first[0][0]
    base = np.zeros(1) if sent.base is None else sent.base
    peak = float(np.max(np.abs(sent.excitation.samples - base)))
    try:
        weight = speed_injection.informative_weight(first, setup.rate)
    except ValueError:
        return further
    band = excite.band_for(setup.rate, settings.f_min_hz, settings.f_max_hz)
    shaped = speed_injection.sequences(
        setup.rate, band, setup.room, peak, settings.realisations, settings.excitation,
        base=settings.base_motion, weight=weight,
    )  # fmt: skip
    return sized(shaped[_PAIR:], 1.0, float(np.max(np.abs(base))))
