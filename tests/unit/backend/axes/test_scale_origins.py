"""Who states the scale of an axis, and what counts: codes of CiA 303-2, factors of CiA 402-2."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from backend.axes.axis import teaching
from backend.axes.axis.axis import Axis
from backend.axes.axis.remembered import AxisRecord, AxisStore
from backend.axes.drive.drive import Drive
from backend.axes.drive.ports import Port
from backend.axes.drive.readings import Reading
from backend.axes.scales.resolve import Reported, scales_of
from backend.axes.scales.scale import Origin, ScaleUnknown, Uncertainty
from backend.axes.scales.taught import Taught, TaughtDrive
from backend.axes.scales.units import AxisUnits, read_units
from backend.axes.scales.units_found import nearest_unit
from backend.axes.scales.words import apart, halt_words
from backend.commands.drive.scales import take_taught, taught_file
from drivers.errors import NotAllowed, OutOfRange
from drivers.halt import HaltCause, Halted
from drivers.link import Found
from profiles import load_profile
from tests.support.memory_link import MemoryLink

GENERIC = load_profile("generic402").units
INC, INC_S, INC_S2 = 0x00B50000, 0x00B50300, 0x00B55700
RPM, TENTH_RPM, RAD_S, DEGREE_S = 0x00B44700, 0xFFB44700, 0x00100300, 0x00410300
TENTH_DEGREE = 0xFF410000


def velocity(code: int | None, **raws: int) -> tuple[float | None, Uncertainty | None]:
    reported = {"608F:01": 65_536, "608F:02": 1} | raws
    if code is not None:
        reported["60A9:00"] = code
    scale = scales_of(GENERIC, Reported(reported), None).velocity
    return scale.raw_per_unit, scale.uncertainty


@pytest.mark.parametrize(
    ("code", "raw_per_rpm"),
    [
        (INC_S, 65_536 / 60),
        (RPM, 1.0),
        (TENTH_RPM, 10.0),
        (0xFDB44700, 1000.0),  # 0.001 rpm
        (0x00B40300, 1 / 60),  # rev/s
        (DEGREE_S, 6.0),
        (RAD_S, 0.10471975512),
    ],
)
def test_codes_of_60a9h(code: int, raw_per_rpm: float) -> None:
    assert velocity(code) == (pytest.approx(raw_per_rpm), None)


@pytest.mark.parametrize(
    ("code", "uncertainty"),
    [
        (None, Uncertainty.NOT_STATED),
        (0, Uncertainty.NOT_STATED),
        (0x00010300, Uncertainty.UNREADABLE),  # m/s: how far a revolution goes is not said
        (0x12345678, Uncertainty.UNREADABLE),
    ],
)
def test_a_unit_that_nobody_states_is_none(code: int | None, uncertainty: Uncertainty) -> None:
    assert velocity(code) == (None, uncertainty)


def test_turns_behind_a_gear_are_not_certain() -> None:
    """6091h of 5 to 1: rpm of the motor, or of the shaft behind it?"""
    gear = {"6091:01": 5, "6091:02": 1}
    assert velocity(RPM, **gear) == (None, Uncertainty.BEHIND_GEAR)
    assert velocity(INC_S, **gear) == (pytest.approx(65_536 / 5 / 60), None)


@pytest.mark.parametrize(
    "raws",
    [
        {"6090:01": 6_553, "6090:02": 1},
        {"6090:01": 65_536, "6090:02": 10},
        {"6096:01": 10, "6096:02": 1},
        {"6096:01": 1, "6096:02": 60},
    ],
)
def test_a_speed_that_is_counted_otherwise_is_not_certain(raws: dict[str, int]) -> None:
    """6090h next to a 608Fh of 65536 increments, or a velocity factor (CiA 402-2 clause 10)."""
    assert velocity(INC_S, **raws) == (None, Uncertainty.FACTOR)
    assert velocity(RPM, **raws) == (None, Uncertainty.FACTOR)


def test_factors_that_change_nothing_are_none() -> None:
    alike = {"6090:01": 131_072, "6090:02": 2, "6096:01": 7, "6096:02": 7}
    assert velocity(INC_S, **alike) == (pytest.approx(65_536 / 60), None)
    assert velocity(INC_S, **{"6090:01": 0, "6096:01": 0}) == (pytest.approx(65_536 / 60), None)


def test_a_factor_of_the_acceleration_leaves_the_speed_certain() -> None:
    reported = {"608F:01": 65_536, "60A9:00": INC_S, "60AA:00": INC_S2, "6097:01": 1, "6097:02": 10}
    scales = scales_of(GENERIC, Reported(reported), None)
    assert scales.velocity.certain
    assert scales.acceleration.uncertainty is Uncertainty.FACTOR


@pytest.mark.parametrize(
    ("raws", "per_rev"),
    [
        ({"608F:01": 131_072, "608F:02": 1}, 131_072),
        ({"608F:01": 20_000, "608F:02": 2}, 10_000),
        ({"608F:01": 131_072, "6092:01": 10_000, "6092:02": 1}, 10_000),
        ({"6092:01": 36_000, "6092:02": 1, "6091:01": 10, "6091:02": 1}, 3_600),
        ({"60A8:00": TENTH_DEGREE, "608F:01": 131_072}, 3_600),
        ({"60A8:00": TENTH_DEGREE, "6092:01": 3_600, "6092:02": 1}, 3_600),
        ({"60A8:00": INC, "608F:01": 4_096, "608F:02": 1}, 4_096),
    ],
)
def test_increments_of_a_revolution(raws: dict[str, int], per_rev: float) -> None:
    scale = scales_of(GENERIC, Reported(raws), None).position
    assert (scale.raw_per_unit, scale.origin) == (per_rev, Origin.DRIVE)


@pytest.mark.parametrize(
    ("raws", "uncertainty"),
    [
        ({}, Uncertainty.NO_RESOLUTION),
        ({"6092:01": 0, "6092:02": 1}, Uncertainty.NO_RESOLUTION),
        # No ratio has a 0 in it; what a drive takes in its place is its own affair.
        ({"6092:01": 10_000, "6092:02": 0}, Uncertainty.NO_RESOLUTION),
        ({"6092:01": 10_000, "6091:01": 0, "6091:02": 1}, Uncertainty.NO_RESOLUTION),
        ({"6092:01": 10_000, "6091:01": 10, "6091:02": 0}, Uncertainty.NO_RESOLUTION),
        ({"608F:01": 131_072, "608F:02": 0}, Uncertainty.NO_RESOLUTION),
        ({"6092:01": 1, "6092:02": 1, "608F:01": 131_072}, Uncertainty.FEED_OF_ONE),
        ({"60A8:00": TENTH_DEGREE, "6092:01": 10_000}, Uncertainty.UNIT_AND_FEED),
        ({"60A8:00": 0xFA010000}, Uncertainty.LINEAR),  # µm
        ({"60A8:00": 0x00990000}, Uncertainty.UNREADABLE),
    ],
)
def test_a_resolution_that_nobody_states_is_none(
    raws: dict[str, int], uncertainty: Uncertainty
) -> None:
    scale = scales_of(GENERIC, Reported(raws), None).position
    assert (scale.raw_per_unit, scale.uncertainty) == (None, uncertainty)


@pytest.mark.parametrize(
    ("numerator", "denominator", "per_rev"),
    [(0, 0, 10_000), (1, 1, 10_000), (2, 1, 5_000), (0, 1, None), (1, 0, None)],
)
def test_a_gear_that_was_never_set_is_none_where_the_profile_states_it(
    numerator: int, denominator: int, per_rev: float | None
) -> None:
    """DS_C, 003:490; any other family with 0 in both parts is not certain."""
    spec = load_profile("ds_c").units
    raws = {"2300:00": numerator, "2301:00": denominator}
    assert scales_of(spec, Reported(raws), None).position.raw_per_unit == per_rev
    both = Reported({"6092:01": 10_000, "6091:01": 0, "6091:02": 0})
    assert scales_of(GENERIC, both, None).position.raw_per_unit is None


async def test_what_a_drive_has_not_is_asked_for_once() -> None:
    axis = plain(resolution=131_072)
    asked: list[list[str]] = []
    read_many = axis.drive.read_many

    async def counted(keys: Sequence[str]) -> dict[str, Reading]:
        asked.append(list(keys))
        return await read_many(keys)

    axis.drive.read_many = counted  # type: ignore[method-assign, assignment]
    await axis.units()
    await axis.read_scales()
    axis.forget_scales()
    await axis.units()
    assert [len(keys) for keys in asked] == [len(asked[0]), 1, len(asked[0])]
    assert asked[1] == ["608F:01"]


def test_what_a_person_said_counts_while_the_drive_is_as_it_was() -> None:
    raws = {"608F:01": 1_000, "60A9:00": RPM}
    taught = Taught(counts_per_rev=10_000, raw_per_rpm=10.0, bound_to=raws)
    scales = scales_of(GENERIC, Reported(raws), taught)
    assert (scales.position.raw_per_unit, scales.position.origin) == (10_000, Origin.USER)
    assert (scales.velocity.raw_per_unit, scales.velocity.origin) == (10.0, Origin.USER)
    other = scales_of(GENERIC, Reported(raws | {"608F:01": 2_000}), taught)
    assert (other.position.raw_per_unit, other.position.origin) == (2_000, Origin.DRIVE)


def test_the_makers_file_counts_where_the_drive_is_silent() -> None:
    spec = GENERIC.model_copy(
        update={"velocity": "0.1 rpm", "origins": {"velocity": "makers_file"}}
    )
    scale = scales_of(spec, Reported({"608F:01": 1_000}), None).velocity
    assert (scale.raw_per_unit, scale.origin) == (10.0, Origin.MAKERS_FILE)


def test_a_profile_imported_before_origins_were_kept_is_not_taken_for_a_manual() -> None:
    old = GENERIC.model_copy(update={"origins": {}})
    assert (
        scales_of(old, Reported({"608F:01": 1_000}), None).velocity.uncertainty
        is Uncertainty.NOT_STATED
    )


@pytest.mark.parametrize("name", ["mms7", "m6l", "r6l", "ds_c"])
def test_units_of_listed_families_are_those_of_their_manual(name: str) -> None:
    units = AxisUnits(load_profile(name).units, 10_000.0)
    units.require_certain()
    assert {s.origin for s in units.scales.all} == {Origin.MANUAL}


def test_nothing_is_converted_by_a_scale_that_is_not_certain() -> None:
    units = AxisUnits(GENERIC, None, scales_of(GENERIC, Reported({}), None), "N axis")
    for convert in (units.position_raw, units.velocity_raw, units.acceleration_raw):
        with pytest.raises(ScaleUnknown, match="N axis: the scale of its"):
            convert(3.0)
    assert (units.position(3), units.names["velocity"]) == (3, "raw")


@pytest.mark.parametrize(
    ("measured", "counts", "expected"),
    [
        (0.997, 65_536.0, (65_536 / 60, "inc/s")),
        (10 * 60 / 10_000 * 1.004, 10_000.0, (10.0, "0.1 rpm")),
        (60 / 10_000, 10_000.0, (1.0, "rpm")),
    ],
)
def test_a_measured_factor_is_the_usual_unit_nearby(
    measured: float, counts: float, expected: tuple[float, str]
) -> None:
    assert nearest_unit(measured, counts) == (pytest.approx(expected[0]), expected[1])


@pytest.mark.parametrize(
    ("measured", "counts"),
    [
        (3.7 * 60 / 10_000, 10_000.0),  # 3.7 raw per rpm: no usual unit
        (1_045 * 60 / 65_536, 65_536.0),  # between 0.001 rpm and increments per second (1092)
    ],
)
def test_an_odd_factor_is_no_unit(measured: float, counts: float) -> None:
    assert nearest_unit(measured, counts) is None


def halted(cause: HaltCause, value: float, limit: float) -> str:
    units = AxisUnits(load_profile("mms7").units, 65_536.0)
    quantity = {HaltCause.POSITION: "position", HaltCause.TORQUE: "torque"}.get(cause, "speed")
    return str(halt_words(Halted(cause, quantity, value, limit), units))  # type: ignore[arg-type]


def test_limits_are_said_in_the_units_of_the_axis() -> None:
    rpm = 65_536 / 60
    assert "torque 80.4 % is beyond the limit of 80 %" in halted(HaltCause.TORQUE, 804, 800)
    assert "speed 320 rpm is beyond the limit of 300 rpm" in halted(
        HaltCause.SPEED, 320 * rpm, 300 * rpm
    )
    words = halted(HaltCause.POSITION, 16_638_901, 16_638_900)
    assert "position 253.88948 rev is beyond the limit of 253.88947 rev" in words


def test_a_contradiction_says_both_speeds() -> None:
    rpm = 65_536 / 60
    words = halted(HaltCause.CONTRADICTION, 12 * rpm, 903 * rpm)
    assert "606Ch reads 12 rpm, the position gives 903 rpm: the scale of 606Ch" in words


def test_two_figures_are_shown_apart() -> None:
    assert apart(2.5, 2.0) == ("2.5", "2")
    assert apart(2.500001, 2.5) == ("2.500001", "2.5")


def plain(**objects: int) -> Axis:
    places = {"position": (0x6064, 0), "resolution": (0x608F, 1), "unit": (0x60A9, 0)}
    link = MemoryLink({places[n]: v.to_bytes(4, "little") for n, v in objects.items()})
    link.kind = "canopen"
    profile = load_profile("generic402")
    spec = next(s for s in profile.links if s.kind == "canopen")
    drive = Drive("n", "N axis", profile, [Port(link, 1, spec)])
    drive.found = Found(1)
    return Axis(drive)


async def test_608fh_alone_is_read() -> None:
    assert (await read_units(plain(resolution=131_072).drive)).counts_per_rev == 131_072


async def test_a_confirmed_small_move_is_bound_to_the_drive_as_it_is() -> None:
    """5 000 increments, half a turn, and 606Ch in 0.1 rpm: 0.06 raw per increment per second."""
    axis = plain(resolution=1_000)
    axis.moved_small(5_000, 0.0602)
    taught = await teaching.confirmed(axis, 0.5)
    assert (taught.counts_per_rev, taught.raw_per_rpm) == (10_000, 10.0)
    assert taught.bound_to == {"608F:01": 1_000}


async def test_what_cannot_be_confirmed() -> None:
    axis = plain(resolution=1_000)
    with pytest.raises(NotAllowed, match="no small move"):
        await teaching.confirmed(axis, 1.0)
    axis.moved_small(500, None)
    with pytest.raises(OutOfRange, match="by eye"):
        await teaching.confirmed(axis, 0.01)
    axis.moved_small(500, -1.0)
    with pytest.raises(NotAllowed, match="opposite signs"):
        await teaching.confirmed(axis, 1.0)


async def test_what_is_said_is_kept_with_the_axis(tmp_path: Path) -> None:
    taught = await teaching.stated(plain(resolution=1_000), 2_000.0, None, None)
    store = AxisStore(tmp_path)
    store.put("x", AxisRecord(scales=taught))
    assert AxisStore(tmp_path).get("x").scales == taught


async def test_a_command_uses_no_scales_of_another_family_at_the_same_place(tmp_path: Path) -> None:
    """Without a serial number, place and profile tell drives apart."""
    axis = plain(resolution=1_000)
    file = await taught_file(axis.drive, tmp_path)
    file.parent.mkdir(parents=True)
    places = (("mlink://memory", 1),)
    for of, counts in (
        (TaughtDrive(profile="generic402", places=places), True),
        (TaughtDrive(profile="ds_c", places=places), False),
        (None, False),  # as earlier versions stored them
    ):
        file.write_text(Taught(counts_per_rev=2_000.0, drive=of).model_dump_json(), "utf-8")
        await take_taught(axis, tmp_path)
        assert (axis.taught is not None) == counts
    with pytest.raises(ScaleUnknown, match="stated for another drive"):
        (await axis.units()).acceleration_raw(1.0)


async def test_a_command_uses_scales_of_the_same_serial_number(tmp_path: Path) -> None:
    axis = plain(resolution=1_000)
    axis.drive.ports[0].link.objects[0x1018, 4] = (7).to_bytes(4, "little")  # type: ignore[attr-defined]
    file = await taught_file(axis.drive, tmp_path)
    file.parent.mkdir(parents=True)
    file.write_text(Taught(counts_per_rev=2_000.0).model_dump_json(), "utf-8")
    await take_taught(axis, tmp_path)
    assert axis.taught is not None
