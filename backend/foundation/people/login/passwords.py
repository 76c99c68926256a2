"""Passwords: which are accepted, and how they are hashed (argon2id)."""

from __future__ import annotations

import secrets
from base64 import b64encode

from argon2 import PasswordHasher
from argon2.exceptions import InvalidHashError, VerificationError
from argon2.low_level import ARGON2_VERSION

from drivers.errors import NotAllowed
from drivers.texts.message import text

MIN_LENGTH = 10
MAX_LENGTH = 200

#: One lane: hashing must not take both cores from a cyclic exchange. 64 MiB and three passes
#: are the second choice of RFC 9106 clause 4, which asks for four lanes.
DEFAULT = PasswordHasher(time_cost=3, memory_cost=64 * 1024, parallelism=1)


class Passwords:
    """Hashes and verifies passwords. Both take tens of milliseconds and belong on a thread."""

    def __init__(self, hasher: PasswordHasher = DEFAULT) -> None:
        self._hasher = hasher
        #: Hash to verify against where the account does not exist, so that
        #: the answer takes as long.
        self.decoy = _random_hash(hasher)

    def hash(self, password: str) -> str:
        """Hash a password; returns the string to store."""
        return self._hasher.hash(password)

    def verify(self, kept: str, password: str) -> bool:
        """Whether this is the password of the stored hash."""
        try:
            return self._hasher.verify(kept, password)
        except (VerificationError, InvalidHashError):
            return False


def _random_hash(hasher: PasswordHasher) -> str:
    """Encoded as a hash of ``hasher``, but of no known password, and made without hashing."""
    salt, digest = (
        b64encode(secrets.token_bytes(length)).rstrip(b"=").decode()
        for length in (hasher.salt_len, hasher.hash_len)
    )
    cost = f"m={hasher.memory_cost},t={hasher.time_cost},p={hasher.parallelism}"
    return f"$argon2{hasher.type.name.lower()}$v={ARGON2_VERSION}${cost}${salt}${digest}"


def require_good(password: str, name: str) -> None:
    """Check length, and that it is not the name; no character classes (NIST SP 800-63B 5.1.1.2).

    Raises:
        NotAllowed: too short, too long, the name with fewer than six more characters, or fewer than
        four different characters.
    """
    if not MIN_LENGTH <= len(password) <= MAX_LENGTH:
        raise NotAllowed(
            "people.password-needs-characters",
            limit=text("limit.length", least=MIN_LENGTH, most=MAX_LENGTH),
            min_length=MIN_LENGTH,
            max_length=MAX_LENGTH,
        )
    if name and name.casefold() in password.casefold() and len(password) < len(name) + 6:
        raise NotAllowed("people.password-name")
    if len(set(password)) < 4:
        raise NotAllowed("people.password-repeats-itself")
