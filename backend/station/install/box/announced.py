"""The name of the station in the office network: NAME.local, by mDNS (RFC 6762)."""

from __future__ import annotations

import contextlib
import socket
from collections.abc import AsyncIterator, Callable, Sequence

from backend.station.install.box.kept import Box

_SERVICE = "_https._tcp.local."


@contextlib.asynccontextmanager
async def announced(
    box: Box, addresses: Sequence[str], port: int, failed: Callable[[str], None]
) -> AsyncIterator[None]:
    """Publish the name on the ports with these IPv4 addresses, and on no others.

    Where that is not possible, ``failed`` is called with the reason (such as another computer with
    the same name) and the server continues.
    """
    from zeroconf import Error, IPVersion
    from zeroconf.asyncio import AsyncServiceInfo, AsyncZeroconf

    try:
        responder = AsyncZeroconf(interfaces=list(addresses), ip_version=IPVersion.V4Only)
    except (OSError, Error) as error:
        failed(str(error))
        yield
        return
    service = AsyncServiceInfo(
        _SERVICE,
        f"servodeck {box.name}.{_SERVICE}",
        port=port,
        addresses=[socket.inet_aton(address) for address in addresses],
        server=f"{box.name}.local.",
    )
    try:
        try:
            # Probes first whether the name is in use (clause 8.1), then announces it twice.
            await (await responder.async_register_service(service))
        except (OSError, Error) as error:
            failed(str(error) or type(error).__name__)
        yield
    finally:
        await responder.async_close()
