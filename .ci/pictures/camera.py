"""Screenshots and screen recordings of the page as WebP files."""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from marks import Mark, drawn
from PIL import Image
from playwright.sync_api import Browser, BrowserContext, Locator, Page

from tests.browser.conftest import LAPTOP

#: Colours of a stored picture: thin lines of plots keep theirs, by which they are distinguished.
COLOURS = 256
#: Recordings are shown narrower than the page, and with at most so many pictures per second.
RECORDED_WIDTH = 800
RECORDED_PER_S = 5.0
RECORDED_COLOURS = 64
#: A recording must not be larger, in bytes.
RECORDED_LIMIT = 600_000
#: How long the last picture of a recording stays before it begins again, in ms.
LAST_MS = 2500
#: Notices that no picture may show: something was refused, a job failed, a drive is silent.
TROUBLE = ".note.fault, [role=alert], .late .note"
#: What is still being fetched.
LOADING = re.compile("^(Loading…|加载中…)$")
ARRIVING = ".arriving, .arriving-path, .arriving-note"
TIMEOUT_MS = 60_000


@contextmanager
def opened(
    browser: Browser, url: str, language: str, size: dict[str, Any] = LAPTOP
) -> Iterator[Page]:
    """A light page in a language, without the offer of the guided tour and without 3D.

    3D without a graphics processor takes the computer that the cyclic exchange needs.
    """
    context: BrowserContext = browser.new_context(
        locale=language, color_scheme="light", reduced_motion="reduce", **size
    )
    context.add_init_script(
        f"localStorage.setItem('servodeck.language', '{language}');"
        "localStorage.setItem('servodeck.tour', 'left');"
        "localStorage.setItem('servodeck.overview.scene', 'no')"
    )
    page = context.new_page()
    page.set_default_timeout(TIMEOUT_MS)
    page.goto(url)
    page.get_by_role("heading", level=1).wait_for()
    try:
        yield page
    finally:
        context.close()


def obstacle(page: Page) -> str:
    """Why the page cannot be photographed now; empty where it can."""
    if page.locator(ARRIVING).count() > 0 or page.get_by_text(LOADING).count() > 0:
        return "the page is not whole yet"
    notices = [each.inner_text() for each in page.locator(TROUBLE).all() if each.is_visible()]
    return "; ".join(each for each in notices if each)


def take(what: Page | Locator, file: Path, marks: Sequence[Mark] = ()) -> None:
    """Store a screenshot of a page or of a part of it.

    Raises:
        ValueError: a mark is not in sight.
    """
    page = what if isinstance(what, Page) else what.page
    with drawn(page, marks):
        picture = Image.open(io.BytesIO(what.screenshot())).convert("RGB")
    reduced = picture.quantize(COLOURS, dither=Image.Dither.NONE).convert("RGB")
    reduced.save(file, lossless=True, quality=90, method=4)


class Recording:
    """The screen of a page while something happens, from Chromium's own screencast."""

    def __init__(self, page: Page, speed: float = 1.0) -> None:
        """``speed``: how many times as fast it is shown."""
        self._speed = speed
        self._page = page
        self._frames: list[tuple[float, bytes]] = []
        self._unanswered: list[int] = []
        self._session = page.context.new_cdp_session(page)
        self._session.on("Page.screencastFrame", self._keep)

    def _keep(self, frame: dict[str, Any]) -> None:
        self._frames.append((frame["metadata"]["timestamp"], base64.b64decode(frame["data"])))
        self._unanswered.append(frame["sessionId"])

    def wait(self, time_s: float) -> None:
        """Record for so long.

        The browser sends no more pictures than were answered: encoding more than are kept would
        take the time in which the page must renew a jog.
        """
        interval_s = self._speed / RECORDED_PER_S
        for _ in range(max(round(time_s / interval_s), 1)):
            self._page.wait_for_timeout(interval_s * 1000)
            for frame in self._unanswered:
                self._session.send("Page.screencastFrameAck", {"sessionId": frame})
            self._unanswered.clear()

    def __enter__(self) -> Recording:
        wanted = {"format": "png", "maxWidth": RECORDED_WIDTH, "maxHeight": RECORDED_WIDTH}
        self._session.send("Page.startScreencast", wanted)
        return self

    def __exit__(self, *_exc: object) -> None:
        self._session.send("Page.stopScreencast")
        self._session.detach()

    def store(self, file: Path) -> float:
        """Write what was recorded; returns the length of it in s.

        Raises:
            ValueError: nothing changed on the screen, or the file is larger than it may be.
        """
        kept: list[tuple[float, bytes]] = []
        speed = self._speed
        for time_s, data in self._frames:
            if not kept or (time_s - kept[-1][0]) / speed >= 1 / RECORDED_PER_S:
                kept.append((time_s, data))
        if kept and self._frames[-1][0] > kept[-1][0]:
            kept.append(self._frames[-1])
        if len(kept) < 3:
            raise ValueError(f"{file.name}: nothing changes on the screen")
        pictures = _reduced([data for _, data in kept])
        later = [time_s for time_s, _ in kept[1:]]
        waits = [
            max(round((after - now) / speed * 1000), 20)
            for (now, _), after in zip(kept, later, strict=False)
        ]
        pictures[0].save(
            file, save_all=True, append_images=pictures[1:], duration=[*waits, LAST_MS], loop=0,
            lossless=True, quality=80, method=3, kmin=500, kmax=1000,
        )  # fmt: skip
        if file.stat().st_size > RECORDED_LIMIT:
            raise ValueError(f"{file.name} has {file.stat().st_size} bytes")
        return (kept[-1][0] - kept[0][0]) / speed


def _reduced(kept: Sequence[bytes]) -> list[Image.Image]:
    """The pictures in the same few colours, so that what does not change is not stored again."""
    pictures = [Image.open(io.BytesIO(data)).convert("RGB") for data in kept]
    width, height = pictures[0].size
    typical = [pictures[0], pictures[len(pictures) // 2], pictures[-1]]
    together = Image.new("RGB", (width, height * len(typical)))
    for place, picture in enumerate(typical):
        together.paste(picture, (0, place * height))
    palette = together.quantize(RECORDED_COLOURS, dither=Image.Dither.NONE)
    none = Image.Dither.NONE
    return [picture.quantize(palette=palette, dither=none).convert("RGB") for picture in pictures]
