"""Routes of the terminals: state, forcing, touch probes."""

from __future__ import annotations

import time
from typing import Annotated, Literal

from fastapi import APIRouter, Depends, Request

from backend.api.drive.models_functions import (
    ForcingInfo,
    ForcingStart,
    ForcingValues,
    IoInfo,
    ProbeRequest,
    TerminalFunction,
    TerminalInfo,
)
from backend.api.drive.models_parameters import ParameterValue
from backend.api.messages import convert
from backend.api.messages.errors import NotFound
from backend.api.requests.context import Connection, Controlled, TheBench, TheDrive
from backend.axes.drive import terminals as io_functions
from backend.axes.drive.catalog import functions_of
from backend.axes.drive.terminals import ProbeSettings, TerminalState
from backend.axes.functions.forcing import ForcingSession, ForcingSessions
from backend.station.drives.connected_drive import ConnectedDrive
from drivers.texts.message import Text, joined, text
from profiles.functions import Forcing, TerminalFacts

router = APIRouter(prefix="/drives/{drive_id}/io")
Kind = Literal["outputs", "simulation"]


async def sessions_of(request: Request) -> ForcingSessions:
    """The sessions that force terminals on this bench."""
    sessions = request.app.state.forcing
    if not isinstance(sessions, ForcingSessions):
        raise TypeError("the application was made without forcing sessions")
    return sessions


TheSessions = Annotated[ForcingSessions, Depends(sessions_of)]


@router.get("")
async def terminals(connected: TheDrive, sessions: TheSessions) -> IoInfo:
    """Read all terminals with state, function and polarity."""
    states = await io_functions.read_terminals(connected.drive)
    facts = functions_of(connected.drive.profile).terminals
    return IoInfo(
        time=convert.moment(time.time()),
        terminals=[_terminal(state, facts) for state in states],
        forcing=[
            _forcing(spec, sessions.get(connected.drive.id, spec.name))
            for spec in facts.forcing
            if not connected.drive.unreachable_why(connected.drive.parameter(spec.value.key))
        ],
        notes=facts.notes,
    )


def _terminal(state: TerminalState, facts: TerminalFacts) -> TerminalInfo:
    terminal = state.terminal
    shared = next((p for p in facts.polarities if terminal.name in p.bits), None)
    return TerminalInfo(
        name=terminal.name,
        direction=terminal.direction,
        on=state.on,
        function=state.function,
        function_name=state.function_name,
        function_key=terminal.function_key,
        functions=[
            TerminalFunction(code=f.code, name=f.name, help=f.help) for f in terminal.functions
        ],
        inverted=state.inverted,
        polarity_key=shared.key if shared else terminal.polarity_key,
        polarity_bit=shared.bits[terminal.name] if shared else None,
        same_function=list(state.same_function),
        source=terminal.source,
        notes=terminal.notes,
    )


def _forcing(spec: Forcing, session: ForcingSession | None) -> ForcingInfo:
    return ForcingInfo(
        name=spec.name,
        title=spec.title,
        help=spec.help,
        warning=spec.warning,
        terminals=list(spec.value.bits),
        two_way=spec.enable is not None or spec.name == "outputs",
        source=spec.source,
        notes=spec.notes,
        running=session is not None,
        job=session.job.id if session is not None and session.job is not None else None,
        values=dict(session.values) if session is not None else {},
    )


@router.post("/forcing/{name}")
async def start_forcing(
    bench: TheBench,
    connected: Controlled,
    sessions: TheSessions,
    name: Kind,
    request: ForcingStart,
    connection: Connection = None,
) -> ForcingInfo:
    """Begin to force terminals; the session ends if it is not renewed for five seconds."""
    session = await sessions.start(
        connected.axis, name, confirmed=request.confirmed, connection=connection
    )
    bench.journal.add(
        text("journal.forcing-begun", drive=connected.drive.name, title=session.spec.title),
        level="warning",
        drive=connected.drive.id,
    )
    return _forcing(session.spec, session)


@router.put("/forcing/{name}")
async def overrule(
    bench: TheBench,
    connected: Controlled,
    sessions: TheSessions,
    name: Kind,
    request: ForcingValues,
) -> ForcingInfo:
    """Force or release terminals; also renews the session of the page."""
    session = _running(connected, sessions, name)
    session.renew()
    if request.values:
        await session.set(request.values)
        session.renew()
        reported = joined((_line(n, v) for n, v in request.values.items()), ", ")
        bench.journal.add(
            text(
                "journal.forced",
                drive=connected.drive.name,
                title=session.spec.title,
                terminals=reported,
            ),
            level="warning",
            drive=connected.drive.id,
        )
    return _forcing(session.spec, session)


@router.delete("/forcing/{name}")
async def end_forcing(
    bench: TheBench, connected: TheDrive, sessions: TheSessions, name: Kind
) -> ForcingInfo:
    """Release all forced terminals; everybody may do this, without control of the axis."""
    session = _running(connected, sessions, name)
    await sessions.end(connected.drive.id, name)
    bench.journal.add(
        text("journal.forcing-ended", drive=connected.drive.name, title=session.spec.title),
        drive=connected.drive.id,
    )
    return _forcing(session.spec, None)


def _line(terminal: str, value: bool | None) -> Text:
    if value is None:
        return text("journal.terminal-released", terminal=terminal)
    return text("journal.terminal-on" if value else "journal.terminal-off", terminal=terminal)


def _running(connected: ConnectedDrive, sessions: ForcingSessions, name: str) -> ForcingSession:
    session = sessions.get(connected.drive.id, name)
    if session is None:
        raise NotFound(
            "api-drive.no-terminals-overruled-like", drive=connected.drive.name, value=name
        )
    return session


@router.put("/probes/{number}")
async def set_probe(
    bench: TheBench, connected: Controlled, number: int, request: ProbeRequest
) -> ParameterValue:
    """Set up a touch probe; returns 60B8h as read back."""
    reading = await io_functions.set_probe(
        connected.drive,
        number,
        ProbeSettings(
            request.on, request.continuous, request.rising, request.falling, request.source
        ),
    )
    bench.journal.add(
        text(
            "journal.touch-probe-on" if request.on else "journal.touch-probe-off",
            drive=connected.drive.name,
            number=number,
        ),
        drive=connected.drive.id,
    )
    return convert.reading(connected.drive, reading.key)
