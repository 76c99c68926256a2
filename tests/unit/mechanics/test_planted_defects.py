"""Defects in a bench file and of ``servodeck demo --defect``: what they change, and who refuses."""

from __future__ import annotations

from pathlib import Path

import pytest

from backend.station.demo import DemoBench
from drivers.errors import NotAllowed
from drivers.virtual.bench import STANDARD_BENCH, AxisSpec, bench_file, load_bench
from drivers.virtual.defects import DEFECT_WORDS, DEFECTS
from drivers.virtual.mechanics.chain import analytic_response

GANTRY = """
[[axis]]
name = "L"
drive = "mms7"
on = "ethercat://virtual0"
station = 1
defects = ["out_of_square"]
mechanics = "motor.toml"
[[axis]]
name = "R"
drive = "mms7"
on = "ethercat://virtual0"
station = 2
mechanics = "motor.toml"
[[gantry]]
axes = ["L", "R"]
inertia_kgm2 = 2e-4
yaw_inertia_kgm2 = 4e-5
joint_stiffness_nm_per_rad = 25.0
"""
MOTOR = "[motor]\ninertia_kgm2 = 5e-5\nrated_torque_nm = 1.27\nrated_speed_rpm = 3000\n"


def axis_of(bench: DemoBench, name: str = "Feed screw") -> AxisSpec:
    return next(axis for axis in bench.spec.axis if axis.name == name)


def test_defects_of_the_demo_are_in_its_mechanics_and_named(tmp_path: Path) -> None:
    good = axis_of(DemoBench(None, tmp_path)).mechanics
    asked = ("Feed screw=coupling_loose", "Feed screw=belt_worn", "Turntable=brake_closed")
    bench = DemoBench(None, tmp_path / "wires", defects=asked)
    bad = axis_of(bench).mechanics
    assert bad.load[0].stiffness_nm_per_rad == pytest.approx(
        0.7 * good.load[0].stiffness_nm_per_rad
    )
    assert bad.friction.coulomb_nm == pytest.approx(1.2 * good.friction.coulomb_nm)
    assert bad.friction.viscous_nms == pytest.approx(1.2 * good.friction.viscous_nms)
    assert bad.load[0].backlash_rad > 0.0 == good.load[0].backlash_rad
    # By the equations of motion: at the old resonance the loose axis answers far less.
    hz = 212.0
    ratio = abs(complex(analytic_response(bad, hz))) / abs(complex(analytic_response(good, hz)))
    assert ratio != pytest.approx(1.0, rel=0.05)
    turntable = axis_of(bench, "Turntable").mechanics.motor
    assert turntable.brake
    assert not turntable.brake_supplied
    words = [(name, each.words("en")) for name, each in bench.planted]
    assert words[0] == ("Feed screw", "a loose coupling: 70 % of its stiffness")
    assert [name for name, _ in words] == ["Feed screw", "Feed screw", "Turntable"]
    # The wires are started from the file that has them.
    assert load_bench(bench._file) == bench.spec
    assert axis_of(DemoBench(None, tmp_path)).mechanics == good


@pytest.mark.parametrize(
    ("asked", "code"),
    [
        ("Feed screw=gone", "virtual.no-such-defect"),
        ("Nobody=belt_worn", "virtual.no-such-defect"),
        ("belt_worn", "virtual.no-such-defect"),
        ("Gantry left=out_of_square", "virtual.bench-file-defect-needs"),
    ],
)
def test_what_cannot_be_planted_is_refused(tmp_path: Path, asked: str, code: str) -> None:
    with pytest.raises(NotAllowed) as refused:
        DemoBench(None, tmp_path, defects=(asked,))
    assert refused.value.code == code


def test_a_gantry_is_bent_and_has_no_coupling_to_loosen(tmp_path: Path) -> None:
    file = tmp_path / "gantry.toml"
    file.write_text(GANTRY, "utf-8")
    (tmp_path / "motor.toml").write_text(MOTOR, "utf-8")
    (beam,) = load_bench(file).gantry
    assert beam.square_error_rad != 0.0
    with pytest.raises(NotAllowed) as refused:
        DemoBench(file, tmp_path / "wires", defects=("R=coupling_loose",))
    assert refused.value.code == "virtual.bench-file-defect-needs"


def test_the_bench_with_a_gantry_has_a_place_for_every_defect(tmp_path: Path) -> None:
    """It is chosen by its name, unless a file is called so."""
    asked = ("Left=out_of_square", "Table=belt_worn", "Table=coupling_loose")
    bench = DemoBench(Path("gantry"), tmp_path / "wires", defects=asked)
    assert [name for name, _ in bench.planted] == ["Left", "Table", "Table"]
    (beam,) = bench.spec.gantry
    assert beam.square_error_rad != 0.0
    table = axis_of(bench, "Table").mechanics
    assert table.load_encoder is not None
    assert table.load[-1].backlash_rad > 0.0
    (healthy,) = DemoBench(Path("gantry"), tmp_path).spec.gantry
    assert healthy.square_error_rad == 0.0
    own = tmp_path / "gantry"
    own.write_text(GANTRY.replace('"L"', '"Own"'), "utf-8")
    (tmp_path / "motor.toml").write_text(MOTOR, "utf-8")
    assert load_bench(bench_file(own)).axis[0].name == "Own"
    assert bench_file(None) == STANDARD_BENCH


def test_every_defect_has_words_and_the_standard_bench_has_none() -> None:
    assert set(DEFECT_WORDS) == set(DEFECTS)
    assert all(not axis.defects for axis in load_bench(STANDARD_BENCH).axis)
