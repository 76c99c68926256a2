"""From the wire to the browser: how old a sample is when it arrives and when it is drawn.

A station with four EtherCAT axes in a process of its own delivers 16 channels at 1 kHz (at 4 kHz
with ``--fast``, on a computer that can). A Chromium on the Scope page draws them. A worker in the
same browser subscribes too, as the page's own worker does, and notes when the newest sample of
each block arrives; the page's pictures are timed by the newest sample in each and the end of its
drawing. All clocks are this computer's. Then the server's processor time with more and more pages
that only receive.

Aims: at the worker p50 below 60 ms and p99 below 120 ms (blocks are handed over every 25 ms),
20 pictures a second, less than 5 % of a core for a page that joins.
"""

from __future__ import annotations

import os
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
from benchmarks._aims import Aim, print_verdict
from benchmarks.scope_soak import FLAGS, KEYS, cpu_s, open_scope, prepare, station_process
from tests.support.station import Live

SECONDS = 20.0
PAGES = (0, 1, 2, 4)

#: Notes the newest sample of every answer of the page's worker, and when its picture was drawn
#: (uPlot clears its canvas once for each and draws in the same task; what follows is after it).
#: The picture's zero is the clock of the server, which is this computer's monotonic clock.
WATCH = """() => {
  window.pictures = []
  let newest = null
  const Original = window.Worker
  window.Worker = class extends Original {
    constructor(...given) {
      super(...given)
      this.addEventListener('message', ({ data }) => {
        if (data.kind === 'answer' && data.answer?.columns) newest = data.answer.newest
      })
    }
  }
  const clear = CanvasRenderingContext2D.prototype.clearRect
  CanvasRenderingContext2D.prototype.clearRect = function (...box) {
    const shown = newest
    queueMicrotask(() => window.pictures.push([performance.timeOrigin + performance.now(), shown]))
    return clear.apply(this, box)
  }
}"""
#: Milliseconds since the epoch at which each block came to a worker, and the time of its newest
#: sample.
LISTEN = """([url, channels, ms]) => new Promise((done) => {
  const code = `onmessage = ({ data: [url, channels] }) => {
    const socket = new WebSocket(url)
    socket.binaryType = 'arraybuffer'
    socket.onopen = () => socket.send(
      JSON.stringify({ type: 'scope_start', subscription: 1, channels, period_s: 0 }))
    const seen = []
    socket.onmessage = ({ data }) => {
      if (typeof data === 'string') return
      const now = performance.timeOrigin + performance.now()
      const head = new DataView(data)
      for (let at = 0; at < data.byteLength;) {
        const [rows, columns] = [head.getUint16(at + 16, true), head.getUint16(at + 18, true)]
        const flags = head.getUint32(at + 20, true)
        const dt = head.getFloat64(at + 32, true)
        seen.push([now, head.getFloat64(at + 24, true) + dt * (rows - 1)])
        at += 40 + 4 * rows * columns + (flags & 1) * 8 * rows + ((flags >> 1) & 1) * 8 * columns
      }
    }
    setTimeout(() => { socket.close(); postMessage(seen) }, ${ms})
  }`
  const worker = new Worker(URL.createObjectURL(new Blob([code])))
  worker.onmessage = ({ data }) => { if (Array.isArray(data)) done(data) }
  worker.postMessage([url, channels])
})"""


def ages_ms(seen: list[list[float]]) -> np.ndarray:
    """Age of the newest sample at each moment [n]: rows of epoch ms and sample time in s."""
    rows = np.array([row for row in seen if row[1] is not None])
    offset_s = time.time() - time.monotonic()
    ages: np.ndarray = rows[:, 0] - (rows[:, 1] + offset_s) * 1e3
    return ages[len(ages) // 10 :]  # the first ones still wait for the subscription


def arrivals_ms(page: Page, url: str, drive: str) -> np.ndarray:
    """Age of the newest sample of each block when it arrived in a worker of the browser."""
    channels = [{"drive": drive, "key": key} for key in KEYS]
    live = url.replace("http", "ws") + "/api/v1/live"
    return ages_ms(page.evaluate(LISTEN, [live, channels, SECONDS * 1e3]))


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
        page = browser.new_page(bypass_csp=True)
        page.add_init_script(f"({WATCH})()")
        open_scope(page, url, drives)
        page.evaluate("window.pictures.length = 0")
        began = time.monotonic()
        arrived = arrivals_ms(page, url, drives[0])
        pictures = page.evaluate("window.pictures")
        rate = len(pictures) / (time.monotonic() - began)
        browser.close()
    drawn = ages_ms(pictures)
    p50, p99 = np.percentile(arrived, [50, 99])
    print(f"wire to browser: p50 {p50:.0f} ms, p99 {p99:.0f} ms ({len(arrived)} blocks)")
    late = np.percentile(drawn, [50, 99])
    print(f"wire to picture: p50 {late[0]:.0f} ms, p99 {late[1]:.0f} ms ({len(drawn)} pictures)")
    print(f"the page draws {rate:.0f} pictures a second of 16 channels")
    costs = cost_of_pages(server, url, drives)
    for count, share in costs:
        print(f"server with {count} receiving pages: {share:.0f} % of a core")
    each = float(np.polyfit([n for n, _ in costs], [share for _, share in costs], 1)[0])
    print(f"load of the machine: {os.getloadavg()[0]:.1f}")
    print_verdict(
        [
            Aim(f"wire to browser p50 {p50:.0f} ms, below 60 ms", bool(p50 < 60)),
            Aim(f"wire to browser p99 {p99:.0f} ms, below 120 ms", bool(p99 < 120)),
            Aim(f"{rate:.0f} pictures a second, 20 or more", rate >= 19.5),
            Aim(f"{each:.1f} % of a core for a page that joins, below 5 %", each < 5),
        ]
    )


def main() -> None:
    """Print the figures."""
    scope_soak.CYCLE_US = 250 if "--fast" in sys.argv else 1000
    with tempfile.TemporaryDirectory() as name, station_process(Path(name)) as running:
        measure(*running)


if __name__ == "__main__":
    main()
