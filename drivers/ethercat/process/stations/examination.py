"""Reading of everything in a station that shows why it does not reach Operational.

Source: ETG.1000.4 clause 6 (registers), ETG.1020 clause 22 (1C32h, 1C33h).
"""

from __future__ import annotations

import struct

from drivers.errors import DriveError
from drivers.ethercat.exchange.setup import StationSetup
from drivers.ethercat.process.protocol import Message
from drivers.ethercat.process.stations.station import Station, al_status
from drivers.ethercat.wire import coe
from drivers.ethercat.wire.registers import read_again
from drivers.ethercat.wire.steps import Steps

_MANAGERS, _EEPROM, _WATCHDOG, _CLOCK = 0x800, 0x502, 0x400, 0x980
_EEPROM_ERRORS, _EEPROM_BUSY = 0x7800 & ~0x0700, 0x8000
_ASSIGN = (("outputs", 0x1C12), ("inputs", 0x1C13))


def examine(station: Station, setup: StationSetup | None) -> Steps[Message]:
    """Read facts, named as in `drivers.doctor.evidence.Evidence`; ``setup`` is what was planned."""
    found: Message = {"station": station.number, "answers": (yield from al_status(station))}
    found |= {"al": station.al_state, "al_code": station.al_code, "alias": station.alias}
    if not found["answers"]:
        return found
    found |= {"clock": station.distributed_clock, "mailbox": station.mailbox is not None}
    found |= _planned(setup)
    yield from _registers(found, setup)
    if station.distributed_clock:
        yield from _clock(found)
    ports = station.ports.ports if station.ports is not None else ()
    found["port_errors"] = sum(p.rx_errors + p.invalid_frames for p in ports)
    found["lost_links"] = sum(p.lost_links for p in ports)
    if station.mailbox is not None and station.al_state & 0x0F in (2, 4, 8):
        yield from _objects(station, found)
    return found


def _planned(setup: StationSetup | None) -> Message:
    if setup is None:
        return {}
    rules = setup.bring_up
    planned: Message = {
        "planned_outputs": setup.rx.size,
        "planned_inputs": setup.tx.size,
        "planned_activate": rules.activate if setup.sync0 else 0,
    }
    if setup.sync0:
        planned["planned_sync0_ns"] = rules.sync0_cycle_ns
    return planned


def _registers(found: Message, setup: StationSetup | None) -> Steps[None]:
    managers = yield from read_again(_MANAGERS, 32)
    eeprom = yield from read_again(_EEPROM, 2)
    watchdog = yield from read_again(_WATCHDOG, 0x44)
    sizes = (None, None) if setup is None else (setup.rx.size, setup.tx.size)
    if managers is not None:
        found["managers"] = [
            [
                number,
                *struct.unpack_from("<HHB", managers, 8 * number),
                managers[8 * number + 6] & 1,
                sizes[number - 2] if number > 1 else None,
            ]
            for number in range(4)
        ]
    if eeprom is not None:
        status = int.from_bytes(eeprom, "little")
        found["eeprom_busy"] = bool(status & _EEPROM_BUSY)
        found["eeprom_error"] = bool(status & _EEPROM_ERRORS)
    if watchdog is not None:
        divider, time = (struct.unpack_from("<H", watchdog, at)[0] for at in (0, 0x20))
        found["watchdog_ns"] = 40 * (divider + 2) * time
        found["watchdog_expired"] = not watchdog[0x40] & 1


def _clock(found: Message) -> Steps[None]:
    clock = yield from read_again(_CLOCK, 0x28)
    if clock is None:
        return
    found["activate"] = struct.unpack_from("<H", clock, 0)[0]
    found["sync0_ns"] = struct.unpack_from("<I", clock, 0x20)[0]
    found["sync0_pending"] = bool(clock[1] & 2 and clock[4] & 1)


def _objects(station: Station, found: Message) -> Steps[None]:
    assigned: list[int] = []
    for name, index in _ASSIGN:
        pdos = yield from _list(station, index)
        if pdos is None:
            continue
        assigned += pdos
        bits = 0
        for pdo in pdos:
            bits += sum(word & 0xFF for word in (yield from _list(station, pdo)) or ())
        found[name] = (bits + 7) // 8
    found["assigned"] = assigned
    # Identity from the EEPROM, as used by a search; 1018h may belong to other firmware.
    for key, subindex, known in (
        ("vendor", 1, station.vendor_id),
        ("product", 2, station.product_code),
        ("revision", 3, station.revision),
    ):
        found[key] = known or (yield from _number(station, 0x1018, subindex))
    found["drive_error"] = yield from _number(station, 0x603F, 0)
    counters = []
    for subindex in (0x0B, 0x0C, 0x20):
        counters.append((yield from _number(station, 0x1C32, subindex)))
    found["sm_counters"] = counters


def _list(station: Station, index: int) -> Steps[list[int] | None]:
    count = yield from _number(station, index, 0)
    if count is None:
        return None
    values = []
    for subindex in range(1, min(count, 64) + 1):
        value = yield from _number(station, index, subindex)
        values.append(value or 0)
    return values


def _number(station: Station, index: int, subindex: int) -> Steps[int | None]:
    try:
        data = yield from coe.upload(station.box, index, subindex)
    except DriveError:
        return None
    return int.from_bytes(data, "little")
