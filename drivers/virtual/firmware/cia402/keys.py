"""Parameters for functions common to several families: gains, feed-forward, homing, own tuning."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class FeedForward:
    """Parameters of feed-forward: gains in %, filter times in ms, selections (1 is on)."""

    speed_gain: str
    speed_filter: str
    torque_gain: str | None = None
    torque_filter: str | None = None
    speed_select: str | None = None
    torque_select: str | None = None


@dataclass(frozen=True, slots=True)
class GainKeys:
    """Parameters of a further gain set, in the units of the first."""

    position: str | None = None
    speed: str | None = None
    integral: str | None = None
    torque_filter: str | None = None


@dataclass(frozen=True, slots=True)
class SwitchKeys:
    """Parameters that select between the first and the second gains.

    ``kinds`` maps the condition to the kernel's SWITCH_*; ``on_raw`` are the values of ``mode``
    that enable switching, ``always_raw`` those that select the second gains permanently.
    """

    mode: str
    on_raw: tuple[int, ...] = ()
    always_raw: tuple[int, ...] = ()
    condition: str | None = None
    kinds: dict[int, int] = field(default_factory=dict)
    level: str | None = None
    hysteresis: str | None = None
    delay: str | None = None
    ramp: str | None = None
    third_delay: str | None = None


@dataclass(frozen=True, slots=True)
class SwingKeys:
    """Notch of the position command: frequency and width, and its automatic setting.

    With ``mode`` at ``automatic_raw`` the drive uses the frequency of a deviation above
    ``threshold`` (command units).
    """

    frequency: str
    width: str
    mode: str
    threshold: str
    automatic_raw: int = 1


@dataclass(frozen=True, slots=True)
class QuadrantKeys:
    """Torque after a change of direction: % of the rated torque, ms, ms, command units."""

    positive: str
    negative: str
    delay: str
    filter: str
    travel: str


@dataclass(frozen=True, slots=True)
class JogKeys:
    """The drive's own jog: speed [rpm] and the times [ms] to 1000 rpm and back."""

    speed: str
    rise: str
    fall: str
    trigger: str | None = None
    """A parameter for jogging: 1 forward, 2 backward, 0 ends it (values assumed)."""


@dataclass(frozen=True, slots=True)
class OwnHomingKeys:
    """The drive's own homing: its trigger, method, speed [rpm], ramp and time limit [ms]."""

    trigger: str
    begins: tuple[int, ...]
    method: str
    speed: str
    ramp: str
    limit_ms: str


@dataclass(frozen=True, slots=True)
class CompensationKeys:
    """Torques that the drive adds, in % of the rated torque by the parameters' own scales."""

    bias: str | None = None
    positive: str | None = None
    negative: str | None = None
    viscous: str | None = None
    viscous_per_rpm: float = 1e-4
    """Rated torque per rpm and per % of ``viscous``."""


@dataclass(frozen=True, slots=True)
class TorqueHoming:
    """Homing against the mechanical limit.

    ``methods`` maps each method to its direction and whether it goes back to the index;
    ``torque_key`` is in ‰ of the rated torque, ``time_key`` in ms.
    """

    methods: dict[int, tuple[int, bool]]
    torque_key: str
    time_key: str


@dataclass(frozen=True, slots=True)
class RigidityKeys:
    """Level and mode, and the gains that they set: (position, speed, integral) per set.

    ``levels_of`` is the family whose manual prints the gains of the levels.
    """

    mode: str
    level: str
    first: tuple[str, str, str]
    second: tuple[str, str, str]
    on: tuple[int, ...] = (1, 2)
    levels_of: str = "mms7"


@dataclass(frozen=True, slots=True)
class FoundNotchKeys:
    """Mode and the notches that it may set: frequency and width; ``result`` shows a resonance."""

    mode: str
    notches: tuple[tuple[str, str], ...]
    off_raw: int
    width_raw: int
    count: dict[int, int]
    restore: int
    result: str | None = None


@dataclass(frozen=True, slots=True)
class LoadKeys:
    """Parameters: top speed [rpm], time to it [ms], pause [ms], the ratio; and the online mode.

    ``ratio_per_one`` is the engineering value of the ratio parameter for a load equal to the rotor.
    """

    speed: str
    ramp: str
    pause: str
    ratio: str
    ratio_per_one: float
    command: str
    revolutions: str | None = None
    online: str | None = None
    fault: str = ""
