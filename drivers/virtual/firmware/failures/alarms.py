"""Active faults and warnings of one drive, their reset, and the history of past ones.

Faults have two sources: protections of the 50 µs loop, as bits, and entries of the profile's table
that the firmware or a test raises by their code. Both are reported by the same table.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Final

from drivers.virtual.firmware.axis import VirtualAxis
from drivers.virtual.firmware.cia402.base import FaultInfo
from drivers.virtual.firmware.kernel import layout as k
from profiles.schema import Fault, Profile


@dataclass(frozen=True, slots=True)
class Snapshot:
    """Measured values at the time of a fault; currents are instantaneous phase values."""

    bus_v: float = 0.0
    current_u_a: float = 0.0
    current_v_a: float = 0.0
    current_w_a: float = 0.0
    demand_q_a: float = 0.0
    current_q_a: float = 0.0
    speed_rpm: float = 0.0
    position: float = 0.0
    temperature_c: float = 0.0
    running_s: float = 0.0
    inputs: int = 0
    outputs: int = 0
    state_bits: int = 0
    """Running, forward, standstill: bits 0 to 2 of the M6-L's P11.11."""


@dataclass(frozen=True, slots=True)
class Record:
    """One past fault: code of 603Fh, the drive's own number (0: none), and the snapshot."""

    error_code: int
    number: int
    snapshot: Snapshot


EMPTY: Final = Record(0, 0, Snapshot())


@dataclass
class FaultLog:
    """Past faults, newest first. Preserved over a power cycle, as in the drive's own memory."""

    size: int = 20
    records: list[Record] = field(default_factory=list)

    def add(self, record: Record) -> None:
        """Add a record, keeping only the newest."""
        self.records = [record, *self.records][: self.size]

    def at(self, place: int) -> Record:
        """Return a record by its age, 0 the newest; an empty one if there is none."""
        return self.records[place] if 0 <= place < len(self.records) else EMPTY

    def clear(self) -> None:
        """Delete all records."""
        self.records.clear()


class Alarms:
    """The active faults and warnings."""

    def __init__(
        self,
        profile: Profile,
        infos: Mapping[int, FaultInfo],
        axis: VirtualAxis,
        log: FaultLog,
        *,
        unknown_end: bool = False,
    ) -> None:
        self._unknown_end = unknown_end
        self._table = {fault.code: fault for fault in profile.faults}
        self._infos = infos
        self._axis = axis
        self.log = log
        self.active: dict[str, FaultInfo] = {}
        """Faults by their code in the table, oldest first."""
        self.warnings: dict[str, Fault] = {}
        self.cleared_by_step: set[str] = set()
        """Faults whose own remedy was applied (an encoder reset …), so that a reset ends them."""

    def find(self, code: str) -> Fault | None:
        """Return an entry of the table by its code."""
        return self._table.get(code)

    def find_raw(self, error_code: int) -> Fault | None:
        """Return the first fault (not a warning) with this value of 603Fh."""
        return next(
            (f for f in self._table.values() if f.code_raw == error_code and f.kind == "fault"),
            None,
        )

    def info_of(self, fault: Fault) -> FaultInfo:
        """Return how an entry of the table is reported."""
        for info in self._infos.values():
            if info.fault == fault.code:
                return info
        return FaultInfo(fault.code_raw or 0, fixed=True, fault=fault.code)

    def of_bits(self, bits: int) -> list[FaultInfo]:
        """Return the reports of protections, lowest bit first."""
        return [
            self._infos.get(1 << i, FaultInfo(0)) for i in range(bits.bit_length()) if bits >> i & 1
        ]

    def add(self, infos: Iterable[FaultInfo], snapshot: Callable[[], Snapshot]) -> list[FaultInfo]:
        """Add faults; new ones are recorded and returned."""
        new = [info for info in infos if info.name not in self.active]
        for info in new:
            self.active[info.name] = info
            self.log.add(Record(info.code, number_of(info.fault), snapshot()))
        return new

    @property
    def error_code(self) -> int:
        """603Fh: the newest fault with a code, else the newest warning with one."""
        if not self.active and not self.warnings:
            return 0
        codes = [info.code for info in self.active.values() if info.code]
        if not codes:
            codes = [w.code_raw for w in self.warnings.values() if w.code_raw is not None]
        return codes[-1] if codes else 0

    @property
    def error_register(self) -> int:
        """1001h."""
        found = 0
        for info in self.active.values():
            found |= info.error_register
        return found

    def warn(self, code: str | None, on: bool = True) -> None:
        """Switch a warning of the table on or off; no effect for a code missing there."""
        fault = self._table.get(code or "")
        if fault is None:
            return
        if on:
            self.warnings[fault.code] = fault
        else:
            self.warnings.pop(fault.code, None)

    def resettable(self) -> bool:
        """Return whether a fault reset ends all active faults (ignoring live causes)."""
        return all(self._ends(info) for info in self.active.values())

    def _ends(self, info: FaultInfo) -> bool:
        fault = self._table.get(info.fault)
        if fault is None or fault.reset_by in ("command", "automatic"):
            return True
        if fault.reset_by == "unknown":
            return self._unknown_end
        return fault.reset_by == "special" and fault.code in self.cleared_by_step

    def clear(self) -> None:
        """Clear all faults after a reset."""
        self.active.clear()
        self.cleared_by_step.clear()


def number_of(code: str) -> int:
    """Return the number in a code such as Er.013, AL.247, Err4 or 1007; 0 without one."""
    if code.startswith("0x"):
        return int(code, 16)
    digits = "".join(c for c in code if c.isdigit())
    return int(digits) if digits else 0


def snapshot_of(
    axis: VirtualAxis, position: float, *, inputs: int = 0, outputs: int = 0
) -> Snapshot:
    """Return present measurements; phase currents from the field-oriented q-axis current."""
    s = axis.s
    rms = float(s[k.S_CURRENT])
    angle = axis.motor.pole_pairs * axis.angle_rad
    u, v, w = (-math.sqrt(2) * rms * math.sin(angle - turn * 2 * math.pi / 3) for turn in (0, 1, 2))
    return Snapshot(
        bus_v=float(s[k.S_VOLTAGE]),
        current_u_a=u,
        current_v_a=v,
        current_w_a=w,
        demand_q_a=float(s[k.S_TORQUE_COMMAND]) / axis.motor.torque_constant,
        current_q_a=rms,
        speed_rpm=axis.speed_rad_s * 30 / math.pi,
        position=position,
        temperature_c=float(s[k.S_TEMPERATURE]),
        running_s=float(s[k.S_STEP]) * k.STEP_S,
        inputs=inputs,
        outputs=outputs,
        state_bits=int(axis.powered) | (axis.speed_rad_s >= 0) << 1 | bool(s[k.S_ZERO_T] > 0) << 2,
    )
