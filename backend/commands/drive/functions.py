"""``servodeck io``, ``faults``, ``gear``, ``braking``: functions of a drive."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from typing import Annotated, Literal, Protocol

import typer
from pydantic import ValidationError

from backend.axes.functions.regeneration import BrakingCycle, BrakingLimits, Resistor
from backend.axes.functions.regeneration import braking as braking_of
from backend.axes.scales.gear_calculator import Mechanics, plan_gear
from backend.commands.base.options import Json, Place, Profile, Server, Station, Url, place
from backend.commands.base.printing import print_text, words_of
from backend.commands.base.session import reporting_errors, run
from backend.commands.drive import local_functions, remote_functions
from backend.commands.drive.function_answers import Faults, Gear, Terminal, of_plan
from drivers.errors import OutOfRange
from drivers.texts import limits as limit_texts
from drivers.texts.message import language
from drivers.texts.profile_words import ProfileWords
from drivers.texts.validation import reason_of
from profiles import load_profile


class _Functions(Protocol):
    """Interface of `local_functions` and `remote_functions`."""

    async def terminals(self, place: Place) -> tuple[str, list[Terminal]]: ...

    async def faults(self, place: Place) -> Faults: ...

    async def gear(self, place: Place, mechanics: Mechanics, *, write: bool) -> Gear: ...


def _by(where: Place) -> _Functions:
    """The functions for a bus opened here, or those for a server."""
    return local_functions if where.server is None else remote_functions


def io(
    url: Url,
    station: Station = 1,
    profile: Profile = None,
    as_json: Json = False,
    server: Server = None,
) -> None:
    """Show the terminals: state, function, and functions that two of them have."""

    async def work() -> None:
        where = place(url, station, profile, server)
        family, states = await _by(where).terminals(where)
        if as_json:
            print(json.dumps([state._asdict() for state in states], indent=1))
            return
        say = ProfileWords(family, language())
        for state in states:
            function = say(state.function_name)
            on = "?" if state.on is None else words_of("printed.on" if state.on else "printed.off")
            twins = ""
            if state.same_function:
                same = ", ".join(state.same_function)
                twins = f"  {words_of('printed.same-function', terminals=same)}"
            print(f"{state.name:6} {on:4} {function}{twins}")

    run(work)


def faults(
    url: Url,
    station: Station = 1,
    profile: Profile = None,
    as_json: Json = False,
    server: Server = None,
) -> None:
    """Show active faults, and the drive's own record where it can be read."""

    async def work() -> None:
        where = place(url, station, profile, server)
        found = await _by(where).faults(where)
        if as_json:
            active = [fault.model_dump(mode="json") for fault in found.active]
            past = [entry._asdict() for entry in found.past]
            print(json.dumps({"active": active, "past": past}, indent=1))
            return
        say = ProfileWords(found.family, language())
        for fault in found.active:
            kind = words_of("printed.warning" if fault.kind == "warning" else "printed.fault")
            print(f"{kind} {fault.code} {say(fault.name)}")
            for remedy in fault.remedies:
                print(f"    {say(remedy)}")
        if not found.active:
            print_text("printed.no-fault-active")
        for entry in found.past:
            name = say(entry.name) if entry.name else entry.error
            print(f"{entry.record}: {entry.code} {name or words_of('printed.not-in-profile')}")
        if found.hidden:
            print_text("printed.faults-hidden", count=found.hidden)

    run(work)


@reporting_errors
def gear_command(
    drive: Annotated[str, typer.Argument(help="drive family, or a bus URL with --station")],
    kind: Annotated[Literal["screw", "belt", "rack", "rotary"], typer.Option()],
    station: Annotated[int | None, typer.Option(help="ask the drive at this station")] = None,
    profile: Profile = None,
    lead: Annotated[float | None, typer.Option(help="screw: mm per turn")] = None,
    diameter: Annotated[float | None, typer.Option(help="belt: pulley diameter in mm")] = None,
    pitch: Annotated[float | None, typer.Option(help="belt, rack: mm per tooth")] = None,
    module: Annotated[float | None, typer.Option(help="rack: module of the pinion in mm")] = None,
    teeth: Annotated[int | None, typer.Option(help="teeth of pulley or pinion")] = None,
    motor_turns: Annotated[int, typer.Option(help="gearbox: turns of the motor …")] = 1,
    load_turns: Annotated[int, typer.Option(help="… for so many of the load")] = 1,
    resolution: Annotated[float, typer.Option(help="mm or degrees of one increment")] = 0.001,
    write: Annotated[bool, typer.Option("--write", help="write it, read back")] = False,
    server: Server = None,
) -> None:
    """Electronic gear for a screw, belt, rack or rotary table; writes only with --write."""
    try:
        mechanics = Mechanics(
            kind=kind, lead_mm=lead, diameter_mm=diameter, pitch_mm=pitch, module_mm=module,
            teeth=teeth, motor_turns=motor_turns, load_turns=load_turns, resolution=resolution,
        )  # fmt: skip
    except ValidationError as error:
        first = error.errors()[0]
        raise OutOfRange(
            "command.detail",
            value=first["input"],
            first=first["loc"][0],
            other_first=first["input"],
            first3=reason_of(first),
        ) from error
    if station is None:
        _show(of_plan(plan_gear(load_profile(drive), mechanics, None), drive))
        if write:
            raise OutOfRange("command.write-needs-bus-url")
        return

    async def work() -> None:
        where = place(drive, station, profile, server)
        _show(await _by(where).gear(where, mechanics, write=write))

    run(work)


def _show(plan: Gear) -> None:
    say = ProfileWords(plan.family, language())
    for key, name, raw in plan.values:
        print(f"{key} {say(name)}: {raw}")
    print_text("printed.gear-travel", travel=f"{plan.travel_per_motor_turn:.9g}", unit=plan.unit)
    print_text(
        "printed.gear-increments", increments=f"{plan.reached:.12g}", ppm=f"{plan.error_ppm:.2g}"
    )
    for text in plan.warnings:
        print_text("printed.note", words=text)
    if plan.before is not None:
        print_text("printed.gear-written", before=str(plan.before))
        for key, why in (plan.waits or {}).items():
            print_text("printed.waits-for", key=key, why=str(why))


@reporting_errors
def braking(
    inertia: Annotated[float, typer.Option(help="motor and load, kg·m²")],
    speed: Annotated[float, typer.Option(help="before braking, rpm")],
    time: Annotated[float, typer.Option(help="braking time, s")],
    cycle: Annotated[float, typer.Option(help="cycle time, s")],
    stops: Annotated[float, typer.Option(help="stops in a cycle")] = 2,
    drive: Annotated[str | None, typer.Option(help="drive family, with --model")] = None,
    model: Annotated[str | None, typer.Option(help="model of the family's table")] = None,
    voltage: Annotated[float | None, typer.Option(help="threshold voltage, V")] = None,
) -> None:
    """Energy of braking, and the resistor that it takes."""
    limits = BrakingLimits(on_voltage_v=voltage)
    if drive is not None:
        regen = load_profile(drive).functions.regeneration
        models = {each.model: each for each in regen.models} if regen else {}
        if model not in models:
            raise OutOfRange(
                "command.no-model-table",
                value=model,
                limit=limit_texts.one_of(", ".join(models)),
                drive_name=drive,
                models=", ".join(models) or "none",
            )
        row = models[model]
        built_in = None
        if row.resistance_ohm is not None and row.power_w is not None:
            built_in = Resistor(row.resistance_ohm, row.power_w)
        limits = BrakingLimits(
            row.capacitor_j or 0.0, built_in, row.min_external_ohm, row.max_external_w, voltage
        )
    given = {"inertia": inertia, "speed": speed, "time": time, "cycle": cycle, "stops": stops}
    for name, number in (given | ({} if voltage is None else {"voltage": voltage})).items():
        if not 0 < number < math.inf:
            raise OutOfRange(
                "command.give-number", value=number, limit=limit_texts.above_zero(), name=name
            )
    result = braking_of(BrakingCycle(inertia, speed, time, cycle, stops), limits)
    print(json.dumps(asdict(result), indent=1))
