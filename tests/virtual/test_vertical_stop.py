"""STOP of a load under gravity, judged by the shaft (``python -m benchmarks.stopping --vertical``).

A part of the matrix, and what a parameter write can do to the brake of a load that hangs.
"""

from __future__ import annotations

import asyncio

import pytest

from benchmarks.stopping import vertical
from benchmarks.stopping.clock import run_simulated
from benchmarks.stopping.rig import Rig, free_axis, rig
from benchmarks.stopping.vertical import GRAVITY_NM, VERTICAL, Row, lead_s, sinking

PART = [
    ("mms7", "raising", "605Ah tampered"),
    ("mms7", "homing", "none"),
    ("m6l", "torque", "none"),
    ("m6l", "lowering", "605Ah tampered"),
    ("r6l", "profile position", "none"),
    ("r6l", "holding", "605Ah tampered"),
    ("ep3e", "torque", "none"),
    ("ep3e", "jog by process data", "process data lost"),
    ("ds_c", "jog", "none"),
]
#: The time that these families' brake has to close in at least, by their own defaults, and one
#: step of the recording less: P02.11 = 150 ms (000:1389), P01.13 = 200 ms (002:8259).
LEAD_S = {"m6l": 0.149, "r6l": 0.199}
#: What rules brake or outputs, and a value that would release or drive them (000:3110, 000:3285,
#: 001:990, 002:9222, 002:11519, 002:11950, 003:530, 004:2604, 004:6547).
BRAKE_DOORS = {
    "mms7": (("2108:01", 0), ("2031:02", 0xFFFF), ("2031:03", 0xFFFF), ("6040:00", 15)),
    "m6l": (("60FE:02", 0x1F0000), ("60FE:01", 0x1F0000), ("2003:10", 0), ("2003:11", 18),
            ("2003:16", 1), ("2003:0F", 1)),
    "r6l": (("60FE:02", 0x1F0000), ("60FE:01", 0x1F0000), ("2008:14", 1), ("200C:10", 1),
            ("2002:21", 1), ("2002:22", 1)),
    "ep3e": (("60FE:02", 1), ("60FE:01", 0)),
    "ds_c": (("2400:0C", 7), ("2400:0D", 1), ("2400:0E", 6)),
}  # fmt: skip


@pytest.mark.long(keep=2)
@pytest.mark.parametrize(("family", "motion", "trouble"), PART)
def test_stop_lets_no_load_fall(family: str, motion: str, trouble: str) -> None:
    found = vertical.run_vertical(family, motion, trouble)
    assert found.held, found
    assert found.lead_s is not None, "the power goes, and the brake holds"
    assert found.lead_s >= 0.0, found
    if trouble == "none" or motion != "jog by process data":
        assert found.lead_s >= LEAD_S.get(family, 0.0), found


def test_the_part_is_of_the_matrix() -> None:
    assert set(PART) <= set(vertical.vertical_cells())


def test_the_judge_sees_a_load_that_falls() -> None:
    """Without a brake the power that STOP takes off lets it go."""

    async def main() -> None:
        async with rig("mms7", free_axis(gravity_nm=GRAVITY_NM)) as bench:
            await VERTICAL["raising"][0](bench)
            found = await vertical.stop(bench, "raising", "none")
            assert not found.held
            assert found.sank_deg > 360.0

    run_simulated(main)


def test_what_the_judge_reads_from_a_recording() -> None:
    rows = [
        Row(0.0, 300.0, 10.0),
        Row(0.1, 1.0, 50.0),
        Row(0.2, 0.0, 50.0, released=False),
        Row(0.3, 0.0, 49.0, powered=False, released=False),
        Row(0.4, 0.0, 48.5),
    ]
    assert sinking(rows) == (0.1, 1.5)
    assert lead_s(rows) == pytest.approx(0.1)
    assert lead_s(rows[:2]) is None


def test_a_drive_that_ignores_its_quick_stop_is_held_by_its_brake() -> None:
    """It goes on raising; STOP takes its power, and with that the brake closes."""

    async def main() -> None:
        async with rig("r6l", free_axis(brake=True, gravity_nm=GRAVITY_NM)) as bench:
            await VERTICAL["raising"][0](bench)
            obey = bench.device.control.set_control_word
            bench.device.od.numbered["6040:00"].setter = lambda value: (
                obey(int(value)) if int(value) != 2 else None
            )
            found = await vertical.stop(bench, "raising", "none")
            assert "voltage_disabled" in found.steps
            assert found.rpm_at_end <= 3.0
            assert found.sank_deg <= vertical.SINKS_DEG

    run_simulated(main)


@pytest.mark.long(keep=3)
@pytest.mark.parametrize("family", sorted(BRAKE_DOORS))
def test_no_parameter_write_releases_the_brake_of_a_load_that_hangs(family: str) -> None:
    """Also while process data are exchanged, in which an EP3E follows bit 0 of 60FEh."""

    async def main() -> None:
        async with rig(family, free_axis(brake=True, gravity_nm=GRAVITY_NM)) as bench:
            vertical.with_brake(bench)
            await asyncio.sleep(0.1)
            start_deg = bench.shaft_deg
            await _refused_all(bench)
            if family != "ds_c":
                await bench.bench.start_cyclic(bench.link.url, 0.002)
                await _refused_all(bench)
            await asyncio.sleep(1.0)
            assert abs(bench.shaft_deg - start_deg) < 0.1

    run_simulated(main)


async def _refused_all(bench: Rig) -> None:
    path = f"/drives/{bench.connected.drive.id}/parameters"
    known = bench.device.profile.by_key
    wanted = [(key, raw) for key, raw in BRAKE_DOORS[bench.family] if key in known]
    assert wanted
    for key, raw in wanted:
        answer = await bench.http.put(f"{path}/{key}", json={"raw": raw})
        assert answer.status_code == 409, (key, answer.text)
        assert answer.json()["type"] == "urn:servodeck:not-granted"
    values = {key: {"raw": raw} for key, raw in wanted}
    answer = await bench.http.put(path, json={"values": values})
    assert not any(row["ok"] for row in answer.json())
