from __future__ import annotations

from typing import Any

import numpy as np

from drivers.link import ScopeBlock


def header(channels: int = 2, streams: int = 1, **more: object) -> dict[str, Any]:
    """A header as the recorder writes it; the clocks agree at 100 s = 1 700 000 000 s."""
    return {
        "format": 1,
        "clock": {"sample_s": 100.0, "epoch_s": 1_700_000_000.0},
        "streams": [
            {
                "synchronous": True,
                "channels": [
                    {
                        "drive": f"x{s}",
                        "drive_name": f"X{s}",
                        "key": f"60{c:02X}:00",
                        "name": f"X{s} signal {c}",
                        "unit": "rpm" if c % 2 else "inc",
                    }
                    for c in range(channels)
                ],
            }
            for s in range(streams)
        ],
        **more,
    }


def block(
    n: int, rows: int = 10, columns: int = 2, dt_s: float = 0.001, lost: int = 0
) -> ScopeBlock:
    """The n-th block of a stream that counts: value = 1000 × column + sample number + 1/3."""
    first = n * rows
    numbers = np.arange(first, first + rows, dtype=float)[:, None]
    return ScopeBlock(
        sequence=n + 1,
        t0_s=100.0 + first * dt_s,
        dt_s=dt_s,
        channels=tuple(f"60{c:02X}:00" for c in range(columns)),
        samples=numbers + 1000.0 * np.arange(columns) + 1 / 3,
        dropped=lost,
    )
