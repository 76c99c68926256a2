"""Frequency response of an axis over a bus with cyclic process data.

*mechanics*: torque to velocity, either with no loop (CST) or by torque offsets added to a closed
speed (CSV) or position loop (CSP), as a vertical or limited axis needs. *speed_loop* and
*position_loop*: from the loop's own reference to the motion of the axis.
"""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, replace

from backend.axes.axis.axis import Axis
from backend.axes.axis.cyclic import CyclicSession
from backend.foundation.work.jobs import Progress
from backend.tools.measuring.axis_facts import AxisFacts, read_facts
from backend.tools.measuring.computing import meanwhile
from backend.tools.measuring.recording import require_signals, takes_torque
from backend.tools.measuring.repeats import Repeats
from backend.tools.measuring.temporary import stopping_hard, temporary
from backend.tools.mechanics.inertia.probe import PULLED, Probed, holding_torque, probe_axis
from backend.tools.moving.moves.go_back import go_back
from backend.tools.tool import Keep, Run, Tool
from backend.tools.tuning.notch import filters as notch_tool
from backend.tools.tuning.sweep.adaptive import play_informative
from backend.tools.tuning.sweep.evaluation import SweepResult, SweepSettings, evaluate
from backend.tools.tuning.sweep.plan import (
    Setup,
    check,
    chosen_loop,
    held_by_loop,
    sequences_of,
    setup_of,
)
from backend.tools.tuning.sweep.play import MODE_OF, Records, scaled_by_speed
from backend.tools.tuning.sweep.result import SweepAnswer
from backend.tools.tuning.sweep.settings import SweepRequest
from backend.tools.tuning.sweep.stored import answer_of, raw_of, reevaluate
from backend.tools.tuning.sweep.texts import TEXTS, report
from drivers.cia402 import Mode, State
from drivers.errors import NotAllowed, exceeded
from drivers.halt import HaltCause
from drivers.texts.message import reason_of, text


async def sweep(
    axis: Axis,
    session: CyclicSession,
    settings: SweepSettings,
    progress: Progress,
    keep: Keep | None = None,
    repeats: Repeats | None = None,
) -> SweepResult:
    """Measure; ``keep`` receives the raw data.

    ``repeats`` limits the time for repeating realisations that lost samples; without it they are
    always repeated.

    Raises:
        OutOfRange: invalid settings; nothing has moved.
        NotAllowed: the axis cannot be measured in this way, or the envelope ended the motion;
            states
            the reason.
        LinkLost: samples were lost; nothing is concluded from the rest.
    """
    check(settings)
    await axis.require_certain_scales()
    if settings.hold is None and axis.drive.id in session.by_speed:
        # Profile velocity without ramps: the reference is constant between two cycles.
        settings = replace(settings, hold="zero")
    loop = {"speed_loop": "speed", "position_loop": "position"}.get(settings.kind, settings.loop)
    if loop == "auto" and (settings.excitation == "stepped" or not takes_torque(axis, session)):
        loop = "speed"
    facts = await read_facts(axis, settings.rated_torque_nm)
    home = await axis.position_raw()
    filters = await filters_off(axis, settings)
    async with temporary(axis, filters), stopping_hard(axis, settings.envelope.speed_rpm):
        probed: Probed | None = None
        if loop in ("auto", "none"):
            require_signals(axis, session, Mode.CST, False)
            progress(0.0, text("sweep.looking-load-pulls-axis"))
            held = await holding_torque(axis, session, facts)
            if abs(held) > PULLED * facts.rated_torque_nm:
                loop = held_by_loop(axis, settings.loop, held)
            else:
                progress(0.02, text("sweep.feeling-axis-small-torque"))
                probed = await probe_axis(
                    axis,
                    session,
                    settings.envelope,
                    facts,
                    home,
                    settings.inertia_kgm2,
                    moved_before=settings.inertia_deviation is not None,
                )
                loop = chosen_loop(axis, settings, probed)
        how = _Sweep(axis, session, settings, facts, home, probed, repeats)
        try:
            setup, records = await how.measured(loop, progress)
        except NotAllowed as error:
            # A static load torque that friction hides appears when the axis turns.
            ran_away = exceeded(error) is HaltCause.POSITION
            if (
                loop != "none"
                or settings.loop != "auto"
                or not ran_away
                or await axis.state() is State.FAULT
            ):
                raise
            await go_back(axis, session, home, settings.envelope, facts)
            setup, records = await how.measured("speed", progress)
    progress(0.95, text("sweep.going-back-evaluating"))

    def evaluated() -> SweepResult:
        return evaluate(
            records, setup.rate, facts, settings, setup.loop, _dc(session), setup.by_speed,
            setup.integral_hz,
        )  # fmt: skip

    async def back() -> None:
        # First of all, so that the measurement is not lost if the way back fails.
        if keep is not None:
            keep(f"sweep-{settings.kind}", *raw_of(records, setup, settings, dc=_dc(session)))
        await go_back(axis, session, home, settings.envelope, facts)

    try:
        return await meanwhile(evaluated, back())
    except ValueError as error:
        raise NotAllowed(
            "sweep.recording-cannot-evaluated", drive=axis.drive.name, cause=reason_of(error)
        ) from error


@dataclass(frozen=True)
class _Sweep:
    """Data that is known before a loop is chosen."""

    axis: Axis
    session: CyclicSession
    settings: SweepSettings
    facts: AxisFacts
    home: int
    probed: Probed | None
    repeats: Repeats | None

    async def measured(self, loop: str, progress: Progress) -> tuple[Setup, Records]:
        """Play everything with one loop."""
        axis, session, settings, home = self.axis, self.session, self.settings, self.home
        setup = await setup_of(axis, session, settings, self.facts, loop, self.probed)
        in_loop = settings.kind == "mechanics" and setup.loop != "none" and not setup.by_speed
        require_signals(axis, session, MODE_OF[setup.loop], in_loop)
        progress(0.08, text("sweep.designing-excitation"))
        sequences = await asyncio.to_thread(sequences_of, setup, settings)
        if setup.by_speed:
            progress(0.09, text("sweep.feeling-how-much-torque"))
            sequences = await scaled_by_speed(
                axis, session, settings, setup, sequences, home, progress
            )
        # A stepped sine takes too long to be repeated.
        spare = 0 if settings.excitation == "stepped" else len(sequences)
        return setup, await play_informative(
            axis, session, settings, setup, sequences, home, progress, spare, self.repeats
        )


async def filters_off(axis: Axis, settings: SweepSettings) -> dict[str, int]:
    """Values that switch off notches and torque filter, which lie in the path of the torque.

    Mechanics are measured without them. In a family without an enable bit, a notch is switched off
    by the value of its frequency.
    """
    if settings.kind != "mechanics" or not settings.notches_off:
        return {}
    drive, off = axis.drive, dict[str, int]()
    for number, slot in enumerate(drive.profile.notch.slots if drive.profile.notch else ()):
        if slot.enable_key is not None and slot.enable_bit is not None:
            # The other bits switch filters that belong to the loop in operation.
            if not drive.unreachable_why(drive.parameter(slot.enable_key)):
                before = off.get(slot.enable_key, await drive.raw(slot.enable_key))
                off[slot.enable_key] = before & ~(1 << slot.enable_bit)
        elif slot.enable_key is not None:
            off[slot.enable_key] = 0
        else:
            off |= notch_tool.encode(drive.profile, drive.name, number, None, None).raw
    gains = drive.profile.gains
    if gains is not None and gains.torque_filter is not None:
        low, _high = drive.parameter(gains.torque_filter).raw_limits
        if low == 0:
            off[gains.torque_filter] = 0
    reachable = {k: v for k, v in off.items() if not drive.unreachable_why(drive.parameter(k))}
    return {key: raw for key, raw in sorted(reachable.items()) if await drive.raw(key) != raw}


def _dc(session: CyclicSession) -> bool:
    return session.synchronous


async def run(run: Run, request: SweepRequest) -> SweepAnswer:
    """Run `sweep` for the descriptor."""
    return answer_of(
        await sweep(run.axis, run.session, request.inner, run.progress, run.keep, run.repeats)
    )


TOOL = Tool(
    kind="sweep",
    title=text("sweep.title"),
    settings=SweepRequest,
    result=SweepAnswer,
    run=run,
    reevaluate=reevaluate,
    report=report,
    texts=TEXTS,
)
