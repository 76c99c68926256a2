"""Unprompted messages of nodes: boot-up, heartbeat, node guarding, emergencies. Pure.

Sources: CiA 301 v4.2.0 clauses 7.2.7 (emergency, table 26), 7.2.8.2.2 (node guarding, heartbeat)
and 7.2.8.3.3 (boot-up).
"""

from __future__ import annotations

from dataclasses import dataclass, field

from drivers.canopen.frames import EMERGENCY, HEARTBEAT, NMT_STATES, SDO_REQUEST, SYNC, Frame
from drivers.link import LinkEvent
from drivers.texts.message import Param, Text, prose, text

#: Class of an error code by its upper byte (CiA 301 table 26).
_EMERGENCY_CLASSES = {
    0x00: text("emergency.none"),
    0x10: text("emergency.generic"),
    0x20: text("emergency.current"),
    0x21: text("emergency.current-input"),
    0x22: text("emergency.current-inside"),
    0x23: text("emergency.current-output"),
    0x30: text("emergency.voltage"),
    0x31: text("emergency.mains-voltage"),
    0x32: text("emergency.voltage-inside"),
    0x33: text("emergency.voltage-output"),
    0x40: text("emergency.temperature"),
    0x41: text("emergency.ambient-temperature"),
    0x42: text("emergency.drive-temperature"),
    0x50: text("emergency.hardware"),
    0x60: text("emergency.software"),
    0x61: text("emergency.internal-software"),
    0x62: text("emergency.user-software"),
    0x63: text("emergency.data-set"),
    0x70: text("emergency.additional-modules"),
    0x80: text("emergency.monitoring"),
    0x81: text("emergency.communication"),
    0x82: text("emergency.protocol"),
    0x90: text("emergency.external"),
    0xF0: text("emergency.additional-functions"),
    0xFF: text("emergency.makers"),
}

_COLLISION = 0x8150
_EMERGENCIES = {
    0x8110: text("emergency.can-overrun"),
    0x8120: text("emergency.error-passive"),
    0x8130: text("emergency.life-guard"),
    0x8140: text("emergency.recovered-from-bus-off"),
    _COLLISION: text("emergency.same-identifier"),
    0x8210: text("emergency.pdo-too-short"),
    0x8220: text("emergency.pdo-too-long"),
    0x8240: text("emergency.sync-length"),
    0x8250: text("emergency.pdo-missing"),
}
_UNLISTED = text("emergency.unlisted")

#: A heartbeat is lost when this many of its periods late, plus 0.1 s for a busy host.
_LATE_PERIODS = 2.5
_LATE_EXTRA_S = 0.1
#: Number of intervals kept; the longest is the period: a late heartbeat shortens the next interval.
_INTERVALS_KEPT = 3
_BOOTS_KEPT = 8
_DUPLICATE_WINDOW_S = 10.0
_FORGIVEN_S = 60.0
"""Two nodes with one number keep answering twice; mix-ups by a busy computer end."""
#: Limit of the emergencies reported per node and second: a flickering drive sends hundreds.
_EMERGENCIES_PER_S = 10


def emergency_text(code: int) -> Text:
    """Return the meaning of an emergency error code: exact if in CiA 301, else its class."""
    exact = _EMERGENCIES.get(code)
    if exact is not None:
        return exact
    return _EMERGENCY_CLASSES.get(code >> 8, _EMERGENCY_CLASSES.get(code >> 12 << 4, _UNLISTED))


@dataclass(slots=True)
class NodeRecord:
    """State of one node."""

    node: int
    state: int | None = None
    last_heartbeat_s: float | None = None
    intervals_s: list[float] = field(default_factory=list)
    alive: bool = True
    boots: int = 0
    boots_s: list[float] = field(default_factory=list)
    """Times of its last boot-ups."""
    emergencies: int = 0
    last_emergency: int | None = None
    open_emergency: int | None = None
    """The last emergency, until it is cleared (code 0) or the node restarts."""
    emergency_window_s: float | None = None
    emergencies_reported: int = 0
    emergencies_untold: int = 0
    guard_toggle: int | None = None
    toggle_repeated_s: float | None = None
    guarded: bool = False
    """Its toggle bit was seen set, which it never is in heartbeats: it answers node guarding."""
    guard_asked_s: float | None = None
    foreign_master_s: float | None = None
    strays_s: list[float] = field(default_factory=list)
    in_use: bool = False
    conflict: Text | None = None

    @property
    def period_s(self) -> float | None:
        """Time between its heartbeats; None while unknown."""
        return max(self.intervals_s, default=None)

    @property
    def state_text(self) -> str:
        """Name of the NMT state in CiA 301, its number if it has no name, or empty."""
        return "" if self.state is None else NMT_STATES.get(self.state, f"{self.state}")

    @property
    def nmt_state(self) -> Text | None:
        """NMT state for a list of stations; None while unknown."""
        return prose(self.state_text) if self.state_text else None

    @property
    def shown_state(self) -> Text | None:
        """Text for a list of stations: a conflict of numbers, else the NMT state."""
        return self.conflict or self.nmt_state


class NodeWatch:
    """Follows every node on one bus. Not thread-safe: one thread feeds it."""

    def __init__(self) -> None:
        self.nodes: dict[int, NodeRecord] = {}
        self.sync_heard_s: float | None = None
        """Time of the last SYNC sent by another device."""

    def record(self, node: int) -> NodeRecord:
        """Return the record of ``node``, created on first use."""
        return self.nodes.setdefault(node, NodeRecord(node))

    def is_there(self, node: int) -> bool:
        """Return whether this node was received or is in use here."""
        record = self.nodes.get(node)
        return record is not None and (record.last_heartbeat_s is not None or record.in_use)

    def observe(self, frame: Frame, now_s: float) -> list[LinkEvent]:
        """Take one received frame (not our own) and return the events to report."""
        function, node = frame.cob_id & 0x780, frame.cob_id & 0x7F
        if frame.cob_id == SYNC and not frame.remote:
            self.sync_heard_s = now_s
        if frame.remote or node == 0:
            return []
        if function == HEARTBEAT and len(frame.data) == 1:
            return self._heartbeat(self.record(node), frame.data[0], now_s)
        if function == EMERGENCY and len(frame.data) == 8:
            return self._emergency(self.record(node), frame.data, now_s)
        if function == SDO_REQUEST:
            self.record(node).foreign_master_s = now_s
        return []

    def _heartbeat(self, record: NodeRecord, byte: int, now_s: float) -> list[LinkEvent]:
        state, toggle = byte & 0x7F, byte >> 7
        events = []
        # Some nodes send one at once when their state changes, and after the boot-up message.
        in_its_turn = record.alive and state == record.state
        if not record.alive:
            record.alive = True
            events.append(
                LinkEvent("back", record.node, text("event.node-answers-again", node=record.node))
            )
        if state == 0 and not toggle:
            events.append(self._boot(record, now_s))
        elif record.guard_asked_s is not None and not self._is_heartbeat(record, toggle):
            events += self._guard_answer(record, toggle, now_s)
        elif in_its_turn and not record.guarded and record.last_heartbeat_s is not None:
            record.guard_asked_s = None
            record.intervals_s.append(now_s - record.last_heartbeat_s)
            del record.intervals_s[:-_INTERVALS_KEPT]
        record.last_heartbeat_s = now_s
        if state != record.state:
            known = record.state not in (None, 0)
            record.state = state
            if known and state != 0:
                events.append(
                    LinkEvent(
                        "state",
                        record.node,
                        text("event.node-state", node=record.node, state=record.state_text),
                    )
                )
        return events

    def _is_heartbeat(self, record: NodeRecord, toggle: int) -> bool:
        """Return whether it is a heartbeat, not the answer to a guarding request."""
        return not record.guarded and record.guard_toggle == 0 == toggle

    def _boot(self, record: NodeRecord, now_s: float) -> LinkEvent:
        record.boots += 1
        record.boots_s = [*record.boots_s, now_s][-_BOOTS_KEPT:]
        record.open_emergency = None
        self._withdraw_collision(record)
        record.intervals_s.clear()
        record.guard_toggle = record.guard_asked_s = None
        record.guarded = False
        if record.in_use:
            return LinkEvent("boot", record.node, text("event.node-restarted", node=record.node))
        return LinkEvent("boot", record.node, text("event.node-started", node=record.node))

    def _guard_answer(self, record: NodeRecord, toggle: int, now_s: float) -> list[LinkEvent]:
        record.guard_asked_s = None
        record.guarded = record.guarded or toggle == 1
        repeated = record.guard_toggle == toggle
        record.guard_toggle = toggle
        if not repeated:
            return []
        record.toggle_repeated_s = now_s
        return [
            LinkEvent(
                "fault", record.node, text("event.guarding-answer-repeated", node=record.node)
            )
        ]

    def _emergency(self, record: NodeRecord, data: bytes, now_s: float) -> list[LinkEvent]:
        events = self._end_of_storm(record, now_s)
        code = int.from_bytes(data[:2], "little")
        record.emergencies += 1
        record.last_emergency = code
        record.open_emergency = code or None
        meaning = emergency_text(code)
        if code == _COLLISION:
            record.conflict = meaning
        elif code == 0:
            self._withdraw_collision(record)
        if record.emergencies_reported >= _EMERGENCIES_PER_S:
            record.emergencies_untold += 1
            return events
        record.emergencies_reported += 1
        facts: dict[str, Param] = {
            "node": record.node,
            "meaning": meaning,
            "number": code,
            "register": data[2],
        }
        if any(data[3:8]):
            message = text("event.node-emergency-bytes", **facts, bytes=data[3:8].hex(" "))
        else:
            message = text("event.node-emergency", **facts)
        return [*events, LinkEvent("emergency", record.node, message, code)]

    def _withdraw_collision(self, record: NodeRecord) -> None:
        """End what emergency 8150h reported; conflicts of node numbers end otherwise."""
        if record.conflict == _EMERGENCIES[_COLLISION]:
            record.conflict = None

    def _end_of_storm(self, record: NodeRecord, now_s: float) -> list[LinkEvent]:
        """Return the count of suppressed emergencies; reporting starts again every second."""
        if record.emergency_window_s is not None and now_s - record.emergency_window_s < 1.0:
            return []
        untold, code = record.emergencies_untold, record.last_emergency
        record.emergency_window_s = now_s
        record.emergencies_reported = record.emergencies_untold = 0
        if not untold:
            return []
        message = text("event.more-emergencies", node=record.node, count=untold, number=code or 0)
        return [LinkEvent("emergency", record.node, message, code)]

    def overdue(self, now_s: float) -> list[LinkEvent]:
        """Return nodes whose heartbeat stopped, once each, and emergencies not yet reported."""
        events = []
        for record in self.nodes.values():
            if record.emergencies_untold:
                events += self._end_of_storm(record, now_s)
            if record.strays_s and now_s - record.strays_s[-1] > _FORGIVEN_S:
                record.strays_s.clear()
                record.conflict = None
            if not record.alive or record.last_heartbeat_s is None or record.period_s is None:
                continue
            limit_s = record.period_s * _LATE_PERIODS + _LATE_EXTRA_S
            silent_s = now_s - record.last_heartbeat_s
            if silent_s > limit_s:
                record.alive = False
                record.intervals_s.clear()
                events.append(
                    LinkEvent(
                        "lost",
                        record.node,
                        text("event.heartbeat-stopped", node=record.node, silent_s=silent_s),
                    )
                )
        return events

    def guard_due(self, guard_s: float, now_s: float) -> tuple[list[int], list[LinkEvent]]:
        """Return the nodes to guard now, and events for those that did not answer last time.

        Only nodes that are in use and send no heartbeat are guarded.
        """
        ask: list[int] = []
        events: list[LinkEvent] = []
        for record in self.nodes.values():
            if not record.in_use or record.period_s is not None:
                continue
            asked = record.guard_asked_s
            if asked is not None and now_s - asked < guard_s:
                continue
            last = record.last_heartbeat_s
            if asked is None and last is not None and now_s - last < guard_s:
                continue
            if asked is not None and record.alive and record.guarded:
                record.alive = False
                events.append(
                    LinkEvent(
                        "lost", record.node, text("event.no-guarding-answer", node=record.node)
                    )
                )
            record.guard_asked_s = now_s
            ask.append(record.node)
        return ask, events

    def stray_answer(self, node: int, now_s: float) -> LinkEvent | None:
        """Count an SDO answer of ``node`` without a request from here; return an event if due.

        Two within ten seconds, without requests of another master, mean two nodes with one number,
        until there are none for a minute.
        """
        record = self.record(node)
        record.strays_s = [t for t in record.strays_s if now_s - t < _DUPLICATE_WINDOW_S]
        record.strays_s.append(now_s)
        if len(record.strays_s) < 2 or record.conflict:
            return None
        foreign = record.foreign_master_s
        if foreign is not None and now_s - foreign < _DUPLICATE_WINDOW_S:
            record.conflict = text("canopen.state-another-master")
            return LinkEvent("fault", record.node, text("event.another-master", node=record.node))
        record.conflict = text("canopen.state-same-number")
        return LinkEvent("fault", record.node, text("event.two-nodes-answer", node=record.node))
