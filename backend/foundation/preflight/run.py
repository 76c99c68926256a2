"""One preflight: facts, a measurement in a separate process, findings and verdicts."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from backend.foundation.preflight.findings import Finding, findings
from backend.foundation.preflight.verdicts import PERIODS_US, Verdict, verdicts
from backend.foundation.work.child import run_child
from drivers.adapters import require_interface
from drivers.computer.network.sockets import hold_name, require_linux
from drivers.computer.timing.host_facts import Computer, HostFacts
from drivers.computer.timing.lateness import Measured, from_json
from drivers.errors import Busy, LinkLost

#: Callback with the progress of the measurement (0…1) and its period [µs].
Reported = Callable[[float, int], None]
MOST_S = 60.0


@dataclass(frozen=True, slots=True)
class Preflight:
    """Result of a preflight; ``measured`` by period [µs], empty where nothing was measured."""

    interface: str
    facts: HostFacts
    findings: list[Finding]
    verdicts: list[Verdict]
    measured: Mapping[int, Measured] = field(default_factory=dict)


def judged(
    interface: str, facts: HostFacts, measured: Mapping[int, Measured] | None = None
) -> Preflight:
    """Findings and verdicts from facts and measurement."""
    found = findings(facts)
    runs = measured or {}
    return Preflight(interface, facts, found, verdicts(found, runs), runs)


async def preflight(
    interface: str = "",
    seconds: float = 0.0,
    *,
    computer: Computer | None = None,
    progress: Reported = lambda _fraction, _period_us: None,
) -> Preflight:
    """Read the facts, and measure for ``seconds`` if above 0; frames are sent to ``interface``.

    Nothing is written to a drive: the frames read register 0000h. Where the facts show that no
    frame can be transmitted, only wake-ups are measured.

    Raises:
        NotAllowed: the system is not Linux.
        OutOfRange: not the name of an interface.
        Busy: an EtherCAT master uses the interface.
        LinkLost: the measurement failed; the message contains the reason.
    """
    require_linux("the preflight")
    if interface:
        require_interface(interface)
    facts = await asyncio.to_thread((computer or Computer()).facts, interface)
    result = judged(interface, facts)
    if seconds <= 0:
        return result
    blocked = any(one.blocked_by for one in result.verdicts)
    periods = sorted(set(PERIODS_US.values()), reverse=True)
    measured = {}
    for step, period in enumerate(periods):
        progress(step / len(periods), period)
        share = min(seconds, MOST_S) / len(periods)
        measured[period] = await _measured(period, share, "" if blocked else interface)
    progress(1.0, 0)
    return judged(interface, facts, measured)


async def _measured(period_us: int, seconds: float, interface: str) -> Measured:
    """Run the measuring process, which ends with this call in any case."""
    held = None
    if interface:
        try:
            held = hold_name(f"servodeck-ethercat-{interface}")
        except OSError as error:
            raise Busy("preflight.ethercat-master-servodeck-uses", interface=interface) from error
    with held or contextlib.nullcontext():
        answer = await run_child(
            "drivers.computer.timing.lateness",
            str(period_us),
            f"{seconds:g}",
            *([interface] if interface else []),
        )
    if answer.exit_code:
        raise LinkLost(
            "preflight.measurement-failed",
            interface=interface or "none",
            reason=answer.last_line,
        )
    return from_json(answer.out.decode("ascii"))
