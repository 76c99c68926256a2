"""SOEM against the segment over a veth pair, in a namespace of an ordinary user."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from drivers.errors import LinkLost
from drivers.virtual.wires.ethercat.launch import VirtualSegment
from drivers.virtual.wires.netns import Namespace, NamespaceUnavailable

HERE = Path(__file__).parent
FACTORY = "tests.wire.ethercat_slave.dictionary_device:make_device"
MASTER, SLAVE = "ec0m", "ec0s"
SHARED_MASTER, SHARED_SLAVE = "ec1m", "ec1s"


@pytest.fixture(scope="module")
def namespace() -> Iterator[Namespace]:
    try:
        made = Namespace.create([(MASTER, SLAVE), (SHARED_MASTER, SHARED_SLAVE)])
    except NamespaceUnavailable as error:
        pytest.skip(str(error))
    with made:
        yield made


def segment(
    namespace: Namespace, count: int, *options: str, interface: str = SLAVE
) -> VirtualSegment:
    drives = ["--drive", "dictionary"] * count
    return VirtualSegment.start(interface, [*drives, "--factory", FACTORY, *options], namespace)


@pytest.fixture(scope="module")
def shared(namespace: Namespace) -> Iterator[VirtualSegment]:
    """Two slaves that several tests use one after the other, as a real bench."""
    with segment(namespace, 2, interface=SHARED_SLAVE) as running:
        yield running


def start(namespace: Namespace, scenario: str, interface: str = MASTER) -> subprocess.Popen[str]:
    script = str(HERE / "soem_master.py")
    return namespace.popen(
        [sys.executable, script, scenario, interface],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )


def finish(process: subprocess.Popen[str]) -> dict[str, Any]:
    try:
        out, err = process.communicate(timeout=60)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        raise
    assert process.returncode == 0, err
    answer: dict[str, Any] = json.loads(out.splitlines()[-1])
    return answer


@pytest.mark.long
@pytest.mark.parametrize("count", [1, 4])
def test_soem_takes_the_segment_to_op(namespace: Namespace, count: int) -> None:
    with segment(namespace, count) as running:
        got = finish(start(namespace, "everything"))
        state = running.command("state")
    assert got["found"] == count
    assert got["names"] == ["DICT-1"] * count
    assert got["ids"] == [[0xABCD, 0x1234, 0x00010002]] * count
    assert got["device_type"] == "92010200"
    assert got["complete"] == "0300" + "2211" + "33" + "77665544"
    assert got["segmented"] is True
    assert got["abort"] == 0x06020000
    assert got["od"] == sorted(got["od"])
    assert {0x1000, 0x1603, 0x1C12, 0x2001, 0x6041} <= set(got["od"])
    assert got["entries"] == [[8, 5], [16, 6], [8, 5], [32, 7]]
    assert got["eeprom"].startswith("cdab0000")
    assert got["alias"] == "0500"
    assert got["op"] is True
    assert got["expected_wkc"] == 3 * count
    assert got["wkc"] == [3 * count]
    assert got["statusword"] == ["5002"] * count
    assert [s["station"] for s in state["slaves"]] == [0x1001 + n for n in range(count)]


@pytest.mark.long
def test_in_lockstep_a_target_comes_back_as_position_two_frames_later(
    namespace: Namespace,
) -> None:
    """Set by frame n, taken at the next SYNC0, followed one cycle later, read by frame n + 2."""
    with segment(namespace, 4, "--lockstep", "--al-ms", "0", "--sdo-ms", "0"):
        got = finish(start(namespace, "lockstep"))
    assert got["op"] is True
    assert got["positions"][2:] == list(range(298))


@pytest.mark.long
def test_without_process_data_the_watchdog_acts(
    namespace: Namespace, shared: VirtualSegment
) -> None:
    got = finish(start(namespace, "watchdog", SHARED_MASTER))
    assert got["op"] is True
    assert got["states"] == [[0x14, 0x1B]] * 2


def test_an_emergency_reaches_the_master(namespace: Namespace, shared: VirtualSegment) -> None:
    process = start(namespace, "emergency", SHARED_MASTER)
    assert process.stdout is not None
    assert json.loads(process.stdout.readline()) == {"ready": True}
    shared.command("inject", slave=0, what="emergency", value=0x7305)
    assert finish(process)["codes"] == [0x7305]


@pytest.mark.long
def test_what_strangers_do_with_pysoem(namespace: Namespace) -> None:
    with segment(namespace, 1):
        got = finish(start(namespace, "stranger"))
    assert got["empty_mailbox"] <= 0, "nothing there, as SOEM tells it"
    assert got["written_whole"] == "5aa5"
    assert got["mailbox_words"] == "0010000100110001", "1000h and 1100h, 256 bytes each"
    assert got["watchdog_ms"] == pytest.approx(80, rel=0.01)
    assert got["refused"] == [0x12, 0x11], "from PREOP straight to OP is no step"
    assert got["acknowledged"] == 2
    assert got["overlap_map"] is True
    assert got["clock"] is True
    assert got["safeop"] == 4
    assert got["overlap_wkc"] is True
    assert got["init"] == 1


@pytest.mark.long
def test_soems_own_way_of_loading_firmware(namespace: Namespace) -> None:
    drives = ["--drive", "firmware", "--factory", FACTORY]
    with VirtualSegment.start(SLAVE, drives, namespace) as running:
        got = finish(start(namespace, "firmware"))
        files = running.command("files", slave=0)
    assert (got["init"], got["boot"], got["back"]) == (1, 3, 1)
    assert got["same"] is True
    assert got["missing"] == ""
    whole = hashlib.sha256(bytes(n % 251 for n in range(3000))).hexdigest()
    assert files == {"app.bin": whole}


class Master:
    """The interactive scenario: cycles on demand."""

    def __init__(self, namespace: Namespace) -> None:
        script = str(HERE / "soem_master.py")
        self._process = namespace.popen(
            [sys.executable, script, "interactive", SHARED_MASTER],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        assert self._answer() == {"op": True}

    def cycles(self, count: int) -> tuple[list[int], list[list[int]]]:
        assert self._process.stdin is not None
        self._process.stdin.write(f"{count}\n")
        self._process.stdin.flush()
        answer = self._answer()
        return answer["wkc"], answer["states"]

    def __enter__(self) -> Master:
        return self

    def __exit__(self, *_: object) -> None:
        try:
            self._process.communicate(timeout=20)
        finally:
            self._process.kill()
            self._process.wait()

    def _answer(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        answer: dict[str, Any] = json.loads(self._process.stdout.readline())
        return answer


@pytest.mark.long
def test_trouble_on_the_wire_as_the_master_sees_it(
    namespace: Namespace, shared: VirtualSegment
) -> None:
    with Master(namespace) as master:
        assert master.cycles(3)[0] == [6, 6, 6]

        shared.command("lose", count=2, cyclic=True)
        assert master.cycles(4)[0] == [-1, -1, 6, 6]

        shared.command("counter", by=-3, count=1)
        assert master.cycles(3)[0] == [3, 6, 6]

        # 400 ms late: the master has given up after 250 ms.
        shared.command("late", by_s=0.4, count=1, cyclic=True)
        assert master.cycles(20)[0][0] == -1
        assert shared.command("state")["trouble"]["late"] == 1

        shared.command("late", by_s=0.02, count=3, cyclic=True, direction="out")
        wkcs, _ = master.cycles(3)
        assert wkcs == [6, 6, 6]  # late, and still in the master's time
        assert shared.command("state")["trouble"]["late"] == 4

        shared.command("cut", cable=1)
        wkcs, _ = master.cycles(250)  # at least 500 ms
        assert wkcs[-1] == 3
        shared.command("heal")
        wkcs, states = master.cycles(3)
        # Back on the cable, in Safe-Op by its watchdog; there it still exchanges data.
        assert wkcs[-1] == 6
        assert states == [[8, 0], [0x14, 0x1B]]

        shared.command("cut", cable=0)
        assert set(master.cycles(2)[0]) == {-1}
        shared.command("heal", cable=0)
        assert master.cycles(10)[0][-1] == 6


@pytest.mark.long
def test_one_segment_per_interface(namespace: Namespace, shared: VirtualSegment) -> None:
    with pytest.raises(LinkLost, match="already answers on ec1s"):
        segment(namespace, 1, interface=SHARED_SLAVE)
    assert len(shared.command("state")["slaves"]) == 2


@pytest.mark.long
def test_a_wrong_interface_and_a_wrong_drive_are_reported_in_words(namespace: Namespace) -> None:
    with pytest.raises(LinkLost, match="cannot use interface nosuch0"):
        VirtualSegment.start("nosuch0", ["--drive", "dictionary", "--factory", FACTORY], namespace)
    with pytest.raises(LinkLost, match="no drives"):
        VirtualSegment.start(SLAVE, [], namespace)


@pytest.mark.long
def test_a_killed_segment_is_noticed_and_can_be_restarted(namespace: Namespace) -> None:
    running = segment(namespace, 1)
    running.kill()
    with pytest.raises(LinkLost, match="has ended"):
        running.command("state")
    running.close()
    with segment(namespace, 1) as again:
        assert again.command("state")["slaves"][0]["state"] == "INIT"


def test_the_namespace_is_private(namespace: Namespace) -> None:
    code = "import json, socket; print(json.dumps([name for _, name in socket.if_nameindex()]))"
    process = namespace.popen([sys.executable, "-c", code], stdout=subprocess.PIPE)
    out, _ = process.communicate(timeout=20)
    # A kernel may add its own tunnel devices to every namespace; our cable must be there.
    assert {MASTER, SLAVE} <= set(json.loads(out))


def test_the_cable_is_silent(namespace: Namespace) -> None:
    """No IPv6 or other chatter: nothing but what the master sends arrives at the slave's end."""
    code = (
        "import socket, select;"
        f"s = socket.socket(17, 3, socket.htons(3)); s.bind(('{SLAVE}', 3));"
        "print(len(select.select([s], [], [], 0.3)[0]))"
    )
    process = namespace.popen([sys.executable, "-c", code], stdout=subprocess.PIPE)
    assert process.communicate(timeout=20)[0].strip() == "0"
