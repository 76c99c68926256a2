"""What the tests ask the bench past the page, and ways about the page."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from playwright.sync_api import Page

from tests.support.machine import within
from tests.support.station import HANG_S, Station, until

#: Faster than the noise of the simulated encoder at standstill, slower than any jog here.
MOVING_RPM = 20.0
#: Renewal time-out 0.2 s, braking 0.1 s at 60 rpm and 600 rpm/s, and the time to ask.
STOP_S = 2.0
#: Within this time a page shows what people must know: that it lost the server, that somebody
#: pressed STOP and what it reached, that an axis has a fault.
REPORTED_MS = 5_000
#: Why a jog ends, rightly, when a computer has no time for the page for a tenth of a second.
SILENT = (
    "jog.end-page-silent",
    "jog.end-no-sign-of-life",
    "work.page-not-reachable",
)


class Bench:
    """One axis as the server and the virtual drive see it."""

    def __init__(self, station: Station, drive: str) -> None:
        self.station = station
        self.drive = drive

    def raw(self, key: str) -> Any:
        """A parameter, read from the drive now."""
        answer = self.station.http.get(f"/drives/{self.drive}/parameters/{key}")
        return self.station.ok(answer)["raw"]

    def write(self, key: str, raw: int) -> None:
        path = f"/drives/{self.drive}/parameters/{key}"
        self.station.ok(self.station.http.put(path, json={"raw": raw}))

    def power_cycle(self) -> None:
        self.station.drives.command(do="power_cycle", axis="X")

    def state(self) -> Any:
        return self.station.state(self.drive)

    def moves(self) -> bool:
        return abs(self.state()["velocity"]) > MOVING_RPM

    def wait_moving(self) -> None:
        until(self.moves, HANG_S, "the axis moves")

    def press(
        self,
        press: Callable[[], None],
        let_go: Callable[[], None],
        turned_down: Callable[[], bool] = lambda: False,
    ) -> None:
        """Hold a jog button until the axis moves; after a stall once more, as people do.

        ``turned_down``: whether the page says that the press began nothing.
        """
        for _ in range(8):
            before = {job["id"] for job in self._jogs()}
            press()
            until(
                lambda known=before: self.moves() or self._ended(known) or turned_down(),
                HANG_S,
                "the axis moves",
            )
            if not self._ended(before) and not turned_down():
                return
            let_go()
        raise AssertionError("this machine stalls too often")

    def jog(
        self,
        press: Callable[[], None],
        let_go: Callable[[], None],
        turned_down: Callable[[], bool] = lambda: False,
    ) -> str:
        """Hold a jog button until the axis moves, and let go; returns the code of why it ended."""
        for _ in range(8):
            self.press(press, let_go, turned_down)
            let_go()
            self.wait_standing()
            reason = self.jog_end()
            if reason is not None and reason not in SILENT:
                return reason
        raise AssertionError("this machine stalls too often")

    def _ended(self, before: set[str]) -> bool:
        """Whether a jog beyond these has ended, which only a stall may do."""
        new = [job for job in self._jogs() if job["id"] not in before]
        over = [job for job in new if job["state"] != "running"]
        assert all(_end_of(job) in SILENT for job in over), over
        return bool(over)

    def _jogs(self) -> list[Any]:
        jobs = self.station.ok(self.station.http.get("/jobs"))
        return [job for job in jobs if job["kind"] == "jog"]

    def wait_standing(self) -> None:
        """The axis is at standstill, its job has ended, and it stays where it is."""
        within(STOP_S, lambda: not self.moves(), "the axis stands")
        until(lambda: self.state()["moving_job"] is None, HANG_S, "the job has ended")
        before = self.state()["position"]
        for _ in range(5):
            now = self.state()
            assert abs(now["position"] - before) < 0.02, "the axis creeps"

    def jog_job(self) -> Any:
        """The jog that began last."""
        return self._jogs()[-1]

    def jog_end(self) -> str | None:
        """Why that one ended, as a code."""
        return _end_of(self.jog_job())


def _end_of(job: Any) -> str | None:
    """The code of why a jog ended; None where it has no result."""
    message = (job["result"] or {}).get("reason_message")
    return None if message is None else str(message["code"])


def says_no(page: Page) -> Callable[[], bool]:
    """Whether the page says that a press began nothing."""
    return page.locator(".not-begun").is_visible


def open_axis(page: Page, drive: str, name: str) -> None:
    """Go to a page of an axis, by the address."""
    page.evaluate(f"location.hash = '#/axis/{drive}/{name}'")


def row(page: Page, key: str) -> Any:
    """The row of a parameter in the table."""
    return page.locator(f'[id="row-{key}"]')


def find(page: Page, key: str) -> Any:
    """Search for a parameter, and wait for its row."""
    page.get_by_role("searchbox").fill(key)
    found = row(page, key)
    found.wait_for()
    return found
