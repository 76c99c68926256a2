"""CiA 402 device control: states, option codes, halts and the way into and out of faults."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from drivers.virtual.firmware import kernel as k
from drivers.virtual.firmware.alarms import Alarms, FaultLog, Snapshot, snapshot_of
from drivers.virtual.firmware.brake import HoldingBrake
from drivers.virtual.firmware.core import Core
from drivers.virtual.firmware.families.base import FaultInfo
from drivers.virtual.firmware.identification import Identification
from drivers.virtual.firmware.modes import CST, PP, PT, Modes
from drivers.virtual.firmware.schedule import Timer
from drivers.virtual.firmware.states import Command, State, decode, next_state
from drivers.virtual.firmware.stopping import Stopping
from profiles.schema import Fault

_HALT, _FAULT_RESET, _IDENTIFY = 1 << 8, 1 << 7, 1 << 11
_OPERATING: Final = (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE)
_STOP_OPTIONS: Final = {Command.SHUTDOWN: "605B:00", Command.SWITCH_ON: "605C:00"}
Emergency = tuple[int, int, bytes]


class DeviceControl:
    """Follows the control word, stops as the option codes say and reacts to faults."""

    def __init__(self, core: Core, log: FaultLog | None = None) -> None:
        self._core = core
        self._axis = core.axis
        self._traits = core.family.traits
        self.modes = Modes(core)
        self.identification = Identification(core)
        self.alarms = Alarms(
            core.profile, self._traits.faults, core.axis,
            FaultLog(self._traits.history_size) if log is None else log,
        )  # fmt: skip
        self.state = State.SWITCH_ON_DISABLED
        self.control_word = 0
        self.emergencies: list[Emergency] = []
        self.on_disabled: list[Callable[[], None]] = []
        """Told whenever the power stage has been switched off."""
        self.levels: Callable[[], tuple[int, int]] = lambda: (0, 0)
        """Levels of inputs and outputs, for the record of a fault."""
        self._stops = Stopping(core, self.modes)
        self.brake = HoldingBrake(core)
        self._halted = False
        self._reported = 0
        self._since_s: dict[str, float] = {}
        self._after_stop: Callable[[], None] | None = None
        self._halt_done: Callable[[], None] | None = None
        self._retry_timer: Timer | None = None
        self._emergency = False
        self.modes.homing.guard_limits()
        self.modes.homing.on_failed = self._homing_failed
        self._axis.listen(k.EV_ARRIVED)

    # --- commands --------------------------------------------------------------------------
    def set_control_word(self, word: int) -> None:
        """A new control word, in force at once."""
        before, self.control_word = self.control_word, word
        if word & ~before & _FAULT_RESET:
            self.reset_fault()
        if word & _FAULT_RESET and self._traits.status == "cia402":
            return  # while bit 7 stays 1 no other command acts (001:315, 002:2849, 004:3618)
        self._command(decode(word))
        if self.state is not State.OPERATION_ENABLED or self._after_stop is not None:
            return
        if self.brake.moving:
            return  # the brake is opening: commands are lost (000:1377)
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
            if self.brake.moving:
                self.modes.mode = mode
                return
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
        option = self._option("605A:00", 2)
        if self.state is State.QUICK_STOP_ACTIVE and (option < 5 or self._emergency):
            return
        resumed = self.state is State.QUICK_STOP_ACTIVE
        self._core.od.activate("reenable")
        self._core.apply_settings()
        refused = self._core.family.refusal(self._core.od, self.modes.mode)
        if refused is not None and (fault := self.alarms.find(refused)) is not None:
            self.raise_alarm(fault)
            return
        self.state = State.OPERATION_ENABLED
        self._after_stop = None
        self._halted = False
        self.modes.limited = False
        if resumed or not self.brake.open(lambda: self.modes.start(self.modes.mode)):
            self.modes.start(self.modes.mode)

    def _leave_operation(self, new: State, command: Command) -> None:
        self._end_identification()
        self.modes.end()
        if command is Command.QUICK_STOP:
            self._quick_stop(self._option("605A:00", 2))
            return
        stops = self._traits.stops
        key = _STOP_OPTIONS.get(command, stops.disable_voltage_key)
        option = 0 if key is None else self._option(key, 0)
        if option == 1:
            self._stop(1, lambda: self._disable(new))
        elif stops.off is not None and self.brake.times() is None:
            self._after_stop = lambda: self._disable(new)
            self._finish_now(self._stops.servo_off(stops.off))
        elif stops.waits:
            self._after_stop = lambda: self._disable(new)
            self._finish_now(self._stops.coast())
        else:
            self._switch_off()
            self.state = new

    def _quick_stop(self, option: int) -> None:
        self.state = State.QUICK_STOP_ACTIVE
        if option >= 5:
            self._stop(option - 4, self._hold_stopped)
        else:
            self._stop(option, self._quick_stop_done)

    def _option(self, key: str, default: int) -> int:
        return int(self._core.number(key, default))

    # --- stopping --------------------------------------------------------------------------
    def _stop(self, option: int, done: Callable[[], None]) -> None:
        """Stop as options 0 to 4 of 605Ah–605Eh say, then call ``done``."""
        self._after_stop = done
        self._finish_now(self._stops.begin(option))

    def _finish_now(self, begun: bool) -> None:
        """Go on at once where nothing had to be waited for."""
        if not begun and self._after_stop is not None:
            done, self._after_stop = self._after_stop, None
            done()

    def _switch_off(self, *, at_once: bool = False) -> None:
        """Power stage off; a brake closes first where the family lets it (000:1383)."""
        self._after_stop = None
        self._halted = False
        self.modes.end()
        self.brake.cancel()
        if at_once or not self.brake.close(lambda: self.state is State.OPERATION_ENABLED):
            self._stops.after_rest(self._axis)
        self._core.od.activate("stopped")
        for told in self.on_disabled:
            told()

    def _disable(self, state: State) -> None:
        self._switch_off()
        self.state = state
        self._command(decode(self.control_word))

    def _quick_stop_done(self) -> None:
        self._switch_off()
        self.state = State.SWITCH_ON_DISABLED

    def _hold_stopped(self) -> None:
        # Torque modes know no position lock where 6087h has taken the torque back (000:3020).
        if not (self._traits.stops.slope_in_torque and self.modes.mode in (PT, CST)):
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

    def emergency_stop(self, on: bool) -> None:
        """The emergency stop input; what it does is the family's (001:874, 000:3014)."""
        self._emergency = on
        emergency = self._traits.stops.emergency
        if emergency is None or not on or self.state is not State.OPERATION_ENABLED:
            return
        key, options = emergency
        option = options.get(0 if key is None else self._option(key, 0), -1)
        if option == -1:
            return
        self._end_identification()
        self.modes.end()
        self._quick_stop(self._option("605A:00", 2) if option == -2 else option)

    # --- events ----------------------------------------------------------------------------
    def on_events(self, events: int) -> None:
        """React to what ended a run of the 50 µs loop."""
        if events & k.EV_ALARM_CLOCK:
            self._core.schedule.run()
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
        if self.modes.running:
            self.modes.on_events(events, self.control_word)

    def _homing_failed(self, timed_out: bool) -> None:
        warning, fault = self._traits.homing_alarms
        self.alarms.warn(warning)
        entry = self.alarms.find(fault)
        if timed_out and entry is not None:
            self.raise_alarm(entry)

    # --- identification --------------------------------------------------------------------
    def _begin_identification(self) -> None:
        self.modes.end()
        self._halted = False
        self.identification.start(self._end_identification)

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

    def raise_alarm(self, fault: Fault) -> None:
        """An entry of the fault table by itself; warnings only show."""
        if fault.kind == "warning":
            self.alarms.warn(fault.code)
        else:
            self._take_in([self.alarms.info_of(fault)])

    @property
    def error_code(self) -> int:
        """603Fh."""
        self._watch_limits()
        return self.alarms.error_code

    def _on_fault(self) -> None:
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
        """What a protection reports now: its fault, or nothing where it only warns."""
        if bit == k.F_POSITION_LIMIT and any(self._traits.limits.faults):
            side = int(self._axis.s[k.S_SIGNALS]) & k.SIG_POSITIVE != 0
            fault = self.alarms.find(self._traits.limits.faults[side])
            return [] if fault is None else [self.alarms.info_of(fault)]
        choice = self._traits.choices.get(bit)
        if choice is not None:
            action = choice.actions.get(self._option(choice.key, -1), choice.default)
            if action != "fault":
                self.alarms.warn(choice.warning)
                if action == "stop" and self.state is State.OPERATION_ENABLED:
                    self._leave_operation(State.QUICK_STOP_ACTIVE, Command.QUICK_STOP)
                return []
        return self.alarms.of_bits(bit)

    def _take_in(self, infos: list[FaultInfo]) -> None:
        new = self.alarms.add(infos, self._snapshot)
        if not new:
            return
        now_s = float(self._axis.s[k.S_STEP]) * k.STEP_S
        self._since_s |= {item.name: now_s for item in new}
        told = next((item for item in new if item.code), new[0])
        status = self._axis.faults & 0xFFFF
        self.emergencies.append(
            (told.code or 0xFF00, told.error_register, status.to_bytes(5, "little"))
        )
        if self.state in (State.FAULT, State.NOT_READY):
            return
        self.identification.stop()
        moving = self._axis.powered
        self.modes.end()
        self.brake.cancel()
        self.state = State.FAULT_REACTION
        self._after_stop = self._fault_reaction_done
        self._finish_now(moving and self._stops.react(new, self._option("605E:00", 0)))

    def _snapshot(self) -> Snapshot:
        inputs, outputs = self.levels()
        axis = self._axis
        return snapshot_of(
            axis, self._core.position_of(axis.angle_rad), inputs=inputs, outputs=outputs
        )

    def _fault_reaction_done(self) -> None:
        self._switch_off(at_once=True)
        self.state = State.FAULT
        if self._core.number("200B:07") == 1:  # retry, 004:6221-6232
            delay_s = self._core.number("200B:08", 3000) * 1e-3
            self._retry_timer = self._core.schedule.after(delay_s, self._retry)

    def _retry(self) -> None:
        self._retry_timer = None
        if self.reset_fault() and decode(self.control_word) is Command.ENABLE:
            self.state = State.SWITCHED_ON
            self._enter_operation()

    def reset_fault(self) -> bool:
        """Leave the fault state if no cause is present and the faults let it (004:5068-5073)."""
        if self.state is not State.FAULT:
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
        self.state = State.SWITCH_ON_DISABLED
        return True

    def _cooling(self) -> bool:
        """A fault that a reset ends only after a time (000:3882)."""
        now_s = float(self._axis.s[k.S_STEP]) * k.STEP_S
        waits = self._traits.reset_after_s
        return any(
            now_s - since_s < waits.get(name, 0.0) for name, since_s in self._since_s.items()
        )

    def communication_lost(self) -> None:
        """EtherCAT or CAN traffic ended while the servo is on.

        A drive with 6007h does what that says (CiA 402-2 object 6007h); the others report a
        fault (004:4903-4917).
        """
        fault = self._traits.communication_fault
        if self.state not in _OPERATING or not fault:
            return
        option = self._option("6007:00", 1) if "6007:00" in self._core.od.numbered else 1
        if option == 2:
            self._switch_off(at_once=True)
            self.state = State.SWITCH_ON_DISABLED
        elif option == 3 and self.state is State.OPERATION_ENABLED:
            self._leave_operation(State.QUICK_STOP_ACTIVE, Command.QUICK_STOP)
        elif option == 1:
            self.raise_fault(fault)

    # --- status ----------------------------------------------------------------------------
    def _watch_limits(self) -> None:
        """Warnings of the limit switches come and go with the switches."""
        if not any(self._traits.limits.warnings):
            return
        signals = int(self._axis.s[k.S_SIGNALS])
        for warning, switch in zip(
            self._traits.limits.warnings, (k.SIG_NEGATIVE, k.SIG_POSITIVE), strict=True
        ):
            self.alarms.warn(warning, bool(signals & switch))

    @property
    def warning(self) -> bool:
        """Over-temperature announced 20 °C early (004:4842-4846), or a warning of the table."""
        self._watch_limits()
        threshold = float(self._axis.p[k.P_OTP_C])
        hot = float(self._axis.s[k.S_TEMPERATURE])
        return bool(self.alarms.warnings) or (math.isfinite(threshold) and hot >= threshold - 20)

    def status_word(self) -> int:
        """6041h; "voltage enabled" and "remote" are always set (004:6798-6806)."""
        traits = self._traits
        if traits.status == "echo":
            return self._echo_status()
        word = self.state.value | 0x0210
        if self.state is State.SWITCH_ON_DISABLED:
            word |= traits.disabled_bits
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
            wait_s = max(self._core.family.in_place_s(self._core.od), k.STEP_S)
            in_place = s[k.S_POSITION_T] >= wait_s
            word |= (self.state is State.OPERATION_ENABLED and in_place) << 15
        return int(word)
