"""Each of many problems of a computer is found, and the worst is named first."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from backend.foundation.preflight.findings import Code, Effect, findings
from backend.foundation.preflight.texts import _FINDINGS, words
from tests.support.computer import ALL, FakeComputer

GOVERNOR = "sys/devices/system/cpu/cpu1/cpufreq/scaling_governor"


def found(fake: FakeComputer, interface: str = "eth1") -> list[Code]:
    return [one.code for one in findings(fake.computer.facts(interface))]


def wireless(fake: FakeComputer) -> None:
    (fake.root / "sys/class/net/eth1/wireless").mkdir()


def busy_core(fake: FakeComputer) -> None:
    fake.capabilities(ALL & ~(1 << 23))
    fake.busy = (0.02, 0.97)


def battery(fake: FakeComputer) -> None:
    fake.write("sys/class/power_supply/BAT0/type", "Battery")
    fake.write("sys/class/power_supply/BAT0/status", "Discharging")


def deep_idle(fake: FakeComputer) -> None:
    for core in (0, 1):
        fake.write(f"sys/devices/system/cpu/cpu{core}/cpuidle/state2/disable", "0")


def interrupt_on_busy_core(fake: FakeComputer) -> None:
    fake.busy = (0.95, 0.02)


def balanced(fake: FakeComputer) -> None:
    fake.process(812, "/usr/sbin/irqbalance", "--foreground")
    fake.write("proc/irq/41/smp_affinity_list", "0-1")


def managed(fake: FakeComputer) -> None:
    fake.write("run/NetworkManager/devices/3", "[device]\nmanaged=true\n")


#: Name of a problem, how it comes about, what is to be found first.
PROBLEMS: list[tuple[Callable[[FakeComputer], object], Code]] = [
    (lambda fake: fake.write(GOVERNOR, "powersave"), Code.GOVERNOR),
    (lambda fake: fake.card.update({"rx-usecs": 50}), Code.COALESCING),
    (lambda fake: fake.card.update({"gro": 1}), Code.GROUPED_FRAMES),
    (lambda fake: fake.capabilities(ALL & ~(1 << 13)), Code.MISSING_CAPABILITY),
    (lambda fake: fake.capabilities(ALL & ~(1 << 12)), Code.MISSING_CAPABILITY),
    (lambda fake: fake.capabilities(ALL & ~(1 << 23)), Code.NO_REAL_TIME),
    (lambda fake: fake.capabilities(ALL & ~(1 << 14)), Code.MEMORY_NOT_LOCKED),
    (busy_core, Code.BUSY_CORE),
    (lambda fake: fake.process(99, "/sbin/dhclient", "-v", "eth1"), Code.DHCP_ON_PORT),
    (lambda fake: fake.write("run/systemd/netif/leases/3", "ADDRESS=1"), Code.DHCP_ON_PORT),
    (managed, Code.PORT_MANAGED),
    (lambda fake: fake.write("proc/net/route", "Iface\neth1\t0A00"), Code.PORT_CARRIES_IP),
    (wireless, Code.WIRELESS),
    (battery, Code.ON_BATTERY),
    (deep_idle, Code.DEEP_IDLE),
    (interrupt_on_busy_core, Code.IRQ_ON_BUSY_CORE),
    (balanced, Code.IRQ_BALANCED),
    (lambda fake: setattr(fake, "steal", 0.1), Code.STOLEN_TIME),
    (lambda fake: fake.write("proc/version", "Linux version 5.4 #1 SMP"), Code.KERNEL),
    (lambda fake: setattr(fake, "flags", 0), Code.INTERFACE_DOWN),
    (lambda fake: fake.write("sys/class/net/eth1/carrier", "0"), Code.NO_CARRIER),
    (lambda fake: fake.interfaces.remove("eth1"), Code.NO_INTERFACE),
]


def test_a_good_computer_has_none(tmp_path: Path) -> None:
    assert found(FakeComputer(tmp_path)) == []


@pytest.mark.parametrize(("cause", "code"), PROBLEMS, ids=[code for _, code in PROBLEMS])
def test_one_problem_is_found_and_named_first(
    tmp_path: Path, cause: Callable[[FakeComputer], object], code: Code
) -> None:
    fake = FakeComputer(tmp_path)
    cause(fake)
    assert found(fake)[0] is code


@pytest.mark.parametrize(("cause", "code"), PROBLEMS, ids=[code for _, code in PROBLEMS])
def test_it_is_named_before_two_lesser_ones(
    tmp_path: Path, cause: Callable[[FakeComputer], object], code: Code
) -> None:
    """Grouping costs 20 µs and this coalescing 5 µs, less than anything else does."""
    fake = FakeComputer(tmp_path)
    fake.card.update({"gro": 1, "tx-usecs": 5})
    cause(fake)
    assert found(fake)[0] is code


def test_a_port_that_sys_does_not_show_has_no_lease_of_another(tmp_path: Path) -> None:
    """In a network namespace with the /sys of another one."""
    fake = FakeComputer(tmp_path)
    fake.write("run/systemd/netif/leases/7", "ADDRESS=1")
    (fake.root / "sys/class/net/eth1/ifindex").unlink()
    assert found(fake) == []


def test_the_order_is_by_effect_then_by_delay(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path)
    for cause in (deep_idle, managed, wireless):
        cause(fake)
    fake.card.update({"rx-usecs": 500})
    assert found(fake) == [Code.WIRELESS, Code.PORT_MANAGED, Code.COALESCING, Code.DEEP_IDLE]


def test_delays_that_the_computer_states_are_taken_as_stated(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path)
    deep_idle(fake)
    fake.card.update({"rx-usecs": 30, "tx-usecs": 12})
    delays = {one.code: one.delay_us for one in findings(fake.computer.facts("eth1"))}
    assert delays == {Code.DEEP_IDLE: 133, Code.COALESCING: 42}


def test_load_does_not_matter_to_who_goes_first(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path)
    fake.busy = (0.99, 0.99)
    assert found(fake) == []


def test_an_rtprio_limit_grants_real_time_as_well(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path)
    fake.capabilities(ALL & ~(1 << 23) & ~(1 << 14))
    fake.write(
        "proc/self/limits",
        "Max realtime priority     80     80\n"
        "Max locked memory         unlimited      unlimited     bytes\n",
    )
    assert found(fake) == []


def test_without_an_interface_the_computer_alone_is_looked_at(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path)
    fake.capabilities(0)
    managed(fake)
    assert set(found(fake, "")) == {Code.NO_REAL_TIME, Code.MEMORY_NOT_LOCKED}


@pytest.mark.parametrize("language", ["en", "zh"])
def test_every_finding_has_its_words(tmp_path: Path, language: str) -> None:
    assert set(_FINDINGS[language]) == set(Code)  # type: ignore[index]
    for number, (cause, _) in enumerate(PROBLEMS):
        fake = FakeComputer(tmp_path / str(number))
        cause(fake)
        for one in findings(fake.computer.facts("eth1")):
            what, remedy = words(one, language)  # type: ignore[arg-type]
            assert what
            assert remedy
            assert "{" not in what + remedy


def test_only_what_lets_no_frame_through_blocks(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path)
    managed(fake)
    battery(fake)
    assert {one.effect for one in findings(fake.computer.facts("eth1"))} == {Effect.INTERRUPTS}
