"""Choosing process data: entries of ETG.1000.6, limits of the drive, fixed sets."""

from __future__ import annotations

import subprocess
import sys
import textwrap
from typing import cast

import pysoem
import pytest

from drivers.errors import NotAllowed, ProtocolError
from drivers.ethercat.exchange.mapping import plan_station
from drivers.ethercat.exchange.ring import Ring
from drivers.ethercat.process.operations import Operations
from drivers.ethercat.process.segment import Segment
from drivers.link import Address, CyclicSignal
from drivers.virtual.wires.netns import Namespace, child_environment
from profiles.schema import DataType, PdoSpec, Profile
from tests.wire.ethercat_host.conftest import Rig
from tests.wire.ethercat_host.servo_device import servo_profile


def signal(index: int, kind: DataType = "INT32", sub: int = 0) -> CyclicSignal:
    return CyclicSignal(1, Address(index, sub, kind), f"{index:04X}")


def with_limits(profile: Profile, **limits: int) -> Profile:
    assert profile.pdo is not None
    spec = PdoSpec(**(profile.pdo.model_dump() | limits))
    return Profile(**({n: getattr(profile, n) for n in Profile.model_fields} | {"pdo": spec}))


def test_a_target_brings_what_the_loop_needs_to_stop_the_axis() -> None:
    plan = plan_station(1, [signal(0x606C)], [signal(0x607A)], servo_profile())
    assert [e.word for e in plan.rx.entries] == [0x60400010, 0x607A0020]
    assert [e.word for e in plan.tx.entries] == [0x60410010, 0x60640020, 0x606C0020]
    assert [s.channel for s in plan.mapped] == ["606C", "607A"], "only what was asked for"
    assert (plan.rx.index, plan.tx.index, plan.rx.write) == (0x1600, 0x1A00, True)


def test_what_does_not_fit_is_left_for_polling_with_the_reason() -> None:
    profile = with_limits(servo_profile(), max_entries=3)
    wish = [signal(0x606C), signal(0x6077, "INT16"), signal(0x60F4)]
    plan = plan_station(1, wish, [signal(0x607A)], profile)
    assert [s.channel for s in plan.mapped] == ["606C", "607A"]
    assert [s.channel for s, _ in plan.left_over] == ["6077", "60F4"]
    assert "maps 3 objects" in plan.left_over[0][1].words()


def test_bytes_are_limited_too() -> None:
    profile = with_limits(servo_profile(), max_bytes=8)
    plan = plan_station(1, [signal(0x606C), signal(0x6077, "INT16")], [signal(0x607A)], profile)
    assert [e.index for e in plan.tx.entries] == [0x6041, 0x6064, 0x6077], "6 + 2 bytes fit"
    assert "8 bytes" in plan.left_over[0][1].words()


def test_outputs_that_do_not_fit_are_refused_by_name() -> None:
    profile = with_limits(servo_profile(), max_entries=2)
    with pytest.raises(NotAllowed, match=r"60B2:00 cannot be in the cyclic data.*maps 2 objects"):
        plan_station(1, [], [signal(0x607A), signal(0x60B2, "INT16")], profile)


def test_objects_that_the_drive_does_not_map_are_polled() -> None:
    plan = plan_station(1, [signal(0x2001, "UINT16", 1)], [signal(0x607A)], servo_profile())
    assert plan.left_over[0][1].words() == "the drive does not map it in this direction"


def test_a_drive_that_forbids_remapping_gets_the_fixed_set_with_most_of_the_wish() -> None:
    profile = servo_profile(remappable=False)
    plan = plan_station(
        1, [signal(0x606C), signal(0x6077, "INT16")], [signal(0x607A), signal(0x60FF)], profile
    )
    assert plan.rx.index == 0x1600
    assert plan.rx.write is False
    assert plan.rx.size == 2 + 1 + 4 + 4 + 2
    assert [s.channel for s in plan.mapped] == ["606C", "607A", "60FF"]
    assert plan.left_over[0][1].words() == "not in the drive's fixed process data"


def test_a_wish_that_no_fixed_set_carries_is_refused() -> None:
    with pytest.raises(NotAllowed, match=r"none of the drive's fixed process data carries"):
        plan_station(1, [], [signal(0x60B1)], servo_profile(remappable=False))


def test_a_drive_without_a_profile_gets_a_modest_mapping() -> None:
    wish = [signal(0x6064 + n) for n in range(1, 10)]
    plan = plan_station(1, wish, [signal(0x607A)], None)
    assert len(plan.tx.entries) == 8
    assert len(plan.left_over) == 3


class Soem:
    """A master whose mapping fails with these errors in turn, then succeeds."""

    manual_state_change = 0
    slaves = ()

    def __init__(self, *errors: Exception) -> None:
        self.errors = list(errors)
        self.done: list[str] = []

    def config_init(self, release_gil: bool) -> int:
        self.done.append("searched")
        return 1

    def config_map(self) -> None:
        self.done.append("mapped")
        if self.errors:
            raise pysoem.ConfigMapError([self.errors.pop(0)])

    def _collect_mailbox_errors(self) -> None:
        """There are none."""


STRAY = pysoem.PacketError(1, 3), pysoem.PacketError(1, 1), Exception("unexpected error")
REFUSAL = pysoem.SdoError(2, 0x1C12, 1, 0x06090011, "Subindex does not exist")


def operations(*errors: Exception) -> tuple[Operations, Soem]:
    """Those of a process whose setting-up is a search and a mapping and nothing else."""
    made, master = Operations("none", cast("Ring", None), lambda _message: None), Soem(*errors)
    made.segment._master = master

    def find_and_configure(_message: object) -> dict[str, object]:
        made.segment.find()
        made.segment.map(64)
        return {"configured": True}

    made._find_and_configure = find_and_configure  # type: ignore[method-assign]
    return made, master


@pytest.mark.parametrize("stray", [*STRAY, REFUSAL], ids=str)
def test_after_a_mapping_that_a_stray_answer_spoilt_the_segment_is_searched_again(
    stray: Exception,
) -> None:
    """SOEM looks at the index of an answer at most: any error may be another question's."""
    made, master = operations(stray, stray)
    reported: list[object] = []
    made._configure({}, lambda answer, error: reported.append((answer, error)))
    assert reported == [({"configured": True}, None)]
    assert master.done == ["searched", "mapped"] * 3


def test_a_mapping_that_a_drive_refuses_ends_in_its_words() -> None:
    made, master = operations(REFUSAL, REFUSAL, REFUSAL)
    with pytest.raises(ProtocolError, match=r"station 2 aborted 1C12:01 \(Subindex does not exist"):
        made._configure({}, lambda _answer, _error: None)
    assert not made.segment.mapped
    assert master.done == ["searched", "mapped"] * 3


def test_nothing_is_mapped_twice_after_one_search() -> None:
    """The FMMUs of the first mapping would go on next to those of the second."""
    segment = Segment("none")
    segment._master = Soem()
    segment.find()
    segment.map(64)
    with pytest.raises(NotAllowed, match="once after a search"):
        segment.map(64)


@pytest.mark.long
def test_a_search_takes_away_what_an_earlier_mapping_left_in_the_slaves(
    namespace: Namespace, rig: Rig
) -> None:
    """Registers of the FMMUs: ETG.1000.4 table 56, 16 bytes each from 0x600, active at byte 12."""
    script = textwrap.dedent(
        """
        import time
        from drivers.ethercat.process.segment import Segment

        segment = Segment("ec0m")
        segment.frame_timeout_us = 1_000_000
        segment.open()
        def in_preop(limit_s=2.0):
            end_s = time.monotonic() + limit_s
            while time.monotonic() < end_s:
                if all(segment.read(n, 0x130, 1) == b"\\2" for n in (1, 2)):
                    return True
                time.sleep(0.01)
            return False

        for _ in range(3):
            # A frame of the search that is lost leaves a slave without mailboxes, in INIT.
            for _ in range(5):
                assert segment.find() == 2
                if in_preop():
                    break
            segment.map(64)
            active = [segment.read(1, 0x600 + 16 * n, 16)[12] & 1 for n in range(4)]
            assert active == [1, 1, 0, 0], active
        segment.close()
        """
    )
    result = subprocess.run(
        namespace.command([sys.executable, "-c", script]),
        capture_output=True,
        text=True,
        check=False,
        env=child_environment(),
        timeout=60,
    )
    assert result.returncode == 0, result.stderr
