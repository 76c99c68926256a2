"""Faults of one drive: their sources, their reactions, and their end."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

from drivers.virtual.firmware.cia402.base import FaultInfo
from drivers.virtual.firmware.cia402.states import State
from drivers.virtual.firmware.core import Core
from drivers.virtual.firmware.failures.alarms import Alarms, FaultLog, Snapshot, snapshot_of
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.schedule import Timer
from profiles.schema import Fault

_LIMIT_SWITCHES = k.SIG_NEGATIVE | k.SIG_POSITIVE

Emergency = tuple[int, int, bytes]


class Tripped(Protocol):
    """The part of device control that faults use."""

    state: State

    def trip(self, new: list[FaultInfo]) -> None:
        """React to faults: stop, then switch off and enter "fault"."""

    def stop_on_warning(self) -> None:
        """Brake and hold, for a protection that only warns and stops."""

    def retry_enable(self) -> None:
        """Enable again by itself after a reset, if the control word still commands it."""


class Faults:
    """Adds faults of protections and of the fault table, and resets them."""

    def __init__(self, core: Core, tripped: Tripped, log: FaultLog | None) -> None:
        self._core = core
        self._axis = core.axis
        self._traits = core.family.traits
        self._tripped = tripped
        self.alarms = Alarms(
            core.profile,
            self._traits.faults,
            core.axis,
            FaultLog(self._traits.history_size) if log is None else log,
            unknown_end=self._traits.unknown_faults_end,
        )
        self.emergencies: list[Emergency] = []
        self.levels: Callable[[], tuple[int, int]] = lambda: (0, 0)
        """Levels of inputs and outputs, for the record of a fault."""
        self._warns_of_limits = any(self._traits.limits.warnings)
        self._reported = 0
        self._since_s: dict[str, float] = {}
        self._retry_timer: Timer | None = None

    # --- coming ----------------------------------------------------------------------------
    def raise_bits(self, bits: int) -> None:
        """Raise the fault of a protection outside the 50 µs loop, or of a test."""
        self._axis.raise_fault(bits)
        self.look()

    def raise_entry(self, fault: Fault) -> None:
        """Raise a single entry of the fault table; warnings are only shown."""
        if fault.kind == "warning":
            self.alarms.warn(fault.code)
        else:
            self._take_in([self.alarms.info_of(fault)])

    def raise_code(self, code: str) -> bool:
        """Raise an entry by its code; return False if the table has none."""
        fault = self.alarms.find(code)
        if fault is not None:
            self.raise_entry(fault)
        return fault is not None

    def look(self) -> None:
        """Add faults that the 50 µs loop has found since the last call."""
        new = self._axis.faults & ~self._reported
        if not new:
            return
        self._reported |= new
        infos: list[FaultInfo] = []
        for i in range(new.bit_length()):
            if new >> i & 1:
                infos += self._reports(1 << i)
        self._take_in(infos)

    def _reports(self, bit: int) -> list[FaultInfo]:
        """Return the fault that a protection reports; empty if it only warns."""
        if bit == k.F_POSITION_LIMIT and any(self._traits.limits.faults):
            side = int(self._axis.s[k.S_SIGNALS]) & k.SIG_POSITIVE != 0
            fault = self.alarms.find(self._traits.limits.faults[side])
            return [] if fault is None else [self.alarms.info_of(fault)]
        choice = self._traits.choices.get(bit)
        if choice is not None:
            action = choice.actions.get(int(self._core.number(choice.key, -1)), choice.default)
            if action != "fault":
                self.alarms.warn(choice.warning)
                if action == "stop" and self._tripped.state is State.OPERATION_ENABLED:
                    self._tripped.stop_on_warning()
                return []
        return self.alarms.of_bits(bit)

    def _take_in(self, infos: list[FaultInfo]) -> None:
        new = self.alarms.add(infos, self._snapshot)
        if not new:
            return
        now_s = self._now_s()
        self._since_s |= {item.name: now_s for item in new}
        reported = next((item for item in new if item.code), new[0])
        status = self._axis.faults & 0xFFFF
        self.emergencies.append(
            (reported.code or 0xFF00, reported.error_register, status.to_bytes(5, "little"))
        )
        if self._tripped.state not in (State.FAULT, State.NOT_READY):
            self._tripped.trip(new)

    def _snapshot(self) -> Snapshot:
        inputs, outputs = self.levels()
        axis = self._axis
        return snapshot_of(
            axis, self._core.position_of(axis.angle_rad), inputs=inputs, outputs=outputs
        )

    def _now_s(self) -> float:
        return float(self._axis.s[k.S_STEP]) * k.STEP_S

    # --- going -----------------------------------------------------------------------------
    def reacted(self) -> None:
        """Schedule the automatic retry of some drives after the fault reaction (004:6221-6232)."""
        if self._core.number("200B:07") == 1:
            delay_s = self._core.number("200B:08", 3000) * 1e-3
            self._retry_timer = self._core.schedule.after(delay_s, self._retry)

    def _retry(self) -> None:
        self._retry_timer = None
        if self.reset():
            self._tripped.retry_enable()

    def reset(self) -> bool:
        """Leave the fault state if no cause is present and the faults allow it (004:5068-5073)."""
        if self._tripped.state is not State.FAULT:
            self.alarms.warnings.clear()
            self._reported &= self._axis.live_faults()
            self._axis.clear_faults()
            return False
        if self._axis.live_faults() or not self.alarms.resettable() or self._cooling():
            return False
        self._axis.clear_faults()
        self._reported = 0
        self._since_s.clear()
        self.alarms.clear()
        self.alarms.warnings.clear()
        if self._retry_timer is not None:
            self._retry_timer.cancel()
            self._retry_timer = None
        self._tripped.state = State.SWITCH_ON_DISABLED
        return True

    def _cooling(self) -> bool:
        """Return whether an active fault can only be reset after a time (000:3882)."""
        now_s = self._now_s()
        waits = self._traits.reset_after_s
        return any(
            now_s - since_s < waits.get(name, 0.0) for name, since_s in self._since_s.items()
        )

    # --- showing ---------------------------------------------------------------------------
    @property
    def error_code(self) -> int:
        """603Fh."""
        self._watch_limits()
        return self.alarms.error_code

    @property
    def warning(self) -> bool:
        """Over-temperature announced 20 °C early (004:4842-4846), or a warning of the table."""
        self._watch_limits()
        threshold = self._axis.p.item(k.P_OTP_C)
        hot = self._axis.s.item(k.S_TEMPERATURE)
        return bool(self.alarms.warnings) or (math.isfinite(threshold) and hot >= threshold - 20)

    def _watch_limits(self) -> None:
        """Set and clear warnings of the limit switches with the switches."""
        if not self._warns_of_limits:
            return
        signals = int(self._axis.s.item(k.S_SIGNALS))
        if not signals & _LIMIT_SWITCHES and not self.alarms.warnings:
            return  # this is read twice in every cycle
        for warning, switch in zip(
            self._traits.limits.warnings, (k.SIG_NEGATIVE, k.SIG_POSITIVE), strict=True
        ):
            self.alarms.warn(warning, bool(signals & switch))
