"""``servodeck scan``: search for drives on a bus."""

from __future__ import annotations

import json

from backend.commands.base.options import Json, Server, Url, server_for
from backend.commands.base.printing import print_text, words_of
from backend.commands.base.session import opened, run, show_progress
from backend.station.drives.matching import match_profiles
from drivers.link import Found
from drivers.texts.message import language
from drivers.urls import bus_kind, parse_url


def scan(
    url: Url,
    as_json: Json = False,
    server: Server = None,
) -> None:
    """Look for drives on a bus."""

    async def work() -> None:
        rows = await _found(url, server)
        if as_json:
            print(json.dumps([row | {"profiles": list(fits)} for row, fits in rows], indent=1))
            return
        for row, fits in rows:
            which = ", ".join(f"{name} ({sure})" for name, sure in fits.items())
            name = row["name"] or words_of("printed.no-name")
            serial = (
                words_of("printed.no-serial")
                if row["serial"] is None
                else words_of("printed.serial", serial=str(row["serial"]))
            )
            head = words_of("printed.station", station=str(row["station"]))
            print(f"{head}: {name}  {serial}  {which}")
        if not rows:
            print_text(
                "printed.no-drive-answers", check=bus_kind(parse_url(url).scheme).traits.silent
            )

    run(work)


_FOUND = {
    "station", "vendor_id", "product_code", "revision", "serial", "name", "alias", "firmware",
    "state", "notes",
}  # fmt: skip


async def _found(url: str, server: str | None) -> list[tuple[dict[str, object], dict[str, str]]]:
    """Drives that answer, each with the matching profiles and their confidence."""
    if at := server_for(url, server):
        # The models of the API take longer to import than the rest.
        from backend.commands.drive import remote_params

        return [
            (f.model_dump(include=_FOUND), {m.profile: m.confidence for m in f.matches})
            for f in await remote_params.scan(at, url)
        ]
    async with opened(url) as link:
        return [
            (
                _row(f),
                {m.profile.drive: m.confidence for m in match_profiles(link.kind, f)},
            )
            for f in await link.scan(show_progress, None)
        ]


def _row(found: Found) -> dict[str, object]:
    """A found drive in the form of the server's answer, with texts in the command's language."""
    return {name: getattr(found, name) for name in _FOUND} | {
        "state": "" if found.state is None else found.state.words(language()),
        "notes": [note.words(language()) for note in found.notes],
    }
