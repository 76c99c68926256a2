"""An ideal CiA 402 servo for tests of the host: it follows its setpoints without delay.

It decides by itself only what a drive decides: states, braking on quick stop and when the bus is
lost. Written from CiA 402-2, not from our own firmware.
"""

from __future__ import annotations

from pathlib import Path

from drivers.virtual.mechanics.spec import MechanicsSpec
from profiles.schema import PdoSet, PdoSpec, Profile
from tests.wire.ethercat_slave.dictionary_device import DictionaryDevice, _parameter, make_profile

_NOT_READY, _DISABLED, _READY, _ON, _ENABLED, _QUICK, _FAULT = (
    0x0000, 0x0250, 0x0231, 0x0233, 0x0237, 0x0217, 0x0218,
)  # fmt: skip
_BRAKE = 2_000_000.0
"""Deceleration of quick stop and of a lost bus, counts per s²."""


def servo_profile(*, remappable: bool = True, dc: bool = True) -> Profile:
    base = make_profile(dc=dc, foe=True)
    kept = [p for p in base.parameters if p.index is not None and p.index < 0x6000]
    spec = PdoSpec(
        sets=(
            PdoSet(index=0x1600, direction="rx", source="test",
                   entries=("6040:00", "6060:00", "607A:00", "60FF:00", "6071:00")),
            PdoSet(index=0x1601, direction="rx", source="test",
                   entries=("6040:00", "607A:00")),
            PdoSet(index=0x1A00, direction="tx", source="test",
                   entries=("603F:00", "6041:00", "6061:00", "6064:00", "606C:00")),
        ),
        default_rx=0x1600, default_tx=0x1A00, max_entries=10, max_bytes=40,
        remappable=remappable, cycle_min_us=250, cycle_max_us=10_000,
        sync_modes=("SM", "DC") if dc else ("SM",), source="test",
    )  # fmt: skip
    motion = (
        _parameter("603F:00", "UINT16", "ro", "tx"),
        _parameter("6040:00", "UINT16", "rw", "rx"),
        _parameter("6041:00", "UINT16", "ro", "tx", default=_DISABLED),
        _parameter("6060:00", "INT8", "rw", "rx", default=8),
        _parameter("6061:00", "INT8", "ro", "tx", default=8),
        _parameter("6064:00", "INT32", "ro", "tx", default=1000),
        _parameter("606C:00", "INT32", "ro", "tx"),
        _parameter("6071:00", "INT16", "rw", "rx"),
        _parameter("6072:00", "UINT16", "rw", "rx", default=3000),
        _parameter("6077:00", "INT16", "ro", "tx"),
        _parameter("607A:00", "INT32", "rw", "rx"),
        _parameter("60B0:00", "INT32", "rw", "rx"),
        _parameter("60B1:00", "INT32", "rw", "rx"),
        _parameter("60B2:00", "INT16", "rw", "rx"),
        _parameter("60F4:00", "INT32", "ro", "tx"),
        _parameter("60FF:00", "INT32", "rw", "rx"),
    )
    fields = {name: getattr(base, name) for name in Profile.model_fields}
    return Profile(**(fields | {"parameters": (*kept, *motion), "pdo": spec}))


class ServoDevice(DictionaryDevice):
    def __init__(self, profile: Profile | None = None) -> None:
        self.position = 1000.0
        self.speed = 0.0
        self.status = _DISABLED
        self.bus_lost = False
        self.shifted = 0
        super().__init__(profile or servo_profile())

    def _get(self, index: int) -> int:
        return int.from_bytes(self.values[index, 0], "little", signed=True)

    def _put(self, index: int, value: float) -> None:
        size = len(self.values[index, 0])
        low, high = -(1 << 8 * size - 1), (1 << 8 * size - 1) - 1
        clipped = min(max(round(value), low), high)
        self.values[index, 0] = clipped.to_bytes(size, "little", signed=True)

    def advance(self, t_ns: int) -> None:
        dt = (t_ns - self.time_ns) / 1e9
        if dt <= 0:
            return
        self.time_ns = t_ns
        if not self.powered:
            if t_ns >= self._on_again_ns:
                self._start_up()
                self.status, self.speed, self.bus_lost = _DISABLED, 0.0, False
            return
        self._switch()
        self._move(dt)
        self.values[0x6041, 0] = self.status.to_bytes(2, "little")
        self.values[0x6061, 0] = self.values[0x6060, 0]
        self._put(0x6064, self.position)
        self._put(0x606C, self.speed)

    def _switch(self) -> None:
        word = int.from_bytes(self.values[0x6040, 0], "little")
        if self.status == _FAULT:
            if word & 0x80:
                self.status, self.bus_lost = _DISABLED, False
                self.values[0x603F, 0] = b"\0\0"
        elif not word & 0x02:
            self.status = _DISABLED
        elif not word & 0x04:
            if self.status == _ENABLED:
                self.status = _QUICK
        elif self.status == _DISABLED:
            self.status = _READY if word & 0x07 == 0x06 else _DISABLED
        elif self.status in (_READY, _ON, _ENABLED):
            low = word & 0x0F
            if low == 0x06:
                self.status = _READY
            elif low == 0x07:
                self.status = _ON
            elif low == 0x0F:
                self.status = _ENABLED if self.status != _READY else _ON

    def _move(self, dt: float) -> None:
        if self.status == _ENABLED and not self.bus_lost:
            mode = self._get(0x6060)
            if mode == 8:
                target = float(self._get(0x607A))
                self.speed = (target - self.position) / dt
                self.position = target
                return
            if mode == 9:
                self.speed = float(self._get(0x60FF))
            elif mode == 10:
                self.speed += self._get(0x6071) * 1000 * dt
        else:
            change = _BRAKE * dt
            self.speed -= max(min(self.speed, change), -change)
            if self.status == _QUICK and self.speed == 0:
                self.status = _DISABLED
        self.position += self.speed * dt

    def communication_lost(self, reason: str) -> None:
        super().communication_lost(reason)
        if self.status == _ENABLED:
            self.status, self.bus_lost = _FAULT, True
            self.values[0x603F, 0] = (0x8700).to_bytes(2, "little")
            self.emergencies.append((0x8700, 0x10, bytes(5)))

    def inject(self, what: str, value: float = 1.0) -> None:
        if what == "shift":
            self.position += value
        elif what == "torque":
            self._put(0x6077, value)
        elif what == "following":
            self._put(0x60F4, value)
        elif what == "fault":
            self.status = _FAULT
            self._put(0x603F, value)
        elif what == "calm":
            self.status, self.bus_lost, self.speed = _DISABLED, False, 0.0
            self._put(0x6077, 0)
            self._put(0x60F4, 0)
        else:
            super().inject(what, value)


def make_servo(
    drive: str, mechanics: MechanicsSpec, nvm: Path | None = None, station: int = 1
) -> ServoDevice:
    profile = servo_profile(remappable=drive != "fixed", dc=drive != "without_dc")
    return ServoDevice(profile)
