"""Secrets and names: how they are made, stored and compared."""

from __future__ import annotations

import hashlib
import hmac
import re
import secrets
import unicodedata

from drivers.errors import NotAllowed
from drivers.texts.message import text

#: Letters and digits that cannot be mistaken for one another when read aloud or copied by hand.
_CLEAR = "ABCDEFGHJKMNPQRSTUVWXYZ23456789"

#: Invisible characters (Default_Ignorable_Code_Point, Unicode Standard 15.0
#: DerivedCoreProperties.txt): they would allow many different spellings of a
#: name that looks the same.
_IGNORABLE = re.compile(
    "[\u00ad\u034f\u061c\u115f\u1160\u17b4\u17b5\u180b-\u180f\u200b-\u200f\u202a-\u202e"
    "\u2060-\u206f\u3164\ufe00-\ufe0f\ufeff\uffa0\ufff0-\ufff8"
    "\U0001bca0-\U0001bca3\U0001d173-\U0001d17a\U000e0000-\U000e0fff]"
)


def new_secret(prefix: str = "") -> str:
    """Make a secret of 32 random bytes, URL-safe base64 after ``prefix``."""
    return prefix + secrets.token_urlsafe(32)


def digest(secret: str) -> str:
    """Hash under which a cookie or token is stored.

    Both are 32 random bytes, so that one SHA-256 (hexadecimal) without salt is enough.
    """
    return hashlib.sha256(secret.encode()).hexdigest()


def csrf_of(secret: str) -> str:
    """CSRF token of a session, derived from its cookie; the cookie cannot be derived from it."""
    return hmac.new(secret.encode(), b"servodeck csrf", hashlib.sha256).hexdigest()


def spoken_code(groups: int) -> str:
    """Make a code to be read aloud: groups of four unambiguous characters, 19.8 bits each."""
    parts = ("".join(secrets.choice(_CLEAR) for _ in range(4)) for _ in range(groups))
    return "-".join(parts)


def same_code(given: str, code: str) -> bool:
    """Whether the given code is the right one, regardless of dashes, spaces and case."""

    def plain(text: str) -> bytes:
        return "".join(sign for sign in text.upper() if sign.isalnum()).encode()

    return hmac.compare_digest(plain(given), plain(code))


def name_key(name: str) -> str:
    """Key by which a name is compared and counted: names that look the same have the same key.

    Compatibility forms, case, invisible characters and white space around and between words make no
    difference (NFKC_Casefold, Unicode Standard 3.13 D147, for which a second pass changes nothing).
    """
    text = unicodedata.normalize("NFD", _IGNORABLE.sub("", name))
    for _ in range(2):
        text = unicodedata.normalize("NFKC", text.casefold())
    return " ".join(text.split())


def checked_person(name: str) -> str:
    """Check a name and return it in NFC: 1 to 60 printable characters, no spaces around it.

    Raises:
        NotAllowed: the name is anything else.
    """
    name = unicodedata.normalize("NFC", name).strip()
    if not 1 <= len(name) <= 60 or not name.isprintable():
        raise NotAllowed("people.not-name", limit=text("limit.printable", least=1, most=60))
    return name


def same_text(given: str, kept: str) -> bool:
    """Compare in constant time, so that the duration does not reveal where the strings differ."""
    return hmac.compare_digest(given.encode(), kept.encode())
