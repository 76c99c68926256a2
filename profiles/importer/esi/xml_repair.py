"""Removal of constructs from an ESI file that no XML parser accepts. Pure."""

from __future__ import annotations

import re

_BEGIN = re.compile(r"<(?:\w+:)?EtherCATInfo(?:List)?[\s>]", re.I)
_END = re.compile(r"</(?:\w+:)?EtherCATInfo(?:List)?\s*>", re.I)
_CONTROL = re.compile(
    r"[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff]"
    r"|&#(?:0*(?:[0-8]|1[124-9]|2\d|3[01])|[xX]0*(?:[0-8bcefBCEF]|1[0-9a-fA-F]));"
)
_AMPERSAND = re.compile(r"&(?!(?:#\d+|#[xX][0-9a-fA-F]+|amp|lt|gt|quot|apos);)")
_TAG_PREFIX = re.compile(r"<([A-Za-z_][\w.-]*):[A-Za-z_]")
_PREFIXED = re.compile(r"(\s)(?!xmlns:)[A-Za-z_][\w.-]*:([A-Za-z_][\w.-]*\s*=\s*[\"'])")


def mended(text: str) -> str:
    """Return the text without remarks around its root, control characters and bare ampersands.

    An undeclared prefix is removed from its tag or attribute. A truncated file remains truncated.
    """
    begin = _BEGIN.search(text)
    if begin is not None:
        text = text[begin.start() :]
    ends = list(_END.finditer(text))
    if ends:
        text = text[: ends[-1].end()]
    text = _AMPERSAND.sub("&amp;", _CONTROL.sub("", text))
    for prefix in set(_TAG_PREFIX.findall(text)):
        if f"xmlns:{prefix}" not in text:
            text = re.sub(rf"<(/?){re.escape(prefix)}:", r"<\1", text)
    root, bracket, rest = text.partition(">")
    return _PREFIXED.sub(r"\1\2", root) + bracket + rest
