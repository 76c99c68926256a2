"""Preview of a file, for a person to choose its columns."""

from __future__ import annotations

import numpy as np

from backend.records.response_import.contents import read_table
from backend.records.response_import.signals import unit_in

_FIRST_VALUES, _SHOWN_COLUMNS, _CURVE = 6, 64, 400


def preview(data: bytes, name: str) -> dict[str, object]:
    """Columns by number and name, with first values, range and a thinned curve.

    Raises:
        BadRecording: the file contains no table.
    """
    table = read_table(data, name)
    columns = []
    for i, values in enumerate(table.columns[:_SHOWN_COLUMNS]):
        good = values[np.isfinite(values)]
        step = max(good.size // _CURVE, 1)
        columns.append(
            {
                "number": i + 1,
                "name": table.names[i],
                "first": [float(v) if np.isfinite(v) else None for v in values[:_FIRST_VALUES]],
                "low": float(np.min(good)) if good.size else 0.0,
                "high": float(np.max(good)) if good.size else 0.0,
                "missing": int(values.size - good.size),
                "rises": bool(good.size > 1 and np.all(np.diff(good) > 0)),
                "unit": "s" if i in table.clock_texts else unit_in(table.names[i]),
                "curve": good[::step][:_CURVE].tolist(),
            }
        )
    return {
        "form": table.form,
        "rows": table.rows,
        "first_line": table.first_line,
        "columns": columns,
        "facts": [list(pair) for pair in table.facts],
    }
