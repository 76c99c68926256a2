"""The live websocket of all pages: events of the bench are sent to the pages that watch them."""

from __future__ import annotations

import itertools
from functools import partial

from fastapi import WebSocket

from backend.api.live import news as live_news
from backend.api.live.connection import Connection
from backend.api.live.messages import Logged
from backend.api.live.people import PeopleLive
from backend.api.live.shared import Shared
from backend.api.messages import convert
from backend.api.security.socket import OpenSockets
from backend.axes.drive.readings import Reading
from backend.foundation.people.identity import Actor, acting
from backend.foundation.people.station import People
from backend.foundation.work.jobs import Job
from backend.foundation.work.journal import Entry
from backend.station.bench import Bench
from backend.station.drives.monitor import Snapshot
from drivers.texts.message import text


class LiveHub:
    """All live connections of a server, and the people behind them."""

    def __init__(self, bench: Bench, people: People, sockets: OpenSockets) -> None:
        self.bench = bench
        self.connections: dict[str, Connection] = {}
        self.people = PeopleLive(bench, people, self.connections)
        self._known, self._sockets = people, sockets
        people.on_ended.append(self._ended)
        people.on_lowered.append(self._lowered)
        self._numbers = itertools.count(1)
        bench.on_snapshot.append(self._snapshot)
        bench.on_readings.append(self._readings)
        bench.on_job.append(self._job)
        bench.on_drives.append(self._drives)
        bench.journal.listen(self._logged)

    async def serve(self, socket: WebSocket) -> None:
        """Serve one connection from accept to its end."""
        actor = acting.get()
        if actor is None:
            raise RuntimeError("a live connection without the gate before it")
        await socket.accept()
        name = f"c{next(self._numbers)}"
        connection = Connection(name, socket, self.bench, self.people, self._known, actor.identity)
        self.connections[name] = connection
        self._sockets.own(name, actor.identity.session)
        acting.set(Actor(actor.identity, name))
        try:
            await connection.run()
        finally:
            del self.connections[name]
            self._sockets.disown(name)
            try:
                self.people.left(connection)
            finally:
                await connection.close()

    def _ended(self, session: str) -> None:
        """Release what the pages of an ended session hold, and close their sockets."""
        why = text("motion.session-is-over")
        for connection in self._each():
            if connection.identity.session == session:
                connection.release(None, why)
        self._sockets.end(session)
        self.bench.authority.end_of(session, why)

    def _lowered(self, session: str) -> None:
        """Stop what an account moves after it has lost a right to move axes."""
        why = text("motion.account-has-another-role")
        for connection in self._each():
            if connection.identity.session == session:
                connection.release(None, why)
        self.bench.authority.end_of(session, why)

    def _each(self) -> list[Connection]:
        return list(self.connections.values())

    def _snapshot(self, drive: str, snapshot: Snapshot) -> None:
        state = Shared(partial(live_news.state, self.bench, drive, snapshot))
        for connection in self._each():
            if drive in connection.watched:
                connection.later("state", drive, state)

    def _readings(self, drive: str, readings: list[Reading]) -> None:
        keys = frozenset(reading.key for reading in readings)
        values = Shared(partial(live_news.values, self.bench, drive, keys))
        for connection in self._each():
            connection.fresh_values(drive, keys, values)

    def _job(self, job: Job) -> None:
        changed = Shared(partial(live_news.job_state, job))
        for connection in self._each():
            connection.later("job", job.id, changed)

    def _drives(self) -> None:
        # All connections that hold no axis see the same list.
        others = Shared(partial(live_news.drive_list, self.bench, None))
        for connection in self._each():
            holds = self.bench.leases.held_by(connection.id)
            connection.later("drives", "", connection.drive_list() if holds else others)
            connection.scopes.bench_changed()

    def _logged(self, entry: Entry) -> None:
        logged = Shared(lambda: Logged(entry=convert.log_entry(entry)))
        for connection in self._each():
            connection.send(logged)
