"""Secrets and names: what is made, what is kept of it, and how it is compared."""

from __future__ import annotations

import hashlib
import hmac
import re
import secrets
import unicodedata

from drivers.errors import NotAllowed
from drivers.texts.message import text

#: Letters and digits that are not mistaken for one another when read aloud or copied by hand.
_CLEAR = "ABCDEFGHJKMNPQRSTUVWXYZ23456789"

#: Signs that show nothing (Default_Ignorable_Code_Point, Unicode Standard 15.0
#: DerivedCoreProperties.txt): with them one name could be written in any number of ways.
_IGNORABLE = re.compile(
    "[\u00ad\u034f\u061c\u115f\u1160\u17b4\u17b5\u180b-\u180f\u200b-\u200f\u202a-\u202e"
    "\u2060-\u206f\u3164\ufe00-\ufe0f\ufeff\uffa0\ufff0-\ufff8"
    "\U0001bca0-\U0001bca3\U0001d173-\U0001d17a\U000e0000-\U000e0fff]"
)


def new_secret(prefix: str = "") -> str:
    """32 random bytes, as text."""
    return prefix + secrets.token_urlsafe(32)


def digest(secret: str) -> str:
    """What is kept of a cookie or token: both are 32 random bytes, so one hash is enough."""
    return hashlib.sha256(secret.encode()).hexdigest()


def csrf_of(secret: str) -> str:
    """The token that a page sends with every change; it follows from the cookie, not vice versa."""
    return hmac.new(secret.encode(), b"servodeck csrf", hashlib.sha256).hexdigest()


def spoken_code(groups: int) -> str:
    """A code to be read aloud: groups of four clear signs, 19.8 bits each."""
    parts = ("".join(secrets.choice(_CLEAR) for _ in range(4)) for _ in range(groups))
    return "-".join(parts)


def same_code(given: str, code: str) -> bool:
    """Whether somebody typed this code, however they wrote dashes, spaces and case."""

    def plain(text: str) -> bytes:
        return "".join(sign for sign in text.upper() if sign.isalnum()).encode()

    return hmac.compare_digest(plain(given), plain(code))


def name_key(name: str) -> str:
    """What a name is counted and looked up by: names that look the same are the same.

    Compatibility forms, case, signs without a shape and white space around and between words make
    no difference (NFKC_Casefold, Unicode Standard 3.13 D147, which is stable under itself).
    """
    text = unicodedata.normalize("NFD", _IGNORABLE.sub("", name))
    for _ in range(2):
        text = unicodedata.normalize("NFKC", text.casefold())
    return " ".join(text.split())


def checked_person(name: str) -> str:
    """A name of 1 to 60 printable signs, no spaces around it.

    Raises:
        NotAllowed: anything else.
    """
    name = unicodedata.normalize("NFC", name).strip()
    if not 1 <= len(name) <= 60 or not name.isprintable():
        raise NotAllowed("people.not-name", limit=text("limit.printable", least=1, most=60))
    return name


def same_text(given: str, kept: str) -> bool:
    """Comparison whose time shows nothing."""
    return hmac.compare_digest(given.encode(), kept.encode())
