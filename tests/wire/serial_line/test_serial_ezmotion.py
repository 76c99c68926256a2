"""EZmotion's package moves the virtual MMS7, unchanged but for the parity that a pty refuses.

The drive's clock runs ten times as fast as ours, so that seconds of motion are tenths of a test.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path

import EZMotionMMS2
import pytest
import serial

from drivers.virtual.firmware.factory import make_device
from drivers.virtual.mechanics import FrictionSpec, MechanicsSpec, MotorSpec, TravelSpec
from drivers.virtual.wires.modbus import ModbusSlave, ObjectRegisters
from drivers.virtual.wires.pty import PtyWire

HASTE = 10
REV = 65536
FAULT = 1 << 3
HOMING_DONE = 1 << 12


@pytest.fixture
def motor(port: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[EZMotionMMS2.Ezm]:
    """The maker's program on a drive with end stops at −3 and +30 revolutions."""
    monkeypatch.setattr(serial, "PARITY_EVEN", serial.PARITY_NONE)
    device = make_device(
        "mms7",
        MechanicsSpec(
            motor=MotorSpec(inertia_kgm2=5e-5, rated_torque_nm=1.27, rated_speed_rpm=3000),
            friction=FrictionSpec(viscous_nms=2e-4, coulomb_nm=0.01),
            travel=TravelSpec(min_rev=-3, max_rev=30),
        ),
    )
    device.advance(0)
    device.advance(1_000_000)  # compiles the kernel where it is not in the cache yet
    begun_ns = time.monotonic_ns()
    slave = ModbusSlave(
        PtyWire(port),
        {1: (device, ObjectRegisters(device))},
        now_ns=lambda: 1_000_000 + HASTE * (time.monotonic_ns() - begun_ns),
    )
    slave.start()
    ezm = EZMotionMMS2.Ezm(str(port), 1, 115_200)
    try:
        yield ezm
    finally:
        ezm.Ezm.serial.close()
        slave.stop()


def until(condition: Callable[[], bool], drive_s: float) -> None:
    """Wait for a condition, at most so many seconds of the drive's time (and some of ours)."""
    end = time.monotonic() + drive_s / HASTE + 5
    while not condition():
        assert time.monotonic() < end, "did not happen in time"


def revolutions(motor: EZMotionMMS2.Ezm) -> float:
    value: int = motor.Read_32bit_Reg(EZMotionMMS2.POSITION_ACTUAL_REG, True)
    return value / REV


def test_position_mode(motor: EZMotionMMS2.Ezm) -> None:
    """The package's Example_Position_mode: 10.5 revolutions forth, 5.5 back."""
    start = revolutions(motor)
    motor.Shutdown()
    motor.Set_Op_Mode("POSITION REL")
    assert motor.Read_Op_Mode() == "Operation Mode Selected = 1 (POSITION RELATIVE)"
    motor.Enable_Motor()
    for turns, direction, goal in ((10, "CCW", 10.5), (5, "CW", 5.0)):
        motor.Set_Target_Position(turns, 180, direction)
        motor.Update()
        until(lambda goal=goal: abs(revolutions(motor) - start - goal) < 0.01, 10)  # type: ignore[misc]
        until(motor.Pos_Target_Check_Flag, 1)
    motor.Disable_Motor()
    assert not motor.Read_Status_Word() & FAULT


def test_speed_mode(motor: EZMotionMMS2.Ezm) -> None:
    """Example_Speed_mode, slower: the axis here has an end."""
    motor.Shutdown()
    motor.Set_Op_Mode("SPEED")
    motor.Set_Acceleration(3000)
    motor.Set_Deceleration(3000)
    motor.Set_Target_Velocity(300)
    motor.Enable_Motor()
    until(lambda: abs(motor.Read_Actual_Velocity() - 300) <= 3, 2)
    motor.Set_Target_Velocity(-120)
    until(lambda: abs(motor.Read_Actual_Velocity() + 120) <= 3, 2)
    motor.Disable_Motor()
    assert motor.Read_Op_Mode() == "Operation Mode Selected= 3 (SPEED)"
    assert not motor.Read_Status_Word() & FAULT


def test_torque_mode(motor: EZMotionMMS2.Ezm) -> None:
    """Example_Torque_mode: 30 ‰ of 1.27 Nm overcome 0.01 Nm of friction and turn the shaft."""
    motor.Shutdown()
    motor.Set_Op_Mode("TORQUE")
    motor.Set_Target_Torque(30)
    start = revolutions(motor)
    motor.Enable_Motor()
    until(lambda: abs(motor.Read_Actual_Torque() - 30) <= 5, 2)
    until(lambda: revolutions(motor) > start + 1, 3)
    motor.Disable_Motor()


def test_homing_mode(motor: EZMotionMMS2.Ezm) -> None:
    """Example_Homing_mode: method −3, against the negative end stop three revolutions away."""
    motor.Shutdown()
    motor.Set_Op_Mode("HOMING")
    motor.Homing_Method(-3)
    motor.Homing_Torque(200)
    motor.Homing_Switch_Speed(120)
    motor.Homing_Zero_Speed(60)
    motor.Homing_Acceleration(3000)
    start = revolutions(motor)
    motor.Enable_Motor()
    motor.Update()
    until(lambda: bool(motor.Read_Status_Word() & HOMING_DONE), 15)
    # The stop is the new zero: what was `start` is now three revolutions away from it.
    assert abs(revolutions(motor)) < 0.2
    assert start == pytest.approx(0, abs=0.01)
    motor.Disable_Motor()
