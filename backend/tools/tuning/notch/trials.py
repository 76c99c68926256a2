"""Values of a notch that are tried to measure its effect, and how long that takes."""

from __future__ import annotations

from dataclasses import dataclass

from backend.axes.drive.drive import Drive
from backend.tools.thresholds import notch_trials as threshold
from backend.tools.tuning.notch.steps import hz_steps
from profiles.schema import NotchSlot

BEFORE = threshold.BEFORE


@dataclass(frozen=True)
class Trial:
    """Values of one slot to try: levels or Hz."""

    width: int
    depth: int | None


def trials_of(drive: Drive, slot: NotchSlot, centre: int) -> list[Trial]:
    """Values that show the effect of width and depth, the necessary ones first."""
    if slot.depth_key is None:
        return [Trial(round(share * centre), None) for share in threshold.WIDTHS]
    low_w, high_w = limits_of(drive, slot.width_key)
    low_d, high_d = limits_of(drive, slot.depth_key)
    middle = round(0.5 * (low_w + high_w))
    span = high_d - low_d
    deepest, deep, *others = (round(low_d + part * span) for part in (0.0, 0.08, 0.2, 0.4, 0.7))
    narrow, wide = (round(low_w + part * (high_w - low_w)) for part in (0.15, 1.0))
    least = [(middle, deepest), (middle, others[0]), (wide, deep), (middle, others[2])]
    further = [(narrow, deep), (middle, others[1]), (middle, deep)]
    return [Trial(width, depth) for width, depth in (*least, *further)]


def least_of(slot: NotchSlot) -> int:
    """Number of trials, from the first, that are necessary."""
    return threshold.LEAST_WIDTHS if slot.depth_key is None else threshold.LEAST_LEVELS


def least_s(drive: Drive) -> float:
    """Approximate duration of the necessary trials [s]."""
    slot = _slot(drive)
    return 0.0 if slot is None else threshold.TRIAL_S * (BEFORE + least_of(slot))


def every_s(drive: Drive) -> float:
    """Approximate duration of all useful trials, with a closed loop [s]."""
    slot = _slot(drive)
    return 0.0 if slot is None else threshold.TRIAL_S * (BEFORE + len(trials_of(drive, slot, 1)))


def _slot(drive: Drive) -> NotchSlot | None:
    return drive.profile.notch.slots[0] if drive.profile.notch is not None else None


def limits_of(drive: Drive, key: str | None) -> tuple[int, int]:
    """Lowest and highest raw value of a parameter."""
    low, high = drive.parameter(key or "").raw_limits
    return int(low or 0), int(high or 0)


def raw_of(drive: Drive, slot: NotchSlot, centre_hz: int, trial: Trial) -> dict[str, int]:
    """Raw values of a trial.

    Raises:
        Unsuitable: the unit of its frequency or width is not known.
    """
    raw: dict[str, int] = {}
    if slot.frequency_key is not None:
        raw[slot.frequency_key] = hz_steps(drive.parameter(slot.frequency_key)).nearest(centre_hz)
    if slot.width_key is not None:
        in_hz = slot.depth_key is None
        steps = hz_steps(drive.parameter(slot.width_key)) if in_hz else None
        raw[slot.width_key] = steps.nearest(trial.width) if steps else trial.width
    if slot.depth_key is not None and trial.depth is not None:
        raw[slot.depth_key] = trial.depth
    return raw
