"""Other people's programs on our wire, and our link on theirs."""

from __future__ import annotations

import struct
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import EZMotionMMS2
import minimalmodbus
import pytest
import serial
from pymodbus.client import ModbusSerialClient
from pymodbus.server import ModbusSerialServer
from pymodbus.simulator import DataType as SimType
from pymodbus.simulator import SimData, SimDevice

from drivers.errors import Rejected
from drivers.link import Address
from drivers.virtual.wires.pty import PtyWire

from .conftest import OpenLink
from .shelf import ShelfDevice, serving


@contextmanager
def null_modem(first: Path, second: Path) -> Iterator[None]:
    """Two ports, each the other end of the other."""
    wires = (PtyWire(first), PtyWire(second))
    over = threading.Event()

    def pump(source: PtyWire, sink: PtyWire) -> None:
        while not over.is_set():
            if data := source.read(0.01):
                sink.write(data)

    for wire in wires:
        wire.open()
    threads = [threading.Thread(target=pump, args=pair) for pair in (wires, wires[::-1])]
    for thread in threads:
        thread.start()
    try:
        yield
    finally:
        over.set()
        for thread in threads:
            thread.join()
        for wire in wires:
            wire.close()


async def test_our_link_on_a_pymodbus_server(port: Path, opened: OpenLink) -> None:
    far = port.with_name("far")
    device = SimDevice(
        1, simdata=[SimData(0x6400, values=[1, 2, 3, 0x1234, 0x5678], datatype=SimType.REGISTERS)]
    )
    with null_modem(port, far):
        server = ModbusSerialServer(device, port=str(far))
        await server.serve_forever(background=True)  # it listens when this comes back
        try:
            link = await opened(f"modbus://{port}?timeout_ms=5000&retries=0")
            places = [Address(None, 0, "UINT16", 0x6400 + i) for i in (0, 1, 2)]
            long = Address(None, 0, "UINT32", 0x6403)
            assert await link.read_many(1, [*places, long]) == [
                b"\1\0",
                b"\2\0",
                b"\3\0",
                b"\x78\x56\x34\x12",
            ]
            await link.write(1, places[1], b"\xcd\xab")
            await link.write(1, long, b"\x01\x02\x03\x04")
            assert await link.read(1, places[1]) == b"\xcd\xab"
            assert await link.read(1, long) == b"\x01\x02\x03\x04"
            with pytest.raises(Rejected) as caught:
                await link.read(1, Address(None, 0, "UINT16", 0x100))
            assert caught.value.abort_code == 2
        finally:
            await server.shutdown()


def test_pymodbus_client_on_our_slave(port: Path) -> None:
    shelf = ShelfDevice()
    shelf.registers = {r: r for r in range(0x30, 0x40)}
    shelf.read_only_registers = {0x3F}
    with serving(port, {1: shelf}, by_table=True):
        client = ModbusSerialClient(str(port), baudrate=115_200, timeout=1)
        assert client.connect()
        try:
            assert client.read_holding_registers(0x30, count=16).registers == list(
                range(0x30, 0x40)
            )
            assert not client.write_register(0x31, 0xBEEF).isError()
            assert not client.write_registers(0x32, [1, 2, 3]).isError()
            assert client.read_holding_registers(0x31, count=4).registers == [0xBEEF, 1, 2, 3]
            assert client.read_holding_registers(0x99).exception_code == 2
            assert client.write_register(0x3F, 1).exception_code == 4
            # A function code that the slave does not know: refused, not ignored.
            assert client.read_input_registers(0x30).exception_code == 1
        finally:
            client.close()


def test_minimalmodbus_on_our_slave(port: Path) -> None:
    shelf = ShelfDevice()
    with serving(port, {5: shelf}):
        instrument = minimalmodbus.Instrument(str(port), 5)
        instrument.serial.timeout = 0.1
        try:
            instrument.write_register(0x6400, 0x1F)
            assert instrument.read_register(0x6400) == 0x1F
            with pytest.raises(minimalmodbus.SlaveReportedException):
                instrument.write_register(0x6410, 1, functioncode=6)
            with pytest.raises(minimalmodbus.IllegalRequestError):
                instrument.read_register(0x0001)
        finally:
            instrument.serial.close()


@pytest.fixture
def ezm(
    port: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[tuple[EZMotionMMS2.Ezm, ShelfDevice]]:
    """EZmotion's own program, unchanged but for the parity, which a pty refuses."""
    monkeypatch.setattr(serial, "PARITY_EVEN", serial.PARITY_NONE)
    shelf = ShelfDevice()
    with serving(port, {1: shelf}):
        motor = EZMotionMMS2.Ezm(str(port), 1, 115_200)
        yield motor, shelf
        motor.Ezm.serial.close()


def test_ezmotion_package_finds_every_object_where_it_looks(
    ezm: tuple[EZMotionMMS2.Ezm, ShelfDevice],
) -> None:
    motor, shelf = ezm
    motor.Set_Op_Mode("POSITION ABS")
    assert shelf.objects[0x6060, 0] == b"\x01"
    assert motor.Read_Op_Mode() == "Operation Mode Selected = 1 (POSITION ABSOLUTE)"
    motor.Enable_Motor()
    assert shelf.objects[0x6040, 0] == b"\x0f\0"
    motor.Set_Target_Position(10, 180, "CW")
    # 10.5 revolutions of 65536 increments, clockwise negative.
    assert shelf.objects[0x607A, 0] == struct.pack("<i", -10 * 65536 - 32768)
    motor.Homing_Method(-3)
    assert shelf.objects[0x6098, 0] == b"\xfd"
    motor.Homing_Torque(300)
    assert shelf.objects[0x2070, 1] == struct.pack("<H", 300)
    motor.Homing_Switch_Speed(60)
    motor.Homing_Zero_Speed(30)
    assert shelf.objects[0x6099, 1] == struct.pack("<I", 65536)
    assert shelf.objects[0x6099, 2] == struct.pack("<I", 32768)
    shelf.objects[0x6064, 0] = struct.pack("<i", 3 * 65536 + 16384)
    assert motor.Read_Actual_Position() == (3, 90)
    shelf.objects[0x6041, 0] = struct.pack("<H", 1 << 10)
    assert motor.Pos_Target_Check_Flag()
