"""Present raw values of a drive, read by the command or by a running server."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

from backend.api.drive.models_parameters import ParameterRow
from backend.commands.base.options import Place
from backend.commands.base.session import drive_at, show_progress
from backend.commands.drive.remote_params import remote_drive
from profiles import load_profile
from profiles.schema import Profile, Raw


class Now(NamedTuple):
    """A drive's name, its profile, and raw values by key; None for a value that was not read."""

    name: str
    profile: Profile
    raws: dict[str, Raw | None]


async def values_now(place: Place, keys: Collection[str] = ()) -> Now:
    """Read these parameters; keys that the drive does not have are left out.

    Values that a slow drive did not return are read once more.
    """
    if place.server is None:
        async with drive_at(place.url, place.station, place.profile) as drive:
            known = [
                key
                for key in keys
                if (parameter := drive.profile.by_key.get(key)) is not None
                and parameter.access != "wo"
                and not drive.unreachable_why(parameter)
            ]
            read = await drive.read_many(known, show_progress) if known else {}
            missing = [key for key in known if key not in read or read[key].raw is None]
            read |= await drive.read_many(missing) if missing else {}
            return Now(drive.name, drive.profile, {key: r.raw for key, r in read.items()})
    async with remote_drive(place) as (at, summary):
        profile = load_profile(summary.profile)
        raws: dict[str, Raw | None] = {}
        readable = [
            key for key in keys if key in profile.by_key and profile.by_key[key].access != "wo"
        ]
        missing = readable
        for _ in range(2):
            if not missing:
                break
            await at.result(f"/drives/{summary.id}/jobs/read_all", {"keys": missing})
            rows = await at.ask("GET", f"/drives/{summary.id}/parameters", list[ParameterRow])
            wanted = set(readable)
            raws = {row.key: row.reading.raw for row in rows if row.key in wanted and row.reading}
            missing = [key for key in readable if raws.get(key) is None]
        return Now(summary.name, profile, raws)
