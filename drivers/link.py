"""The interface between drives and buses.

A `Link` is one opened bus. It transfers bytes and interprets neither units nor meaning. Values
travel in CANopen byte order (little endian, CiA 301 clause 7.1.4) on every kind of link; a serial
link converts to and from its registers. The methods of a link are asynchronous; each link runs its
blocking code on a thread of its own, so that there is one transaction at a time per bus.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Literal, Protocol

import numpy as np
import numpy.typing as npt

from drivers.cia402 import State
from drivers.doctor.examined import Examines
from drivers.errors import DriveError, NotAllowed
from drivers.halt import LoopState
from drivers.objects.dictionary import Described
from drivers.objects.feedback import FeedbackScale
from drivers.texts.message import Text, text
from profiles.schema import DataType, LinkKind, Profile


@dataclass(frozen=True, slots=True)
class Address:
    """Address of a value. ``index`` is None for values that only a Modbus register can reach."""

    index: int | None
    subindex: int
    type: DataType
    register: int | None = None

    def __str__(self) -> str:
        if self.index is None:
            return f"register {self.register:#06x}"
        return f"{self.index:04X}:{self.subindex:02X}"


@dataclass(frozen=True, slots=True)
class Found:
    """One drive found by a scan. Fields are None where the link cannot read them."""

    station: int
    vendor_id: int | None = None
    product_code: int | None = None
    revision: int | None = None
    serial: int | None = None
    name: str = ""
    alias: int | None = None
    hardware: str = ""
    firmware: str = ""
    state: Text | None = None
    notes: tuple[Text, ...] = ()
    device_profile: int | None = None
    """Low word of 1000h (CiA 301 clause 7.5.2.1): 402 for drives, 0 for no standard profile."""

    @property
    def is_other_device(self) -> bool:
        """True if the station reports a device profile other than that of drives, such as I/O."""
        return self.device_profile not in (None, 0, 402)


@dataclass(frozen=True, slots=True)
class LinkQuality:
    """Counters since opening. ``details`` holds kind-specific figures with units in the names."""

    connected: bool
    transactions: int = 0
    timeouts: int = 0
    crc_errors: int = 0
    framing_errors: int = 0
    retries: int = 0
    lost_frames: int = 0
    wkc_errors: int = 0
    round_trip_ms: float | None = None
    state: Text | None = None
    details: dict[str, float | int | str] = field(default_factory=dict)


EventKind = Literal["emergency", "boot", "lost", "back", "state", "overload", "fault"]


@dataclass(frozen=True, slots=True)
class LinkEvent:
    """An event that a bus reports unprompted. ``code`` is the error code of an emergency."""

    kind: EventKind
    station: int | None
    text: Text
    code: int | None = None


def notify(listeners: Iterable[Callable[[LinkEvent], None]], event: LinkEvent) -> None:
    """Call each listener on the event loop's thread.

    One that fails is reported to the event loop, and keeps neither the bus nor the other listeners
    from going on.
    """
    for listener in tuple(listeners):
        try:
            listener(event)
        except Exception as error:
            context = {"message": f"a listener failed at {event}", "exception": error}
            asyncio.get_running_loop().call_exception_handler(context)


Progress = Callable[[float, Text], None]
"""Called with a fraction 0…1 and a message about the current step. Must not block."""

Unsubscribe = Callable[[], None]


_CHECK_WHEN_SILENT = text("link.check-when-silent")


@dataclass(frozen=True, slots=True)
class LinkTraits:
    """Properties of a kind of bus: callers query a trait, never the kind."""

    batch: int = 16
    """Number of values for one `Link.read_many`. Small, so that a STOP never waits behind a long
    batch; a link that lets a write pass between two of its requests has a greater number.
    """
    whole_objects: bool = False
    """Entries of one object are read together: an object is not split between two batches."""
    registers: bool = False
    """Values are addressed by their Modbus register, not by index and subindex."""
    synchronous: bool = False
    """Setpoints and samples share one instant in every cycle without clocks in the drives."""
    description: Literal["none", "dictionary", "stored_eds"] = "none"
    """How a drive describes its objects: not at all, by `Link.enumerate`, or by an EDS in 1021h."""
    fills_network: bool = False
    """Its frames occupy the network of the port that sends them."""
    silent: Text = _CHECK_WHEN_SILENT
    """What to check if no station answers."""


def lists_nothing(kind: LinkKind, station: int) -> NotAllowed:
    """Create the error of `Link.enumerate` for a bus whose drives do not list their objects."""
    return NotAllowed(
        "link.drive-cannot-list-objects", drive=text("link.station", station=station), kind=kind
    )


class RecordsFrames(Protocol):
    """A link that keeps the last minute of its frames."""

    async def flight(self, station: int | None = None) -> bytes:
        """Return the frames as a pcapng file; with a station, only those that concern it.

        Raises:
            LinkLost: nothing is being recorded.
        """


class Link(Protocol):
    """One opened bus. See the module docstring for byte order and threading.

    `cyclic`, `doctor` and `frames` are optional parts; each is None on a bus without it.
    """

    kind: LinkKind
    url: str
    traits: LinkTraits

    @property
    def cyclic(self) -> Cyclic | None:
        """Cyclic process data, where the bus has them."""

    @property
    def doctor(self) -> Examines | None:
        """The part that determines why a station is not in Operational."""

    @property
    def frames(self) -> RecordsFrames | None:
        """The recorder of the last minute of frames."""

    async def open(self) -> None:
        """Open the adapter.

        Raises:
            LinkLost: no such adapter, no permission, or in use; the message says which.
        """

    async def close(self) -> None:
        """Close the link. Further calls have no effect."""

    def attach(self, station: int, profile: Profile) -> None:
        """Set the family of the drive at ``station``: word order, block limits, process data."""

    def unreachable(self, station: int, address: Address) -> Text | None:
        """Return why the link cannot transfer this value of the attached family; None if it can."""

    async def scan(
        self,
        progress: Progress,
        stations: Sequence[int] | None = None,
        *,
        stop_after: int | None = None,
    ) -> list[Found]:
        """Look for drives; cancel by cancelling the task.

        ``stop_after``: a bus that queries one address after the other, each at the cost of a
        time-out, stops after this number of drives; a bus that queries all addresses at once
        ignores it.
        """

    async def enumerate(self, station: int, progress: Progress) -> Sequence[Described]:
        """Return objects and entries of the drive's own dictionary, each object before its entries.

        Raises:
            NotAllowed: drives on this kind of bus do not list objects (`LinkTraits.description`).
        """

    async def read(self, station: int, address: Address) -> bytes:
        """Read one value, little endian, with exactly the length of its type (text: as sent)."""

    async def read_many(
        self, station: int, addresses: Sequence[Address]
    ) -> list[bytes | DriveError]:
        """Read several values in batches. A failure does not affect the other values."""

    async def write(self, station: int, address: Address, data: bytes) -> None:
        """Write one value. A write that times out raises LinkTimeout and is never repeated here."""

    def quality(self, station: int | None = None) -> LinkQuality:
        """Return the counters of one station or of the whole bus. Never blocks."""

    def listen(self, listener: Callable[[LinkEvent], None]) -> Unsubscribe:
        """Subscribe to events; the listener is called on the event loop's thread."""


@dataclass(frozen=True, slots=True)
class ScopeBlock:
    """A run of equally spaced samples.

    ``samples`` has shape [n, k] for k ``channels``, in unscaled raw units; ``t0_s`` is the time of
    the first sample on the link's clock (monotonic), ``dt_s`` the spacing. ``dropped``
    counts samples lost since the previous block of this stream; ``valid`` [n] is False where the
    working counter or the timing shows that a sample cannot be trusted.
    """

    sequence: int
    t0_s: float
    dt_s: float
    channels: tuple[str, ...]
    samples: npt.NDArray[np.float64]
    dropped: int = 0
    valid: npt.NDArray[np.bool_] | None = None
    times_s: npt.NDArray[np.float64] | None = None
    """True sampling times [n] of a polled block; None where the spacing is exact."""
    cycle: int | None = None
    """Cycle number of the first sample, in the count that `Cyclic.play` returns; None if polled."""


@dataclass(frozen=True, slots=True)
class CyclicSignal:
    """One process-data signal of one station; ``channel`` is its name in the blocks.

    An ``optional`` output is omitted if the drive's process data have no room for it.
    """

    station: int
    address: Address
    channel: str
    optional: bool = False


@dataclass(frozen=True, slots=True)
class Envelope:
    """Limits enforced every cycle; None means no limit of that kind. Raw drive units."""

    position_min: float | None = None
    position_max: float | None = None
    speed_max: float | None = None
    torque_max: float | None = None
    following_error_max: float | None = None
    feedback: FeedbackScale | None = None
    """Relation of 606Ch to 6064h. If set, both are compared and checked against ``speed_max``."""
    torque_off_only: bool = False
    """At a torque limit the setpoint only becomes zero, and the power is removed a moment later.
    For an axis held by its closed brake, where a quick stop would push against the brake, and for
    pulses to a motor whose phases are not yet known, where a quick stop would close a loop.
    """
    stopped_if_it_runs_on: bool = False
    """With ``torque_off_only``: a shaft that no brake slows down is stopped by a quick stop."""


@dataclass(frozen=True, slots=True)
class Trajectory:
    """One value per cycle for one setpoint object of one station.

    ``values`` has shape [n] in raw units. ``renew_s`` [s] is how long a setpoint stays valid after
    the last value or renewal; without renewal the loop ramps down and leaves Operation enabled.
    """

    station: int
    target: Address
    values: npt.NDArray[np.int64]
    envelope: Envelope
    offset_target: Address | None = None
    offset_values: npt.NDArray[np.int64] | None = None
    renew_s: float = 0.2


@dataclass(frozen=True, slots=True)
class Coupled:
    """Coupling of two trajectories on one machine.

    If one axis is stopped, the other is stopped too, and both stop when the difference of their
    travels changes by more than ``skew_max``. In raw increments of the first axis from ``zero``,
    the position of each; an increment of the second axis is ``ratio`` of the first, negative if
    they count in opposite directions.
    """

    zero: tuple[int, int]
    ratio: float
    skew_max: float


class PlaysPairs(Protocol):
    """A cyclic exchange whose loop can couple two axes."""

    async def play_pair(self, pair: tuple[Trajectory, Trajectory], coupled: Coupled) -> int:
        """Play as `Cyclic.play`, with ``coupled`` checked every cycle until both axes are idle."""


class OwnsPowerState(Protocol):
    """A loop that writes the control words; no other code may write them."""

    async def drive_to(self, station: int, goal: State, mode: int | None = None) -> None:
        """Request a power state; the axis brakes before it leaves Operation enabled."""

    async def reset_fault(self, station: int) -> None:
        """Reset a fault once; the axis stays disabled."""

    def axis_state(self, station: int) -> LoopState:
        """Return power state, phase of the setpoints, and why the last motion was halted."""


class TakesSpeeds(Protocol):
    """A cyclic exchange that can send velocity setpoints to drives without a cyclic mode."""

    unguarded: frozenset[int]
    """Stations commanded by the exchange whose drive would not detect the end of the exchange."""

    def take_speeds(self, station: int, by_profile_velocity: bool) -> None:
        """Switch Profile velocity for ``station`` on or off, effective at the next `configure`.

        Velocity setpoints requested in mode CSV are then sent in mode Profile velocity.
        """


class Cyclic(Protocol):
    """Synchronous process data of a bus that has them (EtherCAT, CANopen with SYNC).

    `power`, `speeds` and `pairs` are optional parts; each is None in an exchange without it.
    """

    @property
    def power(self) -> OwnsPowerState | None:
        """The part that commands the power states, where the loop writes the control words."""

    @property
    def speeds(self) -> TakesSpeeds | None:
        """The part that sends velocity setpoints to drives without a cyclic mode."""

    @property
    def pairs(self) -> PlaysPairs | None:
        """The part that moves two axes of one machine together."""

    @property
    def running(self) -> bool:
        """Whether process data are being exchanged."""

    @property
    def trouble(self) -> Text | None:
        """Why a requested exchange is not running, while it is set up again; None otherwise."""

    @property
    def dc(self) -> bool | None:
        """Whether clocks in the drives set the sampling instant; None: the bus has none."""

    @property
    def left_over(self) -> tuple[tuple[CyclicSignal, Text], ...]:
        """Signals of the last `configure` that are not exchanged, each with the reason."""

    async def configure(
        self, inputs: Sequence[CyclicSignal], outputs: Sequence[CyclicSignal], cycle_s: float
    ) -> tuple[CyclicSignal, ...]:
        """Map signals and return those that fit; the others must be polled.

        Raises:
            NotAllowed: the mapping exceeds a limit of the drive, named in the message.
        """

    async def start(self) -> None:
        """Go to Operational and exchange process data."""

    async def stop(self) -> None:
        """Ramp down every moving axis, then leave Operational."""

    async def play(self, trajectories: Sequence[Trajectory]) -> int:
        """Play trajectories in synchronism; return the cycle number of the first value."""

    async def renew(self, station: int) -> None:
        """Extend the validity of the setpoints of ``station`` by its renewal time."""

    async def halt(self, station: int | None = None) -> None:
        """Stop one station or all under control, now; setpoints end."""

    async def pause(self, station: int) -> None:
        """Brake now and hold, enabled, for the next motion; no effect if the axis is not moving."""

    def newest(self, channels: Sequence[str], within_s: float) -> dict[str, int | float]:
        """Return the raw values of the last cycle, without a request to the drive.

        Values are omitted if they are older than ``within_s`` [s], are from an invalid cycle, or
        belong to a lost station.
        """

    def blocks(self, consumer: Callable[[ScopeBlock], None]) -> Unsubscribe:
        """Deliver samples on the event loop's thread; NaN stands for inputs of a lost station."""
