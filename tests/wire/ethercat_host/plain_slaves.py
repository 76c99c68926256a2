"""A segment of slaves that are not ours: written from ETG.1000.4 and ETG.1000.6 alone.

``python plain_slaves.py INTERFACE KIND,KIND,…`` answers EtherCAT frames until it is killed. It
imports nothing of servodeck, and its slaves have the oddities that real ones have:

``coupler``  no mailbox, no process data, an EEPROM without any category
``outputs``  one byte of digital outputs on SM0, no mailbox; categories in an unusual order
``servo``    a drive with fixed process data that cannot be assigned, on swapped sync managers 2
             and 3; mails without numbers, aborts as responses with odd command bits, no complete
             access, no SDO information, emergencies that come before answers, slow states and an
             error left over from before, which must be acknowledged
``bare``     a drive whose EEPROM has a wrong checksum and no category: no strings, no general part,
             no FMMUs, sync managers or PDOs. Its dictionary comes in fragments that end in the
             middle of a number, and with names longer than its mailbox
``fixed``    a servo whose PDOs can be assigned, and whose mapping can only be read
``packed``   a servo whose watchdog divider is 0 at power-on, and which reads an object as a whole
             with a subindex 0 of one byte, where SOEM awaits two
``hasty``    a servo whose sync managers the first search does not get to read, as when frames of
             the search are lost
"""

from __future__ import annotations

import socket
import struct
import sys
import time

RAM = 0x1000
OUT_BOX, IN_BOX, BOX = 0x1000, 0x1080, 128
AL_SLOW_S = 0.03


def category(kind: int, data: bytes) -> bytes:
    return struct.pack("<HH", kind, len(data) // 2) + data


class Slave:
    """Registers, EEPROM, states, FMMUs; no mailbox."""

    vendor, product, name = 0x00000BAD, 0x0001, b""
    managers = b""
    body = b""

    def __init__(self) -> None:
        self.memory = bytearray(0x3000)
        self.memory[0:10] = struct.pack("<BBHBBBBH", 4, 1, 0, 4, 4, 4, 0x0F, 0)
        struct.pack_into("<HHH", self.memory, 0x400, 0x09C2, 0, 0)
        struct.pack_into("<H", self.memory, 0x420, 1000)
        self.memory[0x130] = 1
        self.target, self.due = 0, 0.0
        words = bytearray(0x80)
        struct.pack_into("<II", words, 16, self.vendor, self.product)
        struct.pack_into("<II", words, 24, 0x10, 0xC0FFEE if self.name else 0)
        self.identify(words)
        self.eeprom = bytes(words) + self.body + b"\xff" * 64
        self.answer = bytes(4)

    def identify(self, words: bytearray) -> None:
        """Mailbox words of the EEPROM."""

    def tick(self) -> None:
        if self.target and time.monotonic() >= self.due:
            if self.target in (1, 2, 4, 8):
                self.memory[0x130] = self.target
                self.memory[0x134:0x136] = bytes(2)
            self.target = 0

    def read(self, at: int, size: int) -> bytes | None:
        if at <= 0x502 < at + size:
            self.memory[0x502:0x504] = b"\0\0"
        if at <= 0x508 < at + size:
            self.memory[0x508:0x50C] = self.answer
        return bytes(self.memory[at : at + size])

    def write(self, at: int, data: bytes) -> bool:
        for place, value in enumerate(data, at):
            if not (0x130 <= place < 0x138 or place < 0x10 or 0x110 <= place < 0x112):
                self.memory[place] = value
        if at <= 0x502 < at + len(data) and self.memory[0x503] & 1 and not self.memory[0x500] & 1:
            (word,) = struct.unpack_from("<I", self.memory, 0x504)
            self.answer = self.eeprom[2 * word : 2 * word + 4].ljust(4, b"\xff")
        if at <= 0x120 < at + len(data):
            self.control(self.memory[0x120])
        return True

    def control(self, word: int) -> None:
        state = self.memory[0x130]
        if state & 0x10:
            if word & 0x10:
                self.memory[0x130] = state & 0x0F
                self.memory[0x134:0x136] = bytes(2)
            return
        self.target, self.due = word & 0x0F, time.monotonic() + self.slow()

    def slow(self) -> float:
        return 0.0

    def logical(self, address: int, data: bytearray, read: bool, write: bool) -> int:
        counted = 0
        for at in range(0x600, 0x640, 16):
            start, size, _b, _e, physical, _p, kind, active = struct.unpack_from(
                "<IHBBHBBB", self.memory, at
            )
            low, high = max(start, address), min(start + size, address + len(data))
            if not active & 1 or low >= high:
                continue
            place = physical + low - start
            part = slice(low - address, high - address)
            if write and kind & 2:
                self.memory[place : place + high - low] = data[part]
                self.outputs()
                counted += 2 if read else 1
            if read and kind & 1:
                self.inputs()
                data[part] = self.memory[place : place + high - low]
                counted += 1
        return counted

    def outputs(self) -> None:
        """New process data have come."""

    def inputs(self) -> None:
        """Process data are about to be read."""


class Coupler(Slave):
    pass


class Outputs(Slave):
    product = 0x0002
    body = (
        category(41, struct.pack("<HHBBBB", 0x0F00, 1, 0x44, 0, 1, 3))
        + category(
            51,
            struct.pack("<HBBBBH", 0x1600, 1, 0, 0, 0, 0)
            + struct.pack("<HBBBBH", 0x7000, 1, 0, 5, 8, 0),
        )
        + category(40, b"\x01\0")
        + category(30, bytes(32))
        + category(0x0800, b"maker's own.")
    )


class Servo(Slave):
    product, name = 0x0402, b"ODD-1"
    outputs_at, inputs_at = 0x1300, 0x1200
    only_read: tuple[int, ...] = (0x1C12, 0x1C13, 0x1600, 0x1A00)
    body = (
        category(30, bytes([0, 0, 0, 1, 0, 0x01]) + bytes(26))
        + category(
            41,
            struct.pack("<HHBBBB", OUT_BOX, BOX, 0x26, 0, 1, 1)
            + struct.pack("<HHBBBB", IN_BOX, BOX, 0x22, 0, 1, 2)
            + struct.pack("<HHBBBB", inputs_at, 0, 0x20, 0, 1, 4)
            + struct.pack("<HHBBBB", outputs_at, 0, 0x24, 0, 1, 3),
        )
        + category(10, b"\x01" + bytes([5]) + b"ODD-1" + b"\0")
        + category(40, b"\x02\x01\x03\0")
    )

    def __init__(self) -> None:
        super().__init__()
        self.memory[0x130], self.memory[0x134] = 0x11, 0x11
        self.full_out = self.full_in = False
        self.queue: list[bytes] = []
        self.last, self.repeat = b"", 0
        self.answers = 0
        self.last_counter = 0
        self.state = 0x0250
        self.position = 0
        self.objects: dict[tuple[int, int], bytes] = {
            (0x1000, 0): struct.pack("<I", 0x00020192), (0x1008, 0): b"ODD-1 drive",
            (0x1018, 0): b"\x04", (0x1018, 1): struct.pack("<I", self.vendor),
            (0x1018, 2): struct.pack("<I", self.product), (0x1018, 3): struct.pack("<I", 0x10),
            (0x1018, 4): struct.pack("<I", 0xC0FFEE),
            (0x1C00, 0): b"\x04", (0x1C00, 1): b"\x01", (0x1C00, 2): b"\x02",
            (0x1C00, 3): b"\x04", (0x1C00, 4): b"\x03",
            (0x1C12, 0): b"\x01", (0x1C12, 1): struct.pack("<H", 0x1A00),
            (0x1C13, 0): b"\x01", (0x1C13, 1): struct.pack("<H", 0x1600),
            (0x1600, 0): b"\x02", (0x1600, 1): struct.pack("<I", 0x60400010),
            (0x1600, 2): struct.pack("<I", 0x607A0020),
            (0x1A00, 0): b"\x02", (0x1A00, 1): struct.pack("<I", 0x60410010),
            (0x1A00, 2): struct.pack("<I", 0x60640020),
            (0x2000, 0): b"\x02", (0x2000, 1): b"\x11\x22", (0x2000, 2): b"\x33\x44",
            (0x6060, 0): b"\x08", (0x6061, 0): b"\x08",
        }  # fmt: skip

    def identify(self, words: bytearray) -> None:
        struct.pack_into("<HHHH", words, 0x30, OUT_BOX, BOX, IN_BOX, BOX)
        struct.pack_into("<H", words, 0x38, 0x04)

    def slow(self) -> float:
        return AL_SLOW_S

    def read(self, at: int, size: int) -> bytes | None:
        if at == IN_BOX and size == BOX:
            if not self.full_in:
                return None
            self.last, self.full_in = bytes(self.memory[at : at + size]), False
            self.put()
            return self.last
        self.memory[0x805] = 8 if self.full_out else 0
        self.memory[0x80D] = 8 if self.full_in else 0
        return super().read(at, size)

    def write(self, at: int, data: bytes) -> bool:
        if at != OUT_BOX or len(data) != BOX:
            super().write(at, data)
            self.repeated()
            return True
        counter = data[5] >> 4
        if counter and counter == self.last_counter:
            return True
        self.last_counter = counter
        length = int.from_bytes(data[:2], "little")
        self.mail(data[5] & 0x0F, data[6 : 6 + length])
        return True

    def repeated(self) -> None:
        """The repeat request has been toggled (ETG.1000.4 clause 6.7.3): the last mail again."""
        asked = self.memory[0x80E] & 2
        if asked != self.repeat and self.last:
            # What lies in the mailbox has not been read: it comes after the repeated one.
            if self.full_in:
                self.queue.insert(0, bytes(self.memory[IN_BOX : IN_BOX + BOX]))
                self.full_in = False
            self.queue.insert(0, self.last)
            self.put()
        self.repeat = asked
        self.memory[0x80F] = self.memory[0x80F] & ~2 | asked

    def put(self) -> None:
        if self.queue and not self.full_in:
            self.memory[IN_BOX : IN_BOX + BOX] = self.queue.pop(0).ljust(BOX, b"\0")
            self.full_in = True

    def post(self, payload: bytes, kind: int = 3) -> None:
        """Without a number of its own: counter 0."""
        self.queue.append(struct.pack("<HHBB", len(payload), 0, 0, kind) + payload)
        self.put()

    def mail(self, kind: int, payload: bytes) -> None:
        if kind != 3 or payload[1] >> 4 != 2:
            self.post(struct.pack("<HH", 1, 2), kind=0)
            return
        command, index, sub = struct.unpack_from("<BHB", payload, 2)
        self.answers += index == 0x2000
        if index == 0x2000 and self.answers % 5 == 0:
            self.post(struct.pack("<HHB5x", 0x1000, 0x8130, 0x11))
        mux = payload[3:6]
        known = self.objects.get((index, sub))
        if command & 0xE0 == 0x80:
            return
        if command & 0x10:
            self.abort(mux, 0x06010000)
        elif known is None:
            self.abort(mux, 0x06090011 if (index, 0) in self.objects else 0x06020000)
        elif command & 0xE0 == 0x40:
            self.upload(mux, known)
        elif index in self.only_read:
            self.abort(mux, 0x06010002)
        else:
            self.objects[index, sub] = payload[6 : 6 + len(known)]
            self.post(struct.pack("<H", 0x3000) + b"\x60" + mux + bytes(4))

    def upload(self, mux: bytes, value: bytes) -> None:
        """Never expedited without need: short values with their size, long ones in one mail."""
        if len(value) <= 4:
            head = bytes([0x43 | (4 - len(value)) << 2])
            self.post(struct.pack("<H", 0x3000) + head + mux + value.ljust(4, b"\0"))
        else:
            size = struct.pack("<I", len(value))
            self.post(struct.pack("<H", 0x3000) + b"\x41" + mux + size + value)

    def abort(self, mux: bytes, code: int) -> None:
        self.post(struct.pack("<H", 0x3000) + b"\x84" + mux + struct.pack("<I", code))

    def outputs(self) -> None:
        word, target = struct.unpack_from("<Hi", self.memory, self.outputs_at)
        if self.memory[0x130] != 8:
            return
        low = word & 0x0F
        order = {0x06: 0x0231, 0x07: 0x0233, 0x0F: 0x0237}
        self.state = order.get(low, 0x0250)
        if self.state == 0x0237:
            self.position = target

    def inputs(self) -> None:
        struct.pack_into("<Hi", self.memory, self.inputs_at, self.state, self.position)


LONG = "Thing of the maker, reported at length and of little use, " * 9
"""Longer than three mailboxes."""

FRAGMENT = 103


class Bare(Servo):
    product, name = 0x0B0B, b"?"
    body = b""

    def __init__(self) -> None:
        super().__init__()
        for n in range(300):
            self.objects[0x3000 + n, 0] = struct.pack("<H", n)
        self.sent = 0

    def post(self, payload: bytes, kind: int = 3) -> None:
        """With a number, so that a repeated mail is known as such."""
        self.sent = self.sent % 7 + 1
        self.queue.append(struct.pack("<HHBB", len(payload), 0, 0, kind | self.sent << 4) + payload)
        self.put()

    def mail(self, kind: int, payload: bytes) -> None:
        if kind != 3 or payload[1] >> 4 != 8:
            super().mail(kind, payload)
            return
        opcode, data = payload[2], payload[6:]
        index = int.from_bytes(data[:2], "little")
        known = sorted({i for i, _ in self.objects})
        if opcode == 1:
            self.tell(2, data[:2] + b"".join(struct.pack("<H", i) for i in known))
            return
        subs = [s for i, s in self.objects if i == index]
        if not subs or (opcode == 5 and data[2] not in subs):
            self.post(struct.pack("<HBBHI", 0x8000, 7, 0, 0, 0x06020000))
        elif opcode == 3:
            reported = struct.pack("<HHBB", index, 6, max(subs), 9 if len(subs) > 1 else 7)
            self.tell(4, reported + f"{index:04X} {LONG}".encode())
        else:
            value = self.objects[index, data[2]]
            reported = struct.pack("<HBBHHH", index, data[2], 0, 6, 8 * len(value), 0x3F)
            self.tell(6, reported + f"entry {data[2]} {LONG}".encode())

    def tell(self, opcode: int, data: bytes) -> None:
        """Fragments, each with the number of those that follow (ETG.1000.6 clause 5.6.3.2)."""
        parts = [data[at : at + FRAGMENT] for at in range(0, len(data), FRAGMENT)]
        for left, part in zip(range(len(parts) - 1, -1, -1), parts, strict=True):
            more = 0x80 if left else 0
            self.post(struct.pack("<HBBH", 0x8000, opcode | more, 0, left) + part)


class Fixed(Servo):
    product = 0x0404
    only_read = (0x1600, 0x1A00)


class Packed(Servo):
    product = 0x0405
    body = Servo.body.replace(bytes([0, 0, 0, 1, 0, 0x01]), bytes([0, 0, 0, 1, 0, 0x21]), 1)

    def __init__(self) -> None:
        super().__init__()
        struct.pack_into("<H", self.memory, 0x400, 0)

    def mail(self, kind: int, payload: bytes) -> None:
        command, index, _ = struct.unpack_from("<BHB", payload, 2)
        whole = kind == 3 and payload[1] >> 4 == 2 and command & 0xF0 == 0x50
        entries = sorted(sub for i, sub in self.objects if i == index)
        if whole and entries:
            self.upload(payload[3:6], b"".join(self.objects[index, sub] for sub in entries))
        elif whole:
            refusal = b"\x90" + payload[3:6] + struct.pack("<I", 0x06020000)
            self.post(struct.pack("<H", 0x2000) + refusal)
        else:
            super().mail(kind, payload)


class Hasty(Servo):
    product = 0x0403
    managers_at = 2 * 0x52  # behind the general category

    def __init__(self) -> None:
        super().__init__()
        self.searches = 0

    def write(self, at: int, data: bytes) -> bool:
        if at <= 0x10 < at + len(data):
            self.searches += 1
        written = super().write(at, data)
        if at <= 0x502 < at + len(data) and self.searches < 2 and self.memory[0x130] & 0x0F == 1:
            (word,) = struct.unpack_from("<I", self.memory, 0x504)
            seen = bytearray(self.answer)
            for place in (self.managers_at, self.managers_at + 1):
                if 0 <= place - 2 * word < len(seen):
                    seen[place - 2 * word] = 0x0F  # a category that is unknown
            self.answer = bytes(seen)
        return written


KINDS = {"coupler": Coupler, "outputs": Outputs, "servo": Servo, "bare": Bare, "fixed": Fixed,
         "packed": Packed, "hasty": Hasty}  # fmt: skip


def station(slave: Slave) -> int:
    return int(struct.unpack_from("<H", slave.memory, 0x10)[0])


def physical(slave: Slave, kind: int, at: int, data: bytes, broadcast: bool) -> tuple[bytes, int]:
    counted, answer = 0, data
    if kind != 1:
        reported = slave.read(at, len(data))
        if reported is not None:
            answer = (
                bytes(a | b for a, b in zip(data, reported, strict=True)) if broadcast else reported
            )
            counted += 1
    if kind != 0 and slave.write(at, data):
        counted += 2 if kind == 2 else 1
    return answer, counted


def handle(slaves: list[Slave], frame: bytearray) -> None:
    at = 16
    while True:
        command = frame[at]
        position, offset = struct.unpack_from("<HH", frame, at + 2)
        word = struct.unpack_from("<H", frame, at + 6)[0]
        size = word & 0x7FF
        data, counter = bytearray(frame[at + 10 : at + 10 + size]), 0
        for slave in slaves:
            slave.tick()
            if command in (10, 11, 12):
                counter += slave.logical(
                    position | offset << 16, data, read=command != 11, write=command != 10
                )
            elif 1 <= command <= 9:
                mine = position == 0 if command <= 3 else command >= 7 or position == station(slave)
                if mine:
                    reported, counted = physical(
                        slave, (command - 1) % 3, offset, bytes(data), command >= 7
                    )
                    data[:] = reported
                    counter += counted
                if command <= 3 or command >= 7:
                    position = (position + 1) & 0xFFFF
        if command not in (10, 11, 12):
            struct.pack_into("<H", frame, at + 2, position)
        frame[at + 10 : at + 10 + size] = data
        struct.pack_into("<H", frame, at + 10 + size, counter)
        if not word & 0x8000:
            return
        at += 12 + size


def main() -> None:
    slaves = [KINDS[name]() for name in sys.argv[2].split(",")]
    for number, slave in enumerate(slaves):
        # Link and communication on port 0, and on port 1 where another slave follows.
        follows = number + 1 < len(slaves)
        struct.pack_into("<H", slave.memory, 0x110, 0x0A31 if follows else 0x0611)
    wire = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, 0)
    wire.setsockopt(263, 23, 1)  # SOL_PACKET, PACKET_IGNORE_OUTGOING
    wire.bind((sys.argv[1], 0x88A4))
    print("ready", flush=True)
    while True:
        frame = bytearray(wire.recv(2048))
        handle(slaves, frame)
        frame[6] |= 0x02
        wire.send(frame)


if __name__ == "__main__":
    main()
