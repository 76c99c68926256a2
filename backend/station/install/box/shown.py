"""The address of the station on its console, as text and as QR code."""

from __future__ import annotations

import io
import socket

import psutil


def phone_address(host: str, port: int) -> str:
    """URL of the station that needs no name server.

    Where the station listens on all ports, it has the address of the port towards the network.
    """
    if host in ("0.0.0.0", "::"):  # noqa: S104 - compared, not bound
        host = _outward() or socket.gethostname().lower()
    return f"https://[{host}]:{port}/" if ":" in host else f"https://{host}:{port}/"


def scan_code(address: str) -> str:
    """A QR code (ISO/IEC 18004) in half blocks, two rows of modules to a line."""
    import segno

    drawn = io.StringIO()
    segno.make(address, error="m", micro=False).terminal(drawn, compact=True)
    return drawn.getvalue()


def _outward() -> str:
    """Address of the port with the default route; without a route, the first of any port."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            # A datagram socket sends nothing by connecting.
            probe.connect(("192.0.2.1", 9))
            return str(probe.getsockname()[0])
        except OSError:
            ports = psutil.net_if_addrs().values()
    found = (one.address for port in ports for one in port if one.family == socket.AF_INET)
    return next((address for address in found if not address.startswith("127.")), "")
