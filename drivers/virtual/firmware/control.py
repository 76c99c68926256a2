"""CiA 402 device control: states, option codes, halts, and entering and leaving faults."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from drivers.virtual.firmware.cia402.base import FaultInfo
from drivers.virtual.firmware.cia402.states import Command, State, decode, next_state
from drivers.virtual.firmware.core import Core
from drivers.virtual.firmware.failures.alarms import FaultLog
from drivers.virtual.firmware.failures.faults import Faults
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.motion.brake import HoldingBrake
from drivers.virtual.firmware.motion.identification import Identification
from drivers.virtual.firmware.motion.jog import TerminalJog
from drivers.virtual.firmware.motion.modes import CST, PP, PT, Modes
from drivers.virtual.firmware.motion.poles import PoleIdentification
from drivers.virtual.firmware.motion.stopping import Stopping

_HALT, _FAULT_RESET, _IDENTIFY = 1 << 8, 1 << 7, 1 << 11
_OPERATING: Final = (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE)
_AT_STANDSTILL: Final = (State.SWITCH_ON_DISABLED, State.READY, State.SWITCHED_ON)
_STOP_OPTIONS: Final = {Command.SHUTDOWN: "605B:00", Command.SWITCH_ON: "605C:00"}


class DeviceControl:
    """Follows the control word, stops according to the option codes, and reacts to faults."""

    def __init__(self, core: Core, log: FaultLog | None = None) -> None:
        self._core = core
        self._axis = core.axis
        self._traits = core.family.traits
        self.modes = Modes(core)
        self.identification = Identification(core)
        self.state = State.SWITCH_ON_DISABLED
        self.control_word = 0
        self.faults = Faults(core, self, log)
        self.alarms = self.faults.alarms
        self.on_disabled: list[Callable[[], None]] = []
        """Called whenever the power stage has been switched off."""
        self._stops = Stopping(core, self.modes)
        self.brake = HoldingBrake(core)
        self.jog = TerminalJog(core, self.brake, self._free)
        self.poles = PoleIdentification(core, self._pole_failed, self._free)
        self._halted = False
        self._after_stop: Callable[[], None] | None = None
        self._halt_done: Callable[[], None] | None = None
        self._emergency = False
        self.modes.homing.guard_limits()
        self.modes.homing.on_failed = self._homing_failed
        self._axis.listen(k.EV_ARRIVED)

    # --- commands --------------------------------------------------------------------------
    def set_control_word(self, word: int) -> None:
        """Apply a new control word at once."""
        before, self.control_word = self.control_word, word
        if word & ~before & _FAULT_RESET:
            self.faults.reset()
        if word & _FAULT_RESET and self._traits.status == "cia402":
            return  # while bit 7 stays 1 no other command acts (001:315, 002:2849, 004:3618)
        self._command(decode(word))
        if self.state is not State.OPERATION_ENABLED or self._after_stop is not None:
            return
        if self.brake.moving or self.poles.active:
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
        """Handle a change of 6060h; a running axis changes over without a bump."""
        if mode == self.modes.mode:
            return
        if self.state is State.OPERATION_ENABLED and self._after_stop is None:
            if self.brake.moving or self.poles.active:
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
        # Until a ramp in progress ends, only "disable voltage" or a quick stop is accepted.
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
        refused = self._core.family.refusal(self._core.od, self.modes.mode) or self.poles.refusal
        if refused is not None and self.faults.raise_code(refused):
            return
        self.jog.cancel()
        self.state = State.OPERATION_ENABLED
        self._after_stop = None
        self._halted = False
        self.modes.limited = False
        if self.poles.needed:
            self.poles.start(self._begin_mode)
        elif resumed or not self.brake.open(self._begin_mode):
            self._begin_mode()

    def _begin_mode(self) -> None:
        self.modes.start(self.modes.mode)

    def _free(self) -> bool:
        """Return whether the axis is not commanded, so that the drive may move it by itself."""
        return self.state in _AT_STANDSTILL and self._after_stop is None and not self.brake.moving

    def _pole_failed(self, code: str) -> None:
        self.faults.raise_code(code)

    def _leave_operation(self, new: State, command: Command) -> None:
        self._end_identification()
        self.poles.cancel()
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
        """Stop according to options 0 to 4 of 605Ah–605Eh, then call ``done``."""
        self._after_stop = done
        self._finish_now(self._stops.begin(option))

    def _finish_now(self, begun: bool) -> None:
        """Continue at once if there is nothing to wait for."""
        if not begun and self._after_stop is not None:
            done, self._after_stop = self._after_stop, None
            done()

    def _switch_off(self, *, at_once: bool = False) -> None:
        """Switch the power stage off; a brake closes first if the family allows it (000:1383)."""
        self._after_stop = None
        self._halted = False
        self.modes.end()
        self.brake.cancel()
        if at_once or not self.brake.close(lambda: self.state is State.OPERATION_ENABLED):
            self._stops.after_rest(self._axis)
        self._core.od.activate("stopped")
        for reported in self.on_disabled:
            reported()

    def _disable(self, state: State) -> None:
        self._switch_off()
        self.state = state
        self._command(decode(self.control_word))

    def _quick_stop_done(self) -> None:
        self._switch_off()
        self.state = State.SWITCH_ON_DISABLED
        if self._traits.status == "echo":
            # Its states are those of the control word, whenever that was written (003:300-303).
            self._command(decode(self.control_word))

    def _hold_stopped(self) -> None:
        # Torque modes have no position lock after 6087h has reduced the torque (000:3020).
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
            # A halt leaves the drive free to accept any further command at once.
            self._halt_done, self._after_stop = self._after_stop, None

    def emergency_stop(self, on: bool) -> None:
        """Handle the emergency stop input; its action depends on the family (001:874, 000:3014)."""
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
        """React to the events that ended a run of the 50 µs loop."""
        if events & k.EV_ALARM_CLOCK:
            self._core.schedule.run()
        if events & k.EV_FAULT:
            self.faults.look()
        if events & k.EV_STOPPED:
            done = self._after_stop
            self.jog.stopped()
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
        if timed_out:
            self.faults.raise_code(fault)

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
    def trip(self, new: list[FaultInfo]) -> None:
        """React to faults: stop as the family does, then enter "fault"."""
        self.identification.stop()
        self.jog.cancel()
        self.poles.cancel()
        moving = self._axis.powered
        self.modes.end()
        self.brake.cancel()
        self.brake.grip()
        self.state = State.FAULT_REACTION
        self._after_stop = self._fault_reaction_done
        self._finish_now(moving and self._stops.react(new, self._option("605E:00", 0)))

    def _fault_reaction_done(self) -> None:
        self._switch_off(at_once=True)
        self.state = State.FAULT
        self.faults.reacted()

    def stop_on_warning(self) -> None:
        """Brake and hold for a protection that does not trip."""
        self._leave_operation(State.QUICK_STOP_ACTIVE, Command.QUICK_STOP)

    def retry_enable(self) -> None:
        """Enable again after the drive itself reset the fault, if still commanded."""
        if decode(self.control_word) is Command.ENABLE:
            self.state = State.SWITCHED_ON
            self._enter_operation()

    def communication_lost(self) -> None:
        """React to the end of EtherCAT or CAN traffic while the servo is on.

        A drive with 6007h acts according to it (CiA 402-2 object 6007h); the others report a fault
        (004:4903-4917).
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
            self.faults.raise_bits(fault)

    # --- status ----------------------------------------------------------------------------
    def status_word(self) -> int:
        """Return 6041h; "voltage enabled" and "remote" are always set (004:6798-6806)."""
        traits = self._traits
        if traits.status == "echo":
            return self._echo_status()
        state = self.state
        word = state.bits | 0x0210
        if state is State.SWITCH_ON_DISABLED:
            word |= traits.disabled_bits
        if traits.home_found_bit is not None and self.homed:
            word |= 1 << traits.home_found_bit
        if self.faults.warning:
            word |= 1 << 7
        if self.identification.active:
            word |= 1 << 14
        return word | self.modes.status_bits(self._stopping, state in _OPERATING)

    @property
    def _stopping(self) -> bool:
        return self._halted or self.state is State.QUICK_STOP_ACTIVE

    @property
    def target_reached(self) -> bool:
        """Bit 10 of the status word."""
        if self._traits.status == "echo":
            return bool(self._echo_status() & 1 << 10)
        return self.state in _OPERATING and self.modes.reached(self._stopping)

    @property
    def homed(self) -> bool:
        """Whether a homing has succeeded since power-on."""
        return self.modes.homing.attained or self.modes.homing.was_attained

    def _echo_status(self) -> int:
        """Return the status word of the DS_C (003:298-308): bits 0 to 2 echo the state."""
        word = {
            State.READY: 1,
            State.SWITCHED_ON: 3,
            State.OPERATION_ENABLED: 7,
        }.get(self.state, 0)
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
