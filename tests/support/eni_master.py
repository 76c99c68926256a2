"""A master that knows of a segment what its ENI says, and nothing else.

As a script: ``python -m tests.support.eni_master ENI INTERFACE`` brings every slave to
Operational, exchanges process data for a while and prints what it saw as one JSON object.
"""

from __future__ import annotations

import json
import socket
import struct
import sys
import time
from collections.abc import Callable
from pathlib import Path
from xml.etree.ElementTree import Element

from defusedxml.ElementTree import parse

_TRANSITIONS = ("IP", "PS", "SO")
_LOGICAL = (10, 11, 12)
_START_TIME, _SYSTEM_TIME, _LEAD_NS = 0x990, 0x910, 50_000_000
Exchange = Callable[[bytes], bytes]


class Refused(Exception):
    """A command of the ENI did not do what the ENI expects."""


def _int(element: Element, tag: str, otherwise: int = 0) -> int:
    text = element.findtext(tag)
    return int(text) if text else otherwise


def frame(parts: list[tuple[int, bytes, bytes]]) -> bytes:
    """Ethernet frame of datagrams (command, 4 bytes of address, data)."""
    body = b""
    for number, (command, address, data) in enumerate(parts):
        more = 0x8000 if number + 1 < len(parts) else 0
        body += bytes([command, number]) + address
        body += struct.pack("<HH", len(data) | more, 0) + data + b"\0\0"
    head = b"\xff" * 6 + b"\x02" * 6 + b"\x88\xa4" + struct.pack("<H", len(body) | 0x1000)
    return (head + body).ljust(60, b"\0")


class EniMaster:
    """Runs the commands of an ENI over ``exchange``, which gives a frame back as it returned."""

    def __init__(self, root: Element, exchange: Exchange) -> None:
        config = root.find("Config")
        assert config is not None
        self.config, self.exchange = config, exchange
        self.slaves = config.findall("Slave")
        self._counters = [0] * len(self.slaves)
        self.wkc: list[tuple[int, int]] = []
        """Of cyclic commands that expect one: what came and what the ENI expects."""

    def one(self, command: int, address: bytes, data: bytes) -> tuple[bytes, int]:
        """One datagram: data and working counter."""
        back = self.exchange(frame([(command, address, data)]))
        found = back[26 : 26 + len(data)]
        return found, struct.unpack_from("<H", back, 26 + len(data))[0]

    # --- transitions ------------------------------------------------------------------

    def start(self) -> None:
        """From wherever the slaves are to Operational, transition by transition."""
        for transition in _TRANSITIONS:
            master = self.config.find("Master")
            assert master is not None
            self._registers(master, transition)
            for number, slave in enumerate(self.slaves):
                mailbox_first = transition != "IP"
                if mailbox_first:
                    self._mailbox(number, slave, transition)
                if transition == "SO":
                    self.cycle("SAFEOP")
                self._registers(slave, transition)
                if not mailbox_first:
                    self._mailbox(number, slave, transition)

    def _registers(self, of: Element, transition: str) -> None:
        for command in of.iterfind("InitCmds/InitCmd"):
            if transition in [each.text for each in command.findall("Transition")]:
                self._init_command(command, transition)

    def _init_command(self, command: Element, transition: str) -> None:
        ado = _int(command, "Ado")
        address = struct.pack("<HH", _int(command, "Adp"), ado)
        data = bytes.fromhex(command.findtext("Data") or "")
        data = data or bytes(_int(command, "DataLength"))
        kind = _int(command, "Cmd")
        if ado == _START_TIME and not any(data):
            data = self._start_time(address)
        validate = command.find("Validate")
        limit = time.monotonic() + (_int(validate, "Timeout") / 1000 if validate is not None else 0)
        while True:
            found, wkc = self.one(kind, address, data)
            name = f"{command.findtext('Comment')} ({transition})"
            expected = command.findtext("Cnt")
            if expected is not None and wkc != int(expected):
                raise Refused(f"{name}: working counter {wkc}, {expected} was expected")
            if validate is None:
                return
            wanted = bytes.fromhex(validate.findtext("Data") or "")
            mask = bytes.fromhex(validate.findtext("DataMask") or "ff" * len(wanted))
            if all(f & m == w & m for f, w, m in zip(found, wanted, mask, strict=True)):
                return
            if time.monotonic() > limit:
                raise Refused(f"{name}: {found.hex()} where {wanted.hex()} was expected")
            if transition == "SO":
                self.cycle("SAFEOP")

    def _start_time(self, address: bytes) -> bytes:
        """ETG.1020: the first SYNC0 lies ahead of the slave's system time."""
        station = address[:2]
        now, _ = self.one(4, station + struct.pack("<H", _SYSTEM_TIME), bytes(8))
        return struct.pack("<Q", struct.unpack("<Q", now)[0] + _LEAD_NS)

    # --- mailbox ----------------------------------------------------------------------

    def _mailbox(self, number: int, slave: Element, transition: str) -> None:
        for command in slave.iterfind("Mailbox/CoE/InitCmds/InitCmd"):
            if transition in [each.text for each in command.findall("Transition")]:
                data = bytes.fromhex(command.findtext("Data") or "")
                index, subindex = _int(command, "Index"), _int(command, "SubIndex")
                self._download(number, slave, index, subindex, data)

    def _download(
        self, number: int, slave: Element, index: int, subindex: int, data: bytes
    ) -> None:
        # ETG.1000.6 clause 5.6.2: expedited up to four bytes, else with the size in front.
        if len(data) <= 4:
            size = (4 - len(data)) << 2
            request = struct.pack("<BHB", 0x23 | size, index, subindex) + data.ljust(4, b"\0")
        else:
            request = struct.pack("<BHBI", 0x21, index, subindex, len(data)) + data
        answer = self._ask(number, slave, struct.pack("<H", 2 << 12) + request)
        if answer[2] & 0xE0 != 0x60:
            code = int.from_bytes(answer[6:10], "little")
            raise Refused(f"{index:04X}h:{subindex}: SDO abort 0x{code:08X}")

    def _ask(self, number: int, slave: Element, payload: bytes) -> bytes:
        send, receive = slave.find("Mailbox/Send"), slave.find("Mailbox/Recv")
        assert send is not None
        assert receive is not None
        info = slave.find("Info")
        assert info is not None
        station = struct.pack("<H", _int(info, "PhysAddr"))
        self._counters[number] = self._counters[number] % 7 + 1
        head = struct.pack("<HHBB", len(payload), 0, 0, 3 | self._counters[number] << 4)
        out = (head + payload).ljust(_int(send, "Length"), b"\0")
        _, wkc = self.one(5, station + struct.pack("<H", _int(send, "Start")), out)
        if wkc != 1:
            raise Refused(f"slave {number + 1} takes no mail")
        place = station + struct.pack("<H", _int(receive, "Start"))
        limit = time.monotonic() + 5
        while time.monotonic() < limit:
            status, _ = self.one(4, station + struct.pack("<H", 0x80D), b"\0")
            if status[0] & 0x08:
                back, wkc = self.one(4, place, bytes(_int(receive, "Length")))
                if wkc == 1 and back[5] & 0x0F == 3 and back[7] >> 4 == 3:
                    return back[6:]
        raise Refused(f"slave {number + 1} does not answer its mail")

    # --- process data -----------------------------------------------------------------

    def cycle(self, state: str) -> None:
        """One cyclic frame of the ENI, as far as it is sent in this state."""
        parts, expected = [], []
        for command in self.config.iterfind("Cyclic/Frame/Cmd"):
            if state not in [each.text for each in command.findall("State")]:
                continue
            kind = _int(command, "Cmd")
            if kind in _LOGICAL:
                address = struct.pack("<I", _int(command, "Addr"))
            else:
                address = struct.pack("<HH", _int(command, "Adp"), _int(command, "Ado"))
            parts.append((kind, address, bytes(_int(command, "DataLength"))))
            expected.append(command.findtext("Cnt"))
        back = self.exchange(frame(parts))
        at = 16
        for (_, _, data), count in zip(parts, expected, strict=True):
            at += 10 + len(data)
            if count is not None:
                self.wkc.append((struct.unpack_from("<H", back, at)[0], int(count)))
            at += 2

    def states(self) -> list[int]:
        """AL status of every slave."""
        found = []
        for slave in self.slaves:
            info = slave.find("Info")
            assert info is not None
            address = struct.pack("<HH", _int(info, "PhysAddr"), 0x130)
            found.append(self.one(4, address, b"\0\0")[0][0])
        return found


def over(interface: str) -> Exchange:
    """Frames over a raw socket; a frame that is lost is an error."""
    ear = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(0x88A4))
    ear.bind((interface, 0))
    ear.settimeout(2.0)

    def exchange(sent: bytes) -> bytes:
        ear.send(sent)
        while True:
            back = ear.recv(2048)
            # One's own frame is seen on its way out as well: slaves set a bit of the source.
            if back[6:12] != sent[6:12] or back[16:] != sent[16:]:
                return back

    return exchange


def main() -> int:
    """Entry point of the script."""
    root = parse(Path(sys.argv[1])).getroot()
    assert root is not None
    master = EniMaster(root, over(sys.argv[2]))
    try:
        master.start()
        master.wkc.clear()
        for _ in range(100):
            master.cycle("OP")
            time.sleep(0.001)
    except Refused as refused:
        print(json.dumps({"refused": str(refused)}))
        return 0
    print(json.dumps({"states": master.states(), "wkc": sorted(set(master.wkc))}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
