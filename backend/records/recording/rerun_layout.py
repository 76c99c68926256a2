"""Layout of signals in rerun: one entity with several series for each plot.

One multi-scalar entity per drive and unit costs a quarter of one entity per channel
(measured at 16 channels × 4 kHz).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import rerun as rr
import rerun.blueprint as rrb

from backend.records.recording.reader import Channel

APPLICATION = "servodeck"
TIMELINE = "time"
EVENTS = "events"


@dataclass(frozen=True, slots=True)
class Plot:
    """One entity: channels of one stream that are shown in the same unit.

    ``columns``: columns of the stream; multiplied by ``factors`` they are in that unit.
    """

    entity: str
    drive_name: str
    title: str
    stream: int
    columns: tuple[int, ...]
    factors: tuple[float, ...]
    names: tuple[str, ...]


def plots(channels: Sequence[Channel]) -> list[Plot]:
    """The plots of these channels, in their order."""
    groups: dict[tuple[int, str], list[Channel]] = {}
    for channel in channels:
        groups.setdefault((channel.stream, channel.shown_unit), []).append(channel)
    result: list[Plot] = []
    for (stream, unit), members in groups.items():
        first = members[0]
        stem = _plain(unit) or "status"
        entity = f"{_plain(first.drive) or 'drive'}/{stem}"
        if any(plot.entity == entity for plot in result):
            entity = f"{entity}_{stream}"
        result.append(
            Plot(
                entity=entity,
                drive_name=first.drive_name,
                title=f"{first.drive_name} [{unit}]" if unit else first.drive_name,
                stream=stream,
                columns=tuple(c.column for c in members),
                factors=tuple(c.shown_factor for c in members),
                names=tuple(c.name for c in members),
            )
        )
    return result


def _plain(text: str) -> str:
    return re.sub(r"[^A-Za-z0-9]+", "_", text.replace("%", "percent").replace("°", "deg")).strip(
        "_"
    )


def blueprint(arranged: Sequence[Plot], *, follow: bool) -> rrb.Blueprint:
    """Blueprint with one tab of plots for each drive, and the events below."""
    drives = dict.fromkeys(plot.drive_name for plot in arranged)
    tabs = [
        rrb.Vertical(
            *(
                rrb.TimeSeriesView(origin=f"/{plot.entity}", name=plot.title)
                for plot in arranged
                if plot.drive_name == name
            ),
            name=name,
        )
        for name in drives
    ]
    return rrb.Blueprint(
        rrb.Vertical(
            rrb.Tabs(*tabs),
            rrb.TextLogView(origin=f"/{EVENTS}", name="Events"),
            row_shares=[4, 1],
        ),
        rrb.TimePanel(
            state="collapsed", timeline=TIMELINE, play_state="following" if follow else "paused"
        ),
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
        auto_layout=False,
        auto_views=False,
    )


def send_names(recording: rr.RecordingStream, arranged: Sequence[Plot]) -> None:
    """Send the names of the series, as static data."""
    for plot in arranged:
        rr.log(
            plot.entity, rr.SeriesLines(names=list(plot.names)), static=True, recording=recording
        )


def send_samples(
    recording: rr.RecordingStream,
    plot: Plot,
    epoch_ns: npt.NDArray[np.int64],
    values: npt.NDArray[np.float64],
) -> None:
    """Send samples: ``values`` [n, k] of the plot's own columns, as recorded."""
    shown = values * np.array(plot.factors)
    rr.send_columns(
        plot.entity,
        indexes=[rr.TimeColumn(TIMELINE, timestamp=epoch_ns.astype("datetime64[ns]"))],
        columns=rr.Scalars.columns(scalars=np.ascontiguousarray(shown)),
        recording=recording,
        strict=True,
    )


def send_event(recording: rr.RecordingStream, epoch_ns: int, text: str, level: str) -> None:
    """Send one line of the text log."""
    rr.send_columns(
        EVENTS,
        indexes=[rr.TimeColumn(TIMELINE, timestamp=np.array([epoch_ns], dtype="datetime64[ns]"))],
        columns=rr.TextLog.columns(text=[text], level=[_LEVELS.get(level, "INFO")]),
        recording=recording,
        strict=True,
    )


_LEVELS = {"info": "INFO", "warning": "WARN", "error": "ERROR"}
