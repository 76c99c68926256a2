"""``servodeck conformance``: rules of the public standards, tested on a slave over its bus."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import asdict
from typing import Annotated, Any

import typer

from backend.commands.base.options import Json, Url
from backend.commands.base.printing import print_text, words_of
from backend.commands.base.session import opened, run, show_progress
from drivers.conformance.check import Finding, check
from drivers.conformance.rule import Verdict
from drivers.conformance.subject import Subject
from drivers.errors import NotAllowed
from drivers.link import Link
from drivers.texts.message import language
from drivers.urls import parse_url

_BUSES = ("ethercat", "canopen")


def conformance(
    url: Url,
    station: Annotated[int | None, typer.Option(help="only this one")] = None,
    as_json: Json = False,
) -> None:
    """Which rules of the public standards a slave keeps. Never enables; nothing moves.

    Opens an EtherCAT or CANopen bus that no server holds. An EtherCAT slave is brought to Init and
    Pre-Op and left in Pre-Op. What is written are present values, in part in a wrong length; a
    drive that is powered is only read. Ends with 1 where a rule has failed.
    """

    async def work() -> bool:
        if parse_url(url).scheme not in _BUSES:
            raise NotAllowed("command.conformance-knows-not", value=url)
        async with opened(url) as link:
            results = await checked(link, url, station)
        _show(results, as_json=as_json)
        return not any(r["verdict"] == "failed" for each in results for r in each["rules"])

    if not run(work):
        raise typer.Exit(1)


async def checked(link: Link, url: str, station: int | None) -> list[dict[str, Any]]:
    """Test the rules on one station, or on each that a scan finds.

    Raises:
        NotAllowed: no station answers.
    """
    wanted = None if station is None else [station]
    seen = {each.station: each for each in await link.scan(show_progress, wanted)}
    numbers = sorted(seen) if station is None else [n for n in (station,) if n in seen]
    if not numbers:
        raise NotAllowed(
            "command.nothing-answers-station-check-power", station=station or 1, url=url
        )
    results = []
    for number in numbers:
        found = await check(Subject(link, number, seen[number]))
        results.append({"station": number, "rules": [shown(each) for each in found]})
    return results


def shown(finding: Finding) -> dict[str, Any]:
    """A finding as JSON values, for scripts."""
    rule, outcome = finding.rule, finding.outcome
    return {
        "code": rule.code.removeprefix("conformance."),
        "clause": rule.clause,
        "title": rule.title.words(language()),
        "verdict": outcome.verdict.value,
        "facts": [asdict(fact) for fact in outcome.facts],
    }


def _show(results: list[dict[str, Any]], *, as_json: bool) -> None:
    if as_json:
        print(json.dumps(results, indent=1, ensure_ascii=False))
        return
    for each in results:
        for rule in each["rules"]:
            verdict = Verdict(rule["verdict"])
            word = verdict.text.words(language())
            print(f"{word}: {rule['title']} [{rule['code']}; {rule['clause']}]")
            if verdict in (Verdict.FAILED, Verdict.NOT_TESTABLE):
                _show_facts(rule["facts"])
        count = Counter(rule["verdict"] for rule in each["rules"])
        print_text(
            "printed.conformance-summary",
            station=str(each["station"]),
            **{verdict.value: count[verdict.value] for verdict in Verdict},
        )


def _show_facts(facts: list[dict[str, Any]]) -> None:
    for fact in facts:
        line = f"     {fact['name']} = {fact['actual']}"
        if fact["expected"] is not None:
            line += words_of("printed.should-be", expected=str(fact["expected"]))
        print(line)
