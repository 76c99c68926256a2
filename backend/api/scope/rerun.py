"""The rerun viewer served from our own origin: its files, the page around it, and the live feed."""

from __future__ import annotations

import asyncio
import contextlib
from pathlib import Path

from fastapi import FastAPI, Request, Response, WebSocket, WebSocketDisconnect
from fastapi.responses import FileResponse

from backend.api.messages.errors import NotFound
from backend.records.recording.rerun_assets import FILES, ViewerAssets
from backend.station.recording.rerun_feed import RerunFeed
from drivers.errors import NotAllowed

_FOLDER = Path(__file__).resolve().parents[2] / "records" / "recording" / "viewer"
#: The viewer is WebAssembly; the browser may compile it on this page only.
_POLICY = (
    "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; connect-src 'self'; "
    "img-src 'self' data: blob:; style-src 'self' 'unsafe-inline'; worker-src 'self' blob:; "
    "frame-ancestors 'self'; base-uri 'none'; form-action 'none'; object-src 'none'"
)
_HEADERS = {"Content-Security-Policy": _POLICY, "Cache-Control": "no-cache"}
_FOREVER = "public, max-age=31536000, immutable"
#: Time [s] without a request for a frame after which a page counts as gone.
SILENT_S = 60.0
SEND_TIMEOUT_S = 10.0


def install(app: FastAPI, feed: RerunFeed, assets: ViewerAssets) -> None:
    """Add the routes of the viewer."""

    @app.get("/rerun/", include_in_schema=False)
    async def viewer() -> Response:
        text = (_FOLDER / "index.html").read_text("utf-8").replace("{version}", assets.version)
        return Response(text, media_type="text/html", headers=_HEADERS)

    @app.get("/rerun/viewer.{kind}", include_in_schema=False)
    async def viewer_part(kind: str) -> Response:
        types = {"js": "text/javascript", "css": "text/css"}
        if kind not in types:
            raise NotFound("api-scope.no-viewer", kind=kind)
        return FileResponse(_FOLDER / f"viewer.{kind}", media_type=types[kind], headers=_HEADERS)

    @app.get("/rerun/{version}/{name}", include_in_schema=False)
    async def viewer_file(request: Request, version: str, name: str) -> Response:
        if version != assets.version or name not in FILES:
            raise NotFound("api-scope.viewer-no-version", name=name, version=version)
        if "gzip" not in request.headers.get("accept-encoding", ""):
            raise NotAllowed("api-scope.viewer-sent-compressed")
        path = await assets.file(name)
        return FileResponse(
            path,
            media_type=FILES[name],
            headers={
                "Content-Encoding": "gzip",
                "Cache-Control": _FOREVER,
                "rerun-final-length": str(assets.size(name)),
                "Content-Security-Policy": _POLICY,
            },
        )

    @app.websocket("/rerun/feed")
    async def live_feed(socket: WebSocket) -> None:
        await socket.accept()
        client = feed.join()
        try:
            with contextlib.suppress(WebSocketDisconnect, TimeoutError):
                while True:
                    async with asyncio.timeout(SILENT_S):
                        await socket.receive_text()
                    frame = await client.pull()
                    async with asyncio.timeout(SEND_TIMEOUT_S):
                        await socket.send_bytes(frame)
        finally:
            await feed.leave(client)
