"""The drive's own identification of motor and load, started by a bit of the control word."""

from __future__ import annotations

import asyncio
import time
from dataclasses import dataclass

from backend.axis.axis import Axis, Envelope
from backend.work.jobs import JobResult, Progress
from drivers import cia402
from drivers.cia402 import Mode, State
from drivers.errors import LinkTimeout, NotAllowed, Rejected
from profiles.functions import DriveIdentification

_POLL_S = 0.02
#: The drive must show within this time that it has begun.
_BEGIN_S = 2.0


@dataclass(frozen=True, slots=True)
class IdentifySettings:
    """Travel in rev from the start point; ``confirmed``: the profile's warning was agreed to."""

    envelope: Envelope
    confirmed: bool


def require_identification(axis: Axis) -> DriveIdentification:
    """How this family identifies by itself.

    Raises:
        NotAllowed: it does not, or its manual does not say how it is started.
    """
    spec = axis.drive.profile.functions.identification
    if spec is None:
        raise NotAllowed(
            f"{axis.drive.name}: {axis.drive.profile.title} has no identification that can be "
            "started from here",
            drive=axis.drive.name,
            remedy="identify the inertia on the Tune page",
        )
    return spec


async def identify(axis: Axis, settings: IdentifySettings, progress: Progress) -> JobResult:
    """Let the drive identify; power state and mode are as before afterwards.

    The values that it found replace those of the motor, which is what the drive does; they are
    read back, and given with those from before.

    Raises:
        NotAllowed: not agreed to, left Operation enabled, or travel beyond the envelope.
        Rejected: the drive reports an error. LinkTimeout: it does not begin or end in time.
    """
    drive = axis.drive
    spec = require_identification(axis)
    if not settings.confirmed:
        raise NotAllowed(
            f"{drive.name}: the identification needs your agreement: {spec.warning}",
            drive=drive.name,
            remedy="read the text and confirm",
        )
    before = {key: r.raw for key, r in (await drive.read_many(spec.keys)).items()}
    word = cia402.ENABLE_OPERATION
    async with axis.enabled(Mode.PP, settings.envelope):
        await axis.control(word | 1 << spec.control_bit)
        try:
            await _until_done(axis, spec, settings, progress)
        finally:
            if not axis.stopped:
                await axis.control(word)
    after = {key: r.raw for key, r in (await drive.read_many(spec.keys)).items()}
    changed = {key: [before[key], raw] for key, raw in after.items() if raw != before[key]}
    return {"changed": changed}


async def _until_done(
    axis: Axis, spec: DriveIdentification, settings: IdentifySettings, progress: Progress
) -> None:
    drive, units = axis.drive, await axis.units()
    names = drive.parameter(spec.status_key).enum
    began = time.monotonic()
    start = await axis.position_raw()
    busy = False
    limit = settings.envelope
    while True:
        elapsed = time.monotonic() - began
        if drive.decode_state(await axis.status_word()) is not State.OPERATION_ENABLED:
            causes = "; ".join(await axis.blocked_by()) or "it left Operation enabled"
            raise NotAllowed(
                f"{drive.name} broke off the identification: {causes}",
                drive=drive.name,
                remedy="see the Alarms page",
            )
        status = await drive.raw(spec.status_key)
        name = names.get(status, str(status))
        busy = busy or (status not in spec.done and status not in spec.failed and status != 0)
        if busy and status in spec.done:
            return
        if busy and status in spec.failed:
            raise Rejected(
                f"{drive.name}: the drive reports that its identification failed",
                code=status,
                drive=drive.name,
                parameter=spec.status_key,
                value=status,
                remedy="check the load, the travel that it may use, and its limits",
            )
        if not busy and elapsed > _BEGIN_S:
            raise LinkTimeout(
                f"{drive.name} does not begin its identification (state: {name})",
                drive=drive.name,
                parameter=spec.status_key,
                remedy="its firmware may want another mode; use the Tune page instead",
            )
        travelled = abs(units.position(await axis.position_raw() - start))
        if travelled > limit.travel_rev:
            raise NotAllowed(
                f"{drive.name} travelled {travelled:.4g} rev in its identification",
                drive=drive.name,
                limit=f"{limit.travel_rev:g} rev",
                remedy="allow more travel, or give the drive fewer revolutions",
            )
        if elapsed > limit.time_s:
            raise LinkTimeout(
                f"{drive.name}: the identification took longer than {limit.time_s:g} s",
                drive=drive.name,
                remedy="allow more time",
            )
        progress(min(0.95, elapsed / limit.time_s), name)
        await asyncio.sleep(_POLL_S)
