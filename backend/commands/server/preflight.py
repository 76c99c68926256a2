"""``servodeck preflight``: check of the computer's timing, and the most effective remedy."""

from __future__ import annotations

import asyncio
import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from backend.commands.base.printing import print_text, words_of
from backend.commands.base.session import reporting_errors
from backend.commands.base.state import state_folder
from backend.foundation.preflight import kept
from backend.foundation.preflight.findings import Effect, Fix
from backend.foundation.preflight.fixes import Fixes
from backend.foundation.preflight.run import Preflight, preflight
from backend.foundation.preflight.texts import (
    Language,
    fix_name,
    purpose_name,
    verdict_words,
    words,
)
from drivers.computer.timing.lateness import EDGES_US, Histogram, Measured
from drivers.errors import OutOfRange

_BAR = 40


@reporting_errors
def preflight_command(
    interface: Annotated[
        str, typer.Argument(help="Network interface for EtherCAT, as eth0; frames go out there.")
    ] = "",
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
    seconds: Annotated[
        float, typer.Option(help="How long to measure, up to 60 s; 0: only look.")
    ] = 10.0,
    language: Annotated[str, typer.Option(help="en or zh.")] = "en",
    fix: Annotated[
        str, typer.Option(help=f"Change a setting: {', '.join(Fix)}. Needs the administrator.")
    ] = "",
    undo: Annotated[
        bool, typer.Option("--undo", help="Restore the settings that --fix has changed.")
    ] = False,
    config: Annotated[Path | None, typer.Option(help="state folder of the station")] = None,
) -> None:
    """Look at this computer, measure how punctual it is, and name the change that helps most.

    Nothing is written to a drive. Exit code 1 where a purpose is not suitable.
    """
    words_in: Language = "zh" if language == "zh" else "en"
    folder = state_folder(config)
    if undo:
        undone = Fixes(folder).undo()
        for change in undone.restored:
            print(f"{change.setting}: {change.before}")
        for change in undone.left:
            print_text("printed.setting-left", setting=str(change.setting))
        return
    if fix:
        if fix not in set(Fix):
            raise OutOfRange("command.no-fix", value=fix, limit=", ".join(Fix))
        for change in Fixes(folder).apply(Fix(fix), interface):
            print(f"{change.setting}: {change.before} -> {change.after}")
        return
    result = asyncio.run(preflight(interface, seconds))
    if result.measured:
        kept.keep(folder, interface, result.measured)
    if as_json:
        print(json.dumps(as_data(result, words_in), indent=2, ensure_ascii=False))
    else:
        _show(result, words_in)
    if any(one.grade == "unsuitable" for one in result.verdicts):
        raise typer.Exit(1)


def as_data(result: Preflight, language: Language) -> dict[str, object]:
    """The result as JSON values: codes and figures, with texts in one language."""
    return {
        "interface": result.interface,
        "facts": asdict(result.facts) | {"capabilities": sorted(result.facts.capabilities)},
        "findings": [
            asdict(one) | {"effect": one.effect.name.lower()} | words(one, language)._asdict()
            for one in result.findings
        ],
        "verdicts": [
            asdict(one) | {"words": verdict_words(one, language)} for one in result.verdicts
        ],
        "edges_us": EDGES_US,
        "measured": [asdict(one) for one in result.measured.values()],
    }


def _show(result: Preflight, language: Language) -> None:
    facts = result.facts
    print_text(
        "printed.computer", kernel=facts.kernel, preemption=str(facts.preemption), cores=facts.cores
    )
    for number, one in enumerate(result.findings):
        what, remedy = words(one, language)
        cost = f" [{one.delay_us:.0f} µs]" if one.effect is Effect.DELAYS else ""
        print(f"{'->' if number == 0 else '  '} {what}{cost}\n      {remedy}")
        if one.fix is not None:
            command = f"servodeck preflight {result.interface} --fix {one.fix}"
            print(f"      {fix_name(one.fix, language)}: {' '.join(command.split())}")
    for run in result.measured.values():
        _show_run(run)
    for verdict in result.verdicts:
        print(f"{purpose_name(verdict.purpose, language)}: {verdict_words(verdict, language)}")


def _show_run(run: Measured) -> None:
    print_text(
        "printed.cycle-measured",
        period_us=run.period_us,
        cycles=run.cycles,
        missed=run.missed,
        fifo=words_of("printed.granted" if run.fifo else "printed.not-granted"),
        memory=words_of("printed.locked" if run.memory_locked else "printed.not-locked"),
    )
    _show_histogram(words_of("printed.wake-up-lateness"), run.lateness)
    if run.round_trip is not None:
        _show_histogram(words_of("printed.frame-round-trip"), run.round_trip)
    elif run.unanswered:
        print_text("printed.no-frame-back")


def _show_histogram(name: str, histogram: Histogram) -> None:
    most = max(histogram.counts)
    print_text(
        "printed.lateness",
        name=name,
        most_us=f"{histogram.below_us(0.999):.0f}",
        latest_us=f"{histogram.most_us:.0f}",
    )
    for count, edge in zip(histogram.counts, (*EDGES_US, None), strict=True):
        if count:
            limit = f"<= {edge:g}" if edge is not None else f"> {EDGES_US[-1]:g}"
            print(f"  {limit:>12} µs {count:7d} {'#' * max(1, _BAR * count // most)}")
