"""EtherCAT as a kind of bus."""

from __future__ import annotations

from drivers.adapters import require_ethercat_adapter
from drivers.bus import BusKind, BusUrl
from drivers.link import Link, LinkTraits
from drivers.texts.message import text


def _link(url: BusUrl) -> Link:
    from drivers.ethercat.link import EthercatLink

    return EthercatLink(str(url))


BUS = BusKind(
    example="ethercat://eth0",
    # The link splits batches itself and reads whole objects: an object split between two batches
    # would be read entry by entry.
    traits=LinkTraits(
        fills_network=True,
        batch=128,
        whole_objects=True,
        description="dictionary",
        silent=text("ethercat.check-when-silent"),
    ),
    require_place=require_ethercat_adapter,
    link=_link,
)
