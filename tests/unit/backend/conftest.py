from __future__ import annotations

from collections.abc import AsyncIterator
from pathlib import Path

import httpx
import pytest

from backend.api.app import make_app
from backend.axes.drive.drive import Drive
from backend.axes.drive.ports import Port
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from drivers.link import Found
from profiles.motion.classify import classified
from profiles.motion.rule import MotionRule
from profiles.schema import (
    Identity,
    LinkSpec,
    Parameter,
    Procedure,
    Profile,
    Signal,
    UnitSpec,
    Watchdog,
    WriteStep,
)
from tests.support.memory_link import MemoryLink
from tests.support.servo import Servo, bench_with

SPEC = LinkSpec(kind="mlink", watchdog=Watchdog(present=False), source="test")


@pytest.fixture
def profile() -> Profile:
    return classified(Profile(
        drive="sample",
        title="Sample drive",
        manual="000",
        identity=Identity(maker="Sample", model="S"),
        links=(SPEC,),
        units=UnitSpec(counts_per_rev=65536),
        supported_modes=(1, 3),
        parameters=(
            Parameter(key="6040:00", name="Control word", group="402", type="UINT16", source="t"),
            Parameter(
                key="6041:00", name="Status word", group="402", type="UINT16", access="ro",
                source="t",
            ),
            Parameter(
                key="2005:03", name="Speed bandwidth", group="Gains", type="UINT16", unit="Hz",
                scale=0.1, min_raw=10, max_raw=5000, default_raw=400, effective="write_settings",
                source="t",
            ),
            Parameter(
                key="2005:10", name="Gain mode", group="Gains", type="UINT16",
                enum={0: "manual", 1: "table"}, source="t",
            ),
            Parameter(
                key="2105:00", name="Address", group="Bus", type="UINT16", motor_individual=True,
                source="t",
            ),
            Parameter(
                key="2100:00", name="Set at stop", group="Bus", type="INT16", settable="stopped",
                source="t",
            ),
            Parameter(key="200D:01", name="Command", group="Bus", type="UINT32", source="t"),
            Parameter(key="PA_38", name="Modbus only", group="Bus", type="UINT16",
                      modbus_register=0x38, source="t"),
        ),
        signals=(
            Signal(role="control_word", key="6040:00"),
            Signal(role="status_word", key="6041:00"),
        ),
        procedures=(
            Procedure(
                name="save", title="Save", help="", source="t",
                steps=(WriteStep(do="write", key="200D:01", raw=0x65766173),),
            ),
        ),
        motion_rules=(
            MotionRule(keys=("2000-5FFF", "PA_00-PA_FF"), motion="none", reason="a sample"),
        ),
    ))  # fmt: skip


@pytest.fixture
def link() -> MemoryLink:
    return MemoryLink(
        {
            (0x6040, 0): b"\0\0",
            (0x6041, 0): b"\x50\x02",
            (0x2005, 3): (400).to_bytes(2, "little"),
            (0x2005, 0x10): b"\0\0",
            (0x2105, 0): b"\1\0",
            (0x2100, 0): b"\0\0",
            (0x200D, 1): b"\0\0\0\0",
        }
    )


@pytest.fixture
def drive(profile: Profile, link: MemoryLink) -> Drive:
    drive = Drive("x", "X axis", profile, [Port(link, 1, SPEC)])
    drive.found = Found(1, serial=7, firmware="1.0")
    return drive


@pytest.fixture
async def servo() -> Servo:
    return Servo()


@pytest.fixture
async def bench(servo: Servo, tmp_path: Path) -> AsyncIterator[Bench]:
    """A bench with the servo as axis ``x``, whose monitor is at standstill."""
    bench, _ = await bench_with(servo, tmp_path)
    yield bench
    servo.mute = False
    servo.gate.set()
    await bench.close()


@pytest.fixture
def x(bench: Bench) -> ConnectedDrive:
    return bench.connected("x")


@pytest.fixture
async def http(bench: Bench) -> AsyncIterator[httpx.AsyncClient]:
    transport = httpx.ASGITransport(make_app(bench, hosts=frozenset({"test"})))
    async with httpx.AsyncClient(transport=transport, base_url="http://test/api/v1") as client:
        yield client


def changed(profile: Profile, **fields: object) -> Profile:
    """The profile with other fields, checked again."""
    old = {name: getattr(profile, name) for name in Profile.model_fields}
    return classified(Profile.model_validate({**old, **fields}))
