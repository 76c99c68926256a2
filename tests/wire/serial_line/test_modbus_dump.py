"""How the registers of manual 003 are read together."""

from __future__ import annotations

from pathlib import Path

from backend.axes.drive.drive import Drive
from backend.axes.drive.ports import Port
from profiles import load_profile

from .conftest import OpenLink
from .shelf import ShelfDevice, serving


async def test_a_whole_ds_c_takes_few_requests_and_no_unnamed_register(
    port: Path, opened: OpenLink
) -> None:
    profile = load_profile("ds_c")
    spec = profile.link("modbus")
    assert spec is not None
    # The manual prints no greatest count: 125 is MODBUS V1.1b3, clause 6.3.
    assert (spec.max_registers, spec.max_gap) == (125, 0)
    readable = [p for p in profile.parameters if p.modbus_register is not None and p.access != "wo"]
    named = {
        (p.modbus_register or 0) + extra for p in readable for extra in range(_registers(p.type))
    }
    runs = sum(1 for register in named if register - 1 not in named)
    shelf = ShelfDevice()
    shelf.registers = {register: register & 0x7F for register in named}
    with serving(port, {1: shelf}, by_table=True) as slave:
        link = await opened(f"modbus://{port}?silence_us=0")
        drive = Drive("z", "Z", profile, [Port(link, 1, spec)])
        link.attach(1, profile)  # type: ignore[attr-defined]
        readings = await drive.read_many([p.key for p in readable])
        assert not [r.error for r in readings.values() if r.error]
        # One request for each run of neighbours, and one more where a batch ends inside a run.
        # A register without a name is answered with exception 2 here, and would cost requests.
        assert slave.requests <= runs + 1
        assert runs < len(readable) / 4


def _registers(kind: str) -> int:
    return 2 if kind.endswith("32") else 1
