"""Trouble on an EtherCAT segment, as a user of the interface sees it.

Each fault: reported as text, the server answers meanwhile, the axis is at standstill, and all is
well again without a restart once the cause is gone. Times of the drives follow the frames, so a
busy test machine changes nothing but how long this takes.
"""

from __future__ import annotations

import os
import re
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from drivers.virtual.wires.ethercat.launch import VirtualSegment
from drivers.virtual.wires.netns import unavailable
from tests.api.test_ethercat import BENCH, JOG, URL, hold, undisturbed
from tests.support.machine import ApiWatch, within
from tests.support.station import HANG_S, Live, Station, until

B = 1
"""Index of the second slave for the segment's commands; cable 1 leads to it."""
VELOCITY = 0x606C
OPTIONS = ["--lockstep", "--mailboxes", "128", "40"]
"""With answers of 40 bytes, lists of process data come in segments."""

LOST = re.compile("no longer answers|does not answer|no valid process data")
"""How a motion ends whose drive vanished, by what is noticed first."""


class Segment:
    """A station with two axes on one segment, and what is done to the segment."""

    def __init__(self, station: Station, options: list[str]) -> None:
        self.station = station
        self._options = options
        self.a = station.add(1, URL, name="A")
        self.b = station.add(2, URL, name="B")

    def trouble(self, command: str, **arguments: object) -> Any:
        return self.station.drives.segments[URL].command(command, **arguments)

    def start_cyclic(self) -> None:
        body = {"url": URL, "cycle_us": 1000}
        bus = self.station.ok(self.station.http.post("/buses/cyclic", json=body))
        assert bus["cyclic"]["running"]

    def end_cyclic(self) -> None:
        self.station.http.delete("/buses/cyclic", params={"url": URL})

    def exchange(self) -> Any:
        """What the interface reports of the exchange."""
        return self.station.ok(self.station.http.get("/buses"))[0]["cyclic"]

    def view(self) -> Any:
        answer = self.station.http.get("/ethercat/segment", params={"url": URL})
        return self.station.ok(answer)

    def reported(self, *words: str, after: int, within_s: float = 10.0) -> str:
        """The line of the log with all these words that is newer than `lines`."""

        def seen() -> str:
            lines = self._log()
            new = lines[: len(lines) - after] if len(lines) >= after else lines
            return next((line for line in new if all(w in line for w in words)), "")

        return str(within(within_s, seen, f"{words} in the log"))

    def lines(self) -> int:
        """How many lines the log has."""
        return len(self._log())

    def _log(self) -> list[str]:
        return [entry["text"] for entry in self.station.ok(self.station.http.get("/log"))]

    def stands(self, slave: int = B) -> None:
        """By the drive's own word, past the wire: below 2 rpm (65536 increments to one turn)."""

        def still() -> bool:
            speed = bytes.fromhex(str(self.trouble("read", slave=slave, index=VELOCITY)))
            return abs(int.from_bytes(speed, "little", signed=True)) < 65536 * 2 / 60

        within(10, still, "the axis stands")

    def settled(self) -> None:
        """Both drives were asked after now and answered; what their return began has ended."""
        now = datetime.now(UTC)

        def calm() -> bool:
            # The states first: a drive's first answer after its return begins the job that reads
            # it again and restores what a motion left changed; until that ends, nothing may move.
            states = [self.station.state(drive) for drive in (self.a, self.b)]
            jobs = self.station.ok(self.station.http.get("/jobs"))
            asked = all(datetime.fromisoformat(state["time"]) > now for state in states)
            fresh = all(state["fresh"] for state in states)
            return asked and fresh and all(job["state"] != "running" for job in jobs)

        within(20, calm, "both drives answer")

    def jogs(self) -> None:
        """Everything works: B can be moved, after a fault that it kept was reset by hand."""
        if self.station.state(self.b)["state"] == "Fault":
            self.station.ok(self.station.http.post(f"/drives/{self.b}/fault-reset", json={}))
        with self.station.live() as page:

            def jog() -> Any:
                page.send(type="jog_start", drive=self.b, direction=1, **JOG)
                hold(page, self.b, 0.8)
                page.send(type="jog_stop", drive=self.b)
                return page.wait("jog_ended", drive=self.b, timeout_s=20)

            ended = undisturbed(jog)
        assert ended["problem"] is None, ended

    def stop(self) -> None:
        self.station.http.post("/stop", json={})
        self.end_cyclic()
        self.station.remove(self.a, self.b)

    def parameter(self, drive: str) -> Any:
        """One parameter, asked of the drive now."""
        return self.station.http.get(f"/drives/{drive}/parameters/2005:03").json()

    def whole(self, drive: str, keys: list[str]) -> Any:
        """What reading several parameters came to."""
        job = self.station.http.post(f"/drives/{drive}/jobs/read_all", json={"keys": keys})
        return self.station.done(job)

    def peace(self) -> None:
        self.trouble("peace")
        self.trouble("timing", al_s=0.0, sdo_s=0.0)
        self.trouble("eeprom_busy", slave=B, for_s=0.0)
        self.trouble("heal")
        self.trouble("die_in_transfer", slave=B, after_segments=None)
        self.trouble("mute", slave=B, on=False)
        self.trouble("power_on", slave=B)

    def start_again(self) -> None:
        """The segment's process again, on the same cable, after it was killed."""
        drives = self.station.drives
        drives.segments[URL].close()
        drives.segments[URL] = VirtualSegment.start("ec0s", self._options, drives._namespaces[0])


@pytest.fixture(scope="module")
def segment(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Segment]:
    if reason := unavailable():
        pytest.skip(f"no private network here: {reason}")
    folder = Path(tmp_path_factory.mktemp("faults"))
    bench = folder / "bench.toml"
    bench.write_text(BENCH)
    # A late reply is awaited: a stalling machine is then no trouble of its own.
    station = Station(folder, bench, OPTIONS)
    station.start()
    made = Segment(station, ["--bench", str(bench), "--on", URL, *OPTIONS])
    yield made
    made.stop()
    station.stop()


@pytest.fixture
def running(segment: Segment) -> Iterator[Segment]:
    """Process data are exchanged; afterwards all trouble is undone.

    The server answers at once all the while, whatever the trouble is.
    """
    segment.settled()
    segment.start_cyclic()
    station = segment.station
    with ApiWatch(f"{station.url}/api/v1/drives") as watch:
        yield segment
    segment.peace()
    segment.station.http.post("/stop", json={})
    segment.end_cyclic()
    segment.settled()
    assert watch.p99_s() < 0.05, sorted(watch.times_s)[-10:]


@contextmanager
def turning(page: Live, segment: Segment) -> Iterator[None]:
    """B turns and is jogged on inside the block. A start that a stall ended is repeated."""
    for _ in range(5):
        page.send(type="jog_start", drive=segment.b, direction=1, **(JOG | {"travel_limit": 60.0}))
        with page.holding(segment.b):
            page.send(type="ping", n=1)
            page.wait("pong", n=1)  # what was sent before has begun
            now = until(lambda: turns_or_ended(segment, page), 60, "it turns")
            if now["moving_job"] is not None:
                yield
                return
        page.wait("jog_ended", drive=segment.b, timeout_s=20)
    raise AssertionError("this machine stalls too often")


def turns_or_ended(segment: Segment, page: Live) -> Any:
    """B's state where it turns or is jogged no more, else None."""
    page.listen()
    now = segment.station.state(segment.b)
    return now if now["moving_job"] is None or abs(now["velocity"] or 0.0) > 100 else None


def reason(ended: Any) -> str:
    """Why a jog ended, as text."""
    return f"{ended['reason']} {(ended['problem'] or {}).get('detail', '')}"


@pytest.mark.long
def test_cut_cable_stops_the_axis_behind_it_and_heals(running: Segment) -> None:
    before = running.lines()
    with running.station.live() as page, turning(page, running):
        running.trouble("cut", cable=1)
        ended = page.wait("jog_ended", drive=running.b, timeout_s=20)
    assert LOST.search(reason(ended)), ended
    running.reported("station 2", "no longer answers: supply off or cable cut", after=before)
    running.stands()
    view = running.view()
    assert [station["answers"] for station in view["stations"]] == [True, False]
    first, second = view["stations"]
    assert not first["ports"][1]["link"]
    assert first["ports"][1]["lost_links"] >= 1
    assert (
        "cable between station 1 and station 2: the link was lost"
        in (first["ports"][1]["findings"][0])
    )
    assert (second["behind_station"], second["behind_port"]) == (1, 1), "although it is cut"
    running.trouble("heal", cable=1)
    running.reported("station 2 is in OP again", after=before)
    assert running.station.state(running.b)["state"] != "Operation enabled"
    running.settled()
    running.jogs()


@pytest.mark.long
def test_power_cycle_of_a_slave(running: Segment) -> None:
    before = running.lines()
    with running.station.live() as page, turning(page, running):
        running.trouble("power_cycle", slave=B, off_s=1.0)
        ended = page.wait("jog_ended", drive=running.b, timeout_s=20)
    assert LOST.search(reason(ended)), ended
    running.reported("station 2", "no longer answers", after=before)
    running.reported("station 2 was switched on again", after=before)
    running.reported("station 2 is in OP again", after=before)
    running.stands()
    assert running.station.state(running.b)["state"] != "Operation enabled"
    running.settled()
    running.jogs()


@pytest.mark.long
def test_mute_mailbox_ends_in_words_while_process_data_go_on(running: Segment) -> None:
    running.trouble("mute", slave=B)
    began = time.monotonic()
    answer = running.station.http.get(f"/drives/{running.b}/parameters/2005:03")
    assert time.monotonic() - began < 6
    reported = answer.json()
    words = reported.get("detail") or reported.get("error")
    assert "did not answer in time" in words, reported
    assert running.view()["stations"][1]["state"] == "OP", "its process data still come"
    answer = running.station.http.get(f"/drives/{running.a}/parameters/2005:03")
    assert answer.json()["raw"] is not None, "the neighbour is served"
    running.trouble("mute", slave=B, on=False)
    running.settled()
    until(
        lambda: (
            running.station.http.get(f"/drives/{running.b}/parameters/2005:03").json().get("raw")
        ),
        HANG_S,
        "the parameter can be read again",
    )
    running.jogs()


@pytest.mark.long
def test_dying_in_a_transfer_ends_in_words_and_is_read_again(running: Segment) -> None:
    keys = [f"1A00:{n:02X}" for n in range(9)]
    before = running.whole(running.b, keys)
    assert not before["failed"]
    running.trouble("die_in_transfer", slave=B, after_segments=0)
    began = time.monotonic()
    dead = running.whole(running.b, keys)
    assert time.monotonic() - began < 6
    assert set(dead["failed"]) == set(keys)
    assert all("did not answer in time" in words for words in dead["failed"].values()), dead
    assert running.view()["stations"][1]["state"] == "OP", "its process data still come"
    assert running.parameter(running.a)["raw"] is not None, "the neighbour is served"
    running.trouble("die_in_transfer", slave=B, after_segments=None)
    running.trouble("mute", slave=B, on=False)
    within(10, lambda: running.whole(running.b, keys) == before, "the list can be read again")
    running.settled()
    running.jogs()


@pytest.mark.long
def test_single_lost_frames_are_counted_and_many_brake(running: Segment) -> None:
    with running.station.live() as page:
        with turning(page, running):
            running.trouble("lose", count=300, cyclic=True)
            ended = page.wait("jog_ended", drive=running.b, timeout_s=20)
        assert "no valid process data" in reason(ended)
    within(5, lambda: running.view()["exchange"]["lost_frames"] >= 30, "they are counted")
    running.trouble("peace")
    running.stands()
    running.settled()
    running.trouble("lose", chance=0.01, cyclic=True)
    lost = running.view()["exchange"]["lost_frames"]
    running.jogs()
    within(10, lambda: running.view()["exchange"]["lost_frames"] > lost, "counted")
    assert all(s["state"] == "OP" for s in running.view()["stations"])


@pytest.mark.long
def test_wrong_working_counters_are_counted_and_brake_when_they_stay(running: Segment) -> None:
    before = running.lines()
    with running.station.live() as page, turning(page, running):
        running.trouble("counter", by=-1)
        page.wait("jog_ended", drive=running.b, timeout_s=20)
    running.reported("no valid process data", "the axis is braked", after=before)
    within(10, lambda: running.view()["exchange"]["wkc_errors"] >= 30, "they are counted")
    running.stands()
    running.trouble("peace")
    running.settled()
    running.jogs()


@pytest.mark.long
def test_late_frames_are_waited_for_and_the_axis_goes_on(running: Segment) -> None:
    """Time follows the frames here: late ones are late for the server, not for the drive."""
    running.trouble("late", by_s=0.02, chance=0.05, cyclic=True)
    running.jogs()
    assert [s["state"] for s in running.view()["stations"]] == ["OP", "OP"]


@pytest.mark.long
def test_slow_answers_and_slow_states_take_their_time_and_no_more(running: Segment) -> None:
    # In the drive's time, which a busy machine stretches: the mailbox's own time-out is 1 s.
    running.trouble("timing", slave=B, sdo_s=0.05, al_s=0.1)
    within(20, lambda: running.parameter(running.b).get("raw") is not None, "it is read")
    running.trouble("timing", slave=B, sdo_s=0.0)
    running.end_cyclic()
    running.start_cyclic()
    assert [s["state"] for s in running.view()["stations"]] == ["OP", "OP"]
    running.trouble("timing", al_s=0.0, sdo_s=0.0)
    running.settled()
    running.jogs()


@pytest.mark.long
def test_a_busy_eeprom_ends_in_words_and_is_written_later(running: Segment) -> None:
    running.end_cyclic()
    body = {"url": URL, "station": 2, "alias": 0, "confirmed": True}
    running.trouble("eeprom_busy", slave=B)
    began = time.monotonic()
    refused = running.station.http.post("/ethercat/alias", json=body)
    assert time.monotonic() - began < 6
    assert refused.status_code == 504
    assert "EEPROM stays busy" in refused.json()["detail"]
    running.trouble("eeprom_busy", slave=B, for_s=0.0)
    running.station.ok(running.station.http.post("/ethercat/alias", json=body))
    running.start_cyclic()
    running.jogs()


@pytest.mark.long
def test_damaged_frames_name_their_cable_until_cleared(running: Segment) -> None:
    running.trouble("corrupt", slave=B, port=0, count=3)
    sentence = within(10, lambda: running.view()["stations"][B]["ports"][0]["findings"])[-1]
    assert "cable between station 1 and station 2: damaged frames arrived" in sentence
    with running.station.live() as other:
        other.send(type="lease", drive=running.b, take=True)
        until(
            lambda: running.station.ok(running.station.http.get(f"/drives/{running.b}"))["lease"][
                "holder"
            ]
        )
        refused = running.station.http.post("/ethercat/counters/clear", json={"url": URL})
        assert refused.status_code == 409
        assert "has control" in refused.json()["detail"]
    until(
        lambda: (
            running.station.http.post("/ethercat/counters/clear", json={"url": URL}).status_code
            == 204
        ),
        HANG_S,
    )
    ports = [port for station in running.view()["stations"] for port in station["ports"]]
    counters = ("rx_errors", "lost_links", "invalid_frames", "forwarded_errors")
    assert [port[name] for port in ports for name in counters] == [0] * 32


def host_process() -> int:
    """The EtherCAT host process, a child of this one."""
    for entry in Path("/proc").iterdir():
        if not entry.name.isdigit():
            continue
        try:
            command = (entry / "cmdline").read_bytes()
            parent = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
        except OSError:
            continue
        if parent == os.getpid() and b"drivers.ethercat.process.host" in command:
            return int(entry.name)
    raise AssertionError("there is no host process")


def test_killed_host_ends_the_motion_and_is_replaced(running: Segment) -> None:
    before = running.lines()
    with running.station.live() as page, turning(page, running):
        first = host_process()
        os.kill(first, signal.SIGKILL)
        ended = page.wait("jog_ended", drive=running.b, timeout_s=20)
    assert reason(ended).strip()
    running.reported("the EtherCAT process ended unexpectedly", after=before)
    running.reported(
        "the cyclic exchange was interrupted: the EtherCAT process ended unexpectedly", after=before
    )
    running.reported("the EtherCAT process runs again", after=before)
    running.reported(
        "the cyclic exchange runs again; every axis is disabled until you enable it",
        after=before,
        within_s=20,
    )
    assert running.exchange()["running"]
    assert not running.exchange()["problem"]
    running.stands()
    assert running.station.state(running.b)["state"] != "Operation enabled"
    running.settled()
    assert host_process() != first
    assert running.view()["host_restarts"] >= 1
    running.jogs()


@pytest.mark.long
def test_an_exchange_that_is_being_set_up_again_can_be_ended(running: Segment) -> None:
    before = running.lines()
    running.trouble("refuse", slave=B, state="SAFEOP", code=0x001D)
    os.kill(host_process(), signal.SIGKILL)
    running.reported("could not be set up again", "invalid output configuration", after=before)
    assert not running.exchange()["running"]
    assert "refuses SAFEOP" in running.exchange()["problem"]
    enabling = {"goal": "Operation enabled", "mode": 1}
    refused = running.station.http.post(f"/drives/{running.a}/transition", json=enabling)
    assert refused.status_code == 409, "it would be reset in the middle of a motion"
    assert "is being set up again" in refused.json()["detail"]
    running.end_cyclic()
    assert running.exchange() is None
    running.trouble("refuse", slave=B, state="SAFEOP", code=None)
    running.settled()
    running.start_cyclic()
    running.jogs()


@pytest.mark.long
def test_killed_segment_ends_the_motion_and_is_found_again(running: Segment) -> None:
    before = running.lines()
    with running.station.live() as page, turning(page, running):
        running.station.drives.segments[URL].kill()
        ended = page.wait("jog_ended", drive=running.b, timeout_s=20)
    assert reason(ended).strip()
    running.reported("station 1", "no longer answers", after=before)
    running.reported("station 2", "no longer answers", after=before)
    assert [s["answers"] for s in running.view()["stations"]] == [False, False]
    running.start_again()
    running.reported("station 2 is in OP again", after=before, within_s=20)
    running.settled()
    running.stands()
    running.jogs()
