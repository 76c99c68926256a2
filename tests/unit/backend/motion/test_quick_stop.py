"""How hard a quick stop brakes while a motion without a loop has no other brake."""

from __future__ import annotations

import numpy as np
import pytest

from backend.axes.axis.axis import Envelope
from backend.axes.axis.stop.quick_stop import STOP_S
from backend.station.drives.connected_drive import ConnectedDrive
from backend.tools.measuring.recording import Play, bus_limits, enabled, play
from backend.tools.measuring.temporary import stopping_hard
from drivers.cia402 import Mode
from drivers.errors import NotAllowed
from drivers.motion import playback
from tests.support.servo import Servo
from tests.virtual.tools.direct import direct
from tests.virtual.tools.rig import mechanics

QUICK = (0x6085, 0)


async def test_it_brakes_from_the_permitted_speed_and_none_is_lowered(
    x: ConnectedDrive, servo: Servo
) -> None:
    units = await x.axis.units()
    counts = units.counts_per_rev or 0.0
    assert counts > 0
    # 600 rpm are 10 rev/s, 100 rev/s² bring them to rest in a tenth of a second.
    needed = round(100 * counts)
    servo.set(QUICK, 65536)
    async with stopping_hard(x.axis, 600.0):
        assert servo.number(QUICK) == needed
    assert servo.number(QUICK) == 65536
    servo.set(QUICK, 2 * needed)
    async with stopping_hard(x.axis, 600.0):
        assert servo.number(QUICK) == 2 * needed
    assert servo.number(QUICK) == 2 * needed


def test_it_brakes_like_the_set_points_of_a_loop() -> None:
    assert STOP_S == playback.STOP_S


async def test_an_axis_without_a_loop_is_brought_to_rest_near_its_envelope() -> None:
    """An R6L as it is shipped (002: 6085h, 1 rev/s²) would go on for 50 revolutions."""
    envelope, spec = Envelope(8.0, 600.0, 100.0, 10.0), mechanics()
    rated_nm, percent = spec.motor.rated_torque_nm, 5.0
    async with direct(spec, drive="r6l") as b:
        units, home = await b.axis.units(), await b.axis.position_raw()
        shipped = await b.axis.drive.raw("6085:00")
        assert units.position(shipped) == pytest.approx(1.0)
        values = np.full(2000, units.torque_raw(percent), dtype=np.int64)
        limits = await bus_limits(b.axis, envelope, home)
        async with stopping_hard(b.axis, envelope.speed_rpm):
            with pytest.raises(NotAllowed, match="speed"):
                async with enabled(b.axis, b.session, Mode.CST):
                    await play(
                        b.axis,
                        b.session,
                        Play(Mode.CST, values),
                        limits,
                        rated_nm,
                        lambda _part: None,
                    )
        went_rev = units.position(b.link.highest["high"] - home)
        fastest_rev_s = units.velocity(b.link.highest["speed"]) / 60.0
        assert await b.axis.drive.raw("6085:00") == shipped
    assert 10.0 < fastest_rev_s < 11.0
    pull = percent / 100.0 * rated_nm - spec.friction.coulomb_nm
    faster_rev_s2 = pull / spec.total_inertia_kgm2 / (2 * np.pi)
    # Up to its speed, down again at 100 rev/s², and the loop's lag of some hundredths of a second.
    assert went_rev < fastest_rev_s**2 * (0.5 / faster_rev_s2 + 0.5 / 100.0) + 0.03 * fastest_rev_s
