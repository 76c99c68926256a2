"""Obstacles to real-time EtherCAT, derived from the facts of a computer, the worst first."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import IntEnum, StrEnum

from drivers.computer.permissions import NEEDED
from drivers.computer.timing.host_facts import HostFacts, Port


class Code(StrEnum):
    """Kind of obstacle."""

    NO_INTERFACE = "no_interface"
    MISSING_CAPABILITY = "missing_capability"
    WIRELESS = "wireless"
    INTERFACE_DOWN = "interface_down"
    NO_CARRIER = "no_carrier"
    DHCP_ON_PORT = "dhcp_on_port"
    PORT_MANAGED = "port_managed"
    PORT_CARRIES_IP = "port_carries_ip"
    ON_BATTERY = "on_battery"
    BUSY_CORE = "busy_core"
    NO_REAL_TIME = "no_real_time"
    STOLEN_TIME = "stolen_time"
    MEMORY_NOT_LOCKED = "memory_not_locked"
    DEEP_IDLE = "deep_idle"
    GOVERNOR = "governor"
    COALESCING = "coalescing"
    IRQ_ON_BUSY_CORE = "irq_on_busy_core"
    IRQ_BALANCED = "irq_balanced"
    GROUPED_FRAMES = "grouped_frames"
    KERNEL = "kernel"


class Effect(IntEnum):
    """Effect of an obstacle, the worst first."""

    BLOCKS = 0
    """No frame is transmitted."""
    INTERRUPTS = 1
    """The bus can fail for seconds during operation."""
    DELAYS = 2
    """Cycles come late."""


class Fix(StrEnum):
    """Settings that servodeck can change and restore."""

    GOVERNOR = "governor"
    IDLE = "idle"
    COALESCING = "coalescing"
    GROUPED_FRAMES = "grouped_frames"
    INTERRUPTS = "interrupts"


@dataclass(frozen=True, slots=True)
class Finding:
    """One obstacle. ``delay_us``: possible delay of a cycle where it DELAYS, otherwise 0 [µs]."""

    code: Code
    effect: Effect
    delay_us: float = 0.0
    params: dict[str, str | float] = field(default_factory=dict)
    fix: Fix | None = None


#: Time slice of a task of the fair scheduler [µs]: base_slice_ns of the kernel with up to 8 cores
#: (kernel/sched/fair.c: 0.75 ms x (1 + ilog2(cores)), at most 4 times it).
_FAIR_TURN_US = 3000.0
_BUSY_SHARE, _STOLEN_SHARE = 0.7, 0.01
_QUICK_IDLE_US = 20
#: Time to read a swapped-out page from a disk [µs].
_PAGE_FAULT_US = 5000.0
#: Time to raise the processor's clock [µs]: the largest common cpuinfo_transition_latency.
_CLOCK_CHANGE_US = 100.0
_GROUPING_US = 20.0
_MOVED_INTERRUPT_US = 50.0
_SECTION_US = 200.0
"""Longest non-preemptible section of the kernel without PREEMPT_RT [µs]."""


def findings(facts: HostFacts) -> list[Finding]:
    """All obstacles, first the one whose removal would help most."""
    found = [*_processor(facts)]
    if facts.port is not None:
        found += [*_permission(facts), *_port(facts.port), *_card(facts, facts.port)]
    return sorted(found, key=lambda one: (one.effect, -one.delay_us))


def _permission(facts: HostFacts) -> Iterator[Finding]:
    missing = [name for name in NEEDED if name not in facts.capabilities]
    if missing:
        yield Finding(
            Code.MISSING_CAPABILITY, Effect.BLOCKS, params={"capabilities": ", ".join(missing)}
        )


def _port(port: Port) -> Iterator[Finding]:
    name: dict[str, str | float] = {"interface": port.name}
    if not port.exists:
        yield Finding(Code.NO_INTERFACE, Effect.BLOCKS, params=name)
        return
    if port.wireless:
        yield Finding(Code.WIRELESS, Effect.BLOCKS, params=name)
    if not port.up:
        yield Finding(Code.INTERFACE_DOWN, Effect.BLOCKS, params=name)
    elif port.carrier is False:
        yield Finding(Code.NO_CARRIER, Effect.BLOCKS, params=name)
    if port.dhcp_by:
        yield Finding(Code.DHCP_ON_PORT, Effect.INTERRUPTS, params={**name, "by": port.dhcp_by})
    elif port.managed_by:
        yield Finding(Code.PORT_MANAGED, Effect.INTERRUPTS, params={**name, "by": port.managed_by})
    elif port.carries_ip:
        yield Finding(Code.PORT_CARRIES_IP, Effect.INTERRUPTS, params=name)


def _processor(facts: HostFacts) -> Iterator[Finding]:
    if facts.discharging:
        yield Finding(Code.ON_BATTERY, Effect.INTERRUPTS)
    if not facts.fifo_allowed:
        # A real-time thread has priority, so the load of other threads only matters without it.
        busiest = max(facts.busy, default=0.0)
        if busiest > _BUSY_SHARE:
            yield _delay(Code.BUSY_CORE, _FAIR_TURN_US, share=busiest)
        yield _delay(Code.NO_REAL_TIME, _FAIR_TURN_US / 2)
    if not facts.memory_lock_allowed:
        # Only when memory is short, which is rare on most computers; hence a tenth.
        yield _delay(Code.MEMORY_NOT_LOCKED, _PAGE_FAULT_US / 10)
    if facts.stolen > _STOLEN_SHARE:
        yield _delay(Code.STOLEN_TIME, _FAIR_TURN_US, share=facts.stolen)
    deepest = max(facts.idle_states, key=lambda one: one.latency_us, default=None)
    if deepest is not None and deepest.latency_us > _QUICK_IDLE_US:
        yield _delay(
            Code.DEEP_IDLE,
            deepest.latency_us,
            Fix.IDLE,
            state=deepest.name,
            latency_us=deepest.latency_us,
        )
    slow = sorted({one for one in facts.governors.values() if one and one != "performance"})
    if slow:
        yield _delay(Code.GOVERNOR, _CLOCK_CHANGE_US, Fix.GOVERNOR, governor=", ".join(slow))
    if facts.preemption == "voluntary":
        yield _delay(Code.KERNEL, _SECTION_US, kernel=facts.kernel)


def _card(facts: HostFacts, port: Port) -> Iterator[Finding]:
    wait = port.card.get("rx-usecs", 0) + port.card.get("tx-usecs", 0)
    if wait > 0:
        yield _delay(Code.COALESCING, wait, Fix.COALESCING, interface=port.name, delay_us=wait)
    grouped = [name for name in ("gro", "lro") if port.card.get(name)]
    if grouped:
        yield _delay(
            Code.GROUPED_FRAMES,
            _GROUPING_US,
            Fix.GROUPED_FRAMES,
            interface=port.name,
            which=", ".join(grouped),
        )
    for number, cores in port.interrupts.items():
        loads = [facts.busy[core] for core in cores if core < len(facts.busy)]
        if len(loads) == 1 and loads[0] > _BUSY_SHARE and min(facts.busy) < _BUSY_SHARE:
            yield _delay(
                Code.IRQ_ON_BUSY_CORE,
                _SECTION_US,
                Fix.INTERRUPTS,
                interface=port.name,
                irq=number,
                core=cores[0],
            )
            return
    if facts.interrupts_balanced and any(len(cores) > 1 for cores in port.interrupts.values()):
        yield _delay(Code.IRQ_BALANCED, _MOVED_INTERRUPT_US, Fix.INTERRUPTS, interface=port.name)


def _delay(
    code: Code, delay_us: float, fix: Fix | None = None, /, **params: str | float
) -> Finding:
    return Finding(code, Effect.DELAYS, delay_us, params, fix)
