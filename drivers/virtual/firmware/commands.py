"""Commands that a drive takes as writes of certain values (200Dh of the MMS7 and its like)."""

from __future__ import annotations

from collections.abc import Callable

from drivers.virtual.device import ABORT_DEVICE_STATE, ABORT_VALUE_RANGE, SdoAbort
from drivers.virtual.firmware.control import DeviceControl
from drivers.virtual.firmware.core import Core
from drivers.virtual.firmware.storage import Storage
from profiles.schema import Raw


class Commands:
    """Save, restore, reset, zero and the rest, by the names that `Traits.commands` uses."""

    def __init__(
        self, core: Core, control: DeviceControl, storage: Storage, reset: Callable[[], None]
    ) -> None:
        self._core = core
        self._control = control
        self._storage = storage
        self._actions: dict[str, Callable[[], None]] = {
            "save": storage.save,
            "restore": self._restore,
            "zero": self._zero_position,
            "clear_history": control.alarms.log.clear,
            "reset": reset,
            "write_settings": self._write_settings,
            "fault_reset": self._reset_fault,
        }

    def setters(self) -> dict[str, Callable[[Raw], None]]:
        """What reacts to writes, by parameter key."""
        return {
            key: self._setter(key, actions)
            for key, actions in self._core.family.traits.commands.items()
        }

    def _setter(self, key: str, actions: dict[int, str]) -> Callable[[Raw], None]:
        self_clearing = self._core.family.traits.self_clearing
        last = 0

        def command(value: Raw) -> None:
            nonlocal last
            before, last = last, int(value)
            # A trigger that stays acts on its change only (003:411-414).
            if last == 0 or (not self_clearing and last == before):
                return
            name = actions.get(int(value))
            if name is None:
                last = before
                raise SdoAbort(ABORT_VALUE_RANGE)
            self._actions[name]()
            if self_clearing:
                last = 0
                self._core.od.put(key, 0)

        return command

    def _write_settings(self) -> None:
        self._core.od.activate("write_settings")
        self._core.apply_settings()

    def _restore(self) -> None:
        if self._core.axis.powered:
            raise SdoAbort(ABORT_DEVICE_STATE)
        self._storage.restore()
        self._core.apply_settings()

    def _zero_position(self) -> None:
        if self._core.axis.powered:
            raise SdoAbort(ABORT_DEVICE_STATE)
        self._core.zero_rad = self._core.axis.angle_rad

    def _reset_fault(self) -> None:
        self._control.reset_fault()
