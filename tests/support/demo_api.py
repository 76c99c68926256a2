"""What a running demo answers about one axis."""

from __future__ import annotations

from typing import Any

import httpx

from tests.support.station import HANG_S, NO_CERTIFICATES, until


class DemoApi:
    """The interface of a demo at an address that ends with a slash."""

    def __init__(self, url: str, axis: str) -> None:
        self.url, self._axis = url, axis
        self.http = httpx.Client(base_url=f"{url}api/v1", timeout=HANG_S, verify=NO_CERTIFICATES)

    def ask(self, path: str) -> Any:
        """What the interface answers.

        Raises:
            AssertionError: it refuses.
        """
        answer = self.http.get(path)
        assert answer.is_success, answer.text
        return answer.json()

    def fresh(self) -> Any:
        """The state of the axis, once its drive answers: a busy computer loses it."""

        def answered() -> Any:
            state = self.ask(f"/drives/{self._axis}/state")
            return state if state["fresh"] and state["position"] is not None else None

        return until(answered, what="the axis answers")
