"""Control channel of a running segment: one JSON object per line, one answer per line.

``{"id": 1, "do": "cut", "cable": 2}`` is answered by ``{"id": 1, "ok": true, "result": …}`` or
``{"id": 1, "ok": false, "error": "…"}``. Slaves are counted from 0, cable k leads to slave k. Times
are in seconds.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from typing import IO, Any

from drivers.virtual.device import SdoAbort, shaft_rev
from drivers.virtual.wires.ethercat.controller import registers as reg
from drivers.virtual.wires.ethercat.controller.registers import AlState
from drivers.virtual.wires.ethercat.mailbox.coe import Oddities
from drivers.virtual.wires.ethercat.mailbox.foe import FileTrouble
from drivers.virtual.wires.ethercat.segment import Segment, register
from drivers.virtual.wires.ethercat.slave import Slave
from drivers.virtual.wires.ethercat.trouble import Fate

_NS = 1_000_000_000
_FOREVER_NS = 1 << 60


class Control:
    """Parses commands and applies them to the segment."""

    def __init__(
        self,
        segment: Segment,
        interface: str,
        answers: IO[bytes],
        carrier: Callable[[bool], None] | None = None,
    ) -> None:
        self._segment = segment
        self._carrier = carrier
        self._interface = interface
        self._answers = answers
        self._rest = b""
        self.stopped = False
        self._commands: dict[str, Callable[..., object]] = {
            "state": self._state,
            "lose": self._lose,
            "late": self._late,
            "corrupt": self._corrupt,
            "counter": self._counter,
            "peace": self._peace,
            "cut": self._cut,
            "heal": self._heal,
            "power_off": self._power_off,
            "power_on": self._power_on,
            "power_cycle": self._power_cycle,
            "timing": self._timing,
            "eeprom_busy": self._eeprom_busy,
            "eeprom_cut": self._eeprom_cut,
            "eeprom": self._eeprom,
            "mute": self._mute,
            "die_in_transfer": self._die_in_transfer,
            "refuse": self._refuse,
            "odd": self._odd,
            "files": self._files,
            "firmware": self._firmware,
            "inject": self._inject,
            "read": self._read,
            "shaft": self._shaft,
            "write": self._write,
            "register": self._register,
            "stop": self._stop,
        }

    def ready(self) -> None:
        """Report that frames are processed from now on."""
        self._send({"ready": True, "interface": self._interface, **self._state()})

    def feed(self, data: bytes) -> None:
        """Take bytes from the channel; complete lines are executed."""
        *lines, self._rest = (self._rest + data).split(b"\n")
        for line in lines:
            if line.strip():
                self._send(self.execute(line))

    def execute(self, line: bytes) -> dict[str, object]:
        """Execute one command line and return the answer."""
        identifier: object = None
        try:
            request = dict(json.loads(line))
            identifier = request.pop("id", None)
            command = self._find(str(request.pop("do", None)))
            return {"id": identifier, "ok": True, "result": command(**request)}
        except (ValueError, TypeError, IndexError, KeyError, SdoAbort) as error:
            return {"id": identifier, "ok": False, "error": str(error)}

    def _find(self, name: str) -> Callable[..., object]:
        if name not in self._commands:
            known = ", ".join(sorted(self._commands))
            raise ValueError(f"unknown command {name!r}; there are: {known}")
        return self._commands[name]

    def _send(self, message: dict[str, Any]) -> None:
        self._answers.write(json.dumps(message).encode() + b"\n")
        self._answers.flush()

    def _slave(self, slave: int) -> Slave:
        if not 0 <= slave < len(self._segment.slaves):
            raise IndexError(f"there is no slave {slave}; there are {len(self._segment.slaves)}")
        return self._segment.slaves[slave]

    def _chosen(self, slave: int | None) -> list[Slave]:
        return self._segment.slaves if slave is None else [self._slave(slave)]

    # -- commands -------------------------------------------------------------------------------

    def _state(self) -> dict[str, object]:
        now = self._segment.settle()
        return {
            "time_s": now / _NS,
            "frames": self._segment.frames,
            "trouble": dict(self._segment.trouble.counted),
            "slaves": [
                {
                    "station": s.controller.station,
                    "state": s.al.state.name,
                    "error": s.al.error,
                    "al_code": s.al.code,
                    "powered": s.device.powered,
                    "missed": s.report.missed,
                    "lost_links": list(s.controller.memory[reg.LOST_LINK : reg.LOST_LINK + 4]),
                    "rx_errors": list(s.controller.memory[reg.RX_ERRORS : reg.RX_ERRORS + 8]),
                }
                for s in self._segment.slaves
            ],
        }

    def _lose(
        self,
        count: int | None = None,
        chance: float = 1.0,
        direction: str = "in",
        cyclic: bool = False,
    ) -> None:
        _check_direction(direction)
        fate = Fate(lost_outbound=direction == "out", lost_inbound=direction == "in")
        self._segment.trouble.add(fate, count, chance, cyclic)

    def _late(
        self,
        by_s: float,
        *,
        count: int | None = None,
        chance: float = 1.0,
        direction: str = "in",
        cyclic: bool = False,
    ) -> None:
        _check_direction(direction)
        late_ns = int(by_s * _NS)
        fate = Fate(hold_ns=late_ns) if direction == "out" else Fate(delay_ns=late_ns)
        self._segment.trouble.add(fate, count, chance, cyclic)

    def _corrupt(
        self, slave: int, port: int = 0, count: int | None = 1, chance: float = 1.0
    ) -> None:
        self._slave(slave)
        self._segment.trouble.add(Fate(corrupt_at=(slave, port)), count, chance)

    def _counter(self, by: int, count: int | None = None, chance: float = 1.0) -> None:
        self._segment.trouble.add(Fate(counter_offset=by), count, chance, cyclic_only=True)

    def _peace(self) -> None:
        self._segment.trouble.clear()

    def _cut(self, cable: int) -> None:
        self._segment.settle()
        self._segment.line.cut(cable)
        self._show_carrier()

    def _heal(self, cable: int | None = None) -> None:
        self._segment.settle()
        self._segment.line.heal(cable)
        self._show_carrier()

    def _show_carrier(self) -> None:
        """Set the carrier of the master's interface as the first cable is connected or not."""
        if self._carrier is not None:
            self._carrier(not self._segment.line.is_cut(0))

    def _power_off(self, slave: int) -> None:
        self._segment.line.power_off(slave, self._segment.settle())

    def _power_on(self, slave: int) -> None:
        self._segment.settle()
        self._segment.line.power_on(slave)

    def _power_cycle(self, slave: int, off_s: float = 0.5) -> None:
        self._segment.line.power_off(slave, self._segment.settle(), off_s)

    def _timing(
        self,
        *,
        slave: int | None = None,
        al_s: float | None = None,
        sdo_s: float | None = None,
        eeprom_read_s: float | None = None,
        eeprom_write_s: float | None = None,
        eeprom_store_s: float | None = None,
        drift_ppm: float | None = None,
    ) -> None:
        for chosen in self._chosen(slave):
            if al_s is not None:
                chosen.al.delay_ns = int(al_s * _NS)
            if sdo_s is not None:
                chosen.mailbox.delay_ns = int(sdo_s * _NS)
            if eeprom_read_s is not None:
                chosen.controller.eeprom.read_ns = int(eeprom_read_s * _NS)
            if eeprom_write_s is not None:
                chosen.controller.eeprom.write_ns = int(eeprom_write_s * _NS)
            if eeprom_store_s is not None:
                chosen.controller.eeprom.store_ns = int(eeprom_store_s * _NS)
            if drift_ppm is not None:
                chosen.dc.drift_ppm = drift_ppm

    def _eeprom_busy(self, slave: int, for_s: float | None = None) -> None:
        now = self._segment.settle()
        until = now + (_FOREVER_NS if for_s is None else int(for_s * _NS))
        self._slave(slave).controller.eeprom.busy_until_ns = until

    def _eeprom_cut(self, slave: int, after_words: int) -> None:
        """Fail the EEPROM supply while a word is stored, until the next power cycle."""
        self._slave(slave).controller.eeprom.cut_after = after_words

    def _eeprom(self, slave: int, word: int | None = None, data: str = "") -> dict[str, object]:
        """Return the EEPROM content; ``word`` and ``data`` change it first."""
        eeprom = self._slave(slave).controller.eeprom
        if word is not None:
            changed = bytes.fromhex(data)
            eeprom.image[2 * word : 2 * word + len(changed)] = changed
        return {"data": eeprom.image.hex(), "words_written": eeprom.words_written}

    def _mute(self, slave: int, on: bool = True) -> None:
        self._slave(slave).mailbox.muted = on

    def _die_in_transfer(self, slave: int, after_segments: int | None = 1) -> None:
        self._slave(slave).mailbox.die_after_segments = after_segments

    def _refuse(self, slave: int, state: str, code: int | None) -> None:
        target = AlState[state.upper()]
        refusals = self._slave(slave).al.refusals
        if code:
            refusals[target] = code
        else:
            refusals.pop(target, None)

    def _odd(
        self,
        slave: int,
        *,
        unpadded_count: bool = False,
        abort_command: int = 0x80,
        endless_segments: bool = False,
    ) -> None:
        """Deviate from the standard as given; without arguments, follow it."""
        self._slave(slave).coe.oddities = Oddities(
            unpadded_count, abort_command & 0xFF, endless_segments
        )

    def _firmware(self, slave: int, **trouble: Any) -> None:
        """Inject faults into firmware downloads, see `FileTrouble`; without arguments, none."""
        store = self._slave(slave).files
        if store is None:
            raise ValueError(f"slave {slave} takes no files")
        store.trouble = FileTrouble(**trouble)

    def _files(self, slave: int) -> dict[str, str]:
        """Return names and SHA-256 of the completely received files."""
        store = self._slave(slave).files
        kept = {} if store is None else store.files
        return {name: hashlib.sha256(data).hexdigest() for name, data in kept.items()}

    def _inject(self, slave: int, what: str, value: float = 1.0) -> None:
        self._segment.settle()
        self._slave(slave).device.inject(what, value)

    def _read(self, slave: int, index: int, subindex: int = 0) -> str:
        """Return the drive's own value, bypassing the bus, as reference for tests."""
        self._segment.settle()
        return self._slave(slave).dictionary.read(index, subindex).hex()

    def _shaft(self, slave: int) -> float:
        """Return the shaft angle in revolutions, independent of bus and units."""
        self._segment.settle()
        return shaft_rev(self._slave(slave).device)

    def _write(self, slave: int, index: int, subindex: int, data: str) -> None:
        self._segment.settle()
        self._slave(slave).dictionary.write(index, subindex, bytes.fromhex(data))

    def _register(self, slave: int, address: int, length: int = 2) -> int:
        self._segment.settle()
        return register(self._slave(slave), address, length)

    def _stop(self) -> None:
        self.stopped = True


def _check_direction(direction: str) -> None:
    if direction not in ("in", "out"):
        raise ValueError("direction is 'out' (to the slaves) or 'in' (back to the master)")
