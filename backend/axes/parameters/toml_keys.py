"""Depth of the dotted keys of a TOML text, checked before parsing.

The time of `tomllib` grows with the square of the number of parts of a dotted key (``a.b.c``), so
that a file of 50 kB with one such key takes minutes.
"""

from __future__ import annotations

import re

#: Characters that end a key or begin a string or comment, and dots.
_SIGN = re.compile(r"""\"{3}|'{3}|["'.#=,{}\[\]\n]""")
#: Escapes and ends within strings in double quotes, of one line and of several lines.
_WITHIN = {
    '"': re.compile(r'\\.|["\n]', re.DOTALL),
    '"""': re.compile(r'\\.|"{3}', re.DOTALL),
}


def deepest_key(content: str) -> int:
    """Number of parts of the longest dotted key; its time is proportional to the text's length.

    Dots of numbers and dates are counted like those of keys; dots of strings and comments are not.
    """
    most = dots = at = 0
    while (found := _SIGN.search(content, at)) is not None:
        sign, at = found[0], found.end()
        if sign == ".":
            dots += 1
            most = max(most, dots)
        elif sign in ("#", "\n"):
            dots = 0
            at = _behind(content, "\n", at) if sign == "#" else at
        elif sign in _WITHIN:
            at = _end_of_string(content, sign, at)
        elif sign in ("'", "'''"):
            at = _end_of_literal(content, sign, at)
        else:
            dots = 0
    return most + 1


def _behind(content: str, mark: str, at: int) -> int:
    end = content.find(mark, at)
    return len(content) if end < 0 else end + len(mark)


def _end_of_string(content: str, quote: str, at: int) -> int:
    while (found := _WITHIN[quote].search(content, at)) is not None:
        if found[0] == "\n":
            return found.start()  # not closed on its line: the parser refuses it
        at = found.end()
        if found[0] == quote:
            return at
    return len(content)


def _end_of_literal(content: str, quote: str, at: int) -> int:
    end = _behind(content, quote, at)
    if quote == "'" and (line_end := content.find("\n", at, end)) >= 0:
        return line_end
    return end
