"""Quick-stop option, travel limits and following window are refused while the axis moves.

605Ah = 0 was taken during a jog, and STOP coasted 3.2 revolutions instead of 1.2; 607Dh and
6065h = FFFFFFFFh were accepted in motion too. Tried by every way that parameters are written, in a
jog of the server and in a motion of another tool; the shaft judges STOP afterwards.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from datetime import UTC, datetime

import pytest

from backend.axes.drive.readings import Reading
from backend.axes.parameters import set_file as parameter_set
from benchmarks.stopping.cells import STANDS_RPM
from benchmarks.stopping.clock import run_simulated
from benchmarks.stopping.motions import jogging, profile_velocity
from benchmarks.stopping.rig import Rig, rig

DRIVE = "mms7"
#: Raw values. 607Dh limits travel, 6065h = FFFFFFFFh switches the supervision off (CiA 402-2).
DANGEROUS = {"605A:00": 0, "607D:01": -(2**31), "607D:02": 2**31 - 1, "6065:00": 0xFFFFFFFF}
SOUND = {"605A:00": 2, "607D:01": -5_000_000, "607D:02": 5_000_000, "6065:00": 100_000}
#: 300 rpm at 3000 rpm/s take 0.1 s and 90 degrees; the rest is lag and sampling.
BRAKES_DEG = 150.0

Way = Callable[[Rig], Awaitable[None]]


def held(bench: Rig) -> dict[str, int]:
    return {key: int(bench.device.od.number(key)) for key in DANGEROUS}


def path_of(bench: Rig) -> str:
    return f"/drives/{bench.connected.drive.id}"


async def one_by_one(bench: Rig) -> None:
    for key, raw in DANGEROUS.items():
        answer = await bench.http.put(f"{path_of(bench)}/parameters/{key}", json={"raw": raw})
        assert answer.status_code == 409, (key, answer.text)
        assert bench.connected.drive.name in answer.json()["detail"]


async def at_once(bench: Rig) -> None:
    values = {key: {"raw": raw} for key, raw in DANGEROUS.items()}
    answer = await bench.http.put(f"{path_of(bench)}/parameters", json={"values": values})
    if answer.is_success:
        assert not any(row["ok"] for row in answer.json()), answer.text
    else:
        assert answer.status_code == 409, answer.text


async def stored(bench: Rig, values: dict[str, int]) -> str:
    """A parameter set on the station, as the product writes one."""
    readings = [Reading(key, raw, None, 1.0) for key, raw in values.items()]
    data = parameter_set.dump(
        bench.connected.drive, readings, author="somebody", notes="", saved=datetime.now(UTC)
    )
    answer = await bench.http.put("/sets/sample.sdset", content=data)
    assert answer.is_success, answer.text
    return "sample.sdset"


async def loaded(bench: Rig, file: str) -> dict[str, object] | None:
    """The result of loading these values; None where the server does not begin."""
    body = {
        "file": file,
        "keys": list(DANGEROUS),
        "accept_other_identity": True,
        "accept_motor_individual": True,
    }
    answer = await bench.http.post(f"{path_of(bench)}/jobs/load_set", json=body)
    if answer.status_code == 409:
        return None
    assert answer.is_success, answer.text
    job = bench.bench.jobs.get(answer.json()["id"])
    assert job is not None
    await job.wait()
    if job.error is not None:
        return None
    return dict(job.result or {})


async def by_set(bench: Rig) -> None:
    await require_refused(bench, await stored(bench, DANGEROUS))


async def by_csv(bench: Rig) -> None:
    rows = [f"{key},{raw}" for key, raw in DANGEROUS.items()]
    answer = await bench.http.post(
        "/sets/list",
        params={"profile": DRIVE, "file": "list"},
        content="\n".join(["key,raw", *rows]),
    )
    assert answer.is_success, answer.text
    await require_refused(bench, answer.json()["file"])


async def require_refused(bench: Rig, file: str) -> None:
    result = await loaded(bench, file)
    if result is None:
        return
    rows = result["rows"]
    assert isinstance(rows, list)
    assert not any(row["ok"] for row in rows), rows


async def stops_by_braking(bench: Rig) -> None:
    start = bench.shaft_deg
    answer = (await bench.http.post("/stop", json={})).json()
    assert answer["axes"][0]["verdict"] == "stopped"
    assert bench.shaft_rpm < STANDS_RPM
    assert abs(bench.shaft_deg - start) < BRAKES_DEG


MOTIONS = {"jog": jogging, "another tool": profile_velocity}


@pytest.mark.long(keep=2)
@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("way", [one_by_one, at_once, by_set, by_csv])
def test_limits_are_refused_in_motion(motion: str, way: Way) -> None:
    async def main() -> None:
        async with rig(DRIVE) as bench:
            for key, raw in SOUND.items():
                bench.poke(key, raw)
            await MOTIONS[motion](bench)
            before = held(bench)
            await way(bench)
            assert held(bench) == before
            assert bench.shaft_rpm > STANDS_RPM, "it was refused in motion"
            await stops_by_braking(bench)

    run_simulated(main)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("motion", MOTIONS)
def test_the_undo_of_a_set_is_refused_in_motion(motion: str) -> None:
    """The backup that loading a set keeps holds what was before it: here the dangerous values."""

    async def main() -> None:
        async with rig(DRIVE) as bench:
            await asyncio.sleep(0.1)
            for key, raw in DANGEROUS.items():
                bench.poke(key, raw)
            result = await loaded(bench, await stored(bench, SOUND))
            assert result is not None
            assert held(bench) == SOUND, "at standstill a set is loaded"
            await MOTIONS[motion](bench)
            before = held(bench)
            await require_refused(bench, str(result["backup"]))
            assert held(bench) == before
            await stops_by_braking(bench)

    run_simulated(main)
