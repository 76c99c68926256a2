"""What must hold, judged by the drives' own word and by the server's answers."""

from __future__ import annotations

import re
import threading
import time
from collections import defaultdict, deque
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx

from benchmarks.chaos.station import PASSWORD, TrialStation, Truth

#: An axis that moves more than this within `_WINDOW_S` is moving.
_MOVES_REV, _WINDOW_S = 0.02, 0.12
#: After the end of a grant: the ramp of the gentlest motion of the trial, and a watchdog before it.
GRANT_BRAKE_S = 2.5
#: "unreachable" needs a reason that is not older than this: a mute drive, a cable, a busy bus.
_REASON_S = 5.0
#: A verdict that says it moves is of a shaft that moved within this time before the answer.
_SAID_S = 1.0
#: Greatest answer time of GET /drives, and its p99 where the machine had time.
SLOWEST_S, P99_S = 2.0, 0.05
_BAD_LOG = re.compile(
    r"Traceback|Error:|never retrieved|never awaited|was destroyed|Exception|^ERROR|Warning:"
)


@dataclass(eq=False)
class Claim:
    """Somebody's reason for an axis to move. Times are monotonic seconds.

    ``ends`` None: still in force. From then on the axis has ``brake_s`` to stand.
    """

    axis: int
    what: str
    person: str
    began: float
    brake_s: float
    travel_rev: float | None = None
    start: int | None = None
    ends: float | None = None
    job: str | None = None

    def end(self, at: float) -> None:
        """No reason any more from this moment on; the earliest counts."""
        self.ends = at if self.ends is None else min(self.ends, at)


@dataclass
class Record:
    """What was found."""

    violations: list[str] = field(default_factory=list)
    excused: int = 0
    times_s: list[float] = field(default_factory=list)


class Judge:
    """Looks at the drives all the time, from a thread of its own."""

    def __init__(self, station: TrialStation, say: Any) -> None:
        self.station, self._say = station, say
        self.record = Record()
        self.claims: list[Claim] = []
        self.counts: dict[int, float] = {}
        #: Axes of which nothing can be said for the rest of the episode, and why.
        self.unclear: dict[int, str] = {}
        self.truths: dict[int, Truth] = {}
        self._history: dict[int, deque[Truth]] = defaultdict(lambda: deque(maxlen=400))
        self._over = threading.Event()
        self._lock = threading.Lock()
        self._reported: dict[str, float] = {}
        self._thread = threading.Thread(target=self._run, daemon=True, name="judge")
        self._poller = threading.Thread(target=self._poll, daemon=True, name="poller")
        #: Until when nothing is said of the server's answers, and of the drives.
        self.pause_polling = 0.0
        self.blind = 0.0
        self._lagging = 0.0
        self._log_at = 0
        #: Ids that the server has given to each axis, as a page saw them.
        self.ids: dict[int, set[str]] = defaultdict(set)
        #: When the last trouble was made or healed.
        self.troubled = 0.0

    def start(self) -> None:
        self._thread.start()
        self._poller.start()

    def close(self) -> None:
        self._over.set()
        for thread in (self._thread, self._poller):
            if thread.is_alive():
                thread.join()

    def violated(self, text: str, key: str = "") -> bool:
        """Note it; the same again within some seconds is the same. Returns whether it is new."""
        now = time.monotonic()
        if now - self._reported.get(key or text, -60.0) < 20.0:
            return False
        self._reported[key or text] = now
        self.record.violations.append(text)
        self._say(f"VIOLATION: {text}")
        return True

    # --- claims -----------------------------------------------------------------------

    def claim(
        self, axis: int, what: str, person: str, brake_s: float, travel_rev: float | None = None
    ) -> Claim:
        truth = self.truths.get(axis)
        made = Claim(axis, what, person, time.monotonic(), brake_s, travel_rev,
                     truth.position if truth and not self.moves(axis) else None)  # fmt: skip
        with self._lock:
            self.claims.append(made)
        return made

    def end_claims(self, *, axis: int | None = None, person: str | None = None,
                   before: float | None = None, at: float | None = None,
                   stands: bool = False) -> None:  # fmt: skip
        """These have no force any more; ``stands``: nor have they time to brake."""
        at = time.monotonic() if at is None else at
        with self._lock:
            for claim in self.claims:
                if (
                    axis in (None, claim.axis)
                    and person in (None, claim.person)
                    and (before is None or claim.began < before)
                ):
                    claim.end(at)
                    if stands:
                        claim.brake_s = 0.0

    def forget_claims(self) -> None:
        with self._lock:
            self.claims.clear()
        self.unclear.clear()

    # --- motion -----------------------------------------------------------------------

    def moves(self, axis: int) -> bool:
        history = tuple(self._history[axis])
        if len(history) < 2 or axis not in self.counts:
            return False
        newest = history[-1]
        older = [t for t in history if newest.wall_s - t.wall_s >= _WINDOW_S]
        if not older:
            return False
        return abs(newest.position - older[-1].position) > _MOVES_REV * self.counts[axis]

    def _run(self) -> None:
        while not self._over.wait(0.02):
            for axis in range(len(self.station.specs)):
                truth = self.station.truth(axis)
                if truth is None:
                    self._history[axis].clear()
                    continue
                self.truths[axis] = truth
                self._history[axis].append(truth)
                self._judge_motion(axis, truth)

    def lag(self, seconds: float) -> None:
        """The server is stopped for so long: what it must do comes as much later."""
        self._lagging = time.monotonic() + seconds + 3.0

    def _judge_motion(self, axis: int, truth: Truth) -> None:
        if axis in self.unclear or axis not in self.counts or truth.wall_s < self.blind:
            return
        with self._lock:
            claims = [c for c in self.claims if c.axis == axis]
        self._judge_envelope(axis, truth, claims)
        if not self.moves(axis):
            return
        late = self._lateness()
        now = truth.wall_s - _WINDOW_S
        self._judge_grant(axis, now, late)
        if any(c.ends is None or now < c.ends + c.brake_s + late for c in claims):
            return
        last = max((c for c in claims), key=lambda c: c.ends or 0.0, default=None)
        why = (
            "nobody ever asked for it"
            if last is None or last.ends is None
            else (
                f"the last reason ({last.what} of {last.person}) ended "
                f"{now - last.ends:.2f} s ago, and it had {last.brake_s:.2f} s to stand"
            )
        )
        key = f"moves {axis}"
        if self.violated(f"axis {self.station.specs[axis].name} moves: {why}", key):
            for each in list(self._history[axis])[-150::6]:
                turns = each.position / self.counts[axis]
                self._say(
                    f"    {each.wall_s - now:+.3f} s: {turns:.3f} rev"
                    f"{', enabled' if each.enabled else ''}"
                )

    def _judge_grant(self, axis: int, now: float, late: float) -> None:
        """No axis turns without a grant of the motion authority, but for its ramp."""
        live = [self.station.grants.last_live(drive) for drive in tuple(self.ids[axis])]
        last = max(live, default=-1.0)
        if now > last + GRANT_BRAKE_S + late:
            ago = "there was none" if last < 0 else f"the last one ended {now - last:.2f} s ago"
            name = self.station.specs[axis].name
            self.violated(f"axis {name} moves without a grant: {ago}", f"grant {axis}")

    def stop_answered(self, verdicts: list[dict[str, Any]], sent: float) -> None:
        """STOP's answer equals the shaft: the verdicts other than ``stopped``, as they arrive.

        ``sent`` is the monotonic time at which STOP was pressed.
        (An axis that is said to stand has no time to brake any more, see `end_claims`.)
        """
        now = time.monotonic()
        for verdict in verdicts:
            for axis in [n for n, ids in self.ids.items() if verdict["drive"] in ids]:
                if axis in self.unclear or now < self.blind or verdict["superseded"]:
                    continue
                self._judge_verdict(axis, verdict, now, sent)

    def _judge_verdict(self, axis: int, verdict: dict[str, Any], now: float, sent: float) -> None:
        name, said = self.station.specs[axis].name, verdict["verdict"]
        late = self._lateness()
        if said == "unreachable":
            if sent > self.troubled + _REASON_S + late:
                self.violated(f"STOP: {name} is unreachable, and nothing is wrong: {verdict}")
            return
        recent = [t.position for t in tuple(self._history[axis]) if now - t.wall_s < _SAID_S + late]
        if said == "stopped" or len(recent) < 5:
            return
        if max(recent) - min(recent) < _MOVES_REV * self.counts[axis]:
            self.violated(f"STOP: {name} is said to move, and it stands: {verdict}")

    def _judge_envelope(self, axis: int, truth: Truth, claims: list[Claim]) -> None:
        for claim in claims:
            if claim.travel_rev is None or claim.start is None:
                continue
            if claim.ends is not None and truth.wall_s > claim.ends + claim.brake_s:
                continue
            if any(o is not claim and (o.ends is None or o.ends > claim.began) for o in claims):
                continue  # two at once: whose start point counts is not known
            moved = abs(truth.position - claim.start) / self.counts[axis]
            if moved > claim.travel_rev * 1.05 + 0.6:
                self.violated(
                    f"axis {self.station.specs[axis].name} is {moved:.2f} rev from the start of "
                    f"{claim.what}, whose limit is {claim.travel_rev:.2f} rev",
                    f"envelope {id(claim)}",
                )

    def _lateness(self) -> float:
        """More time for a machine that has none to give: PSI of the last seconds."""
        if time.monotonic() < self._lagging:
            return 5.0
        try:
            with Path("/proc/pressure/cpu").open() as file:
                share = float(file.readline().split("avg10=")[1].split()[0]) / 100
        except (OSError, IndexError, ValueError):
            return 1.0
        return 0.3 + 3.0 * share

    # --- the server's answers ---------------------------------------------------------

    def _poll(self) -> None:
        client: httpx.Client | None = None
        port = 0
        while not self._over.wait(0.1):
            if self.station.down_since is not None or time.monotonic() < self.pause_polling:
                continue
            if client is None or port != self.station.port:
                port = self.station.port
                client = self.station.client()
            waited, began = self.station.waited_s(), time.monotonic()
            try:
                if not client.cookies:
                    client.post("/session", json={"name": "Anna", "password": PASSWORD})
                    continue
                answer = client.get("/drives")
            except httpx.HTTPError:
                client = None
                if self.station.down_since is None and time.monotonic() > self.pause_polling:
                    self.violated("the server does not answer although it should run", "dead")
                continue
            # A process that was killed meanwhile takes its share of the sum with it.
            waited = max(0.0, self.station.waited_s() - waited)
            took = time.monotonic() - began - waited
            if time.monotonic() < self.pause_polling or self.station.down_since is not None:
                continue
            self.answered("GET", "/drives", answer.status_code, answer.text)
            self.record.times_s.append(max(took, 0.0))
            if took > SLOWEST_S:
                self.violated(f"GET /drives took {took:.2f} s", "slow")

    def answered(self, method: str, path: str, status: int, text: str) -> None:
        """Every answer comes by here."""
        if status >= 500 and status not in (502, 503, 504):
            self.violated(f"{method} {path} was answered by {status}: {text[:300]}", f"500 {path}")

    def read_log(self) -> None:
        """What the server wrote since the last time."""
        with self.station.log.open() as file:
            file.seek(self._log_at)
            text = file.read()
            self._log_at = file.tell()
        if _BAD_LOG.search(text):
            self.violated(f"the server's log has: {text[-3000:]}")
