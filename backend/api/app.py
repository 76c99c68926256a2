"""The web application: routes, live websocket, the page, and the checks before them."""

from __future__ import annotations

from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path

from fastapi import APIRouter, FastAPI, Request, Response, WebSocket
from fastapi.responses import FileResponse
from fastapi.routing import APIRoute

import backend
from backend.api import (
    errors,
    routes_audit,
    routes_bench,
    routes_description,
    routes_drive,
    routes_ethercat,
    routes_functions,
    routes_io,
    routes_library,
    routes_lists,
    routes_recordings,
    routes_rerun,
    routes_scope,
    routes_sets,
    routes_tune,
)
from backend.api.audited import AuditedAnswers
from backend.api.errors import NotFound, answer, problem_of
from backend.api.live import LiveHub
from backend.api.models import Problem
from backend.axis_store import AxisStore
from backend.bench import Bench
from backend.forcing import ForcingSessions
from backend.recording.rerun_assets import ViewerAssets
from backend.recording.rerun_feed import RerunFeed
from backend.recording.service import Recordings
from drivers.errors import NotAllowed

PREFIX = "/api/v1"
_HERE = Path(__file__).resolve()
#: Where a wheel carries the built page, and where a checkout has it.
_PAGE_FOLDERS = (_HERE.parents[1] / "web", _HERE.parents[2] / "webui" / "dist")

_SECURITY_HEADERS = {
    "Content-Security-Policy": (
        "default-src 'self'; connect-src 'self'; img-src 'self' data: blob:; "
        "style-src 'self' 'unsafe-inline'; worker-src 'self' blob:; frame-ancestors 'self'; "
        "base-uri 'none'; form-action 'self'; object-src 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
}


def make_app(bench: Bench, *, hosts: frozenset[str]) -> FastAPI:
    """The application over a bench. ``hosts`` are the Host names that it answers to."""

    recordings = Recordings(bench, bench.state_folder / "recordings")
    feed = RerunFeed(bench)

    @asynccontextmanager
    async def lifespan(_app: FastAPI) -> AsyncIterator[None]:
        recordings.open()
        await bench.restore()
        yield
        # What moves is stopped before a slow disk may keep the server waiting.
        await bench.jobs.close()
        await feed.close()
        await recordings.close()
        await bench.close()

    app = FastAPI(
        title="servodeck",
        version=backend.__version__,
        openapi_url=f"{PREFIX}/openapi.json",
        docs_url=None,
        redoc_url=None,
        lifespan=lifespan,
        generate_unique_id_function=_operation_id,
        responses={
            status: {"model": Problem, "description": text}
            for status, text in (
                (404, "No such thing"),
                (409, "Not possible now"),
                (422, "Not acceptable"),
                (502, "The answer makes no sense"),
                (503, "The link is gone"),
                (504, "No answer in time"),
            )
        },
    )
    app.state.bench = bench
    app.state.recordings = recordings
    app.state.axis_store = AxisStore(bench.state_folder / "axes")
    app.state.forcing = ForcingSessions(bench.jobs, bench.leases)
    errors.install(app)
    live = LiveHub(bench)
    app.state.live = live
    api = APIRouter(prefix=PREFIX)
    for part in (
        routes_bench,
        routes_drive,
        routes_ethercat,
        routes_lists,
        routes_sets,
        routes_description,
        routes_recordings,
        routes_scope,
        routes_tune,
        routes_functions,
        routes_io,
        routes_library,
        routes_audit,
    ):
        api.include_router(part.router)
    app.include_router(api)
    app.add_middleware(AuditedAnswers, audit=bench.audit, stop_path=f"{PREFIX}/stop")

    @app.websocket(f"{PREFIX}/live")
    async def live_socket(socket: WebSocket) -> None:
        if not _allowed(socket.headers.get("host"), socket.headers.get("origin"), hosts):
            await socket.close(code=1008)
            return
        await live.serve(socket)

    routes_rerun.install(
        app,
        feed,
        ViewerAssets(),
        lambda s: _allowed(s.headers.get("host"), s.headers.get("origin"), hosts),
    )

    @app.middleware("http")
    async def guard(
        request: Request, call_next: Callable[[Request], Awaitable[Response]]
    ) -> Response:
        if not _allowed(request.headers.get("host"), request.headers.get("origin"), hosts):
            refusal = NotAllowed(
                "this address of the server is not one that it answers to",
                value=request.headers.get("host"),
                limit=", ".join(sorted(hosts)),
                remedy="open the address that the terminal shows",
            )
            problem = problem_of(refusal)
            return answer(problem.model_copy(update={"status": 403, "title": "Forbidden"}))
        response = await call_next(request)
        for name, value in _SECURITY_HEADERS.items():
            response.headers.setdefault(name, value)
        return response

    _add_page(app)
    return app


def _operation_id(route: APIRoute) -> str:
    return route.name


def _allowed(host: str | None, origin: str | None, hosts: frozenset[str]) -> bool:
    """Host must be ours (DNS rebinding), and a browser's Origin the same host."""
    if host is None or _name(host) not in hosts:
        return False
    return origin is None or origin.split("://", 1)[-1] == host


def _name(host: str) -> str:
    if host.startswith("["):
        return host.split("]", 1)[0] + "]"
    return host.rsplit(":", 1)[0] if ":" in host else host


def _add_page(app: FastAPI) -> None:
    folder = next((f for f in _PAGE_FOLDERS if (f / "index.html").is_file()), None)

    @app.get("/{path:path}", include_in_schema=False)
    async def page(path: str) -> Response:
        if path.startswith("api/"):
            raise NotFound(f"there is nothing at /{path}", remedy=f"see {PREFIX}/openapi.json")
        if folder is None:
            return Response(
                "The web page is not built. Run `make install` and start again.",
                status_code=503,
                media_type="text/plain",
            )
        wanted = (folder / path).resolve()
        if path and wanted.is_relative_to(folder) and wanted.is_file():
            # Assets carry a hash of their contents in the name.
            forever = "public, max-age=31536000, immutable"
            cache = forever if path.startswith("assets/") else "no-cache"
            return FileResponse(wanted, headers={"Cache-Control": cache})
        if path.startswith("assets/"):
            raise NotFound(f"there is no {path}")
        return FileResponse(folder / "index.html", headers={"Cache-Control": "no-cache"})
