"""Start of the server: access, socket, certificate and shutdown."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import ssl
import sys
import webbrowser
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from pathlib import Path

import httpx
import uvicorn
from pydantic import ValidationError

from backend.api.admission.accepting import AcceptingSocket
from backend.api.app import make_app
from backend.api.security.protocol import AcceptingConfig, PatientProtocol, PatientSocket
from backend.api.station.models import Health
from backend.commands.base.printing import print_text
from backend.foundation.people.login.marker import AccountsMarker
from backend.foundation.people.station import People
from backend.foundation.people.tls import (
    Certificate,
    machine_names,
    own_certificate,
    station_certificate,
)
from backend.foundation.store.database import FILE
from backend.foundation.work import libraries
from backend.foundation.work.journal import Entry
from backend.station.bench import Bench
from backend.station.install.box.announced import announced
from backend.station.install.box.kept import Box, names_of, read
from backend.station.install.box.roles import addresses_of
from backend.station.install.box.shown import phone_address, scan_code
from drivers.computer.network.sockets import take_port_alone
from drivers.computer.processes import raise_descriptors
from drivers.computer.timing import scheduling
from drivers.errors import Busy, NotAllowed
from profiles import load_all
from profiles.loader import ProfileError

LOOPBACK = frozenset({"127.0.0.1", "localhost", "[::1]"})
#: Largest message of a page, whose messages are small; a larger one is an attack or a defect.
WS_MAX_BYTES = 64 << 10
#: Period of pings, and timeout of their answers [s]. A connection that is dead but not closed (lid
#: shut, cable pulled) ends after both together. Control, jog and enabling button end earlier, by
#: their own timeouts.
PING_S, PONG_S = 5.0, 10.0
#: Connections that the system holds until they are accepted; the system has its own limit as well.
#: A client that finds no room tries again after a second.
BACKLOG = 2048
#: Open files and connections; the default limit of a process is often a thousand.
DESCRIPTORS = 8192
#: Time for the answer of a server that runs already [s].
_LOOK_S = 3.0


#: Modules that are imported only after the start, so that the page is available sooner.
LATE = (*libraries.COMPUTING, "backend.report.render.pdf")


@dataclass(frozen=True, slots=True)
class Serving:
    """Settings of the server.

    ``accounts``: None requires a login where accounts exist or the address is not loopback.
    ``behind``: host names of a proxy or tunnel in front, which terminates TLS itself.
    """

    host: str = "127.0.0.1"
    port: int = 8420
    accounts: bool | None = None
    certificate: Path | None = None
    key: Path | None = None
    behind: frozenset[str] = frozenset()
    open_page: bool = False

    @property
    def on_loopback(self) -> bool:
        """Whether only this computer can reach the server."""
        return self.host in LOOPBACK or self.host == "::1"


async def serve(
    bench: Bench, serving: Serving, ready: Callable[[], Awaitable[object]] | None = None
) -> None:
    """Serve until interrupted. Port 0 takes a free port; the address is printed.

    ``ready`` is awaited once the server answers, before the address is printed. Where a server of
    this state folder runs already, its page is opened if that was asked for, and nothing started.

    Raises:
        Busy: another server uses the state folder.
        NotAllowed: the port is in use, the certificate is not valid, or others could have access
            without an account.
    """
    try:
        bench.records.claim()
    except Busy:
        if not (serving.open_page and await _answers(serving)):
            raise
        shown = _address(serving, None, serving.port)
        print_text("printed.server-runs-already", url=shown)
        webbrowser.open(shown)
        return
    try:
        await _serve_claimed(bench, serving, ready)
    finally:
        bench.records.release()


async def _answers(serving: Serving) -> bool:
    """Whether a servodeck answers at this address of this computer."""
    if not serving.on_loopback or serving.port == 0:
        return False
    address = f"{_address(serving, None, serving.port)}api/v1/health"
    try:
        async with httpx.AsyncClient(timeout=_LOOK_S, trust_env=False) as client:
            Health.model_validate_json((await client.get(address)).content)
    except (httpx.HTTPError, ValidationError):
        return False
    return True


async def _serve_claimed(
    bench: Bench, serving: Serving, ready: Callable[[], Awaitable[object]] | None
) -> None:
    needed = await accounts_needed(bench.state_folder, serving)
    box = _box(bench.state_folder)
    people = People(bench.state_folder, accounts_needed=needed)
    certificate = _certificate(bench.state_folder, serving, box)
    listening = _listen(serving.host, serving.port)
    config = _config(bench, people, serving, certificate, names_of(box))
    config.accepting = [listening]
    raise_descriptors(DESCRIPTORS)
    server = uvicorn.Server(config)
    running = asyncio.create_task(server.serve(sockets=[listening]))
    while not server.started and not running.done():
        await asyncio.sleep(0.02)
    if server.started:
        if ready is not None:
            await ready()
        port = listening.getsockname()[1]
        shown = _address(serving, certificate, port)
        _print_addresses(shown, people, certificate)
        if people.setup_needed and not serving.on_loopback:
            _print_phone_address(phone_address(serving.host, port))
        _print_problems(bench)
        if serving.open_page:
            webbrowser.open(shown)
        async with _known_by_name(box, serving, port):
            await settle()
            await running
    await running


def _box(folder: Path) -> Box | None:
    """Name and ports of the station; None where the file is missing or cannot be read.

    An unreadable file does not prevent the start: opening EtherCAT is refused where it matters.
    """
    try:
        return read(folder)
    except NotAllowed as error:
        print_text("printed.note-beside", words=str(error.text))
        return None


def _print_phone_address(address: str) -> None:
    print_text("printed.scan-code", url=address)
    print(scan_code(address), flush=True)


def _known_by_name(
    box: Box | None, serving: Serving, port: int
) -> contextlib.AbstractAsyncContextManager[None]:
    addresses = addresses_of(box.office) if box is not None else []
    if box is None or serving.on_loopback or not addresses:
        return contextlib.nullcontext()

    def failed(cause: str) -> None:
        print_text("printed.box-name-taken", name=box.name, cause=cause)

    return announced(box, addresses, port, failed)


#: Time [s] after which a computing thread yields to the event loop. STOP needs the interpreter some
#: twenty times, and a thread that reads a file delays it each time (Python's default: 5 ms).
_SWITCH_S = 0.0005


async def settle() -> None:
    """Load profiles and libraries and tune the interpreter, so that requests do not wait for it."""
    sys.setswitchinterval(_SWITCH_S)
    # A profile that cannot be read is reported where it is used, and does not stop the server.
    with contextlib.suppress(ProfileError, OSError, UnicodeDecodeError):
        await asyncio.to_thread(load_all)
    await asyncio.to_thread(libraries.load, LATE)
    scheduling.spare_collector()


async def accounts_needed(folder: Path, serving: Serving) -> bool:
    """Whether people must log in.

    Raises:
        NotAllowed: no login was requested although others could reach the server.
        AccountsMissing: a login was required before, and there are no accounts any more.
        DatabaseFailed: the accounts cannot be read.
    """
    reachable = not serving.on_loopback or bool(serving.behind)
    if reachable and serving.accounts is False:
        raise NotAllowed(
            "command.without-accounts-servodeck-serves",
            value=serving.host,
            limit="127.0.0.1, localhost, ::1",
        )
    if serving.accounts is False:
        return False
    asked = serving.accounts is True or reachable
    if not (folder / FILE).is_file() and not AccountsMarker(folder).exists:
        return asked
    people = People(folder, accounts_needed=True)
    try:
        await people.open()
        return asked or people.accounts.directory.is_set_up
    finally:
        people.close()


def _certificate(folder: Path, serving: Serving, box: Box | None) -> Certificate | None:
    if serving.certificate is not None and serving.key is not None:
        return own_certificate(serving.certificate, serving.key)
    if serving.certificate is not None or serving.key is not None:
        raise NotAllowed("command.certificate-key-belong-together")
    if serving.on_loopback:
        return None
    return station_certificate(folder / "tls", {*machine_names(), *names_of(box)})


def _config(
    bench: Bench,
    people: People,
    serving: Serving,
    certificate: Certificate | None,
    own_names: frozenset[str] = frozenset(),
) -> AcceptingConfig:
    names = LOOPBACK | own_names
    if not serving.on_loopback:
        names |= {f"[{n}]" if ":" in n else n for n in machine_names()}
    own = certificate is not None and certificate.own
    app = make_app(
        bench,
        hosts=names,
        people=people,
        behind=serving.behind,
        own_addresses=not serving.on_loopback,
        strict_transport=own,
    )
    config = AcceptingConfig(
        app,
        log_level="warning",
        http=PatientProtocol,
        ws=PatientSocket,
        ws_per_message_deflate=False,
        ws_max_size=WS_MAX_BYTES,
        ws_ping_interval=PING_S,
        ws_ping_timeout=PONG_S,
        backlog=BACKLOG,
        timeout_graceful_shutdown=3,
        server_header=False,
        # Proxy headers are trusted only where a proxy was configured.
        proxy_headers=bool(serving.behind),
        ssl_certfile=None if certificate is None else str(certificate.certificate),
        ssl_keyfile=None if certificate is None else str(certificate.key),
    )
    if certificate is not None:
        config.load()
        if config.ssl is not None:
            config.ssl.minimum_version = ssl.TLSVersion.TLSv1_2
    return config


def _address(serving: Serving, certificate: Certificate | None, port: int) -> str:
    scheme = "http" if certificate is None else "https"
    if serving.on_loopback:
        host = "localhost" if serving.host in LOOPBACK else f"[{serving.host}]"
    elif serving.host in ("0.0.0.0", "::"):  # noqa: S104 - compared, not bound
        host = socket.gethostname().lower()
    else:
        host = f"[{serving.host}]" if ":" in serving.host else serving.host
    return f"{scheme}://{host}:{port}/"


def _print_addresses(shown: str, people: People, certificate: Certificate | None) -> None:
    print_text("printed.server-is-at", url=shown)
    if certificate is not None and not certificate.own:
        print_text("printed.own-certificate")
        print(f"  SHA-256 {certificate.fingerprint}", flush=True)
        print_text("printed.own-authority")
        print(f"  SHA-256 {certificate.authority}", flush=True)
    if people.setup_needed:
        print_text("printed.setup-code")
        print(f"  {people.accounts.setup_code}", flush=True)


def _print_problems(bench: Bench) -> None:
    """Print problems of the station itself, such as a database out of reach, present and later."""

    def tell(entry: Entry) -> None:
        if entry.level == "error" and entry.drive is None:
            print_text("printed.note-beside", words=str(entry.text))

    for entry in reversed(bench.journal.entries()):
        tell(entry)
    bench.journal.listen(tell)


def _listen(host: str, port: int) -> AcceptingSocket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    # With the protocol given, asyncio disables Nagle's algorithm, so small answers are not delayed.
    listening = AcceptingSocket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    take_port_alone(listening)
    try:
        listening.bind((host.strip("[]"), port))
    except socket.gaierror as error:
        listening.close()
        raise NotAllowed(
            "command.no-address-computer", value=host, strerror=error.strerror
        ) from error
    except OSError as error:
        listening.close()
        raise NotAllowed(
            "command.port-cannot-used", value=port, host=host, strerror=error.strerror
        ) from error
    listening.listen(BACKLOG)
    return listening
