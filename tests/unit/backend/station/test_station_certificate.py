"""The station's certificate is trusted by whoever trusts its authority, and for nothing else.

Chains are judged by OpenSSL as a browser would (RFC 5280, clause 6), over a real TLS connection.
"""

from __future__ import annotations

import ipaddress
import socket
import ssl
import threading
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID

from backend.foundation.people import tls
from backend.foundation.people.tls import AUTHORITY_FILE, Certificate, station_certificate

NAMES = ["localhost", "127.0.0.1", "::1", "box", "box.local", "192.168.1.7", "203.0.113.9"]


def handshake(made: Certificate, authority: Path, name: str) -> str:
    """Empty where a client that trusts ``authority`` accepts the server as ``name``."""
    server = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    server.load_cert_chain(made.certificate, made.key)
    client = ssl.create_default_context(cafile=str(authority))
    here, there = socket.socketpair()

    def serve() -> None:
        try:
            server.wrap_socket(there, server_side=True).close()
        except OSError:
            there.close()

    answering = threading.Thread(target=serve)
    answering.start()
    try:
        client.wrap_socket(here, server_hostname=name).close()
    except ssl.SSLCertVerificationError as error:
        return error.verify_message
    finally:
        here.close()
        answering.join()
    return ""


def test_who_trusts_the_authority_trusts_the_station(tmp_path: Path) -> None:
    made = station_certificate(tmp_path, NAMES)
    for name in ("localhost", "127.0.0.1", "box", "box.local", "192.168.1.7"):
        assert handshake(made, tmp_path / AUTHORITY_FILE, name) == ""
    assert "mismatch" in handshake(made, tmp_path / AUTHORITY_FILE, "elsewhere.example").lower()
    assert not made.own
    assert made.authority != made.fingerprint
    for key in ("key.pem", "authority-key.pem"):
        assert (tmp_path / key).stat().st_mode & 0o777 == 0o600


def test_another_station_is_not_trusted(tmp_path: Path) -> None:
    made = station_certificate(tmp_path / "one", NAMES)
    station_certificate(tmp_path / "other", NAMES)
    assert handshake(made, tmp_path / "other" / AUTHORITY_FILE, "box.local")


@pytest.mark.parametrize("name", ["bank.example", "203.0.113.9", "notlocal"])
def test_with_the_stolen_key_nobody_can_be_somebody_else(tmp_path: Path, name: str) -> None:
    station_certificate(tmp_path, NAMES)
    authority = x509.load_pem_x509_certificate((tmp_path / AUTHORITY_FILE).read_bytes())
    stolen = serialization.load_pem_private_key((tmp_path / "authority-key.pem").read_bytes(), None)
    assert isinstance(stolen, ec.EllipticCurvePrivateKey)
    secret = ec.generate_private_key(ec.SECP256R1())
    try:
        general: x509.GeneralName = x509.IPAddress(ipaddress.ip_address(name))
    except ValueError:
        general = x509.DNSName(name)
    forged = (
        x509.CertificateBuilder()
        .subject_name(x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "forged")]))
        .issuer_name(authority.subject)
        .public_key(secret.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(datetime.now(UTC) - timedelta(days=1))
        .not_valid_after(datetime.now(UTC) + timedelta(days=1))
        .add_extension(x509.SubjectAlternativeName([general]), critical=False)
        .sign(stolen, hashes.SHA256())
    )
    pem = serialization.Encoding.PEM
    (tmp_path / "forged.pem").write_bytes(forged.public_bytes(pem))
    (tmp_path / "forged-key.pem").write_bytes(
        secret.private_bytes(pem, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
    )
    made = Certificate(tmp_path / "forged.pem", tmp_path / "forged-key.pem", "", own=False)
    assert "subtree" in handshake(made, tmp_path / AUTHORITY_FILE, name)


def test_it_stays_while_it_serves_and_the_authority_outlives_it(tmp_path: Path) -> None:
    first = station_certificate(tmp_path, NAMES)
    assert station_certificate(tmp_path, NAMES) == first
    # An address that comes changes nothing; a name does, and the authority stays.
    assert station_certificate(tmp_path, [*NAMES, "10.0.0.1"]) == first
    renamed = station_certificate(tmp_path, [*NAMES, "cabinet-3.local"])
    assert renamed.fingerprint != first.fingerprint
    assert renamed.authority == first.authority
    assert handshake(renamed, tmp_path / AUTHORITY_FILE, "cabinet-3.local") == ""
    # A name that it may not vouch for takes a new one.
    moved = station_certificate(tmp_path, [*NAMES, "box.works.example"])
    assert moved.authority != first.authority
    assert handshake(moved, tmp_path / AUTHORITY_FILE, "box.works.example") == ""


def test_it_is_renewed_in_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = station_certificate(tmp_path, NAMES)
    # Phones refuse servers that are valid for more than 825 days.
    known = x509.load_pem_x509_certificate(first.certificate.read_bytes())
    assert known.not_valid_after_utc - known.not_valid_before_utc <= timedelta(days=825)
    monkeypatch.setattr(tls, "RENEW", tls.LIFETIME)
    second = station_certificate(tmp_path, NAMES)
    assert second.fingerprint != first.fingerprint
    assert second.authority == first.authority


@pytest.mark.parametrize(
    "file", ["certificate.pem", "key.pem", "authority.pem", "authority-key.pem"]
)
def test_what_is_damaged_is_made_anew(tmp_path: Path, file: str) -> None:
    station_certificate(tmp_path, NAMES)
    (tmp_path / file).write_bytes(b"damaged")
    made = station_certificate(tmp_path, NAMES)
    assert handshake(made, tmp_path / AUTHORITY_FILE, "box.local") == ""


@pytest.mark.parametrize("key", ["key.pem", "authority-key.pem"])
def test_the_key_of_another_station_is_not_used(tmp_path: Path, key: str) -> None:
    station_certificate(tmp_path / "one", NAMES)
    station_certificate(tmp_path / "other", NAMES)
    (tmp_path / "one" / key).write_bytes((tmp_path / "other" / key).read_bytes())
    made = station_certificate(tmp_path / "one", NAMES)
    assert handshake(made, tmp_path / "one" / AUTHORITY_FILE, "box.local") == ""


def test_the_certificate_of_an_earlier_version_gives_way(tmp_path: Path) -> None:
    """Up to 0.2.0 it was signed by itself: no phone can be made to trust that."""
    secret = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "servodeck box")])
    before = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(secret.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(datetime.now(UTC) - timedelta(days=1))
        .not_valid_after(datetime.now(UTC) + timedelta(days=1800))
        .add_extension(
            x509.SubjectAlternativeName([x509.DNSName("box"), x509.DNSName("box.local")]), False
        )
        .sign(secret, hashes.SHA256())
    )
    pem = serialization.Encoding.PEM
    (tmp_path / "certificate.pem").write_bytes(before.public_bytes(pem))
    (tmp_path / "key.pem").write_bytes(
        secret.private_bytes(pem, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
    )
    made = station_certificate(tmp_path, ["box", "box.local"])
    assert handshake(made, tmp_path / AUTHORITY_FILE, "box.local") == ""
