"""How each motion of the matrix is begun, and which families have it."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

from backend.axes.axis.axis import Envelope
from backend.foundation.work.jobs import Progress
from backend.tools.moving.jog.cyclic import jog_cyclic
from backend.tools.moving.jog.hold import Hold
from backend.tools.moving.jog.run import JogSettings, jog
from benchmarks.stopping.rig import Rig

FAMILIES = ("mms7", "m6l", "r6l", "ep3e", "ds_c")
SPEED_RPM = 300.0
_RAMP_RPM_S = 3000.0
_TORQUE_PERCENT = 8.0
_FRICTION_PERCENT = 0.2
_WORD_S = 0.02
#: The monitor looks at an axis that nobody watches every second.
SEEN_S = 1.3
_PV, _PT, _HM, _CSV, _CST = 3, 4, 6, 9, 10
ENVELOPE = Envelope(1000.0, 2 * SPEED_RPM, 100.0, 60.0)


async def enable(rig: Rig, mode: int) -> None:
    """As any other tool does it: past the server."""
    rig.poke("6060:00", mode)
    for word in (6, 7, 15):
        rig.poke("6040:00", word)
        await asyncio.sleep(_WORD_S)


async def set_ramps(rig: Rig) -> None:
    units = await rig.connected.axis.units()
    for key in ("6083:00", "6084:00", "6085:00"):
        if key in rig.device.profile.by_key:
            rig.poke(key, units.acceleration_raw(_RAMP_RPM_S))


def mode_of(rig: Rig, *modes: int) -> int:
    """The first that the family has: an EP3E has cyclic modes alone."""
    return next(mode for mode in modes if mode in rig.device.profile.supported_modes)


async def profile_velocity(rig: Rig) -> None:
    """60FFh, by another tool."""
    units = await rig.connected.axis.units()
    await set_ramps(rig)
    rig.poke("60FF:00", 0)
    await enable(rig, mode_of(rig, _PV, _CSV))
    rig.poke("60FF:00", units.velocity_raw(SPEED_RPM))
    await rig.until_rpm(0.9 * SPEED_RPM)


async def torque(rig: Rig) -> None:
    """6071h, until the axis is fast."""
    units = await rig.connected.axis.units()
    await set_ramps(rig)
    rig.poke("6071:00", 0)
    await enable(rig, mode_of(rig, _PT, _CST))
    rig.poke("6071:00", units.torque_raw(_TORQUE_PERCENT))
    await rig.until_rpm(0.9 * SPEED_RPM, 6.0)
    # About what friction takes, for as long as the monitor needs to see the mode.
    rig.poke("6071:00", units.torque_raw(_FRICTION_PERCENT))
    await asyncio.sleep(SEEN_S)


async def homing(rig: Rig) -> None:
    """Method 17 or 18 searches a limit switch that does not come."""
    units = await rig.connected.axis.units()
    await set_ramps(rig)
    by_key = rig.device.profile.by_key
    rig.poke("6098:00", 18)
    rig.poke("6099:01", units.velocity_raw_of(by_key["6099:01"], SPEED_RPM))
    if "609A:00" in by_key:
        rig.poke("609A:00", units.acceleration_raw(_RAMP_RPM_S))
    await enable(rig, _HM)
    rig.poke("6040:00", 0x1F)
    await rig.until_rpm(0.9 * SPEED_RPM)


async def jogging(rig: Rig) -> None:
    """The server's own hold-to-run jog."""
    hold = _hold()
    settings = JogSettings(1, SPEED_RPM, _RAMP_RPM_S, 1000.0, 100.0)
    axis = rig.connected.axis

    async def work(progress: Progress) -> None:
        await jog(axis, settings, hold, progress)

    rig.bench.jobs.start("jog", "Jog", work, drive=rig.connected.drive.id, motion=True)
    rig.keep(_renewing(hold))
    await rig.until_rpm(0.9 * SPEED_RPM)


async def cyclic_jog(rig: Rig) -> None:
    """The server's jog through process data."""
    url = rig.link.url
    session = await rig.bench.start_cyclic(url, 0.002)
    hold = _hold()
    settings = JogSettings(1, SPEED_RPM, _RAMP_RPM_S, 1000.0, 100.0)
    axis = rig.connected.axis

    async def work(progress: Progress) -> None:
        await jog_cyclic(axis, session, settings, hold, progress)

    rig.bench.jobs.start("jog", "Jog", work, drive=rig.connected.drive.id, motion=True)
    rig.keep(_renewing(hold))
    await rig.until_rpm(0.9 * SPEED_RPM)


def _hold() -> Hold:
    """In simulated time: by the computer's own clock a busy computer would let go of it."""
    return Hold(clock=asyncio.get_running_loop().time)


async def _renewing(hold: Hold) -> None:
    while True:
        hold.renew()
        await asyncio.sleep(0.05)


def _in_rpm(rig: Rig, key: str) -> int:
    return round(rig.device.profile.by_key[key].to_raw(SPEED_RPM))


async def own_jog_by_input(rig: Rig) -> None:
    """An input whose function is jog; M6-L by its virtual inputs, R6L by a wire."""
    if rig.family == "m6l":
        rig.poke("2006:06", _in_rpm(rig, "2006:06"))
        rig.poke("2003:02", 17)
        rig.poke("2003:0F", 3)
    else:
        rig.poke("2004:05", _in_rpm(rig, "2004:05"))
        rig.poke("2002:01", 39)
        rig.device.inject("di1", 1)
    await rig.until_rpm(0.9 * SPEED_RPM)


async def own_jog_by_parameter(rig: Rig) -> None:
    """R6L P12.10."""
    rig.poke("2004:05", _in_rpm(rig, "2004:05"))
    rig.poke("200C:0B", 1)
    await rig.until_rpm(0.9 * SPEED_RPM)


async def own_homing(rig: Rig) -> None:
    """M6-L P12.00 = 4."""
    rig.poke("200C:06", _in_rpm(rig, "200C:06"))
    rig.poke("200C:01", 4)
    await rig.until_rpm(0.9 * SPEED_RPM)


async def identification(rig: Rig) -> None:
    """MMS7 bit 11 of the control word, R6L P12.11, M6-L P09.00."""
    if rig.family == "mms7":
        await enable(rig, _PV)
    if rig.before_trigger is not None:
        await rig.before_trigger()
    if rig.family == "mms7":
        rig.poke("6040:00", 0x80F)
    else:
        rig.poke("200C:0C" if rig.family == "r6l" else "2009:01", 1)
    await rig.until_rpm(20.0, 10.0)


Begin = Callable[[Rig], Awaitable[None]]
EVERY = frozenset(FAMILIES)
MOTIONS: dict[str, tuple[Begin, frozenset[str]]] = {
    "profile velocity": (profile_velocity, EVERY),
    "jog": (jogging, EVERY - {"ep3e"}),
    "jog by process data": (cyclic_jog, EVERY - {"ds_c"}),
    "own jog by input": (own_jog_by_input, frozenset({"m6l", "r6l"})),
    "own jog by parameter": (own_jog_by_parameter, frozenset({"r6l"})),
    "homing": (homing, EVERY),
    "own homing": (own_homing, frozenset({"m6l"})),
    "torque": (torque, EVERY),
    "identification": (identification, frozenset({"mms7", "m6l", "r6l"})),
}
