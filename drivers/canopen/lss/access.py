"""The layer setting services of a CANopen bus, in the server."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any

from drivers.canopen.lss.codes import LssIdentity
from drivers.canopen.lss.master import LssMaster
from drivers.errors import Busy, NotAllowed
from drivers.link import Progress
from drivers.texts.message import text

#: Runs blocking work on a worker thread of the link.
InWorker = Callable[[Callable[[], Any]], Awaitable[Any]]


@dataclass(frozen=True, slots=True)
class LssNode:
    """A node that was found; ``node`` is None if it has no node-ID."""

    identity: LssIdentity
    node: int | None


class LssAccess:
    """Services of one bus. ``taken`` returns whether a node answers under a number."""

    def __init__(
        self,
        master: LssMaster,
        in_worker: InWorker,
        taken: Callable[[int], Awaitable[bool]],
        exchanging: Callable[[], bool],
    ) -> None:
        self._master = master
        self._in_worker = in_worker
        self._taken = taken
        self._exchanging = exchanging

    async def search(self, progress: Progress) -> LssNode | None:
        """Find a node without node-ID, else the only node with these services, if there is one.

        Raises:
            Busy: the cyclic exchange runs: a node being configured leaves it.
            NotAllowed: several nodes have node-IDs and these services; select one by its identity.
            LinkTimeout: a node answers only in part.
        """
        self._require_calm()

        def reported(share: float) -> None:
            progress(share, text("canopen.lss-scanning"))

        if await self._in_worker(self._master.unconfigured):
            found = await self._in_worker(lambda: self._master.find(reported))
            if found is not None:
                return LssNode(found, None)
        only = await self._in_worker(self._master.only_node)
        return None if only is None else LssNode(*only)

    async def set_node(self, identity: LssIdentity, node: int, *, store: bool) -> None:
        """Set the node-ID of a node; see `LssMaster.set_node`.

        Raises:
            Busy: the cyclic exchange runs.
            NotAllowed: another node answers under this number.
        """
        self._require_calm()
        if 1 <= node <= 127 and await self._taken(node):
            raise NotAllowed("canopen.lss-node-taken", value=node)
        await self._in_worker(lambda: self._master.set_node(identity, node, store=store))

    async def set_bit_rate(self, identity: LssIdentity, kbit: int, *, store: bool) -> None:
        """Set a node's bit rate; see `LssMaster.set_bit_rate`.

        Raises:
            Busy: the cyclic exchange runs.
        """
        self._require_calm()
        await self._in_worker(lambda: self._master.set_bit_rate(identity, kbit, store=store))

    def _require_calm(self) -> None:
        if self._exchanging():
            raise Busy("canopen.lss-exchange-runs")
