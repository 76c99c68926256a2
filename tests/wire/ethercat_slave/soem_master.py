"""A bare pysoem master that runs inside the namespace; prints one JSON object.

``python soem_master.py SCENARIO INTERFACE``. Nothing of servodeck is imported here: what SOEM
makes of the segment is the question.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from typing import Any

import pysoem

CYCLE_NS = 1_000_000
# A busy test machine has been seen to stop a process for 115 ms.
ANSWER_US = 1_000_000
LOST_US = 250_000


def opened(interface: str) -> tuple[pysoem.Master, int]:
    master = pysoem.Master()
    master.open(interface)
    found = master.config_init()
    if found > 0:
        master.state_check(pysoem.PREOP_STATE, 2_000_000)
    return master, found


def exchange(master: pysoem.Master, target: int) -> int:
    for slave in master.slaves:
        slave.output = (0x0F).to_bytes(2, "little") + target.to_bytes(4, "little", signed=True)
    master.send_processdata()
    return int(master.receive_processdata(ANSWER_US))


def operational(master: pysoem.Master, dc: bool) -> bool:
    master.config_map()
    if dc:
        master.config_dc()
        for slave in master.slaves:
            slave.dc_sync(act=True, sync0_cycle_time=CYCLE_NS)
    if master.state_check(pysoem.SAFEOP_STATE, 2_000_000) != pysoem.SAFEOP_STATE:
        master.state = pysoem.SAFEOP_STATE
        master.write_state()
        master.state_check(pysoem.SAFEOP_STATE, 2_000_000)
    exchange(master, 0)
    master.state = pysoem.OP_STATE
    master.write_state()
    deadline = time.monotonic() + 3
    while time.monotonic() < deadline:
        exchange(master, 0)
        if master.state_check(pysoem.OP_STATE, 1000) == pysoem.OP_STATE:
            return True
    return False


def everything(interface: str) -> dict[str, Any]:
    """Scan, SDO of all kinds, dictionary, OP, process data."""
    master, found = opened(interface)
    first = master.slaves[0]
    result: dict[str, Any] = {
        "found": found,
        "names": [s.name for s in master.slaves],
        "ids": [[s.man, s.id, s.rev] for s in master.slaves],
        "device_type": first.sdo_read(0x1000, 0).hex(),
        "complete": first.sdo_read(0x2001, 0, ca=True).hex(),
    }
    big = bytes(n * 7 & 0xFF for n in range(1400))
    first.sdo_write(0x2002, 0, big)
    result["segmented"] = first.sdo_read(0x2002, 0, 2000) == big
    try:
        first.sdo_read(0x5555, 0)
    except pysoem.SdoError as error:
        result["abort"] = error.abort_code
    listed = first.od
    result["od"] = [o.index for o in listed]
    result["entries"] = [
        [e.bit_length, e.data_type] for o in listed if o.index == 0x2001 for e in o.entries
    ]
    result["eeprom"] = first.eeprom_read(8).hex()
    first.eeprom_write(4, b"\x05\x00")
    result["alias"] = first.eeprom_read(4)[:2].hex()
    result["op"] = operational(master, dc=True)
    result["expected_wkc"] = master.expected_wkc
    wkcs = set()
    for n in range(200):
        wkcs.add(exchange(master, n))
        time.sleep(0.001)
    result["wkc"] = sorted(wkcs)
    time.sleep(0.003)
    exchange(master, 0)
    time.sleep(0.003)
    exchange(master, 0)
    result["statusword"] = [s.input[2:4].hex() for s in master.slaves]
    master.state = pysoem.INIT_STATE
    master.write_state()
    master.close()
    return result


def lockstep(interface: str) -> dict[str, Any]:
    """As fast as it goes: positions must follow targets with a fixed delay in cycles."""
    master, _ = opened(interface)
    up = operational(master, dc=True)
    for _ in range(5):
        exchange(master, 0)
    positions = []
    for n in range(300):
        exchange(master, n)
        positions.append(int.from_bytes(master.slaves[0].input[4:8], "little"))
    master.close()
    return {"op": up, "positions": positions}


def watchdog(interface: str) -> dict[str, Any]:
    """Stop sending: the slaves must fall to Safe-Op by themselves."""
    master, _ = opened(interface)
    up = operational(master, dc=False)
    time.sleep(0.3)
    master.read_state()
    result = {"op": up, "states": [[s.state, s.al_status] for s in master.slaves]}
    master.close()
    return result


def emergency(interface: str) -> dict[str, Any]:
    """Wait for an emergency while polling the mailbox."""
    master, _ = opened(interface)
    codes: list[int] = []
    master.slaves[0].add_emergency_callback(lambda message: codes.append(message.error_code))
    deadline = time.monotonic() + 3
    print(json.dumps({"ready": True}), flush=True)
    while time.monotonic() < deadline and not codes:
        master.slaves[0].mbx_receive()
        time.sleep(0.005)
    master.close()
    return {"codes": codes[:1]}


def interactive(interface: str) -> dict[str, Any]:
    """In Op; each input line ``N`` is answered by the working counters of N cycles of 2 ms."""
    master, _ = opened(interface)
    for number, slave in enumerate(master.slaves):
        # The first must outlive whatever a busy test machine does, the others are to fall.
        slave.set_watchdog("processdata", 400 if number else 2600)
    print(json.dumps({"op": operational(master, dc=False)}), flush=True)
    for line in sys.stdin:
        wkcs = []
        for n in range(int(line)):
            for slave in master.slaves:
                slave.output = (0x0F).to_bytes(2, "little") + n.to_bytes(4, "little")
            master.send_processdata()
            wkcs.append(int(master.receive_processdata(LOST_US)))
            time.sleep(0.002)
        master.read_state()
        states = [[s.state, s.al_status] for s in master.slaves]
        print(json.dumps({"wkc": wkcs, "states": states}), flush=True)
    master.close()
    return {}


def stranger(interface: str) -> dict[str, Any]:
    """What other programmes with pysoem do with a slave, one thing after the other."""
    master, _ = opened(interface)
    slave = master.slaves[0]
    result: dict[str, Any] = {"empty_mailbox": slave.mbx_receive()}
    record = slave.sdo_read(0x2001, 0, ca=True)
    changed = bytearray(record)
    changed[2:4] = b"\x5a\xa5"
    slave.sdo_write(0x2001, 0, bytes(changed), ca=True)
    result["written_whole"] = slave.sdo_read(0x2001, 1).hex()
    slave.sdo_write(0x2001, 0, record, ca=True)
    words = [slave.eeprom_read(word)[:2] for word in range(0x40)]
    result["mailbox_words"] = b"".join(words[0x18:0x1C]).hex()
    slave.set_watchdog("processdata", 80)
    result["watchdog_ms"] = slave.get_watchdog("processdata")
    slave.state = pysoem.OP_STATE
    slave.write_state()
    time.sleep(0.02)
    master.read_state()
    result["refused"] = [slave.state, slave.al_status]
    slave.state = pysoem.PREOP_STATE + pysoem.STATE_ACK
    slave.write_state()
    result["acknowledged"] = slave.state_check(pysoem.PREOP_STATE, 500_000)
    result["overlap_map"] = master.config_overlap_map() > 0
    result["clock"] = bool(master.config_dc())
    slave.state = pysoem.SAFEOP_STATE
    slave.write_state()
    result["safeop"] = slave.state_check(pysoem.SAFEOP_STATE, 2_000_000)
    master.send_overlap_processdata()
    result["overlap_wkc"] = int(master.receive_processdata(ANSWER_US)) > 0
    slave.state = pysoem.INIT_STATE
    slave.write_state()
    result["init"] = slave.state_check(pysoem.INIT_STATE, 500_000)
    master.close()
    return result


def firmware(interface: str) -> dict[str, Any]:
    """A download as SOEM's own firmware updater does it: INIT, BOOT mailboxes, BOOT, FoE, INIT."""
    master, _ = opened(interface)
    slave = master.slaves[0]
    slave.state = pysoem.INIT_STATE
    slave.write_state()
    result: dict[str, Any] = {"init": slave.state_check(pysoem.INIT_STATE, 500_000)}
    words = b"".join(slave.eeprom_read(word)[:2] for word in range(0x14, 0x18))
    out, out_size, back, back_size = (
        int.from_bytes(words[n : n + 2], "little") for n in range(0, 8, 2)
    )
    slave.amend_mbx("out", out, out_size)
    slave.amend_mbx("in", back, back_size)
    slave.state = pysoem.BOOT_STATE
    slave.write_state()
    result["boot"] = slave.state_check(pysoem.BOOT_STATE, 500_000)
    data = bytes(n % 251 for n in range(3000))
    slave.foe_write("app.bin", 0, data)
    result["same"] = slave.foe_read("app.bin", 0, 4000)[: len(data)] == data
    # SOEM gives back its own error number, or nothing, for a file that is not there.
    missing = slave.foe_read("none.bin", 0, 100)
    result["missing"] = bytes(missing or b"").rstrip(b"\0").hex()
    slave.state = pysoem.INIT_STATE
    slave.write_state()
    result["back"] = slave.state_check(pysoem.INIT_STATE, 500_000)
    master.close()
    return result


SCENARIOS: dict[str, Callable[[str], dict[str, Any]]] = {
    "everything": everything,
    "lockstep": lockstep,
    "watchdog": watchdog,
    "emergency": emergency,
    "interactive": interactive,
    "stranger": stranger,
    "firmware": firmware,
}

if __name__ == "__main__":
    print(json.dumps(SCENARIOS[sys.argv[1]](sys.argv[2])))
