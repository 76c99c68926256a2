"""One preflight: facts, the measurement in a process of its own, and what both mean."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from backend.preflight.findings import Finding, findings
from backend.preflight.verdicts import PERIODS_US, Verdict, verdicts
from drivers.adapters import require_interface
from drivers.computer.host_facts import Computer, HostFacts
from drivers.computer.lateness import Measured, from_json
from drivers.computer.sockets import hold_name, require_linux
from drivers.errors import Busy, LinkLost

#: How far the measurement is (0…1) and at which period.
Reported = Callable[[float, int], None]
MOST_S = 60.0


@dataclass(frozen=True, slots=True)
class Preflight:
    """The result; ``measured`` is by period in µs and empty where nothing was measured."""

    interface: str
    facts: HostFacts
    findings: list[Finding]
    verdicts: list[Verdict]
    measured: Mapping[int, Measured] = field(default_factory=dict)


def judged(
    interface: str, facts: HostFacts, measured: Mapping[int, Measured] | None = None
) -> Preflight:
    """What facts and figures mean."""
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
    """Look, and measure for ``seconds`` where that is more than 0; frames go to ``interface``.

    Nothing is written to a drive: the frames read register 0000h. Where the facts say that no frame
    gets through, wake-ups alone are measured.

    Raises:
        NotAllowed: the system is not Linux. OutOfRange: no name of an interface. Busy: an
        EtherCAT master uses the interface. LinkLost: the measurement failed, with its reason.
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
    """Run the process that measures; it ends with this call, however that ends."""
    held = None
    if interface:
        try:
            held = hold_name(f"servodeck-ethercat-{interface}")
        except OSError as error:
            raise Busy("preflight.ethercat-master-servodeck-uses", interface=interface) from error
    process = None
    try:
        process = await asyncio.create_subprocess_exec(
            sys.executable,
            "-m",
            "drivers.computer.lateness",
            str(period_us),
            f"{seconds:g}",
            *([interface] if interface else []),
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.PIPE,
        )
        answer, complaint = await process.communicate()
    finally:
        if process is not None and process.returncode is None:
            process.kill()
            await process.wait()
        if held is not None:
            held.close()
    if process.returncode:
        reason = complaint.decode("utf-8", "replace").strip().rpartition("\n")[2]
        raise LinkLost(
            "preflight.measurement-failed", interface=interface or "this computer", reason=reason
        )
    return from_json(answer.decode("ascii"))
