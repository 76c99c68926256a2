"""SDO transfers as scripted bytes (CiA 301 v4.2.0 clause 7.2.4.3), and against the server."""

from __future__ import annotations

from binascii import crc_hqx

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.canopen.sdo import transfers as sdo
from drivers.canopen.sdo.channel import SdoChannel
from drivers.errors import LinkTimeout, ProtocolError, Rejected
from drivers.objects.sdo_abort import abort_text, rejected
from drivers.virtual.device import SdoAbort
from drivers.virtual.wires.sdo_server import SdoServer

MUX = b"\x08\x10\x00"


def talk(transfer: sdo.Transfer[object], script: list[tuple[str, str]]) -> object:
    """Run ``transfer`` against (what it must send, what is answered) in hex."""
    answer: bytes | None = None
    for sent, reply in script:
        exchange = next(transfer) if answer is None else transfer.send(answer)
        assert b"".join(exchange.send).hex() == sent.replace(" ", "")
        answer = bytes.fromhex(reply)
    assert answer is not None
    try:
        extra = transfer.send(answer)
    except StopIteration as ended:
        return ended.value
    raise AssertionError(f"it goes on with {extra}")


def test_expedited_upload() -> None:
    script = [("40 00 10 00 00 00 00 00", "43 00 10 00 92 01 02 00")]
    assert talk(sdo.upload(0x1000, 0), script) == b"\x92\x01\x02\x00"


def test_expedited_upload_of_two_bytes_and_without_a_size() -> None:
    request = "40 41 60 00 00 00 00 00"
    assert talk(sdo.upload(0x6041, 0), [(request, "4b 41 60 00 50 02 00 00")]) == b"\x50\x02"
    assert talk(sdo.upload(0x6041, 0), [(request, "42 41 60 00 50 02 00 00")]) == b"\x50\x02\0\0"


def test_segmented_upload() -> None:
    # The example of the CiA 301 literature: 1008h = "Tiny Node - Mega Domains !".
    script = [
        ("40 08 10 00 00 00 00 00", "41 08 10 00 1a 00 00 00"),
        ("60 00 00 00 00 00 00 00", "00 54 69 6e 79 20 4e 6f"),
        ("70 00 00 00 00 00 00 00", "10 64 65 20 2d 20 4d 65"),
        ("60 00 00 00 00 00 00 00", "00 67 61 20 44 6f 6d 61"),
        ("70 00 00 00 00 00 00 00", "15 69 6e 73 20 21 00 00"),
    ]
    assert talk(sdo.upload(0x1008, 0), script) == b"Tiny Node - Mega Domains !"


def test_expedited_download() -> None:
    script = [("2b 17 10 00 e8 03 00 00", "60 17 10 00 00 00 00 00")]
    assert talk(sdo.download(0x1017, 0, b"\xe8\x03"), script) is None


def test_segmented_download() -> None:
    script = [
        ("21 00 20 00 0d 00 00 00", "60 00 20 00 00 00 00 00"),
        ("00 41 20 6c 6f 6e 67 20", "20 00 00 00 00 00 00 00"),
        ("13 73 74 72 69 6e 67 00", "30 00 00 00 00 00 00 00"),
    ]
    assert talk(sdo.download(0x2000, 0, b"A long string"), script) is None


def test_block_upload() -> None:
    text = b"Tiny Node - Mega Domains !"
    crc = crc_hqx(text, 0).to_bytes(2, "little").hex()
    transfer = sdo.block_upload(0x1008, 0)
    assert next(transfer).send[0].hex() == "a40810007f000000"
    assert transfer.send(bytes.fromhex("c6 08 10 00 1a 00 00 00")).send[0].hex()[:2] == "a3"
    for line in ("01 54 69 6e 79 20 4e 6f", "02 64 65 20 2d 20 4d 65", "03 67 61 20 44 6f 6d 61"):
        assert transfer.send(bytes.fromhex(line)).send == ()
    assert transfer.send(bytes.fromhex("84 69 6e 73 20 21 00 00")).send[0].hex()[:6] == "a2047f"
    final = transfer.send(bytes.fromhex("c9" + crc + "00" * 5))
    assert final.send[0][0] == 0xA1
    assert not final.answered
    with pytest.raises(StopIteration) as ended:
        transfer.send(b"")
    assert ended.value.value == text


@pytest.mark.parametrize(
    ("answer", "error"),
    [
        ("80 08 10 00 00 00 02 06", Rejected),
        ("60 08 10 00 00 00 00 00", ProtocolError),
        ("41 08 10 00 ff ff ff ff", ProtocolError),
    ],
)
def test_wrong_answers_end_the_transfer(answer: str, error: type[Exception]) -> None:
    sent: list[bytes] = []

    def send(frame: bytes) -> None:
        sent.append(frame)
        channel.deliver(bytes.fromhex(answer))

    channel = SdoChannel(1, send)
    with pytest.raises(error):
        channel.run(sdo.upload(0x1008, 0), 0.5)
    if error is ProtocolError:  # the server is reported before we raise
        assert sent[-1][:4] == b"\x80" + MUX


def test_a_repeated_segment_is_not_taken_twice() -> None:
    transfer = sdo.upload(0x1008, 0)
    next(transfer)
    transfer.send(bytes.fromhex("41 08 10 00 1a 00 00 00"))
    transfer.send(bytes.fromhex("00 54 69 6e 79 20 4e 6f"))
    reported = transfer.send(bytes.fromhex("00 54 69 6e 79 20 4e 6f"))
    assert reported.send[0] == sdo.abort_frame(MUX, 0x05030000)
    with pytest.raises(ProtocolError, match="twice or was lost"):
        transfer.send(b"")


def test_unknown_abort_codes_keep_their_number() -> None:
    assert "0x12345678" in abort_text(0x12345678).words()
    assert rejected(0x06010002, parameter="6041:00", writing=True).message == (
        "the drive refused the write of 6041:00: the object can only be read (abort 06010002h)"
    )


class Memory:
    """A server with one object, and the frames lost on the way to the client."""

    def __init__(self, data: bytes, *, offers_block: bool = True) -> None:
        self.data = data
        self.server = SdoServer(self._read, self._write, offers_block=offers_block)
        self.first_bytes: list[int] = []

    def _read(self, index: int, subindex: int) -> bytes:
        if index != 0x2000:
            raise SdoAbort(0x06020000)
        return self.data

    def _write(self, index: int, subindex: int, data: bytes) -> None:
        self.data = data

    def channel(self) -> SdoChannel:
        channel = SdoChannel(1, lambda frame: self._exchange(channel, frame))
        return channel

    def _exchange(self, channel: SdoChannel, frame: bytes) -> None:
        self.first_bytes.append(frame[0])
        for answer in self.server.request(frame):
            channel.deliver(answer)


@settings(deadline=None, max_examples=60)
@given(data=st.binary(min_size=1, max_size=2500), block=st.booleans(), offers=st.booleans())
def test_every_length_survives_there_and_back(data: bytes, block: bool, offers: bool) -> None:
    memory = Memory(b"", offers_block=offers)
    channel = memory.channel()
    channel.write(0x2000, 0, data, 0.5)
    assert memory.data == data
    assert channel.read(0x2000, 0, 0.5) == data
    if block and offers:
        assert channel.run(sdo.block_upload(0x2000, 0), 0.5) == data
        channel.run(sdo.block_download(0x2000, 0, data[::-1]), 0.5)
        assert memory.data == data[::-1]


def test_long_objects_really_use_block_transfer_where_offered() -> None:
    with_block, without = Memory(bytes(2000)), Memory(bytes(2000), offers_block=False)
    with_block.channel().read(0x2000, 0, 0.5)
    assert 0xA4 in with_block.first_bytes
    assert 0x60 not in with_block.first_bytes
    channel = without.channel()
    channel.read(0x2000, 0, 0.5)
    assert 0x60 in without.first_bytes


def test_a_node_that_ignores_block_requests_gets_segments() -> None:
    """A node without block transfer should refuse the request; some do not answer at all."""
    long, back = bytes(range(256)) * 8, bytes(range(255, -1, -1)) * 8
    memory, ignored = Memory(long), list[int]()

    def send(frame: bytes) -> None:
        if frame[0] in sdo.BLOCK_REQUESTS:
            ignored.append(frame[0])
            return
        for answer in memory.server.request(frame):
            channel.deliver(answer)

    channel = SdoChannel(1, send)
    channel.write(0x2000, 0, back, 0.05)
    assert memory.data == back
    assert channel.read(0x2000, 0, 0.05) == back
    assert (len(ignored), channel.no_block_transfer) == (1, True)


def test_a_block_lost_in_part_is_sent_again() -> None:
    memory = Memory(bytes(range(100)))
    lost = iter([True, False])

    def send(frame: bytes) -> None:
        answers = memory.server.request(frame)
        if len(answers) > 4 and next(lost):
            del answers[3]
        for answer in answers:
            channel.deliver(answer)

    channel = SdoChannel(1, send)
    assert channel.run(sdo.block_upload(0x2000, 0), 0.5) == bytes(range(100))


def test_a_stop_goes_out_to_a_node_that_cannot_be_heard() -> None:
    """It may hear all the same; what enables waits until it answers (CiA 402: 6040h)."""
    sent: list[bytes] = []
    channel = SdoChannel(1, sent.append)
    with pytest.raises(LinkTimeout):
        channel.read(0x6041, 0, 0.0)
    stop, enable = (bytes([0x2B, 0x40, 0x60, 0, word, 0, 0, 0]) for word in (2, 15))
    with pytest.raises(LinkTimeout, match="nothing was asked"):
        channel.write(0x6040, 0, b"\x0f\0", 0.0)
    assert enable not in sent
    with pytest.raises(LinkTimeout):
        channel.write(0x6040, 0, b"\x02\0", 0.0, at_any_rate=True)
    assert sent[-1] == stop


@given(st.lists(st.binary(min_size=8, max_size=8), max_size=30))
def test_the_server_survives_any_request(frames: list[bytes]) -> None:
    memory = Memory(b"some contents")
    for frame in frames:
        for answer in memory.server.request(frame):
            assert len(answer) == 8


@settings(deadline=None, max_examples=100)
@given(st.lists(st.binary(min_size=8, max_size=8), min_size=1, max_size=40), st.booleans())
def test_the_client_survives_any_answer(frames: list[bytes], block: bool) -> None:
    script = iter(frames)

    def send(_frame: bytes) -> None:
        answer = next(script, None)
        if answer is not None:
            channel.deliver(answer[:1] + b"\x00\x20\x00" + answer[4:])

    channel = SdoChannel(1, send)
    transfer = sdo.block_upload(0x2000, 0) if block else sdo.upload(0x2000, 0)
    try:
        channel.run(transfer, 0.0)
    except (LinkTimeout, Rejected, ProtocolError):
        return
