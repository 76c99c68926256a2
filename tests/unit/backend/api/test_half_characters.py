"""Half a surrogate pair in a JSON body is refused, also by routes that take large bodies."""

from __future__ import annotations

import json
from pathlib import Path

import httpx
import pytest

from backend.api.app import make_app
from backend.station.bench import Bench

HALF = "\ud800"
LARGE = [
    ("/handover", {"format": "python", "file": "a", "axes": [{"drive_id": "x", "set_file": HALF}]}),
    ("/drives/x/handover", {"format": "python", "file": "a", "set_file": HALF}),
]


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(("path", "body"), LARGE, ids=lambda part: part if "/" in part else "")
async def test_a_route_of_files_refuses_it(
    tmp_path: Path, path: str, body: dict[str, object]
) -> None:
    app = make_app(Bench(tmp_path), hosts=frozenset({"localhost"}))
    wire = httpx.ASGITransport(app, raise_app_exceptions=False)
    async with (
        app.router.lifespan_context(app),
        httpx.AsyncClient(transport=wire, base_url="http://localhost/api/v1") as client,
    ):
        for kind in ("application/json", "Application/JSON; charset=utf-8"):
            answer = await client.post(
                path, content=json.dumps(body).encode(), headers={"Content-Type": kind}
            )
            assert answer.status_code == 422, answer.text
            assert answer.json()["type"] == "urn:servodeck:body"
