"""Every homing method that a manual lists, from three start positions, against the geometry.

The machine (motor revolutions): end stops at ±5.3, limit switches at ±4.6, an index pulse at every
whole revolution, and a home switch from 0.7 to 2.2. Methods 3 to 6 and 19 to 22 are for a switch
that stays on from its edge to the end of the travel. Where each method must end follows from
CiA 402-2 clause 11.4 and from the sequences of 000:2238-2756, 001:600-700, 003:370-400, 004:3837.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import pytest

from drivers.virtual.mechanics import (
    FrictionSpec,
    MechanicsSpec,
    MotorSpec,
    SwitchSpec,
    TravelSpec,
)
from profiles import load_profile

from .on_wire import EVERY, Aborted, OnWire

FAMILIES = tuple(name for name in EVERY if name != "generic402")
NEAR, FAR, LIMIT, STOP = 0.7, 2.2, 4.6, 5.3
FAST, SLOW = 6.0, 1.5  # rev/s
LEFT, ON, RIGHT = -1.5, 1.4, 3.4


@dataclass(frozen=True)
class Case:
    """Where a method ends from three places; ``switch`` is the home switch it is meant for."""

    starts: tuple[float, float, float]
    homes: tuple[float, float, float]
    switch: tuple[float, float] = (NEAR, FAR)


def always(home: float, *starts: float, switch: tuple[float, float] = (NEAR, FAR)) -> Case:
    a, b, c = starts or (LEFT, ON, RIGHT)
    return Case((a, b, c), (home, home, home), switch)


UP, DOWN = (NEAR, math.inf), (-math.inf, FAR)
CASES: dict[int, Case] = {
    1: always(-4, -4.7, -3.3, 2.2),
    2: always(4, 4.7, 3.3, -2.2),
    3: always(0, LEFT, 0.3, RIGHT, switch=UP),
    4: always(1, LEFT, 0.3, RIGHT, switch=UP),
    5: always(3, RIGHT, 2.7, LEFT, switch=DOWN),
    6: always(2, RIGHT, 2.7, LEFT, switch=DOWN),
    7: always(0), 8: always(1), 9: always(2), 10: always(3),
    11: always(3), 12: always(2), 13: always(1), 14: always(0),
    17: always(-LIMIT, -4.7, -3.3, 2.2),
    18: always(LIMIT, 4.7, 3.3, -2.2),
    19: always(NEAR, LEFT, 0.3, RIGHT, switch=UP),
    20: always(NEAR, LEFT, 0.3, RIGHT, switch=UP),
    21: always(FAR, RIGHT, 2.7, LEFT, switch=DOWN),
    22: always(FAR, RIGHT, 2.7, LEFT, switch=DOWN),
    23: always(NEAR), 24: always(NEAR), 25: always(FAR), 26: always(FAR),
    27: always(FAR), 28: always(FAR), 29: always(NEAR), 30: always(NEAR),
    33: Case((-1.5, 0.4, 2.3), (-2, 0, 2)),
    34: Case((-1.5, 0.4, 2.3), (-1, 1, 3)),
    35: Case((-1.5, 0.4, 2.3), (-1.5, 0.4, 2.3)),
    36: Case((-1.5, 0.4, 2.3), (-1, 1, 3)),
    37: Case((-1.5, 0.4, 2.3), (-2, 0, 2)),
    38: Case((-1.6, 0.4, 2.7), (-2, 0, 3)),
}  # fmt: skip
#: Against the mechanical limit: MMS7 (004:3840-3842) and M6-L (000:2701-2756) mean other things.
TORQUE = {
    "mms7": {-3: always(-STOP), -2: always(STOP)},
    "m6l": {-1: always(STOP), -2: always(-STOP), -3: always(-5), -4: always(5)},
}


def methods() -> list[tuple[str, int, int]]:
    found = []
    for name in FAMILIES:
        for method in load_profile(name).homing_methods:
            # The R6L draws 36 to 39, and its 6098h ends at 35 (002:13493): see below.
            if not (name == "r6l" and method.method > 35):
                found += [(name, method.method, place) for place in range(3)]
    return found


def machine(case: Case) -> MechanicsSpec:
    return MechanicsSpec(
        motor=MotorSpec(inertia_kgm2=5e-5, rated_torque_nm=1.27, rated_speed_rpm=3000),
        friction=FrictionSpec(coulomb_nm=0.02),
        travel=TravelSpec(min_rev=-STOP, max_rev=STOP),
        switches=SwitchSpec(
            negative_limit_rev=-LIMIT,
            positive_limit_rev=LIMIT,
            home_from_rev=case.switch[0],
            home_to_rev=case.switch[1],
        ),
    )


def wired(name: str, case: Case) -> OnWire:
    """The drive with its switches on terminals that know what they are."""
    d = OnWire(name, machine(case))
    if name == "mms7":
        d.set_all({"2030:01": 1, "2030:02": 2, "2030:03": 3})
        d.set_all({"2070:01": 300, "2070:02": 100})
        d.set("200D:00", 0xAAB555AA)
    elif name == "m6l":
        d.set_all({"2003:03": 32, "2009:27": 0, "2017:15": 300, "2017:16": 100})
    elif name == "r6l":
        d.set_all({"2006:0D": 0})
    return d


def speed_raw(d: OnWire, key: str, rev_s: float) -> float:
    """Homing speeds are in rpm on the M6-L and the DS_C."""
    if d.profile.by_key[key].unit == "rpm":
        return rev_s * 60
    return rev_s * d.speed_per_rev_s


def home(d: OnWire, method: int, offset: int = 0, fast: float = FAST) -> None:
    """Start a method; returns with the axis searching."""
    d.set_all(
        {
            "6098:00": method,
            "6099:01": speed_raw(d, "6099:01", fast),
            "6099:02": speed_raw(d, "6099:02", SLOW),
            "609A:00": d.ramp(200),
            "607C:00": offset,
            "6060:00": 6,
        }
    )
    d.command(6, 7, 15)
    d.set("6040:00", 0x1F)


def attained(d: OnWire) -> bool:
    return bool(d.status & (1 << 8 if d.drive == "ds_c" else 1 << 12))


@pytest.mark.long(keep=14)
@pytest.mark.parametrize(("name", "method", "place"), methods())
def test_method(name: str, method: int, place: int) -> None:
    case = TORQUE.get(name, {}).get(method) or CASES[method]
    d = wired(name, case)
    d.device.inject("turn_to_rev", case.starts[place])
    home(d, method)
    fastest = 0.0

    def done() -> bool:
        nonlocal fastest
        fastest = max(fastest, abs(d.speed_rev_s))
        return attained(d)

    d.until(done, 30.0, 0.02)
    d.run(0.2)
    assert d.angle_rev == pytest.approx(case.homes[place], abs=3e-3)
    assert abs(d.get("6064:00")) <= 0.004 * d.per_rev
    # No faster than 6099h:01 but for the overshoot of the gains; without a switch than 6099h:02.
    assert fastest < FAST * 1.15
    if method in (33, 34):
        assert fastest < SLOW * 1.5
    status = d.status
    if name != "ds_c":
        assert status & 1 << 12
        assert not status & 1 << 13
    if name in ("r6l", "ep3e"):
        assert status & 1 << 15  # home found (002:12793, 001:372)


@pytest.mark.parametrize("name", FAMILIES)
def test_the_edge_is_exact(name: str) -> None:
    """An edge that is passed at the low speed is home to 50 µs of that speed."""
    d = wired(name, CASES[23])
    d.device.inject("turn_to_rev", LEFT)
    home(d, 23)
    d.until(lambda: attained(d), 30.0, 0.01)
    zero_rev = d.device.core.zero_rad / (2 * math.pi)
    assert zero_rev == pytest.approx(NEAR, abs=8e-5)


#: Position at home per revolution of offset: the zero lies the offset beyond home, or the offset
#: is shown at home (002:4344, 001:687, P12.11 of the M6-L: 000:2213).
OFFSETS = [
    ("mms7", {}, -0.5, 1.0),
    ("ds_c", {}, -0.5, 1.0),
    ("r6l", {}, 0.5, 1.0),
    ("ep3e", {}, 0.5, 1.0),
    ("m6l", {"200C:0C": 0}, 0.5, 1.0),
    ("m6l", {"200C:0C": 1}, 1.0 + 0.5, 1.0),
    ("m6l", {"200C:0C": 2}, 0.0, 1.5),
    ("m6l", {"200C:0C": 3}, 0.5, 1.5),
]


@pytest.mark.parametrize(("name", "settings", "shown_rev", "rests_rev"), OFFSETS)
def test_home_offset(
    name: str, settings: dict[str, int], shown_rev: float, rests_rev: float
) -> None:
    """Half a revolution of offset, index at 1: what 6064h shows and where the axis is."""
    d = wired(name, CASES[34])
    d.set_all(settings)
    d.device.inject("turn_to_rev", 0.4)
    d.set("607C:00", round(0.5 * d.per_rev))
    if name == "ep3e":
        d.restart_network()  # the offset acts from Init to Pre-Operational (001:1002)
    home(d, 34, offset=round(0.5 * d.per_rev))
    d.until(lambda: attained(d), 30.0, 0.01)
    d.run(0.2)
    assert d.angle_rev == pytest.approx(rests_rev, abs=3e-3)
    assert d.get("6064:00") / d.per_rev == pytest.approx(shown_rev, abs=4e-3)


def test_m6l_takes_the_index_on_which_it_stands() -> None:
    """000:2677: no motion."""
    d = wired("m6l", CASES[33])
    d.device.inject("turn_to_rev", 2.0)
    home(d, 33)
    d.run(0.02)
    assert attained(d)
    assert d.angle_rev == pytest.approx(2.0, abs=1e-4)


def test_m6l_comes_back_from_behind_the_home_switch() -> None:
    """Method 4 started between the cam and the positive limit (000:2285)."""
    d = wired("m6l", CASES[7])
    d.device.inject("turn_to_rev", RIGHT)
    home(d, 4)
    d.until(lambda: attained(d), 60.0, 0.01)
    d.run(0.2)
    assert d.angle_rev == pytest.approx(1.0, abs=3e-3)


@pytest.mark.parametrize("method", [36, 37, 38, 39])
def test_r6l_refuses_methods_beyond_35(method: int) -> None:
    """6098h ends at 35 (002:13493)."""
    d = OnWire("r6l", None)
    with pytest.raises(Aborted):
        d.set("6098:00", method)


@pytest.mark.parametrize("name", [n for n in FAMILIES if n != "ds_c"])
def test_a_missing_switch_is_a_homing_error_at_the_limit(name: str) -> None:
    """Method 19 without a home switch ends at the positive limit: bit 13, at standstill."""
    case = Case((0, 0, 0), (0, 0, 0), switch=(90, 91))
    d = wired(name, case)
    home(d, 19)
    d.until(lambda: bool(d.status & 1 << 13), 30.0, 0.01)
    d.run(0.3)
    assert not d.status & 1 << 12
    assert abs(d.speed_rev_s) < 0.01
    assert LIMIT - 0.1 < d.angle_rev < STOP
    if name == "r6l":
        assert d.status & 1 << 7
        assert "AL.420" in d.device.control.alarms.warnings


@pytest.mark.parametrize("name", FAMILIES)
def test_bit_4_falling_ends_the_search(name: str) -> None:
    d = wired(name, CASES[17])
    home(d, 17)
    d.run(0.4)
    assert d.speed_rev_s == pytest.approx(-FAST, rel=0.05)
    d.set("6040:00", 0x0F)
    d.run(0.3)
    assert abs(d.speed_rev_s) < 0.01
    assert not attained(d)


def test_time_out_of_the_mms7_sets_bit_13() -> None:
    """2070h:03 in seconds (004:3834)."""
    d = wired("mms7", CASES[17])
    d.set_all({"2070:03": 1, "200D:00": 0xAAB555AA})
    home(d, 17, fast=FAST / 3)
    d.run(0.9)
    assert not d.status & 1 << 13
    d.run(0.3)
    assert d.status & 1 << 13


def test_time_out_of_the_m6l_is_fault_37() -> None:
    """P12.09 in ms (000:3635), Er.037 (000:3921)."""
    d = wired("m6l", CASES[17])
    d.set("200C:0A", 1000)
    home(d, 17, fast=FAST / 3)
    d.run(0.9)
    assert d.state == 0x27
    d.run(0.2)
    assert d.state == 0x08
    assert d.get("603F:00") == 0xFF25
    assert d.status & 1 << 13
