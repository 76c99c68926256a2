"""Search for the settings of a serial line that are unknown (or not in a manual)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from drivers.bus import BusKind, BusUrl
from drivers.errors import OutOfRange
from drivers.link import Found, Progress
from drivers.modbus.port import Parity, is_pseudo_terminal
from drivers.texts.message import Text, text


@dataclass(frozen=True, slots=True)
class LineFound:
    """The URL with the settings at which drives answered, and these drives."""

    url: str
    drives: tuple[Found, ...]


async def search_line_settings(
    bus: BusUrl,
    kind: BusKind,
    progress: Progress,
    *,
    baudrates: Sequence[int] = (),
    parities: Sequence[Parity] = (),
    stations: Sequence[int] = (1,),
) -> LineFound | None:
    """Try baud rates and parities until a drive answers with a correct CRC; None if none does.

    Only reads are sent. Query few stations: the time is the product of the three lists and one
    time-out. Rates that the adapter does not support are skipped. Cancel by cancelling the task.

    Raises:
        LinkLost: the adapter is missing, in use, or unplugged during the search.
    """
    usual = kind.serial
    assert usual is not None, "only a serial line has settings to search for"
    rates = baudrates or usual.baudrates
    kinds: Sequence[str] = parities or usual.parities
    if is_pseudo_terminal(bus.place):
        kinds = kinds[:1]  # no bits, no parity: the others would give the same result
    settings = [(rate, parity) for rate in rates for parity in kinds]
    for number, (rate, parity) in enumerate(settings):
        progress(
            number / len(settings), text("modbus.trying-baud-parity", rate=rate, parity=parity)
        )
        candidate = bus.with_options(baudrate=rate, parity=parity)
        link = kind.link(candidate)
        try:
            await link.open()
            found = await link.scan(_quiet, stations)
        except OutOfRange:
            continue
        finally:
            await link.close()
        if found:
            progress(1.0, text("modbus.answers-baud-parity", rate=rate, parity=parity))
            return LineFound(str(candidate), tuple(found))
    progress(1.0, text("modbus.nothing-answered-settings"))
    return None


def _quiet(_fraction: float, _text: Text) -> None:
    """Ignore progress: a scan of few stations inside a search needs none of its own."""
