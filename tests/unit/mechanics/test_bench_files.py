"""Bench files with odd but plausible machines are taken; impossible ones are refused, with why."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest
from pydantic import ValidationError

from backend.commands.buses.virtual import _one_drive
from drivers.errors import NotAllowed
from drivers.texts.validation import reason_of
from drivers.virtual.bench import load_bench
from drivers.virtual.firmware.factory import make_device, number_device
from drivers.virtual.mechanics.spec import (
    FrictionSpec,
    LoadSpec,
    MechanicsSpec,
    MotorSpec,
    SwitchSpec,
    TravelSpec,
)

MOTOR = MotorSpec(inertia_kgm2=5e-5, rated_torque_nm=1.27, rated_speed_rpm=3000)
AXIS = '[[axis]]\nname = "{name}"\ndrive = "{drive}"\non = "{on}"\nstation = {station}\n'


def refused(tmp_path: Path, text: str) -> str:
    file = tmp_path / "bench.toml"
    file.write_text(text, "utf-8")
    with pytest.raises(NotAllowed) as caught:
        load_bench(file)
    return caught.value.message


@pytest.mark.parametrize(
    ("drive", "on", "station", "says"),
    [
        ("mms8", "mlink://virtual0", 1, "no profile named 'mms8'; there are: ds_c"),
        ("m6l", "mlink://virtual0", 1, "has no mlink port"),
        ("mms7", "canopen://virtual0", 1, "has no canopen port"),
        ("mms7", "mlink://virtual0", 248, "station 248 of mlink://virtual0 is outside 1 to 247"),
        ("ds_c", "canopen://virtual0", 128, "outside 1 to 127"),
        ("ds_c", "canopen://virtual0", 0, "outside 1 to 127"),
        (
            "ds_c",
            "canopen://socketcan/can0",
            1,
            "virtual drives do not support canopen://socketcan/can0",
        ),
        ("mms7", "usb://virtual0", 1, "not a bus URL"),
    ],
)
def test_ports_that_a_drive_does_not_have(
    tmp_path: Path, drive: str, on: str, station: int, says: str
) -> None:
    assert says in refused(tmp_path, AXIS.format(name="X", drive=drive, on=on, station=station))


def test_the_error_of_one_drive_has_no_file_and_is_chinese_in_chinese(tmp_path: Path) -> None:
    """`servodeck virtual` writes a bench file of its own, which nobody knows."""
    file = tmp_path / "bench.toml"
    file.write_text(AXIS.format(name="X", drive="m6l", on="mlink://virtual0", station=1), "utf-8")
    with pytest.raises(NotAllowed) as caught:
        _one_drive(file, tmp_path, None)
    assert "没有 mlink 端口" in caught.value.text.words("zh")
    assert str(tmp_path) not in caught.value.text.words("zh")
    assert caught.value.text.words().endswith("has no mlink port")
    remedy = caught.value.remedy_text
    assert remedy is not None
    assert remedy.words("zh") == "请接到 ethercat"


def test_two_axes_of_one_name_would_be_one_machine(tmp_path: Path) -> None:
    text = "".join(
        AXIS.format(name="X", drive="mms7", on="mlink://virtual0", station=n) for n in (1, 2)
    )
    assert "two axes are named 'X'" in refused(tmp_path, text)


@pytest.mark.parametrize("text", ['axis = "X"', "axis = [1]", "", "[[axis]]", "\x00", '{"axis"'])
def test_what_is_no_bench_is_reported_in_words(tmp_path: Path, text: str) -> None:
    assert str(tmp_path / "bench.toml") in refused(tmp_path, text)


def test_missing_mechanics_are_named(tmp_path: Path) -> None:
    text = AXIS.format(name="X", drive="mms7", on="mlink://virtual0", station=1)
    message = refused(tmp_path, text + 'mechanics = "gantry.toml"\n')
    assert f"{tmp_path / 'gantry.toml'}: No such file or directory" in message


@pytest.mark.parametrize(
    ("parts", "says"),
    [
        ({"friction": {"gravity_nm": -5.0}}, "more than this motor holds"),
        ({"friction": {"coulomb_nm": math.inf}}, "finite"),
        ({"motor": {"inertia_kgm2": math.inf}}, "finite"),
        ({"load": [{"inertia_kgm2": 1e-4, "stiffness_nm_per_rad": math.inf}]}, "finite"),
        ({"travel": {"min_rev": math.nan, "max_rev": 2}}, "start position"),
        ({"switches": {"negative_limit_rev": 3, "positive_limit_rev": -3}}, "must lie below"),
        ({"switches": {"home_from_rev": 1, "home_to_rev": 1}}, "begin before it ends"),
        (
            {"travel": {"min_rev": -2, "max_rev": 2}, "switches": {"positive_limit_rev": 2.5}},
            "positive_limit_rev 2.5 lies beyond the end stops",
        ),
        (
            {"travel": {"min_rev": -2, "max_rev": 2}, "switches": {"positive_limit_rev": -1.9}},
            "leave no room",
        ),
    ],
)
def test_impossible_machines_are_refused(parts: dict[str, object], says: str) -> None:
    motor = parts.pop("motor", {})
    assert isinstance(motor, dict)
    table = {"motor": MOTOR.model_dump() | motor} | parts
    with pytest.raises(ValidationError, match=says) as refused:
        MechanicsSpec.model_validate(table)
    chinese = reason_of(refused.value.errors()[0]).words("zh")
    assert re.search("[\u4e00-\u9fff]", chinese)


def test_a_short_travel_keeps_its_switches_apart() -> None:
    """A gripper of a fifth of a turn each way: 0.25 turns before the stops would cross over."""
    gripper = MechanicsSpec(motor=MOTOR, travel=TravelSpec(min_rev=-0.2, max_rev=0.2))
    assert gripper.limit_switches_rev == pytest.approx((-0.16, 0.16))


def test_odd_but_plausible_machines_are_taken() -> None:
    behind_a_gear_of_60 = LoadSpec(inertia_kgm2=3.6 / 60**2, stiffness_nm_per_rad=9000 / 60**2)
    vertical = FrictionSpec(gravity_nm=1.2, coulomb_nm=0.1)
    for spec in (
        MechanicsSpec(motor=MOTOR, load=(behind_a_gear_of_60,)),
        MechanicsSpec(motor=MOTOR.model_copy(update={"brake": True}), friction=vertical),
        MechanicsSpec(motor=MOTOR, friction=FrictionSpec(coulomb_nm=10.0)),  # seized, to train on
        MechanicsSpec(motor=MOTOR, travel=TravelSpec(min_rev=0, max_rev=900)),
        MechanicsSpec(motor=MOTOR, switches=SwitchSpec(home_from_rev=-math.inf)),
    ):
        low, high = spec.limit_switches_rev
        assert low < high


def test_no_two_drives_of_a_bench_have_one_serial_number(tmp_path: Path) -> None:
    """Else a drive on a second bus would pass for a second port of the same one."""
    file = tmp_path / "bench.toml"
    places = [("mlink://virtual0", 1), ("ethercat://virtual0", 1), ("ethercat://virtual0", 2)]
    file.write_text(
        "".join(
            AXIS.format(name=number, drive="mms7", on=on, station=station)
            for number, (on, station) in enumerate(places)
        )
        + AXIS.format(name="own", drive="mms7", on="mlink://virtual0", station=2)
        + "serial = 4711\n"
    )
    numbers = [axis.serial_number for axis in load_bench(file).axis]
    assert len(set(numbers)) == 4
    assert numbers[-1] == 4711
    device = make_device("mms7")
    number_device(device, numbers[0])
    assert device.read(0x1018, 4) == numbers[0].to_bytes(4, "little")
    device.power_cycle()
    assert device.read(0x1018, 4) == numbers[0].to_bytes(4, "little"), "after a power cycle, too"
