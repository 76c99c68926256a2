"""``servodeck sweep`` and ``servodeck inertia``: a measurement without the page."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from backend.api.station.models import DriveSummary
from backend.axis.axis import Axis, Envelope
from backend.axis.cyclic import CyclicSession
from backend.commands.remote import Remote, remote
from backend.commands.restoring import restore_first
from backend.commands.session import drive_and_pending, progress, run_in_order
from backend.store.files import write_atomically
from drivers.errors import NotAllowed

Url = Annotated[str | None, typer.Argument(metavar="[BUS_URL]")]
Station = Annotated[int, typer.Option(help="station address on the bus")]
Profile = Annotated[str | None, typer.Option(help="drive family; recognised where possible")]
Server = Annotated[str | None, typer.Option(help="measure through this running server")]
AxisName = Annotated[str | None, typer.Option("--axis", help="the server's name of the drive")]
Out = Annotated[Path, typer.Option(help="JSON file to write")]
Cycle = Annotated[float, typer.Option(help="cycle time in ms")]
Travel = Annotated[float, typer.Option(help="longest way from the start, in revolutions")]
Speed = Annotated[float, typer.Option(help="highest speed, in rpm")]
Torque = Annotated[float, typer.Option(help="highest torque, in % of rated")]
Rated = Annotated[float | None, typer.Option(help="rated torque in Nm, if not the drive's")]
Consent = Annotated[
    bool,
    typer.Option(
        "--consent",
        help="measure although nothing in the drive ends a speed when this computer falls silent "
        "(DS_C): its travel limits are active and a hand is on the emergency stop",
    ),
]


class KindName(StrEnum):
    """What is measured."""

    mechanics = "mechanics"
    speed_loop = "speed_loop"
    position_loop = "position_loop"


class LoopName(StrEnum):
    """Which loop is closed meanwhile."""

    auto = "auto"
    none = "none"
    speed = "speed"
    position = "position"


class WaveformName(StrEnum):
    """What the axis is moved with."""

    multisine = "multisine"
    chirp = "chirp"
    prbs = "prbs"
    stepped = "stepped"


class SchemeName(StrEnum):
    """How the axis may travel."""

    free = "free"
    limited = "limited"
    taught = "taught"


def sweep(
    out: Out,
    url: Url = None,
    station: Station = 1,
    profile: Profile = None,
    server: Server = None,
    axis: AxisName = None,
    kind: KindName = KindName.mechanics,
    loop: LoopName = LoopName.auto,
    cycle_ms: Cycle = 1.0,
    travel_rev: Travel = 3.0,
    speed_rpm: Speed = 1200.0,
    torque_percent: Torque = 80.0,
    f_min_hz: Annotated[float, typer.Option(help="lowest line")] = 5.0,
    f_max_hz: Annotated[float | None, typer.Option(help="highest line")] = None,
    share: Annotated[float, typer.Option(help="excitation's share of the torque")] = 0.35,
    realisations: Annotated[int, typer.Option(help="pairs of realisations")] = 2,
    excitation: Annotated[WaveformName, typer.Option(help="signal")] = WaveformName.multisine,
    rated_torque_nm: Rated = None,
    consent: Consent = False,
) -> None:
    """Measure a frequency response and write it as JSON. The axis moves."""
    limits = {
        "travel_limit": travel_rev, "speed_limit": speed_rpm, "torque_limit": torque_percent,
        "time_limit_s": 60.0, "consent": consent,
    }  # fmt: skip
    more: dict[str, object] = {
        "kind": kind.value, "loop": loop.value, "f_min_hz": f_min_hz, "f_max_hz": f_max_hz,
        "share": share, "realisations": realisations, "rated_torque_nm": rated_torque_nm,
        "excitation": excitation.value,
    }  # fmt: skip

    async def here() -> dict[str, object]:
        # The analysis takes seconds to import; no other command shall wait for it.
        from backend.tools.sweep import evaluation as sweep_evaluation
        from backend.tools.sweep import run as sweep_tool

        settings = sweep_evaluation.SweepSettings(
            Envelope(travel_rev, speed_rpm, torque_percent, 60.0), kind.value, loop.value,
            f_min_hz, f_max_hz, share, realisations, rated_torque_nm=rated_torque_nm,
            excitation=excitation.value,
        )  # fmt: skip
        async with exchanging(url, station, profile, cycle_ms, settings.envelope, consent) as (
            found,
            session,
        ):
            return sweep_evaluation.as_json(
                await sweep_tool.sweep(found, session, settings, progress())
            )

    _measure(out, here, "sweep", server, axis, cycle_ms, limits | more)


def inertia(
    out: Out,
    url: Url = None,
    station: Station = 1,
    profile: Profile = None,
    server: Server = None,
    axis: AxisName = None,
    scheme: SchemeName = SchemeName.free,
    end_low_rev: Annotated[float | None, typer.Option(help="taught end")] = None,
    end_high_rev: Annotated[float | None, typer.Option(help="taught end")] = None,
    cycle_ms: Cycle = 1.0,
    travel_rev: Travel = 3.0,
    speed_rpm: Speed = 1200.0,
    torque_percent: Torque = 80.0,
    repetitions: Annotated[int, typer.Option(help="moves forth and back")] = 4,
    rated_torque_nm: Rated = None,
    motor_inertia_kgm2: Annotated[float | None, typer.Option(help="of the motor alone")] = None,
    consent: Consent = False,
) -> None:
    """Measure inertia and friction and write them as JSON. The axis moves."""
    ends = taught_ends(end_low_rev, end_high_rev)
    request: dict[str, object] = {
        "travel_limit": travel_rev, "speed_limit": speed_rpm, "torque_limit": torque_percent,
        "time_limit_s": 60.0, "consent": consent, "scheme": scheme.value, "ends_rev": ends,
        "repetitions": repetitions, "rated_torque_nm": rated_torque_nm,
        "motor_inertia_kgm2": motor_inertia_kgm2,
    }  # fmt: skip

    async def here() -> dict[str, object]:
        from backend.tools.inertia import evaluation as inertia_evaluation
        from backend.tools.inertia.run import inertia as measure_inertia

        settings = inertia_evaluation.InertiaSettings(
            Envelope(travel_rev, speed_rpm, torque_percent, 60.0), scheme.value, ends,
            repetitions=repetitions, rated_torque_nm=rated_torque_nm,
            motor_inertia_kgm2=motor_inertia_kgm2,
        )  # fmt: skip
        async with exchanging(url, station, profile, cycle_ms, settings.envelope, consent) as (
            found,
            session,
        ):
            return inertia_evaluation.as_json(
                await measure_inertia(found, session, settings, progress())
            )

    _measure(out, here, "inertia", server, axis, cycle_ms, request)


@asynccontextmanager
async def exchanging(
    url: str | None, station: int, profile: str | None, cycle_ms: float, envelope: Envelope,
    consent: bool,
) -> AsyncIterator[tuple[Axis, CyclicSession]]:  # fmt: skip
    """The drive with its bus exchanging process data, all of it ended afterwards."""
    from backend.commands.scales import take_taught
    from backend.tools.sweep import profile_speed

    if url is None:
        raise NotAllowed("command.give-bus-url-server")
    async with drive_and_pending(url, station, profile) as (drive, pending):
        axis = Axis(drive)
        await restore_first(axis, pending)
        await take_taught(axis)
        link = drive.ports[0].link
        by_speed = {drive.id} if profile_speed.needed(drive, link) else set[str]()
        session = CyclicSession(link, [drive], by_speed)
        await session.start(cycle_ms / 1e3)
        axis.session = session
        try:
            with axis.granted("measurement from the command line", envelope):
                async with profile_speed.prepared(axis, session, envelope, consent):
                    yield axis, session
        finally:
            axis.session = None
            await session.stop()


def _measure(
    out: Path, here: object, tool: str, server: str | None, axis: str | None, cycle_ms: float,
    request: dict[str, object],
) -> None:  # fmt: skip
    async def work() -> None:
        if server is not None:
            answer = await through_server(server, axis, tool, cycle_ms, request)
        else:
            assert callable(here)
            answer = await here()
        write_atomically(out, json.dumps(answer, indent=1).encode())
        for line in _told(tool, answer):
            print(line)
        print(f"written: {out}")

    run_in_order(work)


def _told(tool: str, answer: dict[str, object]) -> list[str]:
    if tool == "inertia":
        return [
            f"inertia {_shown(answer['inertia_kgm2'])} kg·m²  friction "
            f"{_shown(answer['coulomb_nm'])} Nm + {_shown(answer['viscous_nms'])} Nm·s  load "
            f"{_shown(answer['gravity_nm'])} Nm",
            *_told_beside(answer),
            f"verdict: {answer['verdict']}",
        ]
    rows = answer["resonances"]
    lines = [
        f"{row['kind']:14} {row['frequency_hz']:8.1f} Hz  damping {row['damping']:.3f}"
        for row in (rows if isinstance(rows, list) else [])
    ]
    warnings = answer["warnings"]
    return lines + [f"note: {w}" for w in (warnings if isinstance(warnings, list) else [])]


def _told_beside(answer: dict[str, object]) -> list[str]:
    """Torques beside inertia and friction, where some are found."""
    words = {
        "place_nm": "position-dependent torque (spring, arm, imbalance)",
        "fan_nm": "torque by the square of the speed (fan, pump)",
    }
    return [
        f"{text}: up to {_shown(answer[key])} Nm"
        for key, text in words.items()
        if answer.get(key) is not None
    ]


def _shown(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else "not known"


async def through_server(
    server: str, name: str | None, tool: str, cycle_ms: float, request: dict[str, object]
) -> dict[str, object]:
    """Run the job on a server and wait for it; its own bus exchange is started where needed."""
    async with remote(server) as at:
        drive = await drive_of(at, name)
        return await at.result(f"/drives/{drive.id}/jobs/{tool}", request | {"cycle_ms": cycle_ms})


async def drive_of(at: Remote, name: str | None) -> DriveSummary:
    """The server's drive of this name or id.

    Raises:
        NotAllowed: there is none; the message lists those that are.
    """
    drives = await at.drives()
    drive = next((d for d in drives if name in (d.name, d.id)), None)
    if drive is None:
        names = ", ".join(d.name for d in drives) or "none"
        raise NotAllowed("command.no-drive", value=name, limit=names, address=at.address)
    return drive


def taught_ends(low_rev: float | None, high_rev: float | None) -> tuple[float, float] | None:
    """Both ends, or none of them.

    Raises:
        typer.BadParameter: only one is given.
    """
    if low_rev is None or high_rev is None:
        if low_rev is not None or high_rev is not None:
            raise typer.BadParameter("give both --end-low-rev and --end-high-rev, or none of them")
        return None
    return low_rev, high_rev
