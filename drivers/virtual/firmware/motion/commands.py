"""Commands that a drive accepts as writes of certain values (200Dh of the MMS7 and others)."""

from __future__ import annotations

from collections.abc import Callable

from drivers.virtual.device import ABORT_DEVICE_STATE, ABORT_VALUE_RANGE, SdoAbort
from drivers.virtual.firmware.control import DeviceControl
from drivers.virtual.firmware.core import Core
from drivers.virtual.firmware.motion.load_identification import LoadIdentification
from drivers.virtual.firmware.objects.slow_store import SlowStore
from drivers.virtual.firmware.objects.storage import Storage
from profiles.schema import Raw


class Commands:
    """Save, restore, reset, zero and others, by the names in `Traits.commands`."""

    def __init__(
        self, core: Core, control: DeviceControl, storage: Storage, reset: Callable[[], None]
    ) -> None:
        self._core = core
        self._control = control
        self._storage = storage
        self._actions: dict[str, Callable[[], None]] = {
            "save": self._save,
            "restore": self._restore,
            "zero": self._zero_position,
            "clear_history": control.alarms.log.clear,
            "reset": reset,
            "write_settings": self._write_settings,
            "fault_reset": self._reset_fault,
            "clear_encoder_fault": self._clear_encoder_fault,
            "identify": self._identify,
            "identify_poles": self._identify_poles,
        }
        self.load: LoadIdentification | None = None
        keys = core.family.traits.load_identification
        if keys is not None and keys.ratio in core.profile.by_key:
            self.load = LoadIdentification(core, keys, self._identification_failed)
        self.store = (
            SlowStore(core, self._storing_failed)
            if core.family.traits.slow_store and "1010:01" in core.od.numbered
            else None
        )

    def setters(self) -> dict[str, Callable[[Raw], None]]:
        """Return the functions that react to writes, by parameter key."""
        traits = self._core.family.traits
        found = {key: self._setter(key, actions) for key, actions in traits.commands.items()}
        if traits.jog is not None and traits.jog.trigger is not None:
            found[traits.jog.trigger] = self._jog
        if traits.own_homing is not None:
            found[traits.own_homing.trigger] = self._home
        return found

    def _jog(self, value: Raw) -> None:
        self._control.jog.order({1: 1, 2: -1}.get(int(value), 0))

    def _home(self, value: Raw) -> None:
        keys = self._core.family.traits.own_homing
        if keys is not None:
            self._control.jog.home(keys, begin=int(value) in keys.begins)

    def _setter(self, key: str, actions: dict[int, str]) -> Callable[[Raw], None]:
        self_clearing = self._core.family.traits.self_clearing
        last = 0

        def command(value: Raw) -> None:
            nonlocal last
            before, last = last, int(value)
            if last == 0 and "identify_poles" in actions.values() and self._control.poles.active:
                # How it is ended is not printed; resetting its parameter is assumed to end it.
                self._control.poles.cancel()
                self._core.axis.power_off()
            # A trigger that keeps its value acts only on a change (003:411-414).
            if last == 0 or (not self_clearing and last == before):
                return
            name = actions.get(int(value))
            if name is None:
                last = before
                raise SdoAbort(ABORT_VALUE_RANGE)
            self._actions[name]()
            if self.store is not None and self.store.busy:
                last = 0
                return  # its value reports the result
            if self_clearing:
                last = 0
                self._core.od.put(key, 0)

        return command

    def _save(self) -> None:
        if self.store is not None:
            self.store.begin(self._storage.save, self._storage.changed_share())
        else:
            self._storage.save()

    def _storing_failed(self) -> None:
        self._raise("Err68")

    def _raise(self, code: str) -> None:
        self._control.faults.raise_code(code)

    def _identify(self) -> None:
        if self._core.axis.powered or self._control.alarms.active:
            raise SdoAbort(ABORT_DEVICE_STATE)
        if self.load is not None:
            self.load.start()

    def _identify_poles(self) -> None:
        if self._control.alarms.active or not self._control.poles.start():
            raise SdoAbort(ABORT_DEVICE_STATE)

    def _identification_failed(self) -> None:
        keys = self._core.family.traits.load_identification
        if keys is not None:
            self._raise(keys.fault)

    def _clear_encoder_fault(self) -> None:
        """Clear AL.221 and AL.222, as P12.05 of the R6L does (002:1681)."""
        self._control.alarms.cleared_by_step |= {"AL.221", "AL.222"}
        self._control.faults.reset()

    def _write_settings(self) -> None:
        self._core.od.activate("write_settings")
        self._core.apply_settings()

    def _restore(self) -> None:
        if self._core.axis.powered:
            raise SdoAbort(ABORT_DEVICE_STATE)
        if self.store is not None:
            self.store.begin(self._restore_now, self._storage.changed_share())
        else:
            self._restore_now()

    def _restore_now(self) -> None:
        self._storage.restore()
        self._control.alarms.cleared_by_step.add("Er.013")  # 000:3883
        self._core.apply_settings()

    def _zero_position(self) -> None:
        if self._core.axis.powered:
            raise SdoAbort(ABORT_DEVICE_STATE)
        self._core.zero_rad = self._core.axis.angle_rad

    def _reset_fault(self) -> None:
        self._control.faults.reset()
