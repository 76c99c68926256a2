"""Execution of a profile's named procedures: save, restore, reset, write settings and others."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Sequence
from contextlib import AsyncExitStack, nullcontext

from backend.axes.axis.axis import Axis
from backend.axes.drive.drive import Drive
from backend.axes.motion.classes import motion_of
from backend.foundation.work.jobs import JobResult, Progress
from backend.tools.thresholds import moves_procedures as threshold
from drivers.cia402 import State
from drivers.errors import DriveError, LinkTimeout, NotAllowed, Rejected
from drivers.texts.message import Text, joined, profile_text, text
from profiles.schema import (
    ConfirmStep,
    PollStep,
    Procedure,
    ReconnectStep,
    RewriteStep,
    Step,
    WaitStep,
    WriteStep,
)


def describe(procedure: Procedure) -> list[Text]:
    """Messages that describe the steps; the ``text`` of a confirmation is a text of the profile."""
    return [_described(step) for step in procedure.steps]


def _described(step: Step) -> Text:
    match step:
        case WriteStep():
            shown = f"0x{step.raw:X}" if isinstance(step.raw, int) else step.raw
            return text("moves.step-write", key=step.key, value=shown)
        case RewriteStep():
            return text("moves.step-write-again")
        case WaitStep():
            return text("moves.step-leave-alone", time_s=step.seconds)
        case PollStep():
            return text(
                "moves.step-wait-until", key=step.key, value=step.equals, time_s=step.timeout_s
            )
        case ConfirmStep():
            return text("moves.step-confirm", text=step.text)
        case ReconnectStep():
            return text("moves.step-answers-again", time_s=step.timeout_s)


async def run_procedure(
    axis: Axis, procedure: Procedure, confirmed: bool, progress: Progress
) -> JobResult:
    """Carry out the steps in order; the first failure ends the procedure.

    Raises:
        NotAllowed: not confirmed, or the axis is enabled although it must not be.
        DriveError: a step failed; states which, and that later steps were not carried out.
    """
    drive = axis.drive
    family = drive.profile.drive
    texts = [step.text for step in procedure.steps if isinstance(step, ConfirmStep)]
    if texts and not confirmed:
        raise NotAllowed(
            "moves.needs-your-agreement",
            drive=drive.name,
            procedure_title=profile_text(family, procedure.title),
            texts=joined((profile_text(family, each) for each in texts), " "),
        )
    if procedure.requires_stop and await axis.state() is State.OPERATION_ENABLED:
        raise NotAllowed(
            "moves.possible-motor-not-enabled",
            drive=drive.name,
            procedure_title=profile_text(family, procedure.title),
        )
    described = describe(procedure)
    moves = any(_energises(drive, step) for step in procedure.steps)
    with axis.granted(profile_text(family, procedure.title)) if moves else nullcontext():
        await _carry_out(axis, procedure, described, progress)
    _remember(axis, procedure.name)
    return {
        "procedure": procedure.name,
        "steps": [step.words() for step in described],
        "step_messages": [step.to_wire() for step in described],
    }


def _energises(drive: Drive, step: Step) -> bool:
    return isinstance(step, WriteStep) and motion_of(drive.parameter(step.key)) == "energises"


async def _carry_out(
    axis: Axis, procedure: Procedure, described: Sequence[Text], progress: Progress
) -> None:
    drive = axis.drive
    async with AsyncExitStack() as left_alone:
        for number, step in enumerate(procedure.steps):
            progress(number / len(procedure.steps), described[number])
            try:
                if rest_s := _rest_from(procedure.steps, number):
                    await left_alone.enter_async_context(drive.exclusive.alone(rest_s))
                await _step(axis, step)
            except DriveError as error:
                left = len(procedure.steps) - number - 1
                error.text = text(
                    "moves.procedure-step-before-others" if left else "moves.procedure-step",
                    procedure=procedure.title,
                    number=number + 1,
                    step=described[number],
                    cause=error.text,
                    left=left,
                )
                raise
            if isinstance(step, WaitStep):
                await left_alone.aclose()


def _rest_from(steps: Sequence[Step], number: int) -> float:
    """Time without access by others to the drive, beginning with this step [s]; 0: none begins.

    It begins before the write that a wait follows: if an EP3E receives a request between the two,
    while it stores, it stores nothing (001:1212).
    """
    step, after = steps[number], steps[number + 1 : number + 2]
    if isinstance(step, WriteStep) and after and isinstance(after[0], WaitStep):
        return after[0].seconds
    begun = number > 0 and isinstance(steps[number - 1], WriteStep)
    return step.seconds if isinstance(step, WaitStep) and not begun else 0.0


async def _step(axis: Axis, step: Step) -> None:
    drive = axis.drive
    match step:
        case WriteStep():
            value = drive.check(drive.parameter(step.key), step.raw)
            if _energises(drive, step):
                await drive.command(step.key, int(value), axis.grant(step.key))
            elif isinstance(value, str):
                await drive.write(step.key, value)
            else:
                await drive.trigger(step.key, int(value))
        case RewriteStep():
            for key in sorted(drive.unsaved):
                # Read again: the drive must store what it holds, not what was read last.
                raw = (await drive.read(key)).raw
                if raw is not None and motion_of(drive.parameter(key)) != "energises":
                    await drive.write(key, raw)
        case WaitStep():
            await asyncio.sleep(step.seconds)
        case PollStep():
            await _poll(axis, step)
        case ReconnectStep():
            await _reconnect(axis, step.timeout_s)
        case ConfirmStep():
            pass


async def _poll(axis: Axis, step: PollStep) -> None:
    drive = axis.drive
    deadline = time.monotonic() + step.timeout_s
    while True:
        raw = await drive.raw(step.key)
        if raw & step.mask == step.equals & step.mask:
            return
        if raw in step.failed:
            raise Rejected(
                "moves.reads-means-failed",
                abort_code=raw,
                drive=drive.name,
                parameter=step.key,
                value=raw,
            )
        if time.monotonic() > deadline:
            raise LinkTimeout(
                "moves.still-reads-after",
                drive=drive.name,
                parameter=step.key,
                value=raw,
                limit=text("limit.within-time", wanted=str(step.equals), timeout_s=step.timeout_s),
                timeout_s=step.timeout_s,
            )
        await asyncio.sleep(threshold.POLL_S)


async def _reconnect(axis: Axis, timeout_s: float) -> None:
    """Wait until the restarting drive's status word can be read again."""
    axis.drive.forget()
    axis.forget()
    deadline = time.monotonic() + timeout_s
    await asyncio.sleep(threshold.POLL_S)
    while True:
        try:
            await axis.status_word()
        except DriveError as error:
            if time.monotonic() > deadline:
                raise LinkTimeout(
                    "moves.not-answer-after-restart", drive=axis.drive.name, timeout_s=timeout_s
                ) from error
            await asyncio.sleep(threshold.POLL_S)
        else:
            return


def _remember(axis: Axis, name: str) -> None:
    """Update the change marks after a well-known procedure."""
    drive = axis.drive
    match name:
        case "save":
            drive.mark_saved()
            drive.mark_applied("write_settings")
        case "write_settings":
            drive.mark_applied("write_settings")
            axis.forget()
        case "restore" | "reset":
            drive.forget()
            axis.forget()
        case _:
            pass
