"""The command line: ``servodeck …``.

Only the command that is run is imported: server and analysis take seconds, and a list of the
commands none of that.
"""

from __future__ import annotations

import importlib
import io
import os
import sys
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from backend import __version__
from drivers.texts.message import Language, language, language_of, speak

COMMANDS = {
    "serve": ("server.start:serve", "Start the server and the web page."),
    "demo": (
        "server.start:demo",
        "Start the server on a bench of virtual drives: no hardware, no root.",
    ),
    "virtual": ("buses.virtual:virtual", "Run one virtual drive on a real wire, for any client."),
    "scan": ("buses.scan:scan", "Look for drives on a bus."),
    "bus": ("buses.bus:app", "What goes over the wires of a bus."),
    "doctor": (
        "buses.doctor:doctor",
        "Why a drive does not reach Operational. Nothing moves.",
    ),
    "conformance": (
        "buses.conformance:conformance",
        "Which rules of the public standards a slave keeps. Never enables; nothing moves.",
    ),
    "eeprom": (
        "buses.eeprom:app",
        "The EEPROM of an EtherCAT drive: save, compare, restore, alias, identity.",
    ),
    "lss": (
        "buses.lss:app",
        "Node number and bit rate of a CANopen node that has none, or by its identity (CiA 305).",
    ),
    "params": ("drive.params:app", "Read and write parameters on a bus, or by a running server."),
    "jog": (
        "drive.live:jog",
        "Turn an axis for as long as this command runs. It moves; Ctrl+C stops it.",
    ),
    "scope": (
        "drive.live:scope",
        "Record signals of one drive or several into a CSV file. Nothing moves.",
    ),
    "io": (
        "drive.functions:io",
        "Show the terminals: state, function, and functions that two of them have.",
    ),
    "faults": (
        "drive.functions:faults",
        "Show active faults, and the drive's own record where it can be read.",
    ),
    "gear": (
        "drive.functions:gear_command",
        "Electronic gear for a screw, belt, rack or rotary table; writes only with --write.",
    ),
    "scales": (
        "drive.scales:app",
        "What a raw position and speed mean: show, state, or teach by a small move (moves).",
    ),
    "braking": ("drive.functions:braking", "Energy of braking, and the resistor that it takes."),
    "sweep": (
        "measuring.tools:sweep",
        "Measure a frequency response and write it as JSON. The axis moves.",
    ),
    "response": (
        "measuring.response:app",
        "Frequency responses from recordings of other programs. Nothing moves.",
    ),
    "inertia": (
        "measuring.tools:inertia",
        "Measure inertia and friction and write them as JSON. The axis moves.",
    ),
    "step": (
        "measuring.tools:step",
        "Command a step of speed or a move and read overshoot, settling and torque. "
        "The axis moves.",
    ),
    "friction": (
        "measuring.friction:friction",
        "Map friction over speed and torque over position, both directions. The axis moves.",
    ),
    "load-side": (
        "measuring.tools:load_side",
        "Measure backlash, stiffness and transmission error with a second encoder. The axis moves.",
    ),
    "gantry": (
        "measuring.tools:gantry",
        "Measure two coupled axes together: response, skew and the margins of both loops. Both "
        "axes move.",
    ),
    "first-power": (
        "measuring.tools:first_power",
        "Before the first closed loop: supply, counts, direction, switches, brake and phase order. "
        "The axis is energised: at most 10 % of torque and 0.1 rev.",
    ),
    "health": (
        "measuring.health:app",
        "The condition of an axis: measure, sign a baseline, repeat, compare, trend. "
        "Measuring moves it.",
    ),
    "brake-test": (
        "measuring.tools:brake_test",
        "Torque against the closed holding brake, both directions, until the test torque or slip. "
        "The axis is energised.",
    ),
    "safety-check": (
        "measuring.tools:safety_check",
        "Watch what the axis does when you trigger a safety function by hand: torque, stop and "
        "speed. It records and does not certify. The axis moves.",
    ),
    "shaping": (
        "measuring.tools:shaping",
        "Frequency and damping of the slow vibration after a move, input shapers for it, and the "
        "same move with one of them. The axis moves.",
    ),
    "vibration": (
        "measuring.tools:vibration",
        "Map vibration over speed, both directions: orders, frequencies and the resonances that "
        "orders excite. The axis moves.",
    ),
    "dwell": (
        "measuring.tools:dwell",
        "Vibrate at one frequency, for a person who looks for what rattles by hand and ear. The "
        "axis moves.",
    ),
    "cycle": (
        "measuring.tools:cycle",
        "Torque, speed, heat and braking energy of the machine's own cycle, from reading the drive "
        "or from a recording. Nothing is written and nothing is moved.",
    ),
    "autotune": (
        "measuring.tune:autotune",
        "Measure, design and, with --apply or --keep, verify an axis's loop gains. The axis moves.",
    ),
    "recompute": (
        "measuring.report:recompute",
        "Evaluate a stored measurement again from its raw signals. Nothing moves.",
    ),
    "report": (
        "measuring.report:report",
        "Write the commissioning report of an axis, from measurement files or a running server.",
    ),
    "handover": (
        "drive.handover:app",
        "Start-up lists for a machine's controller: write, compare, watch. Writes to no drive.",
    ),
    "profile": ("drive.profile:app", "Drive profiles: show, check, import."),
    "audit": ("server.keep:audit", "Check and export the audit trail."),
    "library": ("server.keep:library", "Search, export and import the library."),
    "backup": (
        "server.keep:backup",
        "Save everything that the station keeps. The server may run meanwhile.",
    ),
    "restore": (
        "server.keep:restore",
        "Put a backup in place, after checking it as a whole. End the server first.",
    ),
    "people": ("server.people:app", "Accounts of this station."),
    "station": ("server.station:app", "A station as a service."),
    "preflight": (
        "server.preflight:preflight_command",
        "Look at this computer, measure how punctual it is, and name the change that helps most.",
    ),
    "latency": (
        "server.latency:latency_command",
        "For how long a serial adapter holds answers back; lower it with --set.",
    ),
}
"""Name of a command to where it is, below `backend.commands`, and what the list says of it."""


class _Servodeck(TyperGroup):
    def format_help(self, ctx: Any, formatter: Any) -> None:
        _translate(self)
        super().format_help(ctx, formatter)


def _translate(command: TyperCommand | TyperGroup) -> None:
    """Help in the chosen language; the file of texts is read for that alone."""
    if language() == "zh":
        from backend.commands.base.help_texts import translate

        translate(command)


app = typer.Typer(
    cls=_Servodeck,
    help="Servo-drive commissioning in a browser.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


def _later(name: str, where: str) -> type[TyperCommand]:
    """A command that is imported when it is called."""

    class Later(TyperCommand):
        def make_context(
            self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any
        ) -> Any:
            command = imported(name, where)
            if not args or "--help" in args:
                _translate(command)
            return command.make_context(info_name, args, parent, **extra)

    return Later


def imported(name: str, where: str) -> TyperCommand | TyperGroup:
    """The command itself."""
    module, _, attribute = where.partition(":")
    found = getattr(importlib.import_module(f"backend.commands.{module}"), attribute)
    one = typer.Typer(add_completion=False)
    if isinstance(found, typer.Typer):
        one.add_typer(found, name=name)
        group = typer.main.get_command(one)
        assert isinstance(group, TyperGroup)
        command = group.commands[name]
    else:
        one.command(name)(found)
        command = typer.main.get_command(one)
    assert isinstance(command, TyperCommand | TyperGroup)
    return command


def _never() -> None:
    """Stands for what `_later` imports."""


for _name, (_where, _help) in COMMANDS.items():
    app.command(_name, help=_help, cls=_later(_name, _where))(_never)


def _speak_any_letter() -> None:
    """Terminals of other code pages get a ? for what they lack; files and pipes get UTF-8."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(encoding=None if stream.isatty() else "utf-8", errors="replace")


def _speak(wanted: Language | None) -> Language | None:
    if wanted is not None:
        speak(wanted)
    return wanted


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"servodeck {__version__}")
        raise typer.Exit


@app.callback()
def _whole(
    *,
    language: Annotated[
        Language | None,
        typer.Option(
            help="of errors, progress and reports; by default that of the system",
            callback=_speak,
            is_eager=True,
        ),
    ] = None,
    version: Annotated[
        bool,
        typer.Option(
            "--version", help="print the version and end", callback=_print_version, is_eager=True
        ),
    ] = False,
) -> None:
    """Options of every command."""


def _language_of_locale() -> Language:
    names = (os.environ.get(name) for name in ("LC_ALL", "LC_MESSAGES", "LANG"))
    return language_of(next((name for name in names if name), None))


def main() -> None:
    """Entry point. A defect of the program itself ends it with exit code 70, in one sentence."""
    _speak_any_letter()
    speak(_language_of_locale())
    try:
        app()
    except Exception as error:
        if os.environ.get("SERVODECK_TRACEBACK"):
            raise
        print(f"error: this is a defect of servodeck: {error!r}", file=sys.stderr)
        print(
            "try:   run it again with SERVODECK_TRACEBACK=1 and report what it prints",
            file=sys.stderr,
        )
        raise SystemExit(70) from error
