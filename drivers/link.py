"""The seam between drives and buses.

A `Link` is one opened bus. It moves bytes and interprets neither units nor meaning. Values travel
in CANopen byte order (little endian, CiA 301 clause 7.1.4) on every kind of link; a serial link
converts to and from its registers. Links are asynchronous outside; each runs its blocking code
on one thread of its own, so that there is one transaction at a time per bus.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Literal, Protocol

import numpy as np
import numpy.typing as npt

from drivers.cia402 import State
from drivers.dictionary import Described
from drivers.doctor.examined import Examines
from drivers.errors import DriveError, NotAllowed
from drivers.feedback import FeedbackScale
from drivers.halt import LoopState
from drivers.texts.message import Text, text
from profiles.schema import DataType, LinkKind, Profile


@dataclass(frozen=True, slots=True)
class Address:
    """Where a value lives. ``index`` is None for what only a Modbus register reaches."""

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
    """One drive seen by a scan. Fields are None where the link cannot show."""

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
    """Low word of 1000h (CiA 301 clause 7.5.2.1): 402 for drives, 0 for none of the standard."""

    @property
    def is_other_device(self) -> bool:
        """It states a device profile, and not that of drives: a terminal, say."""
        return self.device_profile not in (None, 0, 402)


@dataclass(frozen=True, slots=True)
class LinkQuality:
    """Counters since opening. ``details`` holds kind-specific figures with units in the name."""

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
    """What a bus reports by itself. ``code`` is the error code of an emergency."""

    kind: EventKind
    station: int | None
    text: Text
    code: int | None = None


Progress = Callable[[float, Text], None]
"""Called with a fraction 0…1 and what is being done. Must not block."""

Unsubscribe = Callable[[], None]


_CHECK_WHEN_SILENT = text("link.check-when-silent")


@dataclass(frozen=True, slots=True)
class LinkTraits:
    """What a kind of bus is like: callers ask for a trait, never for a kind."""

    batch: int = 16
    """Values for one `Link.read_many`. Small, so that a STOP never waits behind a long batch; a
    link that lets a write go between two of its requests takes more.
    """
    whole_objects: bool = False
    """Entries of an object are read together: an object is not parted between two batches."""
    registers: bool = False
    """Values are reached by their Modbus register, not by index and subindex."""
    synchronous: bool = False
    """Setpoints and samples share one instant of every cycle without clocks in the drives."""
    description: Literal["none", "dictionary", "stored_eds"] = "none"
    """How a drive reports its own objects: not, by `Link.enumerate`, or by an EDS in 1021h."""
    fills_network: bool = False
    """Its frames fill the network of the port that they are sent on."""
    silent: Text = _CHECK_WHEN_SILENT
    """What to look at where nothing answers."""


def lists_nothing(kind: LinkKind, station: int) -> NotAllowed:
    """What `Link.enumerate` raises on a bus whose drives do not list their objects."""
    return NotAllowed("link.drive-cannot-list-objects", drive=f"station {station}", kind=kind)


class RecordsFrames(Protocol):
    """A link that keeps the last minute of its frames."""

    async def flight(self, station: int | None = None) -> bytes:
        """The frames as a pcapng file; of one station only what has to do with it.

        Raises:
            LinkLost: nothing is being recorded.
        """


class Link(Protocol):
    """One opened bus. See the module docstring for byte order and threading.

    `cyclic`, `doctor` and `frames` are parts that a bus may lack, and are None then.
    """

    kind: LinkKind
    url: str
    traits: LinkTraits

    @property
    def cyclic(self) -> Cyclic | None:
        """Synchronous process data, where the bus has them."""

    @property
    def doctor(self) -> Examines | None:
        """What states why a station is not in Operational."""

    @property
    def frames(self) -> RecordsFrames | None:
        """The last minute of its frames."""

    async def open(self) -> None:
        """Open the adapter.

        Raises:
            LinkLost: no such adapter, no permission, or in use; the message says which.
        """

    async def close(self) -> None:
        """Close it. Calling again does nothing."""

    def attach(self, station: int, profile: Profile) -> None:
        """Say which family answers at ``station``: word order, block limits, process data."""

    def unreachable(self, station: int, address: Address) -> Text | None:
        """Why the link cannot carry this value of the attached family; None where it can."""

    async def scan(
        self,
        progress: Progress,
        stations: Sequence[int] | None = None,
        *,
        stop_after: int | None = None,
    ) -> list[Found]:
        """Look for drives; cancel by cancelling the task.

        ``stop_after`` so many drives a bus stops that asks one address after the other, each at
        the price of a time-out; one that asks all at once pays it no heed.
        """

    async def enumerate(self, station: int, progress: Progress) -> Sequence[Described]:
        """Objects and entries of the drive's own dictionary, each object before its entries.

        Raises:
            NotAllowed: drives on this kind of bus list nothing (`LinkTraits.description`).
        """

    async def read(self, station: int, address: Address) -> bytes:
        """Read one value, little endian, exactly as long as its type (text: as sent)."""

    async def read_many(
        self, station: int, addresses: Sequence[Address]
    ) -> list[bytes | DriveError]:
        """Read several, batched as the bus allows. One failure does not spoil the others."""

    async def write(self, station: int, address: Address, data: bytes) -> None:
        """Write one value. A timed-out write raises LinkTimeout and is never repeated here."""

    def quality(self, station: int | None = None) -> LinkQuality:
        """Counters for one station or the whole bus. Never blocks."""

    def listen(self, listener: Callable[[LinkEvent], None]) -> Unsubscribe:
        """Be notified of events, on the event loop's thread."""


@dataclass(frozen=True, slots=True)
class ScopeBlock:
    """A run of equally spaced samples.

    ``samples`` has shape [n, k] for k ``channels`` in raw units scaled by nobody; ``t0_s`` is the
    time of the first sample on the link's clock (monotonic), ``dt_s`` the spacing. ``dropped``
    counts samples lost since the previous block of this stream; ``valid`` [n] is False where the
    working counter or the timing says that a sample cannot be trusted.
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
    """Number of the first sample's cycle, as `Cyclic.play` counts them; None where polled."""


@dataclass(frozen=True, slots=True)
class CyclicSignal:
    """One process-data signal of one station, named ``channel`` in the blocks.

    An ``optional`` output is left out where the drive's process data have no place for it.
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
    """How 606Ch and 6064h hang together: they are compared then, the speed limit watches both."""
    torque_off_only: bool = False
    """Beyond a limit a torque only becomes zero, and the power goes a moment later. For an axis
    that its closed brake holds, as a quick stop would push against the brake, and for pulses of a
    motor whose phases are not known yet, as a quick stop would close a loop."""


@dataclass(frozen=True, slots=True)
class Trajectory:
    """One value per cycle for one setpoint object of one station.

    ``values`` has shape [n] in raw units. ``renew_s`` is the life of the setpoint after the
    last value or renewal: with none the loop ramps down by itself and leaves Operation enabled.
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
    """What holds for two trajectories on one machine: neither axis goes on when the other one is
    stopped, and both stop when the difference of their ways changes by more than ``skew_max``.

    In raw increments of the first axis from ``zero``, the position of each; an increment of the
    second axis is ``ratio`` of the first, negative where they count against each other.
    """

    zero: tuple[int, int]
    ratio: float
    skew_max: float


class PlaysPairs(Protocol):
    """An exchange whose loop can hold two axes together."""

    async def play_pair(self, pair: tuple[Trajectory, Trajectory], coupled: Coupled) -> int:
        """As `Cyclic.play`, with this watched in every cycle until both axes are at rest."""


class OwnsPowerState(Protocol):
    """A loop that writes the control words, so that nobody else may."""

    async def drive_to(self, station: int, goal: State, mode: int | None = None) -> None:
        """Head for a power state; the axis brakes before it leaves Operation enabled."""

    async def reset_fault(self, station: int) -> None:
        """Reset a fault once; the axis stays disabled."""

    def axis_state(self, station: int) -> LoopState:
        """Power state, phase of the setpoints, and why the last motion was ended by force."""


class TakesSpeeds(Protocol):
    """An exchange that can give speeds with every cycle to a drive that has no cyclic mode."""

    unguarded: frozenset[int]
    """Stations commanded by the exchange whose drive would not notice that it ended."""

    def take_speeds(self, station: int, by_profile_velocity: bool) -> None:
        """Command ``station`` in Profile velocity from the next `configure` on, or not any more.

        Where speeds of the mode CSV are asked for, the mode is then Profile velocity.
        """


class Cyclic(Protocol):
    """Synchronous process data of a bus that has them (EtherCAT, CANopen with SYNC).

    `power`, `speeds` and `pairs` are parts that an exchange may lack, and are None then.
    """

    @property
    def power(self) -> OwnsPowerState | None:
        """What commands the power states, where the loop writes the control words."""

    @property
    def speeds(self) -> TakesSpeeds | None:
        """What gives speeds to drives without a cyclic mode."""

    @property
    def pairs(self) -> PlaysPairs | None:
        """What moves two axes of one machine together."""

    @property
    def running(self) -> bool:
        """Whether process data are exchanged."""

    @property
    def trouble(self) -> Text | None:
        """Why it does not run although it is wanted, while it is set up again; else None."""

    @property
    def dc(self) -> bool | None:
        """Whether clocks in the drives rule the instant; None: the bus has none."""

    @property
    def left_over(self) -> tuple[tuple[CyclicSignal, Text], ...]:
        """Signals of the last `configure` that are not exchanged, each with the reason."""

    async def configure(
        self, inputs: Sequence[CyclicSignal], outputs: Sequence[CyclicSignal], cycle_s: float
    ) -> tuple[CyclicSignal, ...]:
        """Map signals and return those that fit; the rest is for polling.

        Raises:
            NotAllowed: the mapping exceeds a limit of the drive, named in the message.
        """

    async def start(self) -> None:
        """Go to Operational and exchange process data."""

    async def stop(self) -> None:
        """Ramp down whatever moves, then leave Operational."""

    async def play(self, trajectories: Sequence[Trajectory]) -> int:
        """Play trajectories in step; returns the cycle counter of the first value."""

    async def renew(self, station: int) -> None:
        """Extend the life of the setpoints of ``station`` by its renewal time."""

    async def halt(self, station: int | None = None) -> None:
        """Controlled stop now, for one station or all; setpoints end."""

    async def pause(self, station: int) -> None:
        """Brake now and hold, enabled, for the next motion; nothing where nothing moves."""

    def newest(self, channels: Sequence[str], within_s: float) -> dict[str, int | float]:
        """Raw values of the last cycle, without asking the drive.

        What is older than ``within_s``, came in an invalid cycle or is of a station that is lost
        is not among them.
        """

    def blocks(self, consumer: Callable[[ScopeBlock], None]) -> Unsubscribe:
        """Deliver samples on the event loop's thread; NaN stands for inputs of a lost station."""
