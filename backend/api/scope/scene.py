"""The 3D scene served from our own origin: viser's page, and its websocket relayed.

viser listens on loopback only and has no log-in, so that it can be reached only through here.
Nothing that a page sends is relayed: the scene is for viewing, and viser would open a tunnel to a
server on the internet for any client that requests one.
"""

from __future__ import annotations

import asyncio
import base64
import contextlib
import hashlib
import re
from functools import cache
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

from fastapi import FastAPI, Response, WebSocket, WebSocketDisconnect
from websockets.asyncio.client import connect
from websockets.exceptions import WebSocketException
from websockets.typing import Subprotocol

from backend.scene.feed import SceneFeed

SEND_TIMEOUT_S = 10.0
#: viser's own panel shows internals (scene tree, server address) and covers a phone's screen.
_NO_PANEL = (
    "<style>.mantine-Paper-root:not(.mantine-Notification-root){display:none!important}</style>"
)
#: viser prepares to sort Gaussian splats, which our scenes do not contain, and its sorter generates
#: code from text. The policy refuses that, as it refuses all other code from text; this script
#: hides the resulting error in the console, which has no effect.
_NO_SPLATS = (
    "<script>addEventListener('unhandledrejection',(e)=>{"
    "if(e.reason instanceof EvalError)e.preventDefault()})</script>"
)
_SCRIPT = re.compile(r"<script[^>]*>(.*?)</script>", re.DOTALL)


def install(app: FastAPI, feed: SceneFeed) -> None:
    """Add the routes of the scene."""

    @app.get("/viser/", include_in_schema=False)
    async def scene_page() -> Response:
        text, policy = await asyncio.to_thread(_page)
        headers = {"Content-Security-Policy": policy, "Cache-Control": "no-cache"}
        return Response(text, media_type="text/html", headers=headers)

    @app.websocket("/viser")
    async def scene(socket: WebSocket) -> None:
        protocol = _protocol()
        if protocol not in socket.scope.get("subprotocols", []):
            await socket.close(code=1002)
            return
        port = await feed.join()
        try:
            await socket.accept(subprotocol=protocol)
            await _pass_on(socket, port, protocol)
        finally:
            await feed.leave()


async def _pass_on(socket: WebSocket, port: int, protocol: str) -> None:
    """Relay viser's messages to the page, until either ends or the page stops receiving."""
    with contextlib.suppress(OSError, WebSocketException, WebSocketDisconnect, TimeoutError):
        async with connect(
            f"ws://127.0.0.1:{port}",
            subprotocols=[Subprotocol(protocol)],
            compression=None,
            max_size=None,
            proxy=None,
        ) as upstream:
            gone = asyncio.create_task(_until_gone(socket))
            try:
                while not gone.done():
                    receiving = asyncio.ensure_future(upstream.recv(decode=False))
                    await asyncio.wait({receiving, gone}, return_when=asyncio.FIRST_COMPLETED)
                    if not receiving.done():
                        receiving.cancel()
                        break
                    async with asyncio.timeout(SEND_TIMEOUT_S):
                        await socket.send_bytes(receiving.result())
            finally:
                gone.cancel()
    with contextlib.suppress(RuntimeError, WebSocketDisconnect):
        await socket.close()


async def _until_gone(socket: WebSocket) -> None:
    """Discard what the page sends, until it leaves."""
    while (await socket.receive())["type"] != "websocket.disconnect":
        pass


def _protocol() -> str:
    """Subprotocol with viser's version: client and server must be of the same one."""
    return f"viser-v{version('viser')}"


@cache
def _page() -> tuple[str, str]:
    """viser's own page, and a policy that allows the scripts in it and nothing else.

    ``strict-dynamic`` is needed because the page unpacks itself: a packed script inserts the real
    one, which cannot be allowed by its hash.
    """
    spec = find_spec("viser")
    if spec is None or spec.origin is None:
        raise FileNotFoundError("viser is not installed")
    text = (Path(spec.origin).parent / "client" / "build" / "index.html").read_text("utf-8")
    text = text.replace("<head>", f"<head>{_NO_SPLATS}", 1)
    hashes = " ".join(
        "'sha256-" + base64.b64encode(hashlib.sha256(s.encode()).digest()).decode() + "'"
        for s in _SCRIPT.findall(text)
    )
    policy = (
        f"default-src 'self'; script-src {hashes} 'strict-dynamic' 'wasm-unsafe-eval' blob:; "
        "connect-src 'self' blob: data:; img-src 'self' data: blob:; font-src 'self' data:; "
        "style-src 'self' 'unsafe-inline'; worker-src 'self' blob: data:; "
        "frame-ancestors 'self'; base-uri 'none'; form-action 'none'; object-src 'none'"
    )
    return text.replace("</head>", f"{_NO_PANEL}</head>", 1), policy
