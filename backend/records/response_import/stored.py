"""An import as a stored measurement, which can be opened and evaluated again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, fields
from datetime import datetime

import numpy as np
import numpy.typing as npt

from backend.records.library.measurements import pack_other
from backend.records.response_import.evaluation import ImportSettings, evaluate_signals
from backend.records.response_import.signals import Signals

KIND = "imported-response"
TOOL = "response-import"


def pack_import(
    name: str,
    signals: Signals,
    settings: ImportSettings,
    result: Mapping[str, object],
    saved: datetime,
) -> bytes:
    """A measurement file with both signals as they were in the imported file."""
    meta = {
        "tool": TOOL,
        "file": name,
        "settings": asdict(settings),
        "sample_rate_hz": signals.sample_rate_hz,
        "input_name": signals.input_name,
        "output_name": signals.output_name,
        "time_unit": signals.time_unit,
        "repeated_rows": signals.repeated_rows,
    }
    arrays = {"input": signals.signal_in, "output": signals.signal_out}
    return pack_other(KIND, name, arrays, meta, saved, result)


def reevaluate(
    arrays: Mapping[str, npt.NDArray[np.generic]], meta: Mapping[str, object]
) -> dict[str, object]:
    """Evaluate the stored signals again.

    Raises:
        ValueError, KeyError, TypeError: not the data of an import.
        BadRecording: the recording does not permit a result.
    """
    given = meta["settings"]
    if not isinstance(given, dict):
        raise TypeError("settings")
    known = {f.name for f in fields(ImportSettings)}
    plain = {name: value for name, value in given.items() if name in known}
    band = plain.get("band_hz")
    plain["band_hz"] = (float(band[0]), float(band[1])) if isinstance(band, list) else None
    signals = Signals(
        np.asarray(arrays["input"], np.float64),
        np.asarray(arrays["output"], np.float64),
        float(str(meta["sample_rate_hz"])),
        str(meta["input_name"]),
        str(meta["output_name"]),
        str(meta["time_unit"]),
        int(str(meta.get("repeated_rows", 0))),
    )
    if signals.signal_in.shape != signals.signal_out.shape or signals.signal_in.ndim != 1:
        raise ValueError("input and output differ in length")
    return evaluate_signals(signals, str(meta.get("file", "")), ImportSettings(**plain))
