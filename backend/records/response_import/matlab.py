"""Columns of a MATLAB file up to version 7; the newer HDF5 format is recognised and refused."""

from __future__ import annotations

import io
import struct
import zlib
from typing import Any

import numpy as np
import numpy.typing as npt

from backend.analysis.signals.arrays import FloatArray
from backend.records.response_import.errors import BadRecording
from drivers.texts import limits
from drivers.texts.message import text

_MAX_UNPACKED = 512 << 20
_MOST = 256


def read_matlab(data: bytes, name: str) -> tuple[tuple[str, ...], tuple[FloatArray, ...]] | None:
    """Vectors and columns of matrices with their names; None where it is not a MATLAB file.

    Fields of a structure are named ``structure.field``, columns of a matrix ``matrix(:,3)``.

    Raises:
        BadRecording: version 7.3, damaged, or without numbers.
    """
    if data[:8] == b"\x89HDF\r\n\x1a\n" or data[512:520] == b"\x89HDF\r\n\x1a\n":
        raise BadRecording(
            "import.matlab-file-version-hdf5", value="7.3", limit=text("limit.version-7"), name=name
        )
    if data[:6] == b"MATLAB" or (len(data) > 128 and data[126:128] in {b"IM", b"MI"}):
        _refuse_bomb(data, name)
    elif not _is_version_4(data):
        return None
    from scipy.io import loadmat

    try:
        file: Any = io.BytesIO(data)
        found = loadmat(file, squeeze_me=False, struct_as_record=True, chars_as_strings=True)
    except Exception as error:
        # With a damaged file this reader may raise nearly any error; it runs in a separate process.
        raise BadRecording("import.damaged-matlab-file", value=name, cause=str(error)) from error
    names: list[str] = []
    columns: list[FloatArray] = []
    for key, value in found.items():
        if not key.startswith("__"):
            _collect(key, value, names, columns, 0)
    if not columns:
        raise BadRecording("import.holds-no-vectors-numbers", value=name)
    return tuple(names), tuple(columns)


def _is_version_4(data: bytes) -> bool:
    """Whether the first matrix has a header of version 4, which nothing precedes.

    The header (MAT-File Format, "Level 4"): type in decimal digits MOPT (byte order, 0, precision,
    kind), rows, columns, whether there is an imaginary part, length of the name; then the name with
    a zero at its end.
    """
    for order in "<>":
        if len(data) < 20:
            return False
        kind, rows, columns, imaginary, length = struct.unpack(order + "5i", data[:20])
        digits = divmod(kind, 1000)[0], kind // 100 % 10, kind // 10 % 10, kind % 10
        if digits[0] != (order == ">") or digits[1] or digits[2] > 5 or digits[3] > 2:
            continue
        if min(rows, columns) < 0 or imaginary not in (0, 1) or not 1 < length <= 64:
            continue
        title = data[20 : 20 + length]
        if title.endswith(b"\0") and title[:-1].isascii() and title[:-1].decode().isidentifier():
            return True
    return False


def _refuse_bomb(data: bytes, name: str) -> None:
    """Check the unpacked size of compressed elements (type 15) before unpacking them as a whole."""
    order = "<" if data[126:128] == b"IM" else ">"
    place, total = 128, 0
    while place + 8 <= len(data):
        kind, size = struct.unpack(order + "II", data[place : place + 8])
        part = data[place + 8 : place + 8 + size]
        if kind == 15:
            packed = zlib.decompressobj()
            rest = part
            while rest and total <= _MAX_UNPACKED:
                try:
                    total += len(packed.decompress(rest, 1 << 24))
                except zlib.error as error:
                    raise BadRecording(
                        "import.damaged-matlab-file-copy-file", value=name, cause=str(error)
                    ) from error
                rest = packed.unconsumed_tail
        else:
            total += size
        if total > _MAX_UNPACKED:
            raise BadRecording(
                "import.unpacks-more-bytes-save-fewer",
                value=name,
                limit=limits.size(_MAX_UNPACKED),
                max_unpacked_bytes=_MAX_UNPACKED,
            )
        place += 8 + size


def _collect(
    key: str, value: npt.NDArray[Any], names: list[str], columns: list[FloatArray], depth: int
) -> None:
    if len(names) >= _MOST or not isinstance(value, np.ndarray) or depth > 6:
        return
    if value.dtype.names:
        # Objects of classes are stored elsewhere in the file; these are references to them.
        if set(value.dtype.names) == {"s0", "s1", "s2", "arr"}:
            return
        for i, each in enumerate(value.flat[:_MOST]):
            own = key if value.size == 1 else f"{key}({i + 1}){_label(each)}"
            for field in value.dtype.names:
                _collect(f"{own}.{field}", each[field], names, columns, depth + 1)
    elif value.dtype == object:
        for i, each in enumerate(value.flat[:_MOST]):
            own = key if value.size == 1 else f"{key}{{{i + 1}}}"
            _collect(own, each, names, columns, depth + 1)
    elif value.dtype.kind in "iufb" and value.ndim >= 2 and value.size > 1:
        numbers = np.asarray(value, dtype=np.float64)
        if numbers.ndim > 2:
            # Simulink: channels × 1 × samples.
            numbers = np.squeeze(numbers)
            numbers = numbers[None, :] if numbers.ndim == 1 else numbers
            if numbers.ndim > 2:
                return
        if 1 in numbers.shape:
            names.append(key)
            columns.append(numbers.ravel())
            return
        rows = numbers if numbers.shape[0] >= numbers.shape[1] else numbers.T
        for i in range(min(rows.shape[1], _MOST)):
            names.append(f"{key}(:,{i + 1})" if rows is numbers else f"{key}({i + 1},:)")
            columns.append(np.ascontiguousarray(rows[:, i]))


def _label(element: Any) -> str:
    """Name of a channel in an array of structures, as dSPACE and Simulink write it."""
    for field in ("Name", "name", "label", "blockName"):
        if field in (element.dtype.names or ()):
            value = np.asarray(element[field])
            if value.dtype.kind == "U" and value.size == 1 and str(value.flat[0]).strip():
                return f" {str(value.flat[0]).strip()[:64]}"
    return ""
