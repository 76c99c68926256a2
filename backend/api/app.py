"""The web application: routes, live websocket, the page, and the checks before them."""

from __future__ import annotations

import asyncio
import mimetypes
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path

from fastapi import FastAPI, Request, Response, WebSocket
from fastapi.responses import FileResponse
from fastapi.routing import APIRoute

import backend
from backend.api.drive import functions as routes_functions
from backend.api.drive import motion_class as routes_motion_class
from backend.api.drive import restore as routes_pending
from backend.api.drive import routes as routes_drive
from backend.api.drive import scales as routes_scales
from backend.api.drive import terminals as routes_io
from backend.api.health import routes as routes_health
from backend.api.health.unattended import Unattended
from backend.api.live.live import LiveHub
from backend.api.messages import errors
from backend.api.messages.described import DescribedApp, refusals
from backend.api.messages.errors import NotFound
from backend.api.people import accounts as routes_accounts
from backend.api.people import session as routes_session
from backend.api.people import support as routes_support
from backend.api.records.audit import routes as routes_audit
from backend.api.records.audit.audited import AuditedAnswers
from backend.api.records.handover import routes as routes_handover
from backend.api.records.library import routes as routes_library
from backend.api.records.sets import lists as routes_lists
from backend.api.records.sets import routes as routes_sets
from backend.api.requests.spoken import Spoken
from backend.api.scope import recordings as routes_recordings
from backend.api.scope import rerun as routes_rerun
from backend.api.scope import routes as routes_scope
from backend.api.scope import scene as routes_scene
from backend.api.security.gate import Gate
from backend.api.security.origin import Addresses
from backend.api.security.socket import OpenSockets
from backend.api.station import adapters as routes_adapters
from backend.api.station import description as routes_description
from backend.api.station import doctor as routes_doctor
from backend.api.station import flight as routes_flight
from backend.api.station import preflight as routes_preflight
from backend.api.station import routes as routes_bench
from backend.api.station.box import routes as routes_box
from backend.api.station.ethercat import eeprom as routes_eeprom
from backend.api.station.ethercat import routes as routes_ethercat
from backend.api.tuning import measure as routes_tune
from backend.axes.functions.forcing import ForcingSessions
from backend.foundation.people.station import People
from backend.records.recording.rerun_assets import ViewerAssets
from backend.scene.feed import SceneFeed
from backend.station.bench import Bench
from backend.station.recording.rerun_feed import RerunFeed
from backend.station.recording.service import Recordings
from drivers.computer.timing import scheduling
from drivers.texts.message import language, text

PREFIX = "/api/v1"
_HERE = Path(__file__).resolve()
#: Folder of the built page: in a wheel, and in a checkout.
_PAGE_FOLDERS = (_HERE.parents[1] / "web", _HERE.parents[2] / "webui" / "dist")

_PROBLEMS = (
    (400, "Not a request of this interface"),
    (401, "Nobody is logged in"),
    (403, "Not for this person, or not from our page"),
    (404, "No such thing"),
    (405, "Not with this method"),
    (408, "The body came too slowly"),
    (409, "Not possible now"),
    (413, "Too large"),
    (422, "Not acceptable"),
    (429, "Too many requests"),
    (502, "Invalid answer"),
    (503, "Link lost"),
    (504, "No answer in time"),
)
_PARTS = (
    routes_bench,
    routes_drive,
    routes_pending,
    routes_eeprom,
    routes_ethercat,
    routes_doctor,
    routes_flight,
    routes_adapters,
    routes_preflight,
    routes_box,
    routes_lists,
    routes_sets,
    routes_handover,
    routes_health,
    routes_description,
    routes_motion_class,
    routes_recordings,
    routes_scope,
    routes_tune,
    routes_functions,
    routes_scales,
    routes_io,
    routes_library,
    routes_audit,
    routes_session,
    routes_accounts,
    routes_support,
)


def make_app(
    bench: Bench,
    *,
    hosts: frozenset[str],
    people: People | None = None,
    behind: frozenset[str] = frozenset(),
    own_addresses: bool = False,
    strict_transport: bool = False,
) -> FastAPI:
    """Make the application of a bench. ``hosts`` are the accepted values of the Host header.

    Without ``people`` there are no accounts and everybody who reaches the server is the same user,
    which is permissible only on the machine's own loopback interface. For ``behind`` and
    ``own_addresses`` see `Addresses`; ``strict_transport`` makes browsers use HTTPS only.
    """

    recordings = Recordings(bench, bench.state_folder / "recordings")
    feed = RerunFeed(bench)
    known = people or People(bench.state_folder)
    sockets = OpenSockets()
    live = LiveHub(bench, known, sockets)
    unattended = Unattended(bench, known)
    axis_store = bench.axis_records
    scene = SceneFeed(bench, lambda drive: axis_store.get(drive).mechanics)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        _build_routes(app)
        # This thread sleeps between answers; when woken, it must run before a
        # browser's longer slices.
        scheduling.short_slice()
        # Whatever fails during start or end, the bench is closed in order: axes lose their power.
        async with AsyncExitStack() as then:
            recordings.open()
            await known.open()
            then.callback(known.close)
            then.push_async_callback(bench.close)
            await bench.restore()
            watch = asyncio.create_task(live.people.run(), name="people")
            then.callback(watch.cancel)
            await unattended.open()
            then.push_async_callback(recordings.close)
            then.push_async_callback(scene.close)
            then.push_async_callback(feed.close)
            # Motion is stopped before a slow disk can delay the end of the server.
            then.push_async_callback(bench.jobs.close)
            then.push_async_callback(unattended.close)
            yield

    app = DescribedApp(
        title="servodeck",
        version=backend.__version__,
        openapi_url=f"{PREFIX}/openapi.json",
        docs_url=None,
        redoc_url=None,
        lifespan=lifespan,
        generate_unique_id_function=_operation_id,
        responses=refusals(_PROBLEMS),
    )
    app.state.bench = bench
    app.state.recordings = recordings
    app.state.unattended = unattended
    app.state.axis_store = axis_store
    app.state.forcing = ForcingSessions(bench.jobs, bench.leases.taken_by)
    errors.install(app)
    app.state.live = live
    app.state.people = known
    for part in _PARTS:
        app.include_router(part.router, prefix=PREFIX)
    app.add_middleware(
        AuditedAnswers, audit=bench.audit, name_of=bench.name_of, stop_path=f"{PREFIX}/stop"
    )

    @app.websocket(f"{PREFIX}/live")
    async def live_socket(socket: WebSocket) -> None:
        await live.serve(socket)

    routes_rerun.install(app, feed, ViewerAssets())
    routes_scene.install(app, scene)
    _add_page(app)
    app.add_middleware(
        Gate,
        people=known,
        leases=bench.leases,
        addresses=Addresses(hosts, behind, own_addresses),
        sockets=sockets,
        strict_transport=strict_transport,
    )
    app.add_middleware(Spoken)
    return app


def _build_routes(app: FastAPI) -> None:
    """Build the routes now; the first request would otherwise wait a quarter of a second."""
    nowhere = {"type": "http", "method": "GET", "path": PREFIX, "root_path": "", "headers": []}
    for route in app.routes:
        route.matches(nowhere)


def _operation_id(route: APIRoute) -> str:
    return route.name


def _add_page(app: FastAPI) -> None:
    folder = next((f for f in _PAGE_FOLDERS if (f / "index.html").is_file()), None)

    @app.get("/{path:path}", include_in_schema=False)
    async def page(path: str, request: Request) -> Response:
        if path.startswith("api/"):
            raise NotFound("api.nothing", path=path)
        if folder is None:
            return Response(
                text("api.page-not-built").words(language()),
                status_code=503,
                media_type="text/plain",
            )
        wanted = (folder / path).resolve()
        if path and wanted.is_relative_to(folder) and wanted.is_file():
            # The names of assets contain a hash of their contents.
            forever = "public, max-age=31536000, immutable"
            cache = forever if path.startswith("assets/") else "no-cache"
            headers = {"Cache-Control": cache, "Vary": "Accept-Encoding"}
            packed = wanted.with_name(f"{wanted.name}.gz")
            if "gzip" in request.headers.get("accept-encoding", "") and packed.is_file():
                headers["Content-Encoding"] = "gzip"
                kind = mimetypes.guess_type(wanted.name)[0]
                return FileResponse(packed, headers=headers, media_type=kind)
            return FileResponse(wanted, headers=headers)
        if path.startswith("assets/"):
            raise NotFound("api.no", path=path)
        return FileResponse(folder / "index.html", headers={"Cache-Control": "no-cache"})
