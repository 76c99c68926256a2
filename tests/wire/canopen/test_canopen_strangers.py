"""The virtual node under raw frames as hand-written masters send them; the clock is the test's."""

from __future__ import annotations

import struct

import pytest

from drivers.canopen.frames import Frame
from drivers.virtual.wires.canopen import CanopenNode
from tests.wire.canopen.small_device import SmallDevice


class RawMaster:
    """Sends frames to node 5 and takes what comes back."""

    def __init__(self) -> None:
        self.now_ns = 0
        self.device = SmallDevice()
        self.node = CanopenNode(self.device, 5, lambda: self.now_ns)
        self.node.due()  # the boot-up message

    def send(self, cob_id: int, data: str = "", *, remote: bool = False) -> list[str]:
        self.node.take(Frame(cob_id, bytes.fromhex(data), remote=remote))
        return [f"{frame.cob_id:03x}#{frame.data.hex()}" for frame in self.node.due()]

    def sdo(self, request: str) -> str:
        (answer,) = self.send(0x605, request)
        assert answer.startswith("585#")
        return answer[4:]

    def write(self, index: int, subindex: int, value: int, size: int) -> int:
        """Abort code of an expedited write, 0 where it was taken."""
        head = bytes([0x23 | (4 - size) << 2]) + struct.pack("<HB", index, subindex)
        answer = bytes.fromhex(self.sdo((head + value.to_bytes(4, "little")).hex()))
        return 0 if answer[0] == 0x60 else int(struct.unpack("<I", answer[4:])[0])

    def read(self, index: int, subindex: int) -> str:
        return self.sdo((b"\x40" + struct.pack("<HB", index, subindex) + bytes(4)).hex())


@pytest.fixture
def master() -> RawMaster:
    return RawMaster()


@pytest.mark.parametrize(
    ("request_", "place", "kept"),
    [
        ("2240600006000000", (0x6040, 0), b"\x06\x00"),
        ("22602000ff000000", (0x6060, 0), b"\x00"),  # 2060h: no such object, 6060h is untouched
        ("22606000ff000000", (0x6060, 0), b"\xff"),
        ("227a600078563412", (0x607A, 0), b"\x78\x56\x34\x12"),
    ],
)
def test_a_write_that_leaves_its_length_open_has_that_of_the_object(
    master: RawMaster, request_: str, place: tuple[int, int], kept: bytes
) -> None:
    """CiA 301 clause 7.2.4.3.3: e = 1, s = 0 means that the size is not indicated."""
    taken = master.sdo(request_).startswith("60")
    assert taken is (request_[2:6] != "6020")
    assert master.device.read(*place) == kept


def test_a_length_that_is_reported_must_be_the_objects(master: RawMaster) -> None:
    assert master.sdo("2340600006000000")[8:] == "10000706"  # 0607 0010h, little endian
    assert master.sdo("2f40600006000000")[8:] == "10000706"


def test_the_list_of_errors_is_read_and_emptied_as_cia_301_has_it(master: RawMaster) -> None:
    assert master.read(0x1003, 0) == "4f03100000000000"
    assert master.read(0x1003, 1) == "8003100124000008"  # no data available
    assert master.read(0x1003, 9) == "8003100911000906"
    master.device.inject("2310")
    assert master.node.due()[0].cob_id == 0x85
    assert master.read(0x1003, 1) == "4303100110230000"
    assert master.write(0x1003, 1, 0, 4) == 0x06010002
    assert master.write(0x1003, 0, 1, 1) == 0x06090030
    assert master.read(0x1003, 0) == "4f03100001000000"
    assert master.write(0x1003, 0, 0, 1) == 0
    assert master.read(0x1003, 0) == "4f03100000000000"


@pytest.mark.parametrize(
    "taken", [0x000, 0x001, 0x07F, 0x101, 0x180, 0x585, 0x605, 0x6E0, 0x705, 0x780, 0x20000185]
)
@pytest.mark.parametrize("index", [0x1400, 0x1800])
def test_a_pdo_gets_no_identifier_of_another_service(
    master: RawMaster, index: int, taken: int
) -> None:
    """CiA 301 table 40: restricted CAN-IDs; 29-bit identifiers this node does not have."""
    own = int.from_bytes(bytes.fromhex(master.read(index, 1))[4:], "little")
    assert master.write(index, 1, own | 1 << 31, 4) == 0
    assert master.write(index, 1, taken, 4) == 0x06090030
    assert master.write(index, 1, own, 4) == 0


def test_sync_can_be_taken_but_not_sent(master: RawMaster) -> None:
    assert master.write(0x1005, 0, 0x40000080, 4) == 0x06090030
    assert master.write(0x1005, 0, 0, 4) == 0x06090030
    assert master.write(0x1005, 0, 0x81, 4) == 0


def test_inhibit_time_is_set_before_the_pdo_exists(master: RawMaster) -> None:
    assert master.write(0x1800, 3, 500, 2) == 0x08000022
    assert master.write(0x1800, 1, 0x80000185, 4) == 0
    assert master.write(0x1800, 3, 500, 2) == 0  # 50 ms
    assert master.write(0x1800, 2, 254, 1) == 0
    assert master.write(0x1800, 1, 0x185, 4) == 0
    assert master.send(0, "0105") == ["185#5002"]
    master.write(0x6040, 0, 6, 2)
    assert master.node.due() == []  # changed, and kept back
    master.now_ns += 49_000_000
    assert master.node.due() == []
    master.now_ns += 2_000_000
    assert [frame.data.hex() for frame in master.node.due()] == ["3102"]


def test_remote_frames_are_answered_where_the_pdo_allows(master: RawMaster) -> None:
    master.send(0, "0105")
    assert master.send(0x185, remote=True) == ["185#5002"]
    assert master.write(0x1800, 1, 0x80000185, 4) == 0
    assert master.write(0x1800, 1, 0x40000185, 4) == 0
    assert master.send(0x185, remote=True) == []


@pytest.mark.parametrize(
    ("kind", "syncs"), [(1, [1, 1, 1, 1]), (2, [0, 1, 0, 1]), (0, [1, 0, 0, 0])]
)
def test_synchronous_types_count_syncs(master: RawMaster, kind: int, syncs: list[int]) -> None:
    assert master.write(0x1800, 1, 0x80000185, 4) == 0
    assert master.write(0x1800, 2, kind, 1) == 0
    assert master.write(0x1800, 1, 0x185, 4) == 0
    master.send(0, "0105")
    assert [len(master.send(0x80)) for _ in syncs] == syncs


def test_a_block_is_acknowledged_up_to_what_was_sent(master: RawMaster) -> None:
    assert master.sdo("a00810007f000000").startswith("c6")
    assert len(master.send(0x605, "a300000000000000")) == 4  # 27 letters
    assert master.sdo("a2057f0000000000") == "8008100003000405"  # invalid sequence number


def test_each_nmt_command_leads_where_it_should(master: RawMaster) -> None:
    def state() -> str:
        (answer,) = master.send(0x705, remote=True)
        return f"{int(answer[4:], 16) & 0x7F:02x}"

    for command, expected in (("01", "05"), ("02", "04"), ("80", "7f"), ("01", "05")):
        reported = master.send(0, f"{command}05")
        assert set(reported) <= {"185#5002"}  # TPDO 1 is event-driven
        assert state() == expected
    for ignored in ("0106", "5505", "02", "020500"):
        master.send(0, ignored)
        assert state() == "05"
    master.send(0, "0200")  # all nodes: stopped
    assert master.send(0x605, "4041600000000000") == []
    assert master.send(0, "8205") == ["705#00"]
    assert master.send(0, "8100") == ["705#00"]
    assert state() == "7f"


def test_an_error_of_the_network_is_reported_once_and_again_when_it_is_over(
    master: RawMaster,
) -> None:
    """CiA 301 clause 7.2.7.1: one emergency per error, code 0 after it; 7.5.2.2: bits 0 and 4."""
    for value in (0x80000205, 0x205):
        if value == 0x205:
            assert master.write(0x1600, 0, 0, 1) == 0
            assert master.write(0x1600, 1, 0x60400010, 4) == 0
            assert master.write(0x1600, 0, 1, 1) == 0
        assert master.write(0x1400, 1, value, 4) == 0
    master.send(0, "0105")
    assert master.read(0x1001, 0) == "4f01100000000000"
    assert master.send(0x205, "06") == ["085#1082110000000000"]  # PDO too short
    assert master.send(0x205, "06") == []
    assert master.read(0x1001, 0) == "4f01100011000000"
    assert "085#0000000000000000" in master.send(0x205, "0600")
    assert master.read(0x1001, 0) == "4f01100000000000"
    assert master.read(0x1003, 0) == "4f03100001000000"  # code 0 is no error of the list


def test_a_heartbeat_has_its_new_period_at_once(master: RawMaster) -> None:
    assert master.send(0x605, "2b17100088130000") == ["585#6017100000000000", "705#7f"]  # 5000 ms
    assert master.node.due() == []
    assert master.send(0x605, "2b17100064000000") == ["585#6017100000000000", "705#7f"]  # 100 ms
    times_ms = []
    for _ in range(45):
        master.now_ns += 10_000_000
        if master.node.due():
            times_ms.append(master.now_ns // 1_000_000)
    assert times_ms == [100, 200, 300, 400]


def test_a_node_with_heartbeat_is_not_guarded(master: RawMaster) -> None:
    """CiA 301 clause 7.2.8.2.2: one of the two, and the heartbeat where its time is not 0."""
    assert master.send(0x705, remote=True) == ["705#7f"]
    assert len(master.send(0x605, "2b171000e8030000")) == 2
    assert master.send(0x705, remote=True) == []


def test_communication_that_starts_anew_forgets_the_number_of_sync(master: RawMaster) -> None:
    assert master.write(0x1005, 0, 0x90, 4) == 0
    master.send(0, "8205")
    assert master.read(0x1005, 0) == "4305100080000000"


def test_a_refused_block_names_its_own_object(master: RawMaster) -> None:
    """An older transfer may still be under way; clause 7.2.4.3.17 names what is refused."""
    assert master.read(0x1008, 0).startswith("41")  # 27 letters: to be fetched in segments
    assert master.sdo("a43412007f000000") == "8034120000000206"
