"""Health checks without a person: on a schedule, or when a controller asks. What is in the way is
told, and nothing moves.

What an axis would answer is given here; `test_health` measures it on virtual mechanics.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import httpx
import pytest

from backend.api.app import make_app
from backend.api.health.kept import records_of
from backend.api.health.unattended import Unattended
from backend.foundation.people.station import People
from backend.station.bench import Bench
from backend.station.drives.monitor import Snapshot
from backend.tools.tool import Run
from backend.tools.watching.health import run as health_run
from backend.tools.watching.health.result import HealthRound, HealthValue
from backend.tools.watching.health.settings import HealthSettings
from backend.tools.watching.trend.permission import WINDOW
from backend.tools.watching.trend.records import axis_of
from drivers.cia402 import State
from drivers.virtual.firmware.factory import make_device
from profiles.loader import load_profile
from tests.virtual.tools.direct import DirectLink
from tests.virtual.tools.rig import mechanics

URL = "ethercat://virtual7"
EVERY_DAY = list(range(7))


@dataclass
class Station:
    http: httpx.AsyncClient
    bench: Bench
    schedule: Unattended
    people: People
    link: DirectLink
    granted: list[str] = field(default_factory=list)
    patch: pytest.MonkeyPatch = field(default_factory=pytest.MonkeyPatch)
    value: float = 60.0
    asked: list[HealthSettings] = field(default_factory=list)
    hold: asyncio.Event = field(default_factory=asyncio.Event)
    ahead: timedelta = timedelta(0)

    def now(self) -> datetime:
        return datetime.now(UTC) + self.ahead

    async def round(self, _run: Run, settings: HealthSettings, _part: object) -> HealthRound:
        self.asked.append(settings)
        await self.hold.wait()
        return HealthRound(values=(HealthValue(quantity="resonance", value=self.value),))

    async def ok(self, method: str, path: str, body: object = None) -> Any:
        answer = await self.http.request(method, path, json=body)
        assert answer.is_success, answer.text
        return answer.json() if answer.content else None

    async def code(self, method: str, path: str, body: object = None) -> str:
        """What a request is refused with."""
        answer = await self.http.request(method, path, json=body)
        assert answer.status_code >= 400, answer.text
        return str(answer.json()["code"])

    async def ends(self) -> None:
        """The run that goes on has ended, and that is noted."""
        for job in self.bench.jobs.all():
            await job.wait()
        await asyncio.gather(*self.schedule._ends)

    async def permission(self) -> Any:
        return await self.ok("GET", "/drives/x/health/permission")

    async def permit(self, **changed: object) -> Any:
        until = (self.now() + timedelta(days=30)).isoformat()
        body = {"until": until, "trigger": True, "person": "Ann", "secured": True, "pause_min": 5}
        return await self.ok("PUT", "/drives/x/health/permission", {**body, **changed})

    def known(self) -> Any:
        found = self.schedule.permissions.of("x")
        assert found is not None
        return found


@pytest.fixture
async def station(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[Station]:
    """A server with one axis that has a signed baseline. Its schedule is asked by the test."""
    link = DirectLink(make_device("mms7", mechanics((1e-4, 60.0, 0.006))), load_profile("mms7"))
    bench = Bench(tmp_path, {URL: lambda: link})
    people = People(tmp_path)
    app = make_app(bench, hosts=frozenset({"test"}), people=people)
    transport = httpx.ASGITransport(app)
    async with httpx.AsyncClient(transport=transport, base_url="http://test/api/v1") as http:
        made = Station(http, bench, app.state.unattended, people, link)
        made.schedule._now, made.schedule._notice_s = made.now, 0.0
        made.hold.set()
        monkeypatch.setattr(health_run, "_round", made.round)
        body = {"url": URL, "station": 1, "profile": "mms7", "name": "X"}
        await made.ok("POST", "/drives", body)
        settings = HealthSettings(travel_limit=3, speed_limit=800, torque_limit=60, rounds=3)
        values = [HealthValue(quantity="resonance", value=each) for each in (60.0, 60.1, 59.9)]
        rounds = [HealthRound(values=(each,)) for each in values]
        axis = axis_of(bench.connected("x").drive, bench.records.station)
        runs = records_of(bench).add(axis, settings, rounds, {}, "Ann")
        await made.ok("POST", "/drives/x/health/baseline", {"runs": runs, "person": "Ann"})
        await seen(made)
        bench.authority.listen(
            lambda drive: made.granted.extend(
                str(grant.purpose) for grant in bench.authority._live(drive)
            )
        )
        yield made
        await made.schedule.close()
        await bench.close()


async def until(true: Callable[[], bool]) -> None:
    for _ in range(500):
        if true():
            return
        await asyncio.sleep(0.01)
    raise AssertionError("never true")


async def seen(station: Station) -> None:
    """The monitor has read the axis."""
    monitor = station.bench.connected("x").monitor
    monitor.hurry()
    await until(lambda: monitor.snapshot.fresh)


@pytest.mark.long
async def test_a_controller_asks_and_only_what_was_permitted_runs(station: Station) -> None:
    assert await station.code("POST", "/drives/x/health/trigger") == "health.trigger-not-permitted"
    unsecured = {"until": station.now().isoformat(), "trigger": True, "person": "Ann"}
    put = ("PUT", "/drives/x/health/permission")
    assert await station.code(*put, unsecured) == "health.permission-secured"
    given = await station.permit()
    assert (given["person"], given["next_due"], given["ended"]) == ("Ann", None, None)
    assert station.granted == []

    station.value = 50.0
    job = await station.ok("POST", "/drives/x/health/trigger")
    assert job["motion"]
    await station.ends()
    assert [(each.speed_limit, each.rounds, each.consent) for each in station.asked] == [
        (800.0, 2, False),
        (800.0, 2, False),
    ]
    (attempt,) = (await station.permission())["attempts"]
    assert (attempt["cause"], attempt["outcome"]) == ("trigger", "done")
    found = await station.ok("GET", "/drives/x/health")
    assert found["changed"] == 1
    lines = [each.text for each in station.bench.journal.entries("x")]
    assert any("resonance 1 has changed by -16.7 %" in line for line in lines), lines

    assert await station.code("POST", "/drives/x/health/trigger") == "health.run-too-soon"
    station.ahead = timedelta(minutes=6)
    await station.ok("POST", "/drives/x/health/trigger")
    await station.ends()
    await station.ok("DELETE", "/drives/x/health/permission")
    station.ahead = timedelta(minutes=20)
    assert await station.code("POST", "/drives/x/health/trigger") == "health.trigger-not-permitted"
    assert len(station.asked) == 4


Way = Callable[[Station], Awaitable[None]]


async def controlled(station: Station) -> None:
    station.bench.leases.take("x", "c9", "Otto")


async def stopped(station: Station) -> None:
    await station.ok("POST", "/stop", {})


async def enabled(station: Station) -> None:
    """By another controller: no grant of this server is behind it."""
    axis = station.bench.connected("x").axis

    async def look(_self: object) -> Any:
        return type("Sample", (), {"state": State.OPERATION_ENABLED})()

    station.patch.setattr("backend.axes.stopping.speed.SpeedWatch.look", look)
    assert axis.known_units is not None


async def turning(station: Station) -> None:
    """By hand, or by what hangs at it."""
    station.patch.setattr(
        "backend.axes.stopping.speed.SpeedWatch.stands", lambda _self, _dwell=0.0: False
    )


async def faulty(station: Station) -> None:
    monitor = station.bench.connected("x").monitor
    await monitor.close()
    monitor.snapshot = Snapshot(0.0, fresh=True, state=State.FAULT)


async def away(station: Station) -> None:
    monitor = station.bench.connected("x").monitor
    await monitor.close()
    monitor.snapshot = Snapshot(0.0, fresh=False)


async def pending(station: Station) -> None:
    station.bench.connected("x").drive.pending_restores.add({"6085:00": 1})


async def other_drive(station: Station) -> None:
    found = station.known().model_copy(update={"axis_key": "2e1-30-8"})
    station.schedule.permissions.put(found)


async def newer_baseline(station: Station) -> None:
    runs = [each["id"] for each in (await station.ok("GET", "/drives/x/health"))["runs"]]
    await station.ok("POST", "/drives/x/health/baseline", {"runs": runs, "person": "Ben"})


async def expired(station: Station) -> None:
    station.ahead = timedelta(days=31)


async def nobody(station: Station) -> None:
    """The station has got accounts, and none is of who permitted it."""
    station.people.accounts_needed = True


@pytest.mark.long(keep=2)
@pytest.mark.parametrize(
    ("way", "code"),
    [
        (controlled, "people.control-axis"),
        (stopped, "health.run-after-stop"),
        (enabled, "health.run-enabled"),
        (turning, "health.run-turning"),
        (faulty, "health.run-fault"),
        (away, "health.run-not-connected"),
        (pending, "health.run-pending"),
        (other_drive, "health.run-other-drive"),
        (newer_baseline, "health.run-other-baseline"),
        (expired, "health.permission-ended"),
        (nobody, "health.permission-person"),
    ],
)
async def test_what_is_in_the_way_is_told_and_nothing_moves(
    station: Station, monkeypatch: pytest.MonkeyPatch, way: Way, code: str
) -> None:
    station.patch = monkeypatch
    await station.permit(days=EVERY_DAY)
    await way(station)
    station.granted.clear()
    station.schedule.permissions.skip(
        station.known().model_copy(
            update={
                "handled": station.now() - timedelta(days=2),
                "at": station.now().astimezone().time(),
            }
        )
    )
    await station.schedule._look_after(station.known())
    if way is not expired:
        attempt = station.known().attempts[-1]
        assert (attempt.outcome, attempt.why["code"]) == ("not_made", code)
        lines = [each.text for each in station.bench.journal.entries("x")]
        assert any("nothing moved" in line for line in lines), lines
    if way is not nobody:
        refused = await station.http.post("/drives/x/health/trigger")
        assert refused.status_code in (409, 503)
        assert refused.json()["code"] == code
    assert station.asked == []
    assert station.granted == []
    if way is stopped:
        assert station.bench.connected("x").axis.stopped, "only a person takes a STOP back"


async def test_the_schedule_survives_a_restart_and_runs_once(station: Station) -> None:
    given = await station.permit(days=EVERY_DAY, at="03:00")
    next_due = datetime.fromisoformat(given["next_due"])
    await station.schedule._look_after(station.known())
    assert station.asked == [], "it is not due yet"

    restarted = Unattended(station.bench, station.people, now=station.now, notice_s=0.0)
    restarted.permissions.load()
    station.ahead = next_due - datetime.now(UTC) + timedelta(seconds=2)
    (known,) = restarted.permissions.all()
    await restarted._look_after(known)
    await station.ends()
    await asyncio.gather(*restarted._ends)
    assert len(station.asked) == 2
    (known,) = restarted.permissions.all()
    assert [(each.cause, each.outcome) for each in known.attempts] == [("schedule", "done")]
    found = await station.ok("GET", "/drives/x/health")
    assert found["runs"][-1]["person"] == "Ann (schedule)"
    await restarted._look_after(known)
    assert len(station.asked) == 2, "once for each time"

    late = Unattended(station.bench, station.people, now=station.now, notice_s=0.0)
    late.permissions.load()
    station.ahead += timedelta(days=1) + WINDOW
    (known,) = late.permissions.all()
    await late._look_after(known)
    assert len(station.asked) == 2, "nobody expects it at another time"
    assert late.permissions.all()[0].attempts[-1].outcome == "missed"


@pytest.mark.long
async def test_taken_back_during_a_run_the_run_ends(station: Station) -> None:
    await station.permit()
    station.hold.clear()
    await station.ok("POST", "/drives/x/health/trigger")
    await until(lambda: bool(station.asked))
    await station.ok("DELETE", "/drives/x/health/permission")
    await station.ends()
    assert station.bench.jobs.all()[-1].state == "cancelled"
    assert (why := station.bench.jobs.all()[-1].cancel_cause) is not None
    assert why.code == "health.permission-withdrawn"
    assert station.bench.authority.grant_of("x") is None


@pytest.mark.long
async def test_stop_before_an_announced_run_prevents_it(station: Station) -> None:
    await station.permit(days=EVERY_DAY)
    station.schedule.permissions.skip(
        station.known().model_copy(
            update={
                "handled": station.now() - timedelta(days=2),
                "at": station.now().astimezone().time(),
            }
        )
    )
    station.schedule._notice_s = 0.5
    run = asyncio.create_task(station.schedule._look_after(station.known()))
    entries = station.bench.journal.entries
    await until(lambda: any("begins in" in each.text for each in entries("x")))
    await station.ok("POST", "/stop", {})
    await run
    assert station.asked == []
    why = station.known().attempts[-1].why
    assert why["code"] == "health.run-after-stop"


async def test_nothing_is_repeated_where_it_cannot_be_stored(
    station: Station, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else a full disk would have the axis run again every second."""
    await station.permit(days=EVERY_DAY)
    station.schedule.permissions.skip(
        station.known().model_copy(
            update={
                "handled": station.now() - timedelta(days=2),
                "at": station.now().astimezone().time(),
            }
        )
    )
    monkeypatch.setattr(station.schedule.permissions, "_file", Path("/proc/none/x.json"))
    await station.schedule._look_after(station.known())
    await station.schedule._look_after(station.known())
    assert station.asked == []
    errors = [e for e in station.bench.journal.entries("x") if e.level == "error"]
    assert len(errors) == 1


async def test_a_run_ends_with_the_right_of_who_permitted_it(station: Station) -> None:
    await station.permit()
    station.hold.clear()
    await station.ok("POST", "/drives/x/health/trigger")
    await until(lambda: bool(station.asked))
    await nobody(station)
    await station.schedule._look_after(station.known())
    station.people.accounts_needed = False
    await station.ends()
    assert station.bench.jobs.all()[-1].state == "cancelled"
    assert station.known().attempts[-1].outcome == "cancelled"
