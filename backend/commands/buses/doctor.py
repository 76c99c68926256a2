"""``servodeck doctor``: why a drive does not reach Operational."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from typing import Annotated, Any

import typer

from backend.commands.base.options import Json, Profile, Server, Url, server_for
from backend.commands.base.printing import note, print_text, words_of
from backend.commands.base.session import opened, run, show_progress
from backend.station.doctor import Examined, examined
from backend.station.doctor import tried as tried_once
from backend.station.drives.matching import match_profiles
from drivers.doctor.diagnosis import Cause
from drivers.doctor.trials import trials
from drivers.errors import NotAllowed
from drivers.link import Found, Link
from drivers.texts.message import language
from drivers.urls import bus_kind, parse_url
from profiles import STANDARD, load_profile
from profiles.schema import Profile as ProfileOf


def doctor(
    url: Url,
    station: Annotated[int | None, typer.Option(help="only this one")] = None,
    profile: Profile = None,
    as_json: Json = False,
    server: Server = None,
    try_settings: Annotated[
        bool, typer.Option("--try", help="try other settings of the bring-up, each undone")
    ] = False,
) -> None:
    """Why a drive does not reach Operational. Nothing moves.

    Takes every drive of an EtherCAT or CANopen bus there, without enabling it. A running server
    says what it sees as it is. Ends with 1 where a drive is not in Operational.
    """

    async def work() -> bool:
        at = server_for(url, server)
        if at and try_settings:
            raise NotAllowed("command.doctor-tries-alone", value=url)
        if at:
            results = await _by_server(at, url, station)
            answered = bool(results)
        else:
            async with opened(url) as link:
                if link.doctor is None:
                    raise NotAllowed("station.doctor-knows-not", value=url)
                results, answered = await _here(link, station, profile, try_settings=try_settings)
        _show(results, as_json=as_json)
        if not answered and not as_json:
            check = bus_kind(parse_url(url).scheme).traits.silent
            print_text("printed.no-station-answers", check=check)
        return answered and all(each["reached"] for each in results)

    if not run(work):
        raise typer.Exit(1)


async def _by_server(at: str, url: str, station: int | None) -> list[dict[str, Any]]:
    from backend.commands.base.remote import remote

    query = {"url": url} | ({} if station is None else {"station": str(station)})
    async with remote(at) as asked:
        answer = await asked.raw("GET", "/buses/doctor", query=query)
        return list(answer.json())


async def _here(
    link: Link, station: int | None, profile: str | None, *, try_settings: bool
) -> tuple[list[dict[str, Any]], bool]:
    """What each drive has, and whether there is any station: a bus may have other devices only."""
    found = {each.station: each for each in await link.scan(show_progress, None)}
    results = []
    # A station that was named but not found is examined as well, to find out why.
    for number in sorted(found) if station is None else [station]:
        chosen = load_profile(profile) if profile else _fitting(link.kind, found.get(number))
        if chosen is None and station is None and found[number].is_other_device:
            note("printed.no-drive", station=str(number))  # standard output may be JSON
            continue
        if chosen is not None:
            link.attach(number, chosen)
        seen = await examined(link, number)
        result: dict[str, Any] = {
            "station": number,
            "reached": seen.reached,
            "refusal": _words(seen),
            "causes": [shown(cause) for cause in seen.causes],
        }
        if try_settings and seen.causes and chosen is not None:
            result["trials"] = await tried(link, number, chosen, seen.causes)
        results.append(result)
    return results, bool(found) or bool(results)


def _fitting(kind: str, found: Found | None) -> ProfileOf | None:
    """The profile that matches a found drive; for an unknown drive the standard one."""
    known = match_profiles(kind, found) if found is not None else []
    sure = (m for m in known if m.confidence != "possible")
    standard = (m for m in known if m.profile.drive == STANDARD)
    best = next(sure, None) or next(standard, None)
    return None if best is None else best.profile


async def tried(
    link: Link, station: int, profile: ProfileOf, causes: Sequence[Cause]
) -> list[dict[str, Any]]:
    """Try each setting by itself until the station reaches Operational, undoing each.

    After each trial the exchange has ended, the drive is in Pre-Operational again, and the profile
    that was attached before is attached again.
    """
    found = []
    for trial in trials(causes, profile):
        result = await tried_once(link, station, profile, trial)
        found.append(
            {
                "setting": trial.setting,
                "before": trial.before,
                "after": trial.after,
                "reached": result.reached,
                "refusal": _words(result),
            }
        )
        if result.reached:
            break
    return found


def _words(result: Examined) -> str | None:
    return None if result.refusal is None else result.refusal.text.words(language())


def shown(cause: Cause) -> dict[str, Any]:
    """A cause as JSON values, for scripts."""
    text = cause.text
    return {
        "code": cause.code,
        "weight": cause.weight,
        "title": text.title,
        "title_zh": text.zh,
        "remedy": text.remedy,
        "remedy_zh": text.zh_remedy,
        "facts": [
            asdict(fact)
            | {
                "label": fact.text.en,
                "label_zh": fact.text.zh,
                "shown": fact.shown,
                "shown_expected": fact.shown_expected,
            }
            for fact in cause.facts
        ],
    }


def _show(results: list[dict[str, Any]], *, as_json: bool) -> None:
    if as_json:
        print(json.dumps(results, indent=1))
        return
    ending = "_zh" if language() == "zh" else ""
    for each in results:
        if each["reached"]:
            print_text("printed.reaches-operational", station=str(each["station"]))
            continue
        head = words_of("printed.station", station=str(each["station"]))
        # A server examines the state as it is, so that no start was refused.
        print(f"{head}: {each.get('refusal') or words_of('printed.not-operational')}")
        for number, cause in enumerate(each["causes"], start=1):
            print(f"  {number}. {cause['title' + ending]}")
            for fact in cause["facts"]:
                line = f"     {fact['label' + ending]}: {fact['shown']}"
                if fact["shown_expected"] is not None:
                    line += words_of("printed.should-be", expected=str(fact["shown_expected"]))
                print(line)
            print_text("printed.cause-remedy", remedy=str(cause["remedy" + ending]))
        _show_trials(each.get("trials"))


def _show_trials(tried_settings: list[dict[str, Any]] | None) -> None:
    if tried_settings is None:
        return
    if not tried_settings:
        print_text("printed.nothing-to-try")
    for trial in tried_settings:
        facts = {name: str(trial[name]) for name in ("setting", "before", "after")}
        if trial["reached"]:
            print_text("printed.trial-reaches", **facts)
        else:
            refusal = trial["refusal"] or words_of("printed.not-operational")
            print_text("printed.trial-does-not", refusal=str(refusal), **facts)
