"""CiA 402 device control: states, option codes, halts and faults of one drive."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from drivers.virtual.firmware import kernel as k
from drivers.virtual.firmware.core import Core
from drivers.virtual.firmware.families.base import FaultInfo
from drivers.virtual.firmware.identification import Identification
from drivers.virtual.firmware.modes import PP, Modes
from drivers.virtual.firmware.states import Command, State, decode, next_state

_HALT, _FAULT_RESET, _IDENTIFY = 1 << 8, 1 << 7, 1 << 11
_OPERATING: Final = (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE)
Emergency = tuple[int, int, bytes]


class DeviceControl:
    """Follows the control word, stops as the option codes say and reacts to faults."""

    def __init__(self, core: Core) -> None:
        self._core = core
        self._axis = core.axis
        self.modes = Modes(core)
        self.identification = Identification(core)
        self.state = State.SWITCH_ON_DISABLED
        self.control_word = 0
        self.error_code = 0
        self.history: list[int] = []
        self.emergencies: list[Emergency] = []
        self._halted = False
        self._reported = 0
        self._after_stop: Callable[[], None] | None = None
        self._halt_done: Callable[[], None] | None = None
        self._retry_step: float | None = None
        self.modes.homing.guard_limits()
        self._axis.listen(k.EV_ARRIVED)

    # --- commands --------------------------------------------------------------------------
    def set_control_word(self, word: int) -> None:
        """A new control word, in force at once."""
        before, self.control_word = self.control_word, word
        if word & ~before & _FAULT_RESET:
            self.reset_fault()
        self._command(decode(word))
        if self.state is not State.OPERATION_ENABLED or self._after_stop is not None:
            return
        if word & _IDENTIFY and not before & _IDENTIFY:
            self._begin_identification()
        elif not word & _IDENTIFY and self.identification.active:
            self._end_identification()
        if self.identification.active:
            return
        self._set_halt(bool(word & _HALT))
        self.modes.on_control_word(word, before)

    def set_mode(self, mode: int) -> None:
        """6060h changed; a running axis changes over without a bump."""
        if mode == self.modes.mode:
            return
        if self.state is State.OPERATION_ENABLED and self._after_stop is None:
            self._halted = False
            self.modes.start(mode)
            self._set_halt(bool(self.control_word & _HALT))
        else:
            self.modes.mode = mode

    def _command(self, command: Command) -> None:
        new = next_state(self.state, command)
        if new is self.state:
            return
        # A ramp under way ends before anything but "disable voltage" or a quick stop counts.
        urgent = command is Command.DISABLE_VOLTAGE or (
            command is Command.QUICK_STOP and self.state is State.OPERATION_ENABLED
        )
        if self._after_stop is not None and not urgent:
            return
        if self.state is State.OPERATION_ENABLED:
            self._leave_operation(new, command)
        elif new is State.OPERATION_ENABLED:
            self._enter_operation()
        else:
            if self.state is State.QUICK_STOP_ACTIVE:
                self._switch_off()
            self.state = new

    def _enter_operation(self) -> None:
        if self.state is State.QUICK_STOP_ACTIVE and self._option("605A:00", 2) < 5:
            return
        self.state = State.OPERATION_ENABLED
        self._after_stop = None
        self._halted = False
        self._core.od.activate("reenable")
        self._core.apply_settings()
        self.modes.limited = False
        self.modes.start(self.modes.mode)

    def _leave_operation(self, new: State, command: Command) -> None:
        self._end_identification()
        self.modes.end()
        if command is Command.QUICK_STOP:
            option = self._option("605A:00", 2)
            self.state = State.QUICK_STOP_ACTIVE
            done = self._hold_stopped if option >= 5 else self._quick_stop_done
            self._stop((option - 4) if option >= 5 else option, done)
            return
        key = {Command.SHUTDOWN: "605B:00", Command.SWITCH_ON: "605C:00"}.get(command)
        if key is not None and self._option(key, 0) == 1:
            self._stop(1, lambda: self._disable(new))
        else:
            self._switch_off()
            self.state = new

    def _option(self, key: str, default: int) -> int:
        return int(self._core.number(key, default))

    # --- stopping --------------------------------------------------------------------------
    def _stop(self, option: int, done: Callable[[], None]) -> None:
        """Stop as options 0 to 4 of 605Ah–605Eh say (004:2451-2551), then call ``done``."""
        axis = self._axis
        self._after_stop = done
        if option == 1:
            axis.stop_ramp(self.modes.slow_ramp())
        elif option == 2:
            axis.stop_ramp(self._core.deceleration("6085:00"))
        elif option == 3:
            axis.stop_by_torque(self._brake_torque())
        elif option == 4:
            axis.stop_by_torque(float(axis.p[k.P_T_MAX]))
        else:
            self._after_stop = None
            done()

    def _brake_torque(self) -> float:
        rated = self._core.motor.rated_torque_nm
        return self._core.number("2002:05", 200) / 1000 * rated

    def _switch_off(self) -> None:
        self._after_stop = None
        self._halted = False
        self.modes.end()
        self._axis.power_off()
        self._core.od.activate("stopped")

    def _disable(self, state: State) -> None:
        self._switch_off()
        self.state = state
        self._command(decode(self.control_word))

    def _quick_stop_done(self) -> None:
        self._switch_off()
        self.state = State.SWITCH_ON_DISABLED

    def _hold_stopped(self) -> None:
        self._axis.hold()

    def _set_halt(self, halt: bool) -> None:
        if halt == self._halted:
            return
        self._halted = halt
        if not halt:
            self._after_stop = None
            self.modes.resume()
            return
        if self.modes.homing.active:
            self.modes.homing.abort()
        self.modes.running = False
        option = self._option("605D:00", 1)
        if option == 0:
            self._axis.stop_by_torque(0.0)
        else:
            self._stop(option, self._hold_stopped)
            # A halt leaves the drive free to take any further command at once.
            self._halt_done, self._after_stop = self._after_stop, None

    # --- events ----------------------------------------------------------------------------
    def on_events(self, events: int) -> None:
        """React to what ended a run of the 50 µs loop."""
        if events & k.EV_ALARM_CLOCK:
            self._axis.set_alarm(None)
        if events & k.EV_FAULT:
            self._on_fault()
        if events & k.EV_STOPPED:
            done = self._after_stop
            if done is not None:
                self._after_stop = None
                done()
            elif self._halted and self._halt_done is not None:
                self._halt_done()
                self._halt_done = None
        if events & k.EV_ALARM_CLOCK and self._retry_step is not None:
            self._retry()
        elif self.identification.active:
            if self.identification.on_events(events):
                self._end_identification()
        elif self.modes.running:
            self.modes.on_events(events, self.control_word)

    # --- identification --------------------------------------------------------------------
    def _begin_identification(self) -> None:
        self.modes.end()
        self._halted = False
        self.identification.start()

    def _end_identification(self) -> None:
        was = self.identification.started
        self.identification.stop()
        if was and self.state is State.OPERATION_ENABLED:
            self._core.apply_settings()
            self.modes.start(self.modes.mode)

    # --- faults ----------------------------------------------------------------------------
    def raise_fault(self, bits: int) -> None:
        """A protection outside the 50 µs loop, or trouble made on purpose."""
        self._axis.raise_fault(bits)
        self._on_fault()

    def clear_history(self) -> None:
        """Forget the alarm records."""
        self.history = []

    def _on_fault(self) -> None:
        new = self._axis.faults & ~self._reported
        if not new:
            return
        self._reported |= new
        faults = self._core.family.traits.faults
        infos = [faults.get(1 << i, FaultInfo(0)) for i in range(new.bit_length()) if new >> i & 1]
        info = next((item for item in infos if item.code), infos[0])
        self.error_code = info.code
        self.history = [info.code, *self.history][:20]
        status = self._axis.faults & 0xFFFF
        self.emergencies.append(
            (info.code or 0xFF00, info.error_register, status.to_bytes(5, "little"))
        )
        if self.state in (State.FAULT, State.NOT_READY):
            return
        self.identification.stop()
        moving = self._axis.powered
        self.modes.end()
        self.state = State.FAULT_REACTION
        option = self._option("605E:00", 0)
        fixed = any(item.fixed for item in infos)
        self._stop(0 if fixed or not moving else option, self._fault_reaction_done)

    def _fault_reaction_done(self) -> None:
        self._switch_off()
        self.state = State.FAULT
        if self._core.number("200B:07") == 1:  # retry, 004:6221-6232
            delay = self._core.number("200B:08", 3000) * 1e-3 / k.STEP_S
            self._retry_step = float(self._axis.s[k.S_STEP]) + delay
            self._axis.set_alarm(self._retry_step)

    def _retry(self) -> None:
        self._retry_step = None
        self._axis.set_alarm(None)
        if self.reset_fault() and decode(self.control_word) is Command.ENABLE:
            self.state = State.SWITCHED_ON
            self._enter_operation()

    def reset_fault(self) -> bool:
        """Leave the fault state if no cause is present (004:5068-5073)."""
        if self.state is not State.FAULT or self._axis.live_faults():
            return False
        self._axis.clear_faults()
        self._reported = 0
        self.error_code = 0
        self._retry_step = None
        self._axis.set_alarm(None)
        self.state = State.SWITCH_ON_DISABLED
        return True

    def communication_lost(self) -> None:
        """EtherCAT or CAN traffic ended while the servo is on.

        A drive with 6007h does what that says (CiA 402-2 object 6007h); the others report a
        fault (004:4903-4917).
        """
        fault = self._core.family.traits.communication_fault
        if self.state not in _OPERATING or not fault:
            return
        option = self._option("6007:00", 1) if "6007:00" in self._core.od.numbered else 1
        if option == 2:
            self._switch_off()
            self.state = State.SWITCH_ON_DISABLED
        elif option == 3 and self.state is State.OPERATION_ENABLED:
            self._leave_operation(State.QUICK_STOP_ACTIVE, Command.QUICK_STOP)
        elif option == 1:
            self.raise_fault(fault)

    # --- status ----------------------------------------------------------------------------
    @property
    def error_register(self) -> int:
        """1001h."""
        found = 0
        for bit, info in self._core.family.traits.faults.items():
            if self._axis.faults & bit:
                found |= info.error_register
        return found

    @property
    def warning(self) -> bool:
        """Over-temperature announced 20 °C early (004:4842-4846)."""
        threshold = float(self._axis.p[k.P_OTP_C])
        hot = float(self._axis.s[k.S_TEMPERATURE])
        return math.isfinite(threshold) and hot >= threshold - 20

    def status_word(self) -> int:
        """6041h; "voltage enabled" and "remote" are always set (004:6798-6806)."""
        traits = self._core.family.traits
        if traits.status == "echo":
            return self._echo_status()
        word = self.state.value | 0x0210
        if traits.home_found_bit is not None and self.homed:
            word |= 1 << traits.home_found_bit
        if self.warning:
            word |= 1 << 7
        if self.identification.active:
            word |= 1 << 14
        enabled = self.state in _OPERATING
        stopping = self._halted or self.state is State.QUICK_STOP_ACTIVE
        return word | self.modes.status_bits(stopping, enabled)

    @property
    def homed(self) -> bool:
        """A homing has succeeded since power-on."""
        return self.modes.homing.attained or self.modes.homing.was_attained

    def _echo_status(self) -> int:
        """Status word of the DS_C (003:298-308): bits 0 to 2 echo the state."""
        word = {
            State.READY: 1, State.SWITCHED_ON: 3, State.OPERATION_ENABLED: 7,
        }.get(self.state, 0)  # fmt: skip
        s = self._axis.s
        word |= (self.state in (State.FAULT, State.FAULT_REACTION)) << 7
        word |= self.homed << 8
        word |= (s[k.S_ZERO_T] > 0) << 10
        if self.modes.mode == PP:
            word |= self.modes.acknowledged << 12
            in_place = s[k.S_POSITION_T] >= self._core.number("6068:00", 10) * 1e-3
            word |= (self.state is State.OPERATION_ENABLED and in_place) << 15
        return int(word)
