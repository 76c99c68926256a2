"""TLS certificate of the station: supplied, or issued by the station's own certificate authority.

Phones can be made to trust the authority once; certificates that the station issues later, for
example under another name, are then trusted too. The authority may only certify the names of this
computer, names under .local and addresses of private networks (name constraints, RFC 5280 clause
4.2.1.10): its key, if stolen, cannot be used to impersonate a bank.
"""

from __future__ import annotations

import ipaddress
import os
import socket
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TypeAlias

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from backend.foundation.store.files import write_atomically
from drivers.errors import NotAllowed

#: Longest lifetime that phones accept, also from an authority that their user has installed.
LIFETIME = timedelta(days=820)
AUTHORITY_LIFETIME = timedelta(days=10 * 365)
#: A certificate with less lifetime left is renewed at a start; the authority
#: outlives what it issues.
RENEW = timedelta(days=180)
AUTHORITY_FILE = "authority.pem"
#: Private, link-local and loopback addresses (RFC 1918, 3927, 4193, 4291).
_PRIVATE = (
    "10.0.0.0/8", "172.16.0.0/12", "192.168.0.0/16", "169.254.0.0/16", "127.0.0.0/8",
    "fc00::/7", "fe80::/10", "::1/128",
)  # fmt: skip


_Key: TypeAlias = ec.EllipticCurvePrivateKey


@dataclass(frozen=True, slots=True)
class Certificate:
    """Certificate files of the server.

    ``fingerprint`` is SHA-256 in the form that browsers show, ``authority`` the same of the
    station's authority; empty where the user supplies the certificate (``own``).
    """

    certificate: Path
    key: Path
    fingerprint: str
    own: bool
    authority: str = ""


def own_certificate(certificate: Path, key: Path) -> Certificate:
    """Certificate supplied by the user.

    Raises:
        NotAllowed: a file cannot be read, or is not a certificate.
    """
    try:
        first = x509.load_pem_x509_certificate(certificate.read_bytes())
        key.read_bytes()
    except (OSError, ValueError) as error:
        raise NotAllowed("people.certificate-cannot-used", cause=str(error)) from error
    return Certificate(certificate, key, _fingerprint(first), own=True)


def station_certificate(folder: Path, names: Iterable[str]) -> Certificate:
    """The station's certificate with its authority, made on first use.

    Only the server's user may read the keys. ``names`` are the host names and addresses that the
    certificate is valid for.
    """
    certificate, key = folder / "certificate.pem", folder / "key.pem"
    wanted = sorted(set(names))
    authority = _authority(folder, wanted)
    known = _usable(certificate, key, wanted, authority[0])
    if known is None:
        known = _issue(certificate, key, wanted, *authority)
    return Certificate(
        certificate, key, _fingerprint(known), own=False, authority=_fingerprint(authority[0])
    )


def authority_file(folder: Path) -> Path:
    """The certificate of the authority in the station's state folder, for phones to install."""
    return folder / "tls" / AUTHORITY_FILE


def _authority(folder: Path, names: list[str]) -> tuple[x509.Certificate, _Key]:
    """The stored authority, or a new one if it expires soon or may not certify one of the names."""
    file, key = folder / AUTHORITY_FILE, folder / "authority-key.pem"
    try:
        known = x509.load_pem_x509_certificate(file.read_bytes())
        secret = serialization.load_pem_private_key(key.read_bytes(), None)
        limits = known.extensions.get_extension_for_class(x509.NameConstraints).value
    except (OSError, ValueError, x509.ExtensionNotFound):
        return _found(file, key, names)
    left = known.not_valid_after_utc - datetime.now(UTC)
    if not isinstance(secret, _Key) or secret.public_key() != known.public_key():
        return _found(file, key, names)
    if left < LIFETIME + RENEW:
        return _found(file, key, names)
    domains = [name for name in names if not _is_address(name)]
    if not all(_may_vouch(limits.permitted_subtrees or [], name) for name in domains):
        return _found(file, key, names)
    return known, secret


def _found(file: Path, key: Path, names: list[str]) -> tuple[x509.Certificate, _Key]:
    """Make a new authority; everybody who trusted the previous one must install this one."""
    secret = ec.generate_private_key(ec.SECP256R1())
    title = f"servodeck authority of {socket.gethostname().lower()}"[:64]
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, title)])
    permitted: list[x509.GeneralName] = [x509.DNSName("local"), x509.DNSName("localhost")]
    permitted += [x509.DNSName(name) for name in names if not _is_address(name)]
    permitted += [x509.IPAddress(ipaddress.ip_network(one)) for one in _PRIVATE]
    made = (
        _builder(subject, subject, secret, AUTHORITY_LIFETIME)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(_usage(signs=True), critical=True)
        .add_extension(x509.NameConstraints(permitted, None), critical=True)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(secret.public_key()), False)
        .sign(secret, hashes.SHA256())
    )
    _keep_key(key, secret)
    write_atomically(file, made.public_bytes(serialization.Encoding.PEM))
    return made, secret


def _may_vouch(permitted: Iterable[x509.GeneralName], name: str) -> bool:
    if _is_address(name):
        address = ipaddress.ip_address(name)
        networks = [one.value for one in permitted if isinstance(one, x509.IPAddress)]
        return any(
            isinstance(one, ipaddress.IPv4Network | ipaddress.IPv6Network) and address in one
            for one in networks
        )
    domains = [one.value for one in permitted if isinstance(one, x509.DNSName)]
    return any(name == one or name.endswith(f".{one}") for one in domains)


def _usable(
    certificate: Path, key: Path, names: list[str], authority: x509.Certificate
) -> x509.Certificate | None:
    try:
        known = x509.load_pem_x509_certificate(certificate.read_bytes())
        secret = serialization.load_pem_private_key(key.read_bytes(), None)
        known.verify_directly_issued_by(authority)
        valid = known.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except (OSError, ValueError, TypeError, InvalidSignature, x509.ExtensionNotFound):
        return None
    left = known.not_valid_after_utc - datetime.now(UTC)
    if left < RENEW or secret.public_key() != known.public_key():
        return None
    have = set(valid.get_values_for_type(x509.DNSName))
    have |= {str(a) for a in valid.get_values_for_type(x509.IPAddress)}
    # Users without the authority compare the fingerprint and store an exception: an address that
    # comes and goes must not change the certificate.
    return known if {n for n in names if not _is_address(n)} <= have else None


def _issue(
    certificate: Path, key: Path, names: list[str], authority: x509.Certificate, signs: _Key
) -> x509.Certificate:
    secret = ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, f"servodeck {names[0]}"[:64])])
    limits = authority.extensions.get_extension_for_class(x509.NameConstraints).value
    # A single public address would make the whole certificate invalid.
    names = [name for name in names if _may_vouch(limits.permitted_subtrees or [], name)]
    issuer_key = x509.AuthorityKeyIdentifier.from_issuer_public_key(signs.public_key())
    made = (
        _builder(subject, authority.subject, secret, LIFETIME)
        .add_extension(x509.SubjectAlternativeName([_general(n) for n in names]), critical=False)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(_usage(signs=False), critical=True)
        .add_extension(x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH]), critical=False)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(secret.public_key()), False)
        .add_extension(issuer_key, critical=False)
        .sign(signs, hashes.SHA256())
    )
    _keep_key(key, secret)
    chain = [one.public_bytes(serialization.Encoding.PEM) for one in (made, authority)]
    write_atomically(certificate, b"".join(chain))
    return made


def _builder(
    subject: x509.Name, issuer: x509.Name, secret: _Key, lifetime: timedelta
) -> x509.CertificateBuilder:
    # The clock of a computer that was just switched on may be behind the real time.
    begin = datetime.now(UTC) - timedelta(days=1)
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(secret.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(begin)
        .not_valid_after(begin + lifetime)
    )


def _usage(*, signs: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not signs,
        key_cert_sign=signs,
        crl_sign=signs,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        encipher_only=False,
        decipher_only=False,
    )


def _keep_key(file: Path, secret: _Key) -> None:
    pem = secret.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )
    # Written through a temporary file that only its user may read (tempfile makes it 0600).
    write_atomically(file, pem)
    os.chmod(file, 0o600)  # noqa: PTH101 - the same for every system


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
    """Names and addresses by which this machine can be reached."""
    name = socket.gethostname().lower()
    names = {"localhost", "127.0.0.1", "::1", name}
    if "." not in name:
        names.add(f"{name}.local")
    try:
        found = socket.getaddrinfo(name, None)
    except OSError:
        found = []
    names |= {str(address[4][0]).split("%")[0] for address in found}
    # Address of the interface with the default route; connecting a datagram socket sends nothing.
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))
            names.add(probe.getsockname()[0])
        except OSError:
            pass
    return sorted(names)
