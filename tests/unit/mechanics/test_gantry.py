"""Two virtual drives on one beam, against equations of motion that are written down apart."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

from drivers.errors import NotAllowed
from drivers.virtual.bench import load_bench
from drivers.virtual.firmware.factory import make_device
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.motion.gantry import VirtualGantry
from drivers.virtual.firmware.servo import VirtualServo
from drivers.virtual.mechanics import GantrySpec, MechanicsSpec, gantry_response
from tests.unit.analysis.gantry_plant import Gantry

TRUTH = Gantry(off_centre=0.2, motors=(5e-5, 6e-5))
SPEC = GantrySpec(
    axes=("L", "R"),
    inertia_kgm2=TRUTH.beam,
    yaw_inertia_kgm2=TRUTH.yaw,
    off_centre=TRUTH.off_centre,
    joint_stiffness_nm_per_rad=TRUTH.joints[0],
    joint_damping_nms_per_rad=TRUTH.joint_damping,
    yaw_stiffness_nm_per_rad=TRUTH.yaw_stiffness,
    yaw_damping_nms_per_rad=TRUTH.yaw_damping,
)


def motor(inertia: float, coulomb: float = 0.0, *, brake: bool = False) -> MechanicsSpec:
    return MechanicsSpec.model_validate(
        {
            "motor": {
                "inertia_kgm2": inertia,
                "rated_torque_nm": 1.27,
                "rated_speed_rpm": 3000,
                "brake": brake,
            },
            "friction": {"viscous_nms": 2e-4, "coulomb_nm": coulomb},
        }
    )


def pair(
    spec: GantrySpec = SPEC, coulomb: float = 0.0, *, brake: bool = False
) -> tuple[VirtualServo, VirtualServo, VirtualGantry]:
    first, second = (
        make_device("mms7", motor(inertia, coulomb, brake=brake), station=station)
        for station, inertia in enumerate(TRUTH.motors, 1)
    )
    assert isinstance(first, VirtualServo)
    assert isinstance(second, VirtualServo)
    return first, second, VirtualGantry(spec, first, second)


def test_the_response_is_that_of_the_equations() -> None:
    f = np.geomspace(1.0, 500.0, 50)
    motors = (motor(TRUTH.motors[0]), motor(TRUTH.motors[1]))
    assert np.allclose(gantry_response(SPEC, motors, f), TRUTH.response(f), rtol=1e-9)


def test_a_torque_on_one_motor_moves_both_as_the_equations_say() -> None:
    first, second, gantry = pair()
    first.advance(0)
    first.axis.run_torque(0.1, 1e9)
    second.axis.run_torque(0.0, 1e9)
    # The same machine with the current loop as one more state, and exact for a constant torque.
    corner = first.axis.current_loop_rad_s
    mass, _, _ = TRUTH.matrices()
    whole = np.zeros((10, 10))
    whole[:8, :8] = TRUTH.state()
    whole[4:8, 8] = np.linalg.inv(mass)[:, 0]
    whole[8, 8], whole[8, 9] = -corner, corner
    start = np.zeros(10)
    start[9] = 0.1
    for steps in (40, 200, 1000):
        first.advance(steps * k.STEP_NS)
        truth = expm(whole * (steps * k.STEP_S)) @ start
        # States of the equations: angles of motors, mean and difference, then their speeds.
        assert gantry.x[0] == pytest.approx(truth[0], rel=1e-3)
        assert gantry.x[3] == pytest.approx(truth[1], rel=1e-3, abs=1e-7)
        assert gantry.x[[1, 4, 7, 9]] == pytest.approx(truth[4:8], rel=1e-3, abs=1e-4)


def test_both_drives_are_at_the_same_time_whichever_is_asked() -> None:
    first, second, _ = pair()
    first.advance(0)
    second.advance(7_000_000)
    assert first.axis.s[k.S_STEP] == second.axis.s[k.S_STEP] == 140
    first.advance(7_000_000)
    assert first.axis.s[k.S_STEP] == 140
    first.advance(9_000_000)
    assert second.axis.s[k.S_STEP] == 180
    assert second.axis.angle_rad == pytest.approx(0.0, abs=1e-6)


def test_a_beam_out_of_square_is_held_by_brakes_and_released_to_its_rest_without() -> None:
    spec = SPEC.model_copy(update={"square_error_rad": 0.3})
    first, second, _ = pair(spec, brake=True)
    first.advance(0)
    first.advance(500_000_000)
    assert (first.axis.angle_rad, second.axis.angle_rad) == pytest.approx((0.0, 0.0), abs=1e-6)
    first, second, gantry = pair(spec)
    first.advance(0)
    first.advance(3_000_000_000)
    assert first.axis.angle_rad - second.axis.angle_rad == pytest.approx(0.3, abs=0.003)
    assert gantry.x[8] == pytest.approx(0.3, abs=0.003)


def test_motors_that_hold_their_place_press_against_each_other() -> None:
    """Half the difference of both torques: the joints and the guides in series."""
    spec = SPEC.model_copy(update={"square_error_rad": 0.3})
    first, second, _ = pair(spec)
    first.advance(0)
    for servo in (first, second):
        servo.axis.hold(0.0)
    first.advance(4_000_000_000)
    joints = TRUTH.joints[0] / 2
    stiffness = joints * TRUTH.yaw_stiffness / (joints + TRUTH.yaw_stiffness)
    half = 0.5 * (first.axis.torque_nm - second.axis.torque_nm)
    assert abs(first.axis.angle_rad - second.axis.angle_rad) < 0.01
    assert half == pytest.approx(-0.3 * stiffness, rel=0.05)
    assert first.axis.torque_nm == pytest.approx(-second.axis.torque_nm, abs=0.01)


def test_a_shaft_that_is_turned_by_hand_takes_the_beam_along() -> None:
    first, second, gantry = pair()
    first.inject("turn_to_rev", 1.0)
    assert gantry.x[0] == pytest.approx(math.tau)
    assert gantry.x[6] == pytest.approx(math.pi)
    assert second.axis.angle_rad == 0.0


def test_friction_of_one_motor_holds_it_while_the_other_moves_on_the_joints() -> None:
    first, _, gantry = pair(coulomb=0.05)
    first.advance(0)
    first.axis.run_torque(0.06, 1e9)
    first.advance(400_000_000)
    # The joints carry less than friction: motor 2 stands exactly, motor 1 has left its place.
    assert gantry.x[3] == 0.0
    assert first.axis.angle_rad > 0.001


AXIS = '[[axis]]\nname = "{name}"\ndrive = "mms7"\non = "{on}"\nstation = {station}\n'
MOTOR = (
    "[axis.mechanics.motor]\ninertia_kgm2 = 5e-5\nrated_torque_nm = 1.27\nrated_speed_rpm = 3000\n"
)
BEAM = (
    '[[gantry]]\naxes = ["L", "R"]\ninertia_kgm2 = 2e-4\nyaw_inertia_kgm2 = 4e-5\n'
    "joint_stiffness_nm_per_rad = 25.0\n"
)


def bench(tmp_path: Path, *parts: str) -> Path:
    file = tmp_path / "bench.toml"
    file.write_text("\n".join(parts), "utf-8")
    return file


def axis(name: str, station: int, on: str = "ethercat://virtual0") -> str:
    return AXIS.format(name=name, on=on, station=station) + MOTOR


def test_a_bench_describes_a_gantry(tmp_path: Path) -> None:
    found = load_bench(bench(tmp_path, axis("L", 1), axis("R", 2), BEAM))
    assert found.gantry[0].axes == ("L", "R")


@pytest.mark.parametrize(
    ("parts", "code"),
    [
        ((axis("L", 1), axis("Q", 2), BEAM), "virtual.bench-file-gantry-axes"),
        ((axis("L", 1), axis("R", 2), BEAM, BEAM), "virtual.bench-file-gantry-axes"),
        (
            (axis("L", 1, "mlink://virtual0"), axis("R", 2, "mlink://virtual0"), BEAM),
            "virtual.bench-file-gantry-bus",
        ),
        (
            (axis("L", 1), axis("R", 1, "ethercat://virtual1"), BEAM),
            "virtual.bench-file-gantry-bus",
        ),
        (
            (AXIS.format(name="L", on="ethercat://virtual0", station=1), axis("R", 2), BEAM),
            "virtual.bench-file-gantry-load",
        ),
    ],
)
def test_a_gantry_that_cannot_be_is_refused(
    tmp_path: Path, parts: tuple[str, ...], code: str
) -> None:
    with pytest.raises(NotAllowed) as refused:
        load_bench(bench(tmp_path, *parts))
    assert refused.value.code == code
