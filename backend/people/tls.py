"""The station's certificate: given, or made once and kept, with its fingerprint to compare."""

from __future__ import annotations

import ipaddress
import os
import socket
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from backend.store.files import write_atomically
from drivers.errors import NotAllowed

LIFETIME = timedelta(days=5 * 365)
#: Made anew when it has less than this left.
RENEW = timedelta(days=30)


@dataclass(frozen=True, slots=True)
class Certificate:
    """Files for the server. ``fingerprint`` is SHA-256 as browsers show it."""

    certificate: Path
    key: Path
    fingerprint: str
    own: bool


def own_certificate(certificate: Path, key: Path) -> Certificate:
    """A certificate that the user brings.

    Raises:
        NotAllowed: a file cannot be read, or is no certificate.
    """
    try:
        first = x509.load_pem_x509_certificate(certificate.read_bytes())
        key.read_bytes()
    except (OSError, ValueError) as error:
        raise NotAllowed("people.certificate-cannot-used", cause=str(error)) from error
    return Certificate(certificate, key, _fingerprint(first), own=True)


def station_certificate(folder: Path, names: Iterable[str]) -> Certificate:
    """The station's own certificate, made on first use; the key is readable by its user only.

    ``names`` are host names and addresses that it is to be valid for.
    """
    certificate, key = folder / "certificate.pem", folder / "key.pem"
    wanted = sorted(set(names))
    known = _usable(certificate, key, wanted)
    if known is None:
        known = _make(certificate, key, wanted)
    return Certificate(certificate, key, _fingerprint(known), own=False)


def _usable(certificate: Path, key: Path, names: list[str]) -> x509.Certificate | None:
    if not key.is_file():
        return None
    try:
        known = x509.load_pem_x509_certificate(certificate.read_bytes())
        valid = known.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except (OSError, ValueError, x509.ExtensionNotFound):
        return None
    if known.not_valid_after_utc - datetime.now(UTC) < RENEW:
        return None
    have = set(valid.get_values_for_type(x509.DNSName))
    have |= {str(a) for a in valid.get_values_for_type(x509.IPAddress)}
    # An address may come and go; a browser compares the fingerprint once and keeps the exception.
    return known if {n for n in names if not _is_address(n)} <= have else None


def _make(certificate: Path, key: Path, names: list[str]) -> x509.Certificate:
    secret = ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, f"servodeck {names[0]}"[:64])])
    begin = datetime.now(UTC) - timedelta(days=1)
    made = (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(subject)
        .public_key(secret.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(begin)
        .not_valid_after(begin + LIFETIME)
        .add_extension(x509.SubjectAlternativeName([_general(n) for n in names]), critical=False)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH]), critical=False)
        .sign(secret, hashes.SHA256())
    )
    pem = secret.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )
    # Written through a file that only its user may read (tempfile makes it 0600).
    write_atomically(key, pem)
    os.chmod(key, 0o600)  # noqa: PTH101 - the same for every system
    write_atomically(certificate, made.public_bytes(serialization.Encoding.PEM))
    return made


def _general(name: str) -> x509.GeneralName:
    if _is_address(name):
        return x509.IPAddress(ipaddress.ip_address(name))
    return x509.DNSName(name)


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _fingerprint(certificate: x509.Certificate) -> str:
    return certificate.fingerprint(hashes.SHA256()).hex(":").upper()


def machine_names() -> list[str]:
    """Names and addresses by which this machine may be reached."""
    name = socket.gethostname().lower()
    names = {"localhost", "127.0.0.1", "::1", name}
    if "." not in name:
        names.add(f"{name}.local")
    try:
        found = socket.getaddrinfo(name, None)
    except OSError:
        found = []
    names |= {str(address[4][0]).split("%")[0] for address in found}
    # The address that faces the network; a datagram socket sends nothing by connecting.
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))
            names.add(probe.getsockname()[0])
        except OSError:
            pass
    return sorted(names)
