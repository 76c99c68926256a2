"""Starting the server: the socket, the browser, and the shutdown."""

from __future__ import annotations

import asyncio
import socket
import webbrowser
from pathlib import Path

import platformdirs
import uvicorn

from backend.api.app import make_app
from backend.bench import Bench
from drivers.errors import NotAllowed

LOOPBACK = frozenset({"127.0.0.1", "localhost", "[::1]"})


def state_folder(chosen: Path | None) -> Path:
    """Where the list of drives and the parameter sets are kept."""
    return chosen or Path(platformdirs.user_data_dir("servodeck"))


async def serve(bench: Bench, host: str, port: int, *, open_page: bool) -> None:
    """Serve until interrupted. Port 0 takes a free one; the address is printed.

    Raises:
        NotAllowed: the port is taken, or the host is not this machine's loopback.
    """
    if host not in LOOPBACK and host != "::1":
        raise NotAllowed(
            f"servodeck serves only this machine; {host} would open it to the network without "
            "accounts",
            value=host,
            limit="127.0.0.1, localhost, ::1",
            remedy="reach it from afar through an SSH tunnel to this machine",
        )
    listening = _listen(host, port)
    shown = f"http://{'localhost' if host in LOOPBACK else f'[{host}]'}:"
    shown += f"{listening.getsockname()[1]}/"
    config = uvicorn.Config(
        make_app(bench, hosts=LOOPBACK),
        log_level="warning",
        ws_per_message_deflate=False,
        ws_max_size=1 << 20,
        timeout_graceful_shutdown=3,
    )
    server = uvicorn.Server(config)
    running = asyncio.create_task(server.serve(sockets=[listening]))
    while not server.started and not running.done():
        await asyncio.sleep(0.02)
    if server.started:
        print(f"servodeck is at {shown}  (Ctrl+C ends it)", flush=True)
        if open_page:
            webbrowser.open(shown)
    await running


def _listen(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listening = socket.socket(family, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind((host, port))
    except OSError as error:
        listening.close()
        raise NotAllowed(
            f"port {port} of {host} cannot be used: {error.strerror}",
            value=port,
            remedy="end the program that uses it, or choose another with --port",
        ) from error
    listening.listen(128)
    return listening
