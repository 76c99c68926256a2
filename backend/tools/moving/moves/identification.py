"""The drive's own identification of motor and load, started by a bit of the control word."""

from __future__ import annotations

import asyncio
import time
from dataclasses import dataclass

from backend.axes.axis.axis import Axis, Envelope
from backend.foundation.work.jobs import JobResult, Progress
from backend.tools.thresholds import moves_identification as threshold
from drivers import cia402
from drivers.cia402 import Mode, State
from drivers.errors import LinkTimeout, NotAllowed, Rejected
from drivers.texts.message import Text, joined, text
from profiles.functions import DriveIdentification, IdentificationState

_STATES: dict[IdentificationState, Text] = {
    "idle": text("moves.identification-idle"),
    "preparation": text("moves.identification-preparation"),
    "resistance": text("moves.identification-resistance"),
    "ready_for_inductance": text("moves.identification-ready-for-inductance"),
    "inductance_d": text("moves.identification-inductance-d"),
    "inductance_q": text("moves.identification-inductance-q"),
    "sensor_bias": text("moves.identification-sensor-bias"),
    "torque_constant": text("moves.identification-torque-constant"),
    "torque_constant_limited": text("moves.identification-torque-constant-limited"),
    "inertia": text("moves.identification-inertia"),
    "inertia_again": text("moves.identification-inertia-again"),
    "inertia_limited": text("moves.identification-inertia-limited"),
    "complete": text("moves.identification-complete"),
    "homing": text("moves.identification-homing"),
    "acceleration_design": text("moves.identification-acceleration-design"),
    "error_handling": text("moves.identification-error-handling"),
    "error": text("moves.identification-error"),
    "waiting": text("moves.identification-waiting"),
    "jog_homing": text("moves.identification-jog-homing"),
}


@dataclass(frozen=True, slots=True)
class IdentifySettings:
    """Travel in rev from the start; ``confirmed``: a person agreed to the profile's warning."""

    envelope: Envelope
    confirmed: bool


def require_identification(axis: Axis) -> DriveIdentification:
    """The identification function of this family.

    Raises:
        NotAllowed: it has none, or its manual does not state how it is started.
    """
    spec = axis.drive.profile.functions.identification
    if spec is None:
        raise NotAllowed(
            "moves.no-identification-started",
            drive=axis.drive.name,
            profile_title=axis.drive.profile.title,
        )
    return spec


def state_of(spec: DriveIdentification, status: int) -> Text:
    """Meaning of a value of the status object; the value itself where the profile has none."""
    state = spec.states.get(status)
    return text("moves.identification-status", value=status) if state is None else _STATES[state]


async def identify(axis: Axis, settings: IdentifySettings, progress: Progress) -> JobResult:
    """Let the drive identify motor and load; power state and mode are restored afterwards.

    The drive itself replaces its motor data by the identified values; they are read back and
    returned with the previous values.

    Raises:
        NotAllowed: not confirmed, left Operation enabled, or travel beyond the envelope.
        Rejected: the drive reports an error.
        LinkTimeout: it does not begin or end in time.
    """
    drive = axis.drive
    spec = require_identification(axis)
    if not settings.confirmed:
        raise NotAllowed(
            "moves.identification-needs-your-agreement", drive=drive.name, warning=spec.warning
        )
    before = {key: r.raw for key, r in (await drive.read_many(spec.keys)).items()}
    word = cia402.ENABLE_OPERATION
    async with axis.enabled(Mode.PP, settings.envelope):
        await axis.control(word | 1 << spec.control_bit)
        try:
            await _until_done(axis, spec, settings, progress)
        finally:
            if not axis.stopped and drive.authority.may_move(drive.id):
                await axis.control(word)
    after = {key: r.raw for key, r in (await drive.read_many(spec.keys)).items()}
    changed = {key: [before[key], raw] for key, raw in after.items() if raw != before[key]}
    return {"changed": changed}


async def _until_done(
    axis: Axis, spec: DriveIdentification, settings: IdentifySettings, progress: Progress
) -> None:
    drive, units = axis.drive, await axis.units()
    began = time.monotonic()
    start = await axis.position_raw()
    busy = False
    limit = settings.envelope
    while True:
        elapsed = time.monotonic() - began
        if drive.decode_state(await axis.status_word()) is not State.OPERATION_ENABLED:
            causes = joined(await axis.blocked_by() or [text("axis.cause-left-enabled")])
            raise NotAllowed("moves.broke-off-identification", drive=drive.name, causes=causes)
        status = await drive.raw(spec.status_key)
        state = state_of(spec, status)
        busy = busy or (status not in spec.done and status not in spec.failed and status != 0)
        if busy and status in spec.done:
            return
        if busy and status in spec.failed:
            raise Rejected(
                "moves.drive-reports-identification-failed",
                abort_code=status,
                drive=drive.name,
                parameter=spec.status_key,
                value=status,
            )
        if not busy and elapsed > threshold.BEGIN_S:
            raise LinkTimeout(
                "moves.not-begin-identification-state",
                drive=drive.name,
                parameter=spec.status_key,
                name=state,
            )
        travelled = abs(units.position(await axis.position_raw() - start))
        if travelled > limit.travel_rev:
            raise NotAllowed(
                "moves.travelled-rev-identification",
                drive=drive.name,
                limit=f"{limit.travel_rev:g} rev",
                travelled_rev=travelled,
            )
        if elapsed > limit.time_s:
            raise LinkTimeout(
                "moves.identification-took-longer", drive=drive.name, time_s=limit.time_s
            )
        progress(min(0.95, elapsed / limit.time_s), state)
        await asyncio.sleep(threshold.POLL_S)
