"""A small MMS7 dictionary of our own, so that these tests do not hang on the whole profile.

Types, ranges and defaults are those of manual 004 (chapter 8 and 9).
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from typing import Any

from drivers.virtual.firmware.servo import VirtualServo
from drivers.virtual.mechanics import FrictionSpec, MechanicsSpec, MotorSpec
from profiles.schema import Identity, Parameter, PdoSpec, Profile, StiffnessTable, UnitSpec

NOW, SETTINGS = "now", "write_settings"

# key, type, access, pdo, effective, default[, min, max]
ROWS: list[tuple[Any, ...]] = [
    ("2001:01", "UINT32", "rw", "none", SETTINGS, 0),
    ("2001:02", "UINT32", "rw", "none", SETTINGS, 0),
    ("2001:03", "UINT32", "rw", "none", SETTINGS, 0),
    ("2001:04", "UINT8", "rw", "none", SETTINGS, 4),
    ("2001:05", "UINT32", "rw", "none", SETTINGS, 0),
    ("2001:06", "UINT32", "rw", "none", SETTINGS, 0),
    ("2001:07", "UINT32", "rw", "none", SETTINGS, 36000),
    ("2001:08", "UINT32", "rw", "none", SETTINGS, 5000),
    ("2001:09", "UINT32", "rw", "none", SETTINGS, 3000),
    ("2001:0A", "UINT16", "rw", "none", SETTINGS, 0),
    ("2001:0B", "UINT16", "rw", "none", SETTINGS, 0),
    ("2002:05", "UINT16", "rw", "none", SETTINGS, 200, 0, 500),
    ("2002:06", "UINT16", "rw", "none", SETTINGS, 10, 0, 500),
    ("2003:06", "UINT8", "rw", "none", SETTINGS, 0, 0, 2),
    ("2004:01", "UINT8", "rw", "none", SETTINGS, 0),
    ("2004:04", "UINT8", "rw", "none", SETTINGS, 100, 0, 200),
    ("2004:05", "UINT16", "rw", "none", SETTINGS, 0),
    ("2004:06", "UINT8", "rw", "none", SETTINGS, 100, 0, 200),
    ("2004:07", "UINT16", "rw", "none", SETTINGS, 0),
    ("2005:01", "UINT16", "rw", "none", SETTINGS, 200, 1, 2000),
    ("2005:02", "UINT16", "rw", "none", SETTINGS, 200, 1, 2000),
    ("2005:03", "UINT16", "rw", "none", SETTINGS, 2000, 1, 5000),
    ("2005:04", "UINT16", "rw", "none", SETTINGS, 100, 1, 500),
    ("2005:05", "UINT16", "rw", "none", SETTINGS, 10000, 2000, 20000),
    ("2005:06", "UINT32", "rw", "none", SETTINGS, 3000),
    ("2005:07", "UINT16", "rw", "none", SETTINGS, 3000),
    ("2005:08", "UINT32", "rw", "none", SETTINGS, 3000),
    ("2005:09", "UINT16", "rw", "none", SETTINGS, 0),
    ("2005:0A", "UINT32", "rw", "none", SETTINGS, 0),
    ("2005:0B", "UINT16", "rw", "none", SETTINGS, 1),
    ("2005:0C", "UINT16", "rw", "none", SETTINGS, 2000, 1, 5000),
    ("2005:0D", "UINT16", "rw", "none", SETTINGS, 100, 1, 500),
    ("2005:0E", "UINT16", "rw", "none", SETTINGS, 0),
    ("2005:0F", "UINT16", "rw", "none", SETTINGS, 13, 0, 31),
    ("2005:12", "UINT16", "rw", "none", SETTINGS, 0, 0, 1),
    ("2005:13", "UINT16", "rw", "none", SETTINGS, 200, 1, 2000),
    ("2005:14", "UINT16", "rw", "none", SETTINGS, 1000, 1, 5000),
    ("2005:15", "UINT16", "rw", "none", SETTINGS, 100, 1, 500),
    ("2007:01", "UINT16", "rw", "none", SETTINGS, 2000, 1000, 20000),
    ("2007:02", "UINT16", "rw", "none", SETTINGS, 10000, 1000, 20000),
    ("2007:05", "UINT16", "rw", "none", SETTINGS, 10000, 1000, 20000),
    ("2008:01", "UINT8", "rw", "none", SETTINGS, 0),
    *((f"2008:{sub:02X}", "UINT16", "rw", "none", SETTINGS, 0) for sub in range(2, 18)),
    ("200B:01", "UINT8", "rw", "none", SETTINGS, 0),
    ("200B:02", "UINT16", "rw", "none", SETTINGS, 20),
    ("200B:03", "UINT16", "rw", "none", SETTINGS, 12, 8, 30),
    ("200B:04", "UINT32", "rw", "none", SETTINGS, 182),
    ("200B:06", "UINT16", "rw", "none", SETTINGS, 1000),
    ("200B:07", "UINT8", "rw", "none", SETTINGS, 0, 0, 1),
    ("200B:08", "UINT16", "rw", "none", SETTINGS, 3000),
    ("200B:09", "UINT16", "rw", "none", SETTINGS, 56),
    ("200B:0A", "UINT16", "rw", "none", SETTINGS, 52),
    ("200B:0B", "UINT16", "ro", "tx", NOW, 0),
    ("200B:0C", "UINT32", "rw", "none", SETTINGS, 3600),
    ("200B:0D", "UINT32", "rw", "none", SETTINGS, 1000),
    ("200B:0E", "UINT16", "rw", "none", SETTINGS, 10),
    ("200C:01", "UINT8", "rw", "none", NOW, 0, 0, 1),
    ("200C:02", "UINT16", "rw", "none", NOW, 50),
    ("200C:03", "UINT16", "rw", "none", NOW, 10),
    ("200C:04", "UINT16", "rw", "none", NOW, 10),
    ("200C:05", "UINT8", "ro", "none", NOW, 0),
    *((f"200C:{sub:02X}", "UINT32", "ro", "none", NOW, 0) for sub in range(6, 13)),
    ("200D:00", "UINT32", "rw", "none", NOW, 0),
    ("200E:02", "INT16", "ro", "tx", NOW, 0),
    ("200E:0C", "UINT16", "ro", "none", NOW, 0),
    *((f"2030:{sub:02X}", "UINT8", "rw", "none", SETTINGS, 0, 0, 4) for sub in range(1, 7)),
    ("2031:01", "UINT16", "rw", "none", SETTINGS, 0),
    ("2031:02", "UINT16", "rw", "none", SETTINGS, 0),
    ("2031:03", "UINT16", "rw", "none", SETTINGS, 0),
    ("2040:00", "INT16", "ro", "tx", NOW, 0),
    ("2041:00", "INT16", "rw", "none", SETTINGS, 85, -40, 125),
    ("2042:01", "UINT8", "rw", "none", SETTINGS, 0),
    ("2042:02", "UINT16", "rw", "none", SETTINGS, 3000, 0, 3000),
    ("2042:03", "UINT16", "rw", "none", SETTINGS, 1000),
    ("2070:01", "UINT16", "rw", "none", NOW, 500),
    ("2070:02", "UINT16", "rw", "none", NOW, 500),
    ("2070:03", "UINT16", "rw", "none", NOW, 100),
    *((f"2080:{sub:02X}", "REAL32", "rw", "rx", NOW, 0) for sub in (1, 2, 3, 5, 6)),
    ("2080:04", "REAL32", "rw", "none", NOW, 1000),
    ("2108:01", "UINT8", "rw", "none", SETTINGS, 0, 0, 1),
    ("603F:00", "UINT16", "ro", "tx", NOW, 0),
    ("6040:00", "UINT16", "rw", "rx", NOW, 0),
    ("6041:00", "UINT16", "ro", "tx", NOW, 0),
    ("605A:00", "INT16", "rw", "none", NOW, 2, 0, 8),
    ("605B:00", "INT16", "rw", "none", NOW, 0, 0, 1),
    ("605C:00", "INT16", "rw", "none", NOW, 0, 0, 1),
    ("605D:00", "INT16", "rw", "none", NOW, 1, 0, 4),
    ("605E:00", "INT16", "rw", "none", NOW, 0, 0, 4),
    ("6060:00", "INT8", "rw", "rx", NOW, 0, -4, 10),
    ("6061:00", "INT8", "ro", "tx", NOW, 0),
    ("6062:00", "INT32", "ro", "tx", NOW, 0),
    ("6063:00", "INT32", "ro", "tx", NOW, 0),
    ("6064:00", "INT32", "ro", "tx", NOW, 0),
    ("6065:00", "UINT32", "rw", "rx", NOW, 182),
    ("6066:00", "UINT32", "rw", "rx", NOW, 10),
    ("6067:00", "UINT32", "rw", "rx", NOW, 182),
    ("6068:00", "UINT16", "rw", "rx", NOW, 10),
    ("606B:00", "INT32", "ro", "tx", NOW, 0),
    ("606C:00", "INT32", "ro", "tx", NOW, 0),
    ("606D:00", "UINT16", "rw", "rx", NOW, 65535),
    ("606E:00", "UINT16", "rw", "rx", NOW, 10),
    ("606F:00", "UINT16", "rw", "rx", NOW, 65535),
    ("6070:00", "UINT16", "rw", "rx", NOW, 10),
    ("6071:00", "INT16", "rw", "rx", NOW, 0, -3000, 3000),
    ("6072:00", "UINT16", "rw", "rx", NOW, 3000, 0, 3000),
    ("6073:00", "UINT16", "rw", "rx", NOW, 3000, 0, 3000),
    ("6074:00", "INT16", "ro", "tx", NOW, 0),
    ("6077:00", "INT16", "ro", "tx", NOW, 0),
    ("6079:00", "UINT32", "ro", "tx", NOW, 0),
    ("607A:00", "INT32", "rw", "rx", NOW, 0),
    ("607B:01", "INT32", "rw", "rx", NOW, -(2**31)),
    ("607B:02", "INT32", "rw", "rx", NOW, 2**31 - 1),
    ("607C:00", "INT32", "rw", "rx", NOW, 0),
    ("607D:01", "INT32", "rw", "rx", NOW, -(2**31)),
    ("607D:02", "INT32", "rw", "rx", NOW, 2**31 - 1),
    ("607E:00", "UINT8", "rw", "none", NOW, 0),
    ("607F:00", "UINT32", "rw", "rx", NOW, 3276800),
    ("6080:00", "UINT32", "rw", "rx", NOW, 3000),
    ("6081:00", "UINT32", "rw", "rx", NOW, 655360),
    ("6083:00", "UINT32", "rw", "rx", NOW, 3276800),
    ("6084:00", "UINT32", "rw", "rx", NOW, 3276800),
    ("6085:00", "UINT32", "rw", "rx", NOW, 3276800),
    ("6087:00", "UINT32", "rw", "rx", NOW, 3000),
    ("6091:01", "UINT32", "rw", "none", NOW, 1),
    ("6091:02", "UINT32", "rw", "none", NOW, 1),
    ("6092:01", "UINT32", "rw", "none", NOW, 65536),
    ("6092:02", "UINT32", "rw", "none", NOW, 1),
    ("6098:00", "INT8", "rw", "rx", NOW, 0, -3, 37),
    ("6099:01", "UINT32", "rw", "rx", NOW, 655360),
    ("6099:02", "UINT32", "rw", "rx", NOW, 65536),
    ("609A:00", "UINT32", "rw", "rx", NOW, 0),
    ("60B0:00", "INT32", "rw", "rx", NOW, 0),
    ("60B1:00", "INT32", "rw", "rx", NOW, 0),
    ("60B2:00", "INT16", "rw", "rx", NOW, 0),
    ("60B8:00", "UINT16", "rw", "rx", NOW, 0),
    ("60B9:00", "UINT16", "ro", "tx", NOW, 0),
    ("60BA:00", "INT32", "ro", "tx", NOW, 0),
    ("60BB:00", "INT32", "ro", "tx", NOW, 0),
    ("60C2:01", "UINT8", "rw", "none", NOW, 1, 1, 255),
    ("60C2:02", "INT8", "rw", "none", NOW, -3, -4, -3),
    ("60C5:00", "UINT32", "rw", "rx", NOW, 2**32 - 1),
    ("60C6:00", "UINT32", "rw", "rx", NOW, 2**32 - 1),
    ("60E0:00", "UINT16", "rw", "rx", NOW, 3000, 0, 3000),
    ("60E1:00", "UINT16", "rw", "rx", NOW, 3000, 0, 3000),
    ("60F2:00", "UINT16", "rw", "rx", NOW, 0),
    ("60F4:00", "INT32", "ro", "tx", NOW, 0),
    ("60FD:00", "UINT32", "ro", "tx", NOW, 0),
    ("60FE:01", "UINT32", "rw", "rx", NOW, 0),
    ("60FE:02", "UINT32", "rw", "none", NOW, 0),
    ("60FF:00", "INT32", "rw", "rx", NOW, 0),
    ("1600:00", "UINT8", "rw", "none", NOW, 2),
    ("1600:01", "UINT32", "rw", "none", NOW, 0x60400010),
    ("1600:02", "UINT32", "rw", "none", NOW, 0x607A0020),
    ("1600:03", "UINT32", "rw", "none", NOW, 0),
    ("1C12:00", "UINT16", "rw", "none", NOW, 1),
    ("1C12:01", "UINT16", "rw", "none", NOW, 0x1600),
]


def small_profile() -> Profile:
    """The rows above as a Profile."""
    parameters = []
    for row in ROWS:
        key, kind, access, pdo, effective, default, *limits = row
        low, high = limits or (None, None)
        parameters.append(
            Parameter(
                key=key, name=key, group="test", type=kind, access=access, pdo=pdo,
                effective=effective, default_raw=default, min_raw=low, max_raw=high,
                unit="rpm" if key == "2005:06" else "", source="004:1",
            )
        )  # fmt: skip
    return Profile(
        drive="mms7",
        title="MMS7 for tests",
        manual="004",
        identity=Identity(maker="EZmotion", model="MMS7", vendor_id=0x1234, product_code=7),
        links=(),
        units=UnitSpec(counts_per_rev=65536),
        supported_modes=(1, 3, 4, 6, 8, 9, 10, -4),
        parameters=tuple(parameters),
        pdo=PdoSpec(
            sets=(), default_rx=0x1603, default_tx=0x1A03, max_entries=12, source="004:1055"
        ),
        stiffness=(
            StiffnessTable(
                level_key="2005:0F",
                columns=("2005:01", "2005:03", "2005:04"),
                rows={13: (77, 270, 76), 20: (329, 1150, 227)},
                source="004:3001",
            ),
        ),
    )


class Bench:
    """A drive with typed access and a clock of its own."""

    def __init__(self, servo: VirtualServo) -> None:
        self.servo = servo
        self.t_ns = 0
        servo.advance(0)

    def run(self, seconds: float) -> None:
        self.t_ns += round(seconds * 1e9)
        self.servo.advance(self.t_ns)

    def run_until(
        self, condition: Callable[[], bool], limit_s: float, step_s: float = 1e-3
    ) -> float:
        """Seconds until the condition holds; fails the test after ``limit_s``."""
        start = self.t_ns
        while not condition():
            assert self.t_ns - start < limit_s * 1e9, "condition not reached in time"
            self.run(step_s)
        return (self.t_ns - start) * 1e-9

    def get(self, key: str) -> int:
        index, sub = int(key[:4], 16), int(key[5:], 16)
        form = self.servo.od.find(index, sub).storage
        assert form is not None
        value: int = form.unpack(self.servo.read(index, sub))[0]
        return value

    def set(self, key: str, value: float) -> None:
        index, sub = int(key[:4], 16), int(key[5:], 16)
        form = self.servo.od.find(index, sub).storage
        assert form is not None
        self.servo.write(index, sub, form.pack(value))

    def apply(self, **_: None) -> None:
        """Write settings."""
        self.servo.write(0x200D, 0, struct.pack("<I", 0xAAB555AA))

    @property
    def status(self) -> int:
        return self.get("6041:00")

    def enable(self, mode: int) -> None:
        self.set("6060:00", mode)
        self.set("6040:00", 6)
        self.set("6040:00", 15)
        assert self.status & 0x6F == 0x27


def rigid(**changes: Any) -> MechanicsSpec:
    """Motor alone, 5e-5 kgm², 1.27 Nm, no friction, a quiet encoder."""
    return MechanicsSpec(
        motor=MotorSpec(inertia_kgm2=5e-5, rated_torque_nm=1.27, rated_speed_rpm=3000),
        friction=changes.pop("friction", FrictionSpec()),
        **changes,
    )


REV = 65536
TURN = 2 * math.pi
