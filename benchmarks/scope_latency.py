"""From the wire to the browser: how old a sample is when it arrives, and what each page costs.

A station with four EtherCAT axes in a process of its own delivers 16 channels at 1 kHz (at 4 kHz
with ``--fast``, on a computer that can). A Chromium on the Scope page draws them; a script in the
same browser subscribes too and notes when the newest sample of each block arrives. Both clocks are
this computer's. Then the server's processor time with more and more pages that only receive.

Aims: p50 below 60 ms and p99 below 120 ms (blocks are handed over every 25 ms), 20 pictures a
second, less than 5 % of a core for a page that joins.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
import threading
import time
from pathlib import Path

import httpx
import numpy as np
from playwright.sync_api import Page, sync_playwright

from benchmarks import scope_soak
from benchmarks.scope_soak import FLAGS, KEYS, cpu_s, open_scope, prepare, station_process
from tests.support.station import Live

SECONDS = 20.0
PAGES = (0, 1, 2, 4)

#: Counts pictures of uPlot, which clears its canvas once for each.
COUNT = """() => {
  window.pictures = 0
  const clear = CanvasRenderingContext2D.prototype.clearRect
  CanvasRenderingContext2D.prototype.clearRect = function (...box) {
    window.pictures++
    return clear.apply(this, box)
  }
}"""
#: Milliseconds since the epoch at which each block came, and the time of its newest sample.
LISTEN = """([channels, ms]) => new Promise((done) => {
  const socket = new WebSocket(location.origin.replace('http', 'ws') + '/api/v1/live')
  const seen = []
  socket.binaryType = 'arraybuffer'
  socket.onopen = () => socket.send(
    JSON.stringify({ type: 'scope_start', subscription: 1, channels, period_s: 0 }))
  socket.onmessage = ({ data }) => {
    if (typeof data === 'string') return
    const now = performance.timeOrigin + performance.now()
    const head = new DataView(data)
    const rows = head.getUint16(16, true)
    seen.push([now, head.getFloat64(24, true) + head.getFloat64(32, true) * (rows - 1)])
  }
  setTimeout(() => { socket.close(); done(seen) }, ms)
})"""


def latencies_ms(page: Page, drive: str) -> np.ndarray:
    """Age of the newest sample of each block when it arrived in the browser."""
    channels = [{"drive": drive, "key": key} for key in KEYS]
    seen = np.array(page.evaluate(LISTEN, [channels, SECONDS * 1e3]))
    offset_s = time.time() - time.monotonic()
    ages: np.ndarray = seen[:, 0] - (seen[:, 1] + offset_s) * 1e3
    return ages[len(ages) // 10 :]  # the first ones still wait for the subscription


class Receiver(threading.Thread):
    """A page that only receives."""

    def __init__(self, url: str, drives: list[str]) -> None:
        super().__init__(daemon=True)
        self.over = threading.Event()
        self._live = Live(url.replace("http", "ws") + "/api/v1/live")
        for number, drive in enumerate(drives, 1):
            channels = [{"drive": drive, "key": key} for key in KEYS]
            self._live.send(type="scope_start", subscription=number, channels=channels)

    def run(self) -> None:
        while not self.over.is_set():
            self._live.receive()
            self._live.binary.clear()
        self._live.close()


def cost_of_pages(server: int, url: str, drives: list[str]) -> list[tuple[int, float]]:
    """Processor time of the server, % of a core, with so many pages."""
    found = []
    for count in PAGES:
        pages = [Receiver(url, drives) for _ in range(count)]
        for page in pages:
            page.start()
        time.sleep(1)
        used, began = cpu_s(server), time.monotonic()
        time.sleep(SECONDS / 2)
        found.append((count, 100 * (cpu_s(server) - used) / (time.monotonic() - began)))
        for page in pages:
            page.over.set()
        for page in pages:
            page.join()
    return found


def measure(http: httpx.Client, server: int, url: str) -> None:
    """Print the figures."""
    drives = prepare(http)
    program = shutil.which("chromium") or "/usr/bin/chromium"
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=FLAGS)
        page = open_scope(browser, url, drives)
        page.evaluate(COUNT)
        began = time.monotonic()
        ages = latencies_ms(page, drives[0])
        rate = page.evaluate("window.pictures") / (time.monotonic() - began)
        browser.close()
    p50, p99 = np.percentile(ages, [50, 99])
    print(f"wire to browser: p50 {p50:.0f} ms, p99 {p99:.0f} ms ({len(ages)} blocks)")
    print(f"the page draws {rate:.0f} pictures a second of 16 channels")
    for count, share in cost_of_pages(server, url, drives):
        print(f"server with {count} receiving pages: {share:.0f} % of a core")


def main() -> None:
    """Print the figures."""
    scope_soak.CYCLE_US = 250 if "--fast" in sys.argv else 1000
    with tempfile.TemporaryDirectory() as name, station_process(Path(name)) as running:
        measure(*running)


if __name__ == "__main__":
    main()
