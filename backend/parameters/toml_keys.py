"""How deep the keys of a TOML text are, before a parser reads it.

`tomllib` takes the square of the number of parts of a dotted key (``a.b.c``), so that a file of
50 kB with one such key occupies it for minutes.
"""

from __future__ import annotations

import re

#: What ends a key, begins a string or a comment, or is a dot.
_SIGN = re.compile(r"""\"{3}|'{3}|["'.#=,{}\[\]\n]""")
#: What matters within a string in double quotes, of one line and of several lines.
_WITHIN = {
    '"': re.compile(r'\\.|["\n]', re.DOTALL),
    '"""': re.compile(r'\\.|"{3}', re.DOTALL),
}


def deepest_key(content: str) -> int:
    """Parts of the longest dotted key, in time that grows with the length of the text alone.

    Dots of numbers and dates are counted as those of keys; dots of strings and comments are not.
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
