"""Writing candidates one after another until one meets its prediction; the others are undone."""

from __future__ import annotations

from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass
from datetime import UTC, datetime

from backend.analysis.loop.design import Candidate
from backend.analysis.loop.loop_goals import Goals
from backend.axes.axis.axis import Axis
from backend.axes.axis.cyclic import CyclicSession
from backend.foundation.work.jobs import Progress
from backend.tools.measuring.interrupted import ends_all
from backend.tools.measuring.temporary import put_back_in_time, write_settings
from backend.tools.thresholds import autotune_apply as threshold
from backend.tools.tuning.autotune.design.candidates import plan
from backend.tools.tuning.autotune.time_budget import TimeLeft
from backend.tools.tuning.autotune.verification.verify import (
    HUM_PERCENT,
    Check,
    Keep,
    TorqueRipples,
    Verified,
    of_candidate,
    verify,
)
from drivers.errors import DriveError, OutOfRange
from drivers.texts.message import Text, joined, text

#: Makes a candidate with this share of the gain; None where it does not meet the margins.
Softer = Callable[[Candidate, float], Awaitable[Candidate | None]]


@dataclass(frozen=True)
class Applied:
    """The candidate in force; ``before`` holds the raw values that undo it."""

    candidate: Candidate
    verified: Verified
    before: dict[str, int]
    written: datetime | None = None
    """Time of writing; None where nothing was written."""


async def first_kept(
    axis: Axis, session: CyclicSession, check: Check, candidates: Sequence[Candidate],
    guaranteed: Goals, tried: list[Text], progress: Progress, keep: Keep | None,
    softer: Softer | None = None, time_left: TimeLeft | None = None,
) -> Applied | None:  # fmt: skip
    """Apply the first candidate that meets its prediction; ``tried`` receives why others failed.

    ``candidates`` are tried in their order. ``guaranteed`` are the requested goals; a more careful
    candidate that misses its own goals may still meet them. A candidate whose only fault is torque
    ripple, or that no raised gain can show to be sound, is tried again with less gain, made by
    ``softer``, before a slower one is tried. When
    ``time_left`` allows only one more verification, the most careful (last) candidate is used for
    it.

    Raises:
        DriveError: the drive has a fault or was disabled by others, or the link is lost; nothing
            stays written.
    """
    reported = stages(progress)
    clock = time_left or TimeLeft()
    waiting, softened = list(candidates), 0
    while waiting:
        allowed = clock.verifications()
        if allowed < 2:
            clock.left_out += len(waiting) - int(allowed)
            waiting = waiting[-1:] if allowed else []
            if not waiting:
                break
        candidate = waiting.pop(0)
        progress(0.65, text("autotune.applying", step=5, steps=6))
        try:
            raw = await plan(axis, candidate, check.inertia_kgm2, check.motor_inertia_kgm2)
        except OutOfRange as error:
            # With more gain than designed it would be another design.
            tried.append(of_candidate(candidate, error.text))
            continue
        earlier = {key: await axis.drive.raw(key) for key in raw}
        share: float | None
        # On the restore list: if this server is killed now, the next one undoes the unverified
        # values.
        with axis.drive.pending_restores.temporary(earlier):
            before = await write_settings(axis, raw)
            written = datetime.now(UTC)
            try:
                with clock.verifying():
                    verified = await verify(
                        axis, session, check, candidate, guaranteed, reported, keep, clock
                    )
            except DriveError as error:
                await take_back(axis, before)
                if await ends_all(axis, error):
                    raise
                tried.append(of_candidate(candidate, error.text))
                if not isinstance(error, TorqueRipples):
                    continue
                share = _quieter_share(error.rms_percent)
            except BaseException:
                await take_back(axis, before)
                raise
            else:
                if verified.kept:
                    return Applied(candidate, verified, before, written)
                if verified.why is not None:
                    tried.append(verified.why)
                await take_back(axis, before)
                share = _softer_share(verified)
        if softer is not None and share is not None and softened < threshold.SOFTENED:
            softened += 1
            less = await softer(candidate, share)
            if less is not None:
                waiting = _in_turn(waiting, candidate, less)
    return None


def _softer_share(verified: Verified) -> float | None:
    """Share of a failed design's gains with which it would be kept; None where it is not known."""
    if verified.hum_percent is not None:
        return _quieter_share(verified.hum_percent)
    return verified.share_to_show


def _quieter_share(rms_percent: float) -> float:
    """Share of the gains with which the axis stands quietly enough.

    The torque ripple that sensor noise causes is proportional to the gain.
    """
    return threshold.QUIETER * HUM_PERCENT / rms_percent


def _in_turn(waiting: Sequence[Candidate], hummed: Candidate, less: Candidate) -> list[Candidate]:
    """Insert ``less`` before slower candidates; drop others with more gain and the same filters."""
    gain = less.gains.speed_nms
    faster = [c for c in waiting if c.gains.speed_nms >= gain and c.filters != hummed.filters]
    return [*faster, less, *(c for c in waiting if c.gains.speed_nms < gain)]


def stages(progress: Progress) -> tuple[Progress, Progress, Progress]:
    """Progress of the three parts of a verification, as parts of the whole."""
    return (
        part(progress, 0.7, 0.72, text("autotune.verifying-standstill", step=6, steps=6)),
        part(progress, 0.72, 0.92, text("autotune.measuring-tuned-loop", step=6, steps=6)),
        part(progress, 0.92, 0.99, text("autotune.step", step=6, steps=6)),
    )


async def take_back(axis: Axis, before: dict[str, int]) -> None:
    """Restore these raw values, even while the job is being cancelled."""
    await put_back_in_time(axis, before)


@asynccontextmanager
async def nothing_stays(axis: Axis, before: dict[str, int]) -> AsyncIterator[None]:
    """Restore the values of ``before`` if an error or a cancellation leaves the context."""
    try:
        yield
    except BaseException:
        await take_back(axis, before)
        raise


def part(progress: Progress, low: float, high: float, step: Text) -> Progress:
    """Progress of one step, shown as the part from ``low`` to ``high`` of the whole."""

    def reported() -> None:
        inner = own.step
        whole = joined((step, own.step_text), ": ") if inner else step
        progress(low + (high - low) * own.fraction, whole)

    own = Progress(reported)
    return own
