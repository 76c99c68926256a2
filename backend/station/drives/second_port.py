"""Further ports of a drive: parameters only they carry, and the check that it is the same drive."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from backend.axes.drive.drive import Drive
from backend.axes.drive.ports import Port, carries
from backend.axes.parameters.set_file import storable
from drivers.errors import LinkTimeout, NotAllowed
from drivers.urls import bus_kind
from profiles.schema import LinkKind

#: Number of settings that are compared before a second port is accepted.
_COMPARED = 24


@dataclass(frozen=True, slots=True)
class MissingPort:
    """A port that the family has and that is not connected.

    ``parameters``: number of parameters that only this port would carry; ``groups``: their groups,
    largest first.
    """

    kind: LinkKind
    parameters: int
    groups: tuple[str, ...]
    wiring: str


def missing_ports(drive: Drive) -> list[MissingPort]:
    """Ports of the drive's family that are not connected."""
    connected = {port.link.kind for port in drive.ports}
    found = []
    for spec in drive.profile.links:
        if spec.kind in connected:
            continue
        traits = bus_kind(spec.kind).traits
        only_there = [
            p
            for p in drive.profile.parameters
            if carries(traits, p) and not any(port.carries(p) for port in drive.ports)
        ]
        groups = Counter(p.group for p in only_there)
        names = tuple(name for name, _ in groups.most_common())
        found.append(MissingPort(spec.kind, len(only_there), names, spec.wiring))
    return found


async def require_same_drive(drive: Drive, other: Port) -> None:
    """Check that settings read over the new port equal those of the connected ports.

    Serial buses report no identity, and a swapped cable must not cause writes to another drive. Two
    drives with equal settings cannot be distinguished this way.

    Raises:
        LinkTimeout: no drive answers at the new port.
        NotAllowed: values differ; the message contains the first of them.
    """
    shared = [
        p
        for p in storable(drive.profile, motor_individual=True)
        if other.carries(p) and any(port.carries(p) for port in drive.ports)
    ][:_COMPARED]
    there = Drive(drive.id, drive.name, drive.profile, [other])
    theirs = await there.read_many([p.key for p in shared])
    if shared and all(reading.raw is None for reading in theirs.values()):
        raise LinkTimeout(
            "station.nothing-read-station",
            drive=drive.name,
            station=other.station,
            url=other.link.url,
            error=next(iter(theirs.values())).problem,
        )
    ours = await drive.read_many([p.key for p in shared])
    different = [
        (p, ours[p.key].raw, theirs[p.key].raw)
        for p in shared
        if ours[p.key].raw is not None
        and theirs[p.key].raw is not None
        and ours[p.key].raw != theirs[p.key].raw
    ]
    if different:
        parameter, here, other_value = different[0]
        raise NotAllowed(
            "station.drive-station-not-hold",
            drive=drive.name,
            parameter=parameter.key,
            value=other_value,
            station=other.station,
            url=other.link.url,
            key=parameter.name,
            here=here,
            different_count=len(different),
            shared_count=len(shared),
        )
