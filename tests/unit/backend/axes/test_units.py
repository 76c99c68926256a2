"""Units of an axis as its drive has them, with the M6-L's switches and gearing."""

from __future__ import annotations

import pytest

from backend.axes.drive.drive import Drive
from backend.axes.drive.ports import Port
from backend.axes.scales.units import AxisUnits, ramp_raw, read_units
from drivers.errors import NotAllowed, OutOfRange, Rejected
from drivers.link import Found
from profiles import load_profile
from tests.support.memory_link import MemoryLink

PROFILE = load_profile("m6l")


def m6l(pulses: int, numerator: int = 1, denominator: int = 1, **switches: int) -> Drive:
    link = MemoryLink(
        {
            (0x2005, 6): pulses.to_bytes(4, "little"),  # P05.05
            (0x6091, 1): numerator.to_bytes(4, "little"),
            (0x6091, 2): denominator.to_bytes(4, "little"),
            (0x2014, 0x0F): switches.get("torque", 0).to_bytes(2, "little"),  # P20.14
            (0x2014, 0x10): switches.get("speed", 1).to_bytes(2, "little"),  # P20.15
        }
    )
    link.kind = "ethercat"
    drive = Drive("x", "X axis", PROFILE, [Port(link, 1, PROFILE.links[0])])
    drive.found = Found(1)
    return drive


async def test_command_pulses_and_gear_factor_together() -> None:
    """Screw of 10 mm per revolution, 23 bits: 8388608 over 10 makes the unit 1 mm (000:1794)."""
    units = await read_units(m6l(8388608, 8388608, 10))
    assert units.counts_per_rev == pytest.approx(10)
    assert (await read_units(m6l(10000))).counts_per_rev == 10000  # 000:3296


async def test_resolution_is_unknown_while_the_gear_ratios_rule() -> None:
    """P05.05 = 0 (000:1276): nothing is converted, and nothing shown as revolutions."""
    units = await read_units(m6l(0))
    assert units.counts_per_rev is None
    assert units.names["position"] == "inc"


@pytest.mark.parametrize(
    ("switches", "number"), [({"speed": 0}, "P20.15"), ({"torque": 1}, "P20.14")]
)
async def test_other_units_are_refused(switches: dict[str, int], number: str) -> None:
    """rpm mistaken for increments per second would run away (000:3695-3696)."""
    with pytest.raises(NotAllowed, match=number) as refusal:
        await read_units(m6l(10000, **switches))
    assert "set it back" in (refusal.value.remedy or "")


def plain(**objects: tuple[int, int]) -> Drive:
    """A drive that is not listed: CiA 402 without what the standard leaves to the maker."""
    places = {"position": (0x6064, 0), "numerator": (0x6091, 1), "denominator": (0x6091, 2)}
    link = MemoryLink(
        {places[name]: value.to_bytes(size, "little") for name, (value, size) in objects.items()}
    )
    link.kind = "canopen"
    profile = load_profile("generic402")
    spec = next(spec for spec in profile.links if spec.kind == "canopen")
    drive = Drive("n", "N axis", profile, [Port(link, 1, spec)])
    drive.found = Found(1)
    return drive


async def test_a_drive_without_gear_objects_counts_in_increments() -> None:
    """6091h and 6092h are optional in CiA 402-2: their absence must not hide where the axis is."""
    units = await read_units(plain(position=(5, 4)))
    assert units.counts_per_rev is None
    assert (units.names["position"], units.position(5)) == ("inc", 5)


async def test_a_gear_that_cannot_be_read_for_another_reason_is_no_gear_of_1() -> None:
    drive = plain(numerator=(3, 4), denominator=(1, 4))
    link = drive.ports[0].link
    assert isinstance(link, MemoryLink)
    link.read_errors[0x6091, 1] = Rejected("a general error", abort_code=0x08000000)
    with pytest.raises(Rejected):
        await read_units(drive)


def test_unit_switches_make_the_units_be_read_again() -> None:
    assert {"2014:0F", "2014:10", "2005:06", "6091:01"} <= PROFILE.unit_keys


async def test_a_ramp_that_a_drive_cannot_do_is_refused_in_the_unit_that_was_typed() -> None:
    """DS_C ramps by a time of at most 2000 ms (003:641), for 3000 rpm: 1500 rpm/s."""
    profile = load_profile("ds_c")
    spec = profile.link("canopen")
    assert spec is not None
    drive = Drive("x", "Low axis", profile, [Port(MemoryLink({}), 3, spec)])
    units = AxisUnits(profile.units, 10000.0)
    assert ramp_raw(units, drive, "6083:00", 1500.0) == 2000
    with pytest.raises(
        OutOfRange, match="Low axis: 600 rpm/s is below the lowest acceleration"
    ) as refused:
        ramp_raw(units, drive, "6083:00", 600.0)
    assert refused.value.limit == "at least 1500 rpm/s"
