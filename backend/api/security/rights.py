"""The right that every route needs. A route that is not in these tables is refused to everybody.

The tables are in one place so that the whole policy can be read at once. `Gate` (HTTP and
websockets) and `Connection` (messages) enforce them, including control of the axis, before any code
of a route runs, so that a new route cannot omit a check: it is refused until it is listed here.
`tests/security` tests every route and message against these tables, with every role.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

from starlette.routing import compile_path

from backend.foundation.people.rights import Right
from backend.tools.registry import TOOLS

API = "/api/v1"

#: ``public``: no identity needed. ``known``: any valid identity. ``stop``: any identity that is
#: valid or was until recently.
Special = Literal["public", "known", "stop"]
#: Drives that a change needs control of: the one in its path (checked by the gate), every drive of
#: the bus that it names (checked by the route), or none.
LeaseOf = Literal["drive", "bus", "none"]

_SMALL, _FILE = 1 << 20, 70 << 20


@dataclass(frozen=True, slots=True)
class Need:
    """Right and control that a request needs, and the size limit of its body [bytes]."""

    right: Right | Special
    lease: LeaseOf = "none"
    body_bytes: int = _SMALL


_PUBLIC, _KNOWN, _STOP = Need("public"), Need("known"), Need("stop")
_LOOK = Need(Right.LOOK)
_FILES, _FILES_UPLOAD = Need(Right.FILES), Need(Right.FILES, body_bytes=_FILE)
_PARAMETERS = Need(Right.PARAMETERS, "drive")
_MEASURE, _MOTION = Need(Right.MEASURE, "drive"), Need(Right.MOTION, "drive")
_STATION, _STATION_DRIVE = Need(Right.STATION), Need(Right.STATION, "drive")
_STATION_BUS = Need(Right.STATION, "bus")
_INVITE, _ADMINISTER = Need(Right.INVITE), Need(Right.ADMINISTER)

#: Keys are "METHOD path"; paths below /api/v1.
_API: dict[str, Need] = {
    # who is there
    "GET /health": _PUBLIC,
    "GET /session": _PUBLIC,
    "GET /certificate": _PUBLIC,
    "POST /session": _PUBLIC,
    "DELETE /session": _KNOWN,
    "POST /setup": _PUBLIC,
    "POST /guests": _PUBLIC,
    "GET /sessions": _KNOWN,
    "DELETE /sessions/{session_id}": _KNOWN,
    "PUT /session/password": _KNOWN,
    "GET /tokens": _KNOWN,
    "POST /tokens": _KNOWN,
    "DELETE /tokens/{token_id}": _KNOWN,
    "GET /accounts": _ADMINISTER,
    "POST /accounts": _ADMINISTER,
    "PATCH /accounts/{account_id}": _ADMINISTER,
    "DELETE /accounts/{account_id}": _ADMINISTER,
    "GET /people": _LOOK,
    "GET /chat": _LOOK,
    "GET /invitations": _INVITE,
    "POST /invitations": _INVITE,
    "DELETE /invitations/{invitation_id}": _INVITE,
    "PUT /invitations/{invitation_id}/grant": _INVITE,
    "DELETE /invitations/{invitation_id}/grant": _INVITE,
    # the station
    "GET /openapi.json": _LOOK,
    "POST /stop": _STOP,
    "GET /interfaces": _LOOK,
    "GET /box": _LOOK,
    "PUT /box": _ADMINISTER,
    "GET /profiles": _LOOK,
    "GET /profiles/matches": _LOOK,
    "GET /profiles/{profile}/eds": _LOOK,
    "GET /profiles/{profile}/esi": _LOOK,
    "GET /profiles/{profile}/texts": _LOOK,
    "GET /profiles/{profile}/parameters/{key}/motion": _LOOK,
    "PUT /profiles/{profile}/parameters/{key}/motion": _STATION,
    "DELETE /profiles/{profile}/parameters/{key}/motion": _STATION,
    "GET /buses": _LOOK,
    "POST /buses/cyclic": _STATION_BUS,
    "DELETE /buses/cyclic": _STATION_BUS,
    "DELETE /buses": _STATION,
    "GET /buses/flight": _LOOK,
    "GET /buses/doctor": _LOOK,
    # A trial takes a drive to Operational, not enabled; only servodeck's own bring-up is changed.
    "POST /buses/doctor/trials": _STATION_BUS,
    "PUT /buses/doctor/kept": _STATION_BUS,
    "DELETE /buses/doctor/kept": _STATION_BUS,
    "POST /scan": _STATION_BUS,
    "POST /search-line": _STATION,
    "GET /adapters/latency-timer": _LOOK,
    "PUT /adapters/latency-timer": _ADMINISTER,
    "DELETE /adapters/latency-timer": _ADMINISTER,
    "GET /preflight": _LOOK,
    "POST /preflight": _STATION,
    "POST /preflight/fixes": _ADMINISTER,
    "DELETE /preflight/fixes": _ADMINISTER,
    "POST /descriptions": Need(Right.STATION, body_bytes=_FILE),
    "POST /descriptions/devices": Need(Right.STATION, body_bytes=_FILE),
    "POST /descriptions/from-drive": _STATION,
    "GET /ethercat/segment": _LOOK,
    "GET /ethercat/permissions": _LOOK,
    "POST /ethercat/counters/clear": _STATION_BUS,
    "POST /ethercat/alias": _STATION_BUS,
    # Reading takes the EEPROM from the drive's processor for a moment.
    "GET /ethercat/eeprom": _STATION,
    "POST /ethercat/eeprom/compare": _STATION,
    "POST /ethercat/eeprom/plan": _STATION,
    "POST /ethercat/eeprom/restore": _STATION_BUS,
    "GET /jobs": _LOOK,
    "GET /jobs/{job_id}": _LOOK,
    # Ends a motion for everybody, like STOP; the route requires more for jobs without motion.
    "DELETE /jobs/{job_id}": _LOOK,
    "GET /log": _LOOK,
    # drives
    "GET /drives": _LOOK,
    "POST /drives": _STATION_BUS,
    "GET /drives/{drive_id}": _LOOK,
    "PATCH /drives/{drive_id}": _STATION_DRIVE,
    "DELETE /drives/{drive_id}": _STATION_DRIVE,
    "POST /drives/{drive_id}/ports": _STATION_DRIVE,
    "GET /drives/{drive_id}/missing-ports": _LOOK,
    "GET /drives/{drive_id}/log": _LOOK,
    "GET /drives/{drive_id}/state": _LOOK,
    "GET /drives/{drive_id}/faults": _LOOK,
    "POST /drives/{drive_id}/fault-reset": _MOTION,
    # For the demo only; the route refuses it elsewhere.
    "POST /drives/{drive_id}/training-fault": _MOTION,
    "POST /drives/{drive_id}/transition": _MOTION,
    "GET /drives/{drive_id}/parameters": _LOOK,
    "PUT /drives/{drive_id}/parameters": _PARAMETERS,
    "GET /drives/{drive_id}/parameters/{key}": _LOOK,
    "PUT /drives/{drive_id}/parameters/{key}": _PARAMETERS,
    # Settings that can start a motion at once need the right to move, not the right to write.
    "PUT /drives/{drive_id}/motion-settings/{key}": _MOTION,
    "POST /drives/{drive_id}/jobs/put-back": _PARAMETERS,
    "DELETE /drives/{drive_id}/pending-restores": _PARAMETERS,
    "GET /drives/{drive_id}/procedures": _LOOK,
    "POST /drives/{drive_id}/procedures/{name}": _MOTION,
    "GET /drives/{drive_id}/homing-methods": _LOOK,
    "POST /drives/{drive_id}/jobs/read_all": _LOOK,
    "POST /drives/{drive_id}/jobs/load_set": _PARAMETERS,
    "POST /drives/{drive_id}/jobs/move": _MOTION,
    "POST /drives/{drive_id}/jobs/sequence": _MOTION,
    "POST /drives/{drive_id}/jobs/generate": _MOTION,
    "POST /drives/{drive_id}/jobs/home": _MOTION,
    "POST /drives/{drive_id}/jobs/identify": _MOTION,
    **{
        f"POST /drives/{{drive_id}}/jobs/{tool.kind}": Need(
            tool.right, "drive" if tool.motion else "none"
        )
        for tool in TOOLS
    },
    "GET /tools": _LOOK,
    "POST /drives/{drive_id}/jobs/firmware": Need(Right.STATION, "drive", _FILE),
    "GET /drives/{drive_id}/io": _LOOK,
    "POST /drives/{drive_id}/io/forcing/{name}": _MOTION,
    "PUT /drives/{drive_id}/io/forcing/{name}": _MOTION,
    # Releases forced terminals, for everybody, like STOP.
    "DELETE /drives/{drive_id}/io/forcing/{name}": _LOOK,
    "PUT /drives/{drive_id}/io/probes/{number}": _PARAMETERS,
    "GET /drives/{drive_id}/functions": _LOOK,
    "GET /drives/{drive_id}/fault-history": _LOOK,
    "POST /drives/{drive_id}/fault-history/read": _PARAMETERS,
    "GET /drives/{drive_id}/record": _LOOK,
    "PUT /drives/{drive_id}/mechanics": _PARAMETERS,
    "PUT /drives/{drive_id}/watch": _PARAMETERS,
    # The scale determines how far the next motion goes, so it needs the right to move.
    "GET /drives/{drive_id}/scales": _LOOK,
    "PUT /drives/{drive_id}/scales": _MOTION,
    "DELETE /drives/{drive_id}/scales": _MOTION,
    "POST /drives/{drive_id}/scales/confirm": _MOTION,
    "POST /drives/{drive_id}/jobs/small_move": _MOTION,
    "POST /drives/{drive_id}/gear/plan": _LOOK,
    "POST /drives/{drive_id}/gear/write": _PARAMETERS,
    "POST /calculate/braking": _LOOK,
    # tuning: previews compute and change nothing
    "GET /drives/{drive_id}/notches": _LOOK,
    "POST /drives/{drive_id}/notches/preview": _LOOK,
    "PUT /drives/{drive_id}/notches": _PARAMETERS,
    "GET /drives/{drive_id}/gains": _LOOK,
    "PUT /drives/{drive_id}/gains": _PARAMETERS,
    "POST /drives/{drive_id}/tune/candidates": _LOOK,
    "POST /drives/{drive_id}/tune/predict": _LOOK,
    "POST /drives/{drive_id}/tune/excitation": _LOOK,
    "POST /drives/{drive_id}/tune/undo": _PARAMETERS,
    "GET /measurements": _LOOK,
    "POST /measurements": _FILES_UPLOAD,
    "POST /measurements/import": _FILES_UPLOAD,
    "POST /measurements/import/preview": _FILES_UPLOAD,
    "GET /measurements/{name}": _LOOK,
    "GET /measurements/{name}/file": _LOOK,
    "POST /measurements/{name}/signature": _FILES,
    "DELETE /measurements/{name}": _FILES,
    # files
    "GET /sets": _LOOK,
    "GET /sets/{file}": _LOOK,
    "GET /sets/{file}/list": _LOOK,
    "GET /sets/{file}/list/left-out": _LOOK,
    "POST /sets/list": _FILES_UPLOAD,
    "PUT /sets/{file}": _FILES_UPLOAD,
    "DELETE /sets/{file}": _FILES,
    "POST /drives/{drive_id}/sets": Need(Right.FILES, "drive"),
    "GET /drives/{drive_id}/diff": _LOOK,
    "GET /drives/{drive_id}/three-way": _LOOK,
    # Lists for the machine's controller are made of stored sets, and noted in the
    # report; comparing only reads.
    "POST /handover": _FILES_UPLOAD,
    "POST /drives/{drive_id}/handover": _FILES_UPLOAD,
    "POST /drives/{drive_id}/handover/compare": Need(Right.LOOK, body_bytes=9 << 20),
    "GET /drives/{drive_id}/handovers": _LOOK,
    "GET /drives/{drive_id}/handovers/{number}/changes": _LOOK,
    # Condition of axes: measuring is a job of the tool; signing makes measured rounds the baseline.
    "GET /health/trend": _LOOK,
    "GET /drives/{drive_id}/health": _LOOK,
    "POST /drives/{drive_id}/health/baseline": _FILES,
    # Permitting unattended runs needs the right to move; a controller's token triggers a run;
    # ending the permission needs less.
    "GET /drives/{drive_id}/health/permission": _LOOK,
    "PUT /drives/{drive_id}/health/permission": _MOTION,
    "DELETE /drives/{drive_id}/health/permission": _FILES,
    "POST /drives/{drive_id}/health/trigger": _MEASURE,
    "GET /library": _LOOK,
    "GET /library/tags": _LOOK,
    "GET /library/{entry_id}": _LOOK,
    "GET /library/{entry_id}/versions": _LOOK,
    "GET /library/{entry_id}/content": _LOOK,
    "PATCH /library/{entry_id}": _FILES,
    "POST /library/{entry_id}/share": _FILES,
    "POST /library/{entry_id}/fetch": _FILES,
    "DELETE /library/{entry_id}": _FILES,
    "GET /recordings": _LOOK,
    "POST /recordings": _FILES,
    "PUT /recordings/retention": _STATION,
    "GET /recordings/{name}": _LOOK,
    "PATCH /recordings/{name}": _FILES,
    "DELETE /recordings/{name}": _FILES,
    "POST /recordings/{name}/stop": _FILES,
    "POST /recordings/{name}/trigger": _FILES,
    "GET /recordings/{name}/file": _LOOK,
    "GET /recordings/{name}/samples": _LOOK,
    "GET /recordings/{name}/exports/{kind}": _LOOK,
    "POST /recordings/{name}/exports/{kind}": _FILES,
    "GET /reports": _LOOK,
    "POST /drives/{drive_id}/reports": _FILES,
    "GET /reports/{name}": _LOOK,
    "DELETE /reports/{name}": _FILES,
    "GET /scope/setups": _LOOK,
    "PUT /scope/setups/{name}": _FILES,
    "DELETE /scope/setups/{name}": _FILES,
    "GET /scope/snapshots": _LOOK,
    "POST /scope/snapshots/{name}": _FILES_UPLOAD,
    "GET /scope/snapshots/{name}": _LOOK,
    "DELETE /scope/snapshots/{name}": _FILES,
    "GET /bundles": _LOOK,
    "POST /bundles": _FILES,
    "PUT /bundles/armed": _STATION,
    "GET /bundles/{name}": _LOOK,
    "DELETE /bundles/{name}": _FILES,
    # the audit is not for guests and viewers
    "GET /audit": _STATION,
    "GET /audit/names": _STATION,
    "GET /audit/verify": _STATION,
    "GET /audit/export": _STATION,
    "GET /audit/status": _LOOK,
    # live
    "WS /live": _LOOK,
}

#: Outside the API: the page itself, which shows the log-in, and the viewers.
_PAGE: dict[str, Need] = {
    "GET /": _PUBLIC,
    "GET /index.html": _PUBLIC,
    "GET /favicon.svg": _PUBLIC,
    "GET /assets/{path:path}": _PUBLIC,
    "GET /rerun/{path:path}": _LOOK,
    "WS /rerun/feed": _LOOK,
    "GET /viser/": _LOOK,
    "WS /viser": _LOOK,
}

#: Needs by "METHOD path", with the paths as the application declares them.
ROUTES: dict[str, Need] = {
    f"{method} {API}{path}": need
    for key, need in _API.items()
    for method, _, path in [key.partition(" ")]
} | _PAGE


@dataclass(frozen=True, slots=True)
class Matched:
    """A need that applies to a request, with the drive in its path."""

    need: Need
    drive: str | None
    route: str
    """Key of the need in `ROUTES`."""


_STOP_ROUTE = ("POST", f"{API}/stop")


class Policy:
    """Finds what a request needs. If several patterns match a path, all their needs must be met."""

    def __init__(self, routes: dict[str, Need] | None = None) -> None:
        self._patterns: list[tuple[str, re.Pattern[str], Need, str]] = []
        for key, need in (ROUTES if routes is None else routes).items():
            method, _, path = key.partition(" ")
            self._patterns.append((method, compile_path(path)[0], need, key))

    def needs(self, method: str, path: str) -> list[Matched]:
        """All needs of this request; empty if no route is declared for it."""
        method = "GET" if method == "HEAD" else method
        if not _plain(path):
            return []
        return [
            Matched(need, found.groupdict().get("drive_id"), route)
            for known, pattern, need, route in self._patterns
            if known == method and (found := pattern.match(path))
        ]

    def is_stop(self, method: str, path: str) -> bool:
        """Whether this is STOP, which must not wait for anything else."""
        return (method, path) == _STOP_ROUTE

    def methods(self, path: str) -> list[str]:
        """HTTP methods that are declared for a path."""
        if not _plain(path):
            return []
        return sorted({m for m, pattern, *_ in self._patterns if m != "WS" and pattern.match(path)})


def _plain(path: str) -> bool:
    """Whether the path contains no "." or ".." segment and no NUL."""
    return not any(part in (".", "..") for part in path.split("/")) and "\0" not in path
