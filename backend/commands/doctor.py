"""``servodeck doctor``: why a drive does not reach Operational."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Annotated, Any

import typer

from backend.commands.options import Json, Profile, Server, Url, server_for
from backend.commands.session import opened, run, show_progress
from backend.station.matching import match_profiles
from drivers.doctor.diagnosis import Cause
from drivers.errors import DriveError, NotAllowed
from drivers.ethercat.link import EthercatLink, segment_of
from drivers.link import Address, CyclicSignal
from profiles import load_profile

_INPUTS = ((0x6041, "UINT16"), (0x6064, "INT32"))
_OUTPUTS = ((0x6040, "UINT16"),)
_CYCLE_S = 0.001


def doctor(
    url: Url,
    station: Annotated[int | None, typer.Option(help="only this one")] = None,
    profile: Profile = None,
    as_json: Json = False,
    server: Server = None,
) -> None:
    """Why a drive does not reach Operational. Nothing moves.

    Takes every drive of an EtherCAT bus there, without enabling it. A running server says what it
    sees as it is. Ends with 1 where a drive is not in Operational.
    """

    async def work() -> bool:
        if at := server_for(url, server):
            results = await _by_server(at, url, station)
        else:
            async with opened(url) as link:
                segment = segment_of(link)
                if segment is None:
                    raise NotAllowed("command.doctor-knows-ethercat", value=url)
                results = await _here(segment, station, profile)
        _show(results, as_json=as_json)
        return all(each["reached"] for each in results)

    if not run(work):
        raise typer.Exit(1)


async def _by_server(at: str, url: str, station: int | None) -> list[dict[str, Any]]:
    from backend.commands.remote import remote

    query = {"url": url} | ({} if station is None else {"station": str(station)})
    async with remote(at) as asked:
        answer = await asked.raw("GET", "/ethercat/doctor", query=query)
        return list(answer.json())


async def _here(
    link: EthercatLink, station: int | None, profile: str | None
) -> list[dict[str, Any]]:
    found = await link.scan(show_progress, None)
    results = []
    for each in found:
        if station not in (None, each.station):
            continue
        known = match_profiles(link.kind, each)
        best = known[0].profile if known else None
        chosen = load_profile(profile) if profile else best
        if chosen is not None:
            link.attach(each.station, chosen)
        results.append(await examined(link, each.station))
    return results


async def examined(link: EthercatLink, station: int) -> dict[str, Any]:
    """Take one station to Operational and back; the causes where it does not get there."""
    refusal: DriveError | None = None
    inputs = [CyclicSignal(station, Address(i, 0, k), f"{i:04X}") for i, k in _INPUTS]  # type: ignore[arg-type]
    outputs = [CyclicSignal(station, Address(i, 0, k), f"{i:04X}") for i, k in _OUTPUTS]  # type: ignore[arg-type]
    causes: tuple[Cause, ...] = ()
    try:
        await link.process_data.configure(inputs, outputs, _CYCLE_S)
        await link.process_data.start()
    except DriveError as error:
        refusal = error
        _, causes = await link.diagnose(station, refusal)
    else:
        await link.process_data.stop()
    return {
        "station": station,
        "reached": refusal is None,
        "refusal": None if refusal is None else refusal.message,
        "causes": [shown(cause) for cause in causes],
    }


def shown(cause: Cause) -> dict[str, Any]:
    """A cause for scripts."""
    text = cause.text
    return {
        "code": cause.code,
        "weight": cause.weight,
        "title": text.title,
        "remedy": text.remedy,
        "facts": [asdict(fact) for fact in cause.facts],
    }


def _show(results: list[dict[str, Any]], *, as_json: bool) -> None:
    if as_json:
        print(json.dumps(results, indent=1))
        return
    for each in results:
        if each["reached"]:
            print(f"station {each['station']}: reaches Operational")
            continue
        print(f"station {each['station']}: {each['refusal'] or 'not in Operational'}")
        for number, cause in enumerate(each["causes"], start=1):
            print(f"  {number}. {cause['title']}")
            for fact in cause["facts"]:
                wanted = "" if fact["expected"] is None else f", should be {fact['expected']}"
                print(f"     {fact['name']} = {fact['actual']}{wanted}")
            print(f"     remedy: {cause['remedy']}")
