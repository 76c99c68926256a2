"""Result of a gantry measurement."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict

from backend.tools.tool import Interval, ToolResult

Code = Literal[
    "not_coupled", "square", "out_of_square", "square_uncertain", "no_skew_stiffness", "skew_mode",
    "pair_sound", "pair_margin_low", "pair_unstable", "margins_beyond_band",
    "controllers_unknown", "factor", "no_factor", "distortion", "rated_torque_unknown",
]  # fmt: skip


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class GantryValue(_Part):
    """A figure with its 95 % interval."""

    value: float
    ci95: Interval


class GantryFinding(_Part):
    """A finding; ``values`` are the figures with units for the placeholders of its text."""

    code: Code
    values: dict[str, str] = {}


class GantryMode(_Part):
    """A resonance of both axes; ``skew_share`` is the differential share of its motion, 0 to 1."""

    kind: Literal["common", "skew"]
    frequency_hz: float
    frequency_ci95_hz: Interval
    damping: float
    damping_ci95: Interval
    skew_share: float


class GantryEntry(_Part):
    """Response from the torque of axis ``torque`` to the speed of axis ``speed`` [lines]."""

    speed: Literal[1, 2]
    torque: Literal[1, 2]
    magnitude_db: tuple[float, ...]
    half_db: tuple[float, ...]
    phase_deg: tuple[float, ...]
    coherence: tuple[float, ...]


class GantryMotion(_Part):
    """Response of the common motion or of the skew [lines].

    Common: mean speed over the sum of both torques; skew: difference of the speeds over half the
    difference of the torques.
    """

    kind: Literal["common", "skew"]
    magnitude_db: tuple[float, ...]
    half_db: tuple[float, ...]
    phase_deg: tuple[float, ...]


class GantryMargins(_Part):
    """Margins of both speed loops together, on the measured lines.

    ``stable`` is None where the lines do not determine it. ``ms_alone`` is the peak sensitivity of
    each axis by itself.
    """

    stable: bool | None
    ms: float
    ms_ci95: Interval
    ms_hz: float
    ms_alone: tuple[float, float]
    phase_margin_deg: float | None
    crossover_hz: float | None


class GantryResult(ToolResult):
    """Result; axis 1 is the one that the measurement was started on, axis 2 is ``partner``.

    ``holding_percent`` is the mean torque of both directions that each axis needs, without
    friction, in % of its rated torque. ``fight_percent`` is half the difference of both torques in
    Nm, in % of the smaller rated torque: with it the two sides oppose each other.
    ``out_of_square_rev`` is how far axis 1 is ahead of the position where the beam would be free of
    it. Where no coupling is visible, neither is stated, nor are modes,
    inertia and stiffness of the machine. ``coupling`` is √|G12·G21/(G11·G22)|, 0 without coupling,
    1 for one rigid body; ``relative_gain`` that of axis 1, 1 without coupling.
    """

    tool: Literal["gantry"] = "gantry"
    partner: str
    frequency_hz: tuple[float, ...]
    entries: tuple[GantryEntry, ...]
    motions: tuple[GantryMotion, GantryMotion]
    coupling: tuple[float, ...]
    coupling_half: tuple[float, ...]
    relative_gain: tuple[float, ...]
    modes: tuple[GantryMode, ...]
    inertia_kgm2: GantryValue | None
    skew_stiffness_nm_per_rad: GantryValue | None
    holding_percent: tuple[GantryValue, GantryValue]
    friction_percent: tuple[GantryValue, GantryValue]
    fight_percent: GantryValue | None
    out_of_square_rev: GantryValue | None
    out_of_square_mm: GantryValue | None
    largest_skew_rev: float
    margins: GantryMargins | None
    gain_factor: float | None
    findings: tuple[GantryFinding, ...]
    periods_used: int
    periods_dropped: int
    motion_s: float
