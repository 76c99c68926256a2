"""From a maker's file to the bytes on the bus: 60 rpm typed are 60 where the drive counts rpm.

The file states 60A9h = 00B44700h (CiA 303-2: revolutions per minute). Over EtherCAT the commands
are those of the loop that fills the process data, over CANopen the frames of the RPDO.
"""

from __future__ import annotations

import struct
from datetime import datetime
from typing import Any

import pytest

from backend.axes.axis.axis import Axis, Envelope
from backend.axes.axis.cyclic import CyclicSession
from backend.axes.drive.drive import Drive
from backend.axes.drive.ports import Port
from backend.axes.scales.scale import Origin, ScaleUnknown, Uncertainty
from backend.tools.moving.jog.cyclic import GeneratorSettings, generate
from drivers.virtual.firmware.factory import make_device
from drivers.virtual.mechanics.rough_feedback import RoughFeedbackSpec
from profiles import load_profile
from profiles.importer import export_eds, import_file
from profiles.schema import Profile
from tests.virtual.tools.can_rig import STATION, can_bench
from tests.virtual.tools.direct import DirectLink
from tests.virtual.tools.rig import mechanics, silent

RPM = 0x00B44700
SPIN = GeneratorSettings(
    "CSV", "ramp", 60.0, 2.0, Envelope(5.0, 200.0, 100.0, 10.0), acceleration=200.0
)
AXIS = mechanics((1e-4, 60.0, 0.006))


def makers_profile(velocity_unit: int | None) -> Profile:
    """An EDS with this default of 60A9h, or without the object, as the importer makes of it."""
    text = export_eds(load_profile("generic402"), datetime(2020, 1, 2), "maker.eds")
    sections = text.split("\r\n[")
    if velocity_unit is None:
        kept = [part for part in sections if not part.upper().startswith("60A9")]
        text = "\r\n[".join(kept)
    else:
        stated = [
            part.replace("DefaultValue=", f"DefaultValue=0x{velocity_unit:08X}")
            if part.upper().startswith("60A9]")
            else part
            for part in sections
        ]
        text = "\r\n[".join(stated)
    made = import_file(text.encode("latin-1", "replace"), "maker.eds")
    return made.profile if hasattr(made, "profile") else made[0].profile


def spec(**options: Any) -> Any:
    return AXIS.model_copy(update={"rough_feedback": RoughFeedbackSpec(**options)})


async def over_ethercat(profile: Profile, device: Any) -> tuple[Axis, CyclicSession, DirectLink]:
    link = DirectLink(device, profile)
    await link.open()
    port = Port(link, 1, load_profile("generic402").link("ethercat"))
    axis = Axis(Drive("x", "X", profile, [port]))
    session = CyclicSession(link, [axis.drive])
    await session.start(1e-3)
    axis.session = session
    return axis, session, link


async def test_ethercat_commands_60_for_60_rpm() -> None:
    profile = makers_profile(RPM)
    assert profile.by_key["60FF:00"].unit == "rpm"
    device = make_device("generic402", spec(velocity_unit=RPM))
    axis, session, link = await over_ethercat(profile, device)
    seen: list[int] = []
    cycle = link._cycle

    def noted() -> list[float]:
        row = cycle()
        seen.append(int.from_bytes(device.read(0x60FF, 0), "little", signed=True))
        return row

    link._cycle = noted  # type: ignore[method-assign]
    try:
        await generate(axis, session, SPIN, silent())
    finally:
        await session.stop()
        await link.close()
    assert max(seen) == 60


async def test_a_file_and_a_drive_without_the_unit_move_nothing() -> None:
    """Neither says it: the standard's increments per second are nobody's word."""
    profile = makers_profile(None)
    device = make_device("generic402", spec(lacks=("60A9",)))
    axis, session, link = await over_ethercat(profile, device)
    try:
        assert (await axis.units()).scales.velocity.uncertainty is Uncertainty.NOT_STATED
        with pytest.raises(ScaleUnknown):
            await generate(axis, session, SPIN, silent())
    finally:
        await session.stop()
        await link.close()


async def test_the_drive_counts_more_than_the_file() -> None:
    """The file says rpm, the drive that is connected was set to 0.1 rpm."""
    profile = makers_profile(RPM)
    device = make_device("generic402", spec(velocity_unit=0xFFB44700))
    axis, session, link = await over_ethercat(profile, device)
    try:
        found = (await axis.units()).scales.velocity
    finally:
        await session.stop()
        await link.close()
    assert (found.raw_per_unit, found.raw_unit, found.origin) == (10.0, "0.1 rpm", Origin.DRIVE)


@pytest.mark.long
async def test_canopen_commands_60_for_60_rpm() -> None:
    """The RPDO with 60FFh, as it goes out on the bus."""
    async with can_bench(spec(velocity_unit=RPM), drive="generic402", pace=20.0) as b:
        frames: list[bytes] = []
        send = b.bus.send

        def noted(message: Any, timeout: float | None = None) -> None:
            if 0x200 <= message.arbitration_id < 0x580 and message.arbitration_id % 0x80 == STATION:
                frames.append(bytes(message.data))
            send(message, timeout)

        b.bus.send = noted
        await generate(b.axis, b.session, SPIN, silent())
    found = {
        struct.unpack_from("<i", data, at)[0] for data in frames for at in range(len(data) - 3)
    }
    assert 60 in found
    assert 10_000 not in found, "60 rpm in increments per second"
