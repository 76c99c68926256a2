"""Messages of the routes of the preflight."""

from __future__ import annotations

from datetime import datetime

from pydantic import Field

from backend.api.messages.models import Message
from backend.foundation.preflight.findings import Code, Fix
from backend.foundation.preflight.verdicts import Grade, Purpose
from drivers.computer.serial_ports.latency_timer import LATENCY_MS, InForce


class PreflightRequest(Message):
    """Settings of a measurement.

    Frames that read one register of all slaves are sent to ``interface``.
    """

    interface: str = Field(default="", max_length=15, description="empty: wake-ups alone")
    seconds: float = Field(default=10.0, ge=1.0, le=60.0)


class FixRequest(Message):
    """One change of the computer's settings."""

    fix: Fix
    interface: str = Field(default="", max_length=15)


class PreflightFinding(Message):
    """An obstacle to punctual cycles; listed in the order of their effect, largest first."""

    code: Code
    effect: str = Field(description="blocks, interrupts or delays")
    delay_us: float
    params: dict[str, str | float]
    what: str
    remedy: str
    fix: Fix | None
    fix_name: str


class PreflightVerdict(Message):
    """Suitability of the computer for a purpose, and the figures that it rests on."""

    purpose: Purpose
    grade: Grade
    name: str
    words: str
    missed_bound: float | None = Field(description="share of missed cycles, 95 % upper bound")
    allowed: float | None


class PreflightRun(Message):
    """Timing measured at one cycle time.

    ``edges_us`` are the upper limits of the classes; one more class is above them.
    """

    period_us: int
    cycles: int
    missed: int
    fifo: bool
    memory_locked: bool
    edges_us: list[float]
    lateness: list[int]
    lateness_median_us: float
    lateness_999_us: float
    lateness_most_us: float
    round_trip: list[int] | None
    round_trip_median_us: float | None
    round_trip_most_us: float | None
    unanswered: int


class PreflightInfo(Message):
    """State of the computer now, with the last measurement of this interface."""

    interface: str
    kernel: str
    preemption: str
    cores: int
    findings: list[PreflightFinding]
    verdicts: list[PreflightVerdict]
    runs: list[PreflightRun]
    measured: datetime | None
    changed: list[str] = Field(description="settings that were changed and can be restored")


class PreflightUndone(Message):
    """Settings that were restored, and those left because somebody has changed them since."""

    restored: list[str]
    left: list[str]


class LatencyRequest(Message):
    """The latency timer that a serial adapter is to have."""

    device: str = Field(max_length=250, description="serial port, as COM3 or /dev/ttyUSB0")
    ms: int = Field(default=1, ge=LATENCY_MS[0], le=LATENCY_MS[1])


class LatencyTimerInfo(Message):
    """The latency timer of a serial adapter.

    ``..._at_most`` are bounds from the timer alone; ``reads_measured`` and ``reads_before`` are
    measured on the bus. All in reads per second, one after another.
    """

    device: str
    ms: int | None = Field(description="None: the adapter has none that is known")
    restarts: bool = Field(description="a change restarts the adapter; no program may use it then")
    reads_at_most: float | None
    lowered_ms: int
    lowered_reads_at_most: float
    reads_measured: float | None = Field(description="of the bus that is open at this port")
    before_ms: int | None = Field(description="timer before servodeck changed it, to be restored")
    reads_before: float | None = Field(description="measured before the change")
    in_force: InForce | None = Field(
        description="of a change just made; None: none was made, or somebody changed it since"
    )
