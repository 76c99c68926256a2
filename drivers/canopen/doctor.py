"""Reading of everything in a node and its bus that shows why it is not Operational. Blocking.

Only reads: reads of objects, received frames, and one request of node guarding if that does not
start life guarding. Source: CiA 301 v4.2.0 clauses 7.2.8.2.2 (error control) and 7.5.2 (objects).
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from drivers.canopen.adapters.port import CanPort
from drivers.canopen.exchange.cyclic import CanopenCyclic
from drivers.canopen.exchange.pdo import INVALID
from drivers.canopen.frames import EMERGENCY, HEARTBEAT, SDO_ANSWER, Frame
from drivers.canopen.nodes import NodeRecord, NodeWatch
from drivers.canopen.sdo.channel import SdoChannel
from drivers.canopen.sdo.scanning import probe
from drivers.canopen.url import CanUrl
from drivers.doctor.can_evidence import BusFacts, CanEvidence
from drivers.errors import DriveError, LinkLost, LinkTimeout, Rejected
from drivers.objects.dialect import dialect_of
from profiles.schema import Profile

_RECENT_S = 10.0
_AT_ONCE = 16
_OTHERS_READ = 16
_LISTEN_S = 0.3
_LONGEST_HEARTBEAT_S = 3.0
_GUARD_ANSWER_S = 0.2
_WAIT_STEP_S = 0.005
_IDENTIFIER = 0x7FF


@dataclass(frozen=True, slots=True)
class _Counts:
    received: int
    acknowledge: int
    protocol: int
    passive: int
    not_sent: int


class Examiner:
    """Examines nodes of one bus. ``lock`` guards ``watch``."""

    def __init__(
        self,
        port: CanPort,
        watch: NodeWatch,
        lock: threading.Lock,
        channels: Mapping[int, SdoChannel],
        cyclic: CanopenCyclic,
    ) -> None:
        self._port = port
        self._watch = watch
        self._lock = lock
        self._channels = channels
        self._cyclic = cyclic

    def known(self) -> list[int]:
        """Return the nodes that were received or are in use."""
        with self._lock:
            return sorted(node for node in self._watch.nodes if self._watch.is_there(node))

    def examine(
        self, node: int, profile: Profile | None, refusal: DriveError | None
    ) -> CanEvidence:
        """Collect the facts of ``node``; 0 is the bus alone. Takes one to five seconds."""
        before, begin_s = self._counts(), time.monotonic()
        facts: dict[str, Any] = {"node": node, "answers": 0, "own_id": self._settings.own_id}
        facts |= {"timeout_s": self._settings.timeout_s} | _refused(refusal)
        if profile is not None:
            identity = profile.identity
            facts |= {"known_vendor": identity.vendor_id, "known_product": identity.product_code}
            facts["known_revision"] = identity.revision
            facts["own_status_word"] = dialect_of(profile).echoes_control
        self._cyclic.forget_arrivals()
        try:
            self._ask(node, facts)
        except LinkLost:
            facts["answers"] = 0
        self._listen(begin_s)
        wanted, silent = self._cyclic.arrivals(node)
        facts |= {"started": wanted > 0, "pdos_wanted": wanted, "pdos_silent": silent}
        with self._lock:
            facts |= self._heard(self._watch.record(node) if node else None, facts)
        return CanEvidence(**facts, bus=self._bus(before))

    @property
    def _settings(self) -> CanUrl:
        return self._port.url

    # Requests

    def _ask(self, node: int, facts: dict[str, Any]) -> None:
        answers: dict[int, list[bytes]] = {}
        numbers = list(self._channels)
        for start in range(0, len(numbers), _AT_ONCE):
            answers |= probe([self._channels[n] for n in numbers[start : start + _AT_ONCE]])
        others = tuple(n for n in sorted(answers) if n != node)
        facts |= {"answers": len(answers.get(node, ())), "others": others}
        if not facts["answers"]:
            facts["same_product"] = self._same_product(others, facts)
            return
        numbers_read = {
            "device_type": (0x1000, 0),
            "vendor": (0x1018, 1),
            "product": (0x1018, 2),
            "revision": (0x1018, 3),
            "sync_cob": (0x1005, 0),
            "status_word": (0x6041, 0),
            "drive_error": (0x603F, 0),
        }
        for name, address in numbers_read.items():
            facts[name] = self._number(node, *address)
        facts["error_register"] = register = self._number(node, 0x1001, 0)
        if (register or 0) & 1:
            facts["emergency"] = (self._number(node, 0x1003, 1) or 0) & 0xFFFF or None
        facts["collisions"] = self._collisions(node, others)
        self._ask_state(node)

    def _same_product(self, others: tuple[int, ...], facts: dict[str, Any]) -> tuple[int, ...]:
        """Return the nodes with the identity of the profile, for a node that does not answer."""
        vendor, product = facts.get("known_vendor"), facts.get("known_product")
        if vendor is None or product is None:
            return ()
        return tuple(
            other
            for other in others[:_OTHERS_READ]
            if self._number(other, 0x1018, 1) == vendor
            and self._number(other, 0x1018, 2) == product
        )

    def _collisions(self, node: int, others: tuple[int, ...]) -> tuple[tuple[int, int], ...]:
        mine = self._sends(node)
        return tuple(
            (cob_id, other)
            for other in others[:_OTHERS_READ]
            for cob_id in sorted(mine & self._sends(other))
        )

    def _sends(self, node: int) -> set[int]:
        """Return the identifiers with which a node sends (CiA 301 clause 7.3.3, 1800h to 1803h)."""
        found = {EMERGENCY + node, SDO_ANSWER + node, HEARTBEAT + node}
        for number in range(4):
            cob_id = self._number(node, 0x1800 + number, 1)
            if cob_id is not None and not cob_id & INVALID:
                found.add(cob_id & _IDENTIFIER)
        return found

    def _ask_state(self, node: int) -> None:
        """Wait for a heartbeat, or request the state by node guarding where that is permitted."""
        period_ms = self._number(node, 0x1017, 0) or 0
        asked_s = time.monotonic()
        if period_ms:
            limit_s = min(2.5 * period_ms / 1e3 + 0.1, _LONGEST_HEARTBEAT_S)
            self._until(lambda record: (record.last_heartbeat_s or 0) >= asked_s, node, limit_s)
            return
        if self._settings.guard_s > 0:
            return  # the link requests it regularly
        # The first request would start life guarding in a node where it is set up (clause
        # 7.2.8.2.2).
        if self._number(node, 0x100C, 0) and self._number(node, 0x100D, 0):
            return
        with self._lock:
            self._watch.record(node).guard_asked_s = asked_s
        self._port.send(Frame(HEARTBEAT + node, remote=True))
        self._until(lambda record: record.guard_asked_s is None, node, _GUARD_ANSWER_S)
        with self._lock:
            self._watch.record(node).guard_asked_s = None

    def _until(self, seen: Callable[[NodeRecord], bool], node: int, limit_s: float) -> None:
        deadline_s = time.monotonic() + limit_s
        while time.monotonic() < deadline_s:
            with self._lock:
                if seen(self._watch.record(node)):
                    return
            time.sleep(_WAIT_STEP_S)

    def _number(self, node: int, index: int, subindex: int) -> int | None:
        try:
            data = self._channels[node].read(index, subindex, self._settings.timeout_s)
        except LinkLost:
            raise
        except DriveError:
            return None
        return int.from_bytes(data, "little")

    # Received frames

    def _listen(self, begin_s: float) -> None:
        """Wait for error frames and process data, which arrive without a request."""
        time.sleep(max(begin_s + _LISTEN_S - time.monotonic(), 0.0))

    def _heard(self, record: NodeRecord | None, facts: dict[str, Any]) -> dict[str, Any]:
        if record is None:
            return {}
        now_s = time.monotonic()
        heard_s, emergency = record.last_heartbeat_s, record.open_emergency
        code = facts.get("emergency") if emergency is None else emergency
        return {
            "state": record.state or None,
            "heard": heard_s is not None,
            "alive": record.alive,
            "guarded": record.guarded,
            "silent_s": None if heard_s is None else now_s - heard_s,
            "period_s": record.period_s,
            "boots": sum(now_s - at_s < _RECENT_S for at_s in record.boots_s),
            "toggle_repeated": _recent(record.toggle_repeated_s, now_s),
            "emergency": code,
            # Bit 0 of 1001h is set as long as there is any error (CiA 301 clause 7.5.2.2): some
            # drives never withdraw an emergency by code 0.
            "emergency_open": bool(code) and facts.get("error_register") != 0,
            "foreign_master": _recent(record.foreign_master_s, now_s),
        }

    def _counts(self) -> _Counts:
        port = self._port
        return _Counts(
            port.received,
            port.acknowledge_errors,
            port.protocol_errors,
            port.error_passive,
            port.lost_frames,
        )

    def _bus(self, before: _Counts) -> BusFacts:
        now, now_s = self._counts(), time.monotonic()
        return BusFacts(
            open=self._port.connected,
            bus_off=_recent(self._port.bus_off_s, now_s),
            received=now.received - before.received,
            acknowledge_errors=now.acknowledge - before.acknowledge,
            protocol_errors=now.protocol - before.protocol,
            error_passive=now.passive - before.passive,
            not_sent=now.not_sent - before.not_sent,
            other_sync=_recent(self._watch.sync_heard_s, now_s),
            bitrate=self._settings.bitrate,
        )


def _recent(at_s: float | None, now_s: float) -> bool:
    return at_s is not None and now_s - at_s < _RECENT_S


def _refused(refusal: DriveError | None) -> dict[str, Any]:
    """Return the refusal with its causes: a failed undo must not hide the first error."""
    if refusal is None:
        return {}
    chain = list(_chain(refusal))
    key = next((each.parameter for each in chain if each.parameter), "")
    abort = next((each for each in chain if isinstance(each, Rejected)), None)
    return {
        "refused": refusal.code or refusal.kind,
        "refused_key": key,
        "refused_code": None if abort is None else abort.abort_code,
        "timed_out": any(isinstance(each, LinkTimeout) for each in chain),
    }


def _chain(error: BaseException | None) -> Iterator[DriveError]:
    while error is not None:
        if isinstance(error, DriveError):
            yield error
        error = error.__cause__ or error.__context__
