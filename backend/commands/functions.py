"""``servodeck io``, ``faults``, ``gear``, ``braking``: a drive's functions without the server."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from typing import Annotated, Literal

import typer
from pydantic import ValidationError

from backend import gear
from backend.axis import Axis
from backend.commands.session import drive_at, run, told
from backend.fault_history import PastFault, history_of, read_history
from backend.faults import active_faults, fault_keys
from backend.io_functions import TerminalState, read_terminals
from backend.mechanics_calc import GearPlan, Mechanics, plan_gear
from backend.regeneration import BrakingCycle, BrakingLimits, Resistor
from backend.regeneration import braking as braking_of
from drivers.errors import OutOfRange
from profiles import load_profile

Url = Annotated[str, typer.Argument(metavar="BUS_URL")]
Station = Annotated[int, typer.Option(help="station address on the bus")]
Profile = Annotated[str | None, typer.Option(help="drive family; recognised where possible")]
Json = Annotated[bool, typer.Option("--json", help="for scripts")]


def io(url: Url, station: Station = 1, profile: Profile = None, as_json: Json = False) -> None:
    """Show the terminals: state, function, and functions that two of them have."""

    async def work() -> None:
        async with drive_at(url, station, profile) as drive:
            states = await read_terminals(drive)
            if as_json:
                print(json.dumps([_terminal(state) for state in states], indent=1))
                return
            for state in states:
                on = "?" if state.on is None else "on" if state.on else "off"
                twins = f"  SAME AS {', '.join(state.same_function)}" if state.same_function else ""
                print(f"{state.terminal.name:6} {on:4} {state.function_name}{twins}")

    run(work)


def _terminal(state: TerminalState) -> dict[str, object]:
    return {
        "name": state.terminal.name,
        "direction": state.terminal.direction,
        "on": state.on,
        "function": state.function,
        "function_name": state.function_name,
        "inverted": state.inverted,
        "same_function": list(state.same_function),
    }


def faults(url: Url, station: Station = 1, profile: Profile = None, as_json: Json = False) -> None:
    """Show active faults, and the drive's own record where it can be read."""

    async def work() -> None:
        async with drive_at(url, station, profile) as drive:
            active = active_faults(drive, await drive.read_many(fault_keys(drive)))
            history = history_of(drive)
            readable = history is not None and history.kind != "unreadable"
            past = await read_history(Axis(drive)) if readable else []
            if as_json:
                found = {
                    "active": [fault.model_dump(mode="json") for fault in active],
                    "past": [_past(entry) for entry in past],
                }
                print(json.dumps(found, indent=1))
                return
            for fault in active:
                print(f"{fault.kind} {fault.code} {fault.name}")
                for text in fault.remedies:
                    print(f"    {text}")
            if not active:
                print("no fault is active")
            for entry in past:
                name = entry.fault.name if entry.fault else entry.error or "not in the profile"
                print(f"{entry.name}: {entry.code_text} {name}")
            if history is not None and not readable:
                print(f"the drive keeps {history.size} past faults that only its maker can read")

    run(work)


def _past(entry: PastFault) -> dict[str, object]:
    return {
        "record": entry.name,
        "code": entry.code_text,
        "name": entry.fault.name if entry.fault else None,
        "values": {reading.key: reading.value for reading in entry.values},
        "error": entry.error,
    }


@told
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
            f"{first['loc'][0]} is {first['input']}: {first['msg']}",
            value=first["input"],
            remedy="see servodeck gear --help",
        ) from error
    if station is None:
        _show(plan_gear(load_profile(drive), mechanics, None))
        if write:
            raise OutOfRange("--write needs a bus URL and --station", remedy="name the drive")
        return

    async def work() -> None:
        async with drive_at(drive, station, profile) as found:
            axis = Axis(found)
            plan = await gear.plan(axis, mechanics)
            _show(plan)
            if write:
                change = await gear.write_gear(axis, plan.values)
                print(f"written; before: {change.before}")
                for key, why in change.waits.items():
                    print(f"  {key} waits for {why}")

    run(work)


def _show(plan: GearPlan) -> None:
    for value in plan.values:
        print(f"{value.parameter.key} {value.parameter.name}: {value.raw}")
    print(f"one motor revolution: {plan.travel_per_motor_turn:.9g} {plan.unit}")
    print(f"increments per motor revolution: {plan.reached:.12g} ({plan.error_ppm:.2g} ppm off)")
    for text in plan.warnings:
        print(f"note: {text}")


@told
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
                f"{drive} has no model {model!r}; its table has {', '.join(models) or 'none'}",
                value=model,
                limit=", ".join(models) or "none",
                remedy="choose one of the listed models",
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
            raise OutOfRange(f"--{name} is {number:g}", value=number, limit="greater than 0",
                             remedy="give a number greater than 0")  # fmt: skip
    result = braking_of(BrakingCycle(inertia, speed, time, cycle, stops), limits)
    print(json.dumps(asdict(result), indent=1))
