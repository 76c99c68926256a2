"""Decoding of a description file to text, whatever encoding its author used."""

from __future__ import annotations

import codecs
import re

from profiles.importer.report import ImportFailed, ImportReport

_MARKS = (
    (b"\xef\xbb\xbf", "utf-8"),
    (b"\xff\xfe", "utf-16-le"),
    (b"\xfe\xff", "utf-16-be"),
)
_DECLARED = re.compile(rb"^\s*<\?xml[^>]*?encoding\s*=\s*[\"']([A-Za-z0-9._-]{1,40})[\"'][^>]*\?>")
_DECLARATION = re.compile(r"^\s*<\?xml[^>]*\?>")
#: "äöüÄÖÜßéèêàâçñ°²" in code page 850: letters of Western languages, degrees and the square.
_DOS_LETTERS = bytes.fromhex("8494818e999ae1828a88858387a4f8fd")
#: Names of encodings in Python; a file may use any alias.
_KNOWN_ENCODINGS = {
    "utf-8", "ascii", "utf-16", "utf-16-le", "utf-16-be", "gb2312", "gbk", "gb18030", "big5",
    "shift_jis", "cp932", "euc_jp", "euc_kr", "cp949", "iso8859-1", "iso8859-2", "iso8859-9",
    "iso8859-15", "cp1250", "cp1251", "cp1252", "cp1254",
}  # fmt: skip


def check_size(data: bytes, limit: int, name: str) -> None:
    """Raise ImportFailed above ``limit`` bytes."""
    if len(data) > limit:
        raise ImportFailed(
            "description.too-large", file=name, size_bytes=len(data), limit_mib=limit // 2**20
        )


def decode_text(data: bytes, name: str, report: ImportReport) -> str:
    """Return the text of a file without a declared encoding (EDS)."""
    for mark, encoding in _MARKS:
        if data.startswith(mark):
            return data[len(mark) :].decode(encoding, "replace")
    for zero, encoding in ((1, "utf-16-le"), (0, "utf-16-be")):
        if len(data) > 1 and data[zero] == 0 and 0 < data[1 - zero] < 0x80:
            report.repaired(name, "description.utf16-no-mark")
            return data.decode(encoding, "replace")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        encoding = "gb18030" if _looks_chinese(data) else _by_editor(data)
    report.repaired(name, "description.not-utf8", encoding=encoding)
    return data.decode(encoding, "replace")


def _looks_chinese(data: bytes) -> bool:
    """Return whether it looks like GB 2312, which has pairs of bytes above A0h."""
    runs = re.findall(rb"[\x80-\xff]+", data[:100_000])
    pairs = sum(len(run) for run in runs if len(run) % 2 == 0 and min(run) > 0xA0)
    return pairs * 2 > sum(map(len, runs))


def _by_editor(data: bytes) -> str:
    """Return Windows, DOS or Shift-JIS encoding: 80h to 9Fh are rarely letters in Windows."""
    high = [byte for byte in data[:100_000] if byte >= 0x80]
    if sum(byte < 0xA0 for byte in high) * 2 < len(high):
        return "cp1252"
    if sum(byte in _DOS_LETTERS for byte in high) * 5 >= len(high) * 4:
        return "cp850"
    try:
        data.decode("cp932")
    except UnicodeDecodeError:
        return "cp1252"
    return "cp932"


def _python_name(encoding: str) -> str:
    """Return the canonical name of an encoding; empty if unknown."""
    try:
        return codecs.lookup(encoding.replace("windows-936", "gbk")).name
    except LookupError:
        return ""


def decode_xml(data: bytes, name: str, report: ImportReport) -> str:
    """Return the text of an XML file without its declaration, as plain Unicode for the parser.

    The parser itself does not support multi-byte encodings such as GB2312.
    """
    declared = _DECLARED.match(data[:400])
    if declared is None or data.startswith(tuple(mark for mark, _ in _MARKS)):
        text = decode_text(data, name, report)
    else:
        encoding = declared.group(1).decode("ascii").lower()
        if _python_name(encoding) not in _KNOWN_ENCODINGS:
            report.repaired(name, "description.encoding-unknown", encoding=encoding)
            encoding = "utf-8"
        try:
            text = data.decode(encoding.replace("windows-936", "gbk"))
        except (UnicodeDecodeError, LookupError):
            report.repaired(name, "description.encoding-differs", encoding=encoding)
            text = decode_text(data, name, report)
    return _DECLARATION.sub("", text.lstrip("\ufeff \t\r\n\0"), count=1)
