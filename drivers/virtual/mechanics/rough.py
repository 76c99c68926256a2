"""Non-ideal behaviour of drives and machines that an analysis does not assume, as options.

Each option has a structure of its own, not the one that `backend.analysis` fits: a held setpoint
although there is a 60C2h, a torque that is reported late or copied from the demand, a loop with
another period, friction that begins as a spring, a belt that creeps. All are off by default.
"""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field


class RoughTorqueSpec(BaseModel):
    """Torque path, loop period and machine of a non-ideal axis; all defaults have no effect.

    ``holds_torque`` and ``holds_speed``: cyclic setpoints act at once and are held for the cycle,
    although the dictionary has 60C2h. ``reported``: 6077h is the current's torque or a copy of the
    demand, behind a first-order filter of ``reported_filter_s``. ``torque_filter_s``: a first-order
    low-pass of the torque command that is not a parameter. ``loop_period_s`` (50 µs or longer): the
    torque changes once per period and the speed's difference is calculated over it.
    ``torque_constant``: true over nominal torque; 6077h stays nominal.

    ``presliding_rad``: friction is Dahl's (P. R. Dahl, 1968) with this rest length instead of
    Coulomb's; ``cogging_nm`` sin(``cogging_per_rev`` θ); ``drag_nm`` is a cable's hysteresis over
    ``drag_rad``. ``inertia_share`` sin(``inertia_per_rev`` θ) of the motor's inertia, and
    ``stiffness_share`` sin(``stiffness_per_rev`` θ) of the first coupling's stiffness, vary by
    position. ``slip_per_s``: share of the first coupling's twist that a belt slips per second.
    ``dip_share`` of the torque is missing for ``dip_s`` out of every ``dip_every_s``, as with a
    supply that breaks down. ``interpolation_rad`` sin(``interpolation_per_rev`` θ) is the encoder's
    error. ``jitter_s``: a cyclic setpoint is delayed by up to this time.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    holds_torque: bool = False
    holds_speed: bool = False
    reported: Literal["current", "demand"] = "current"
    reported_filter_s: float = Field(default=0.0, ge=0)
    torque_filter_s: float = Field(default=0.0, ge=0)
    loop_period_s: float = Field(default=50e-6, ge=50e-6, le=500e-6)
    torque_constant: float = Field(default=1.0, gt=0)
    presliding_rad: float = Field(default=0.0, ge=0)
    cogging_nm: float = Field(default=0.0, ge=0)
    cogging_per_rev: float = Field(default=24.0, gt=0)
    drag_nm: float = Field(default=0.0, ge=0)
    drag_rad: float = Field(default=1.0, gt=0)
    inertia_share: float = Field(default=0.0, ge=0, lt=0.8)
    inertia_per_rev: float = Field(default=1.0, gt=0)
    stiffness_share: float = Field(default=0.0, ge=0, lt=0.8)
    stiffness_per_rev: float = Field(default=1.0, gt=0)
    slip_per_s: float = Field(default=0.0, ge=0)
    dip_share: float = Field(default=0.0, ge=0, le=1)
    dip_s: float = Field(default=0.0, ge=0)
    dip_every_s: float = Field(default=1.0, gt=0)
    interpolation_rad: float = Field(default=0.0, ge=0)
    interpolation_per_rev: float = Field(default=2048.0, gt=0)
    jitter_s: float = Field(default=0.0, ge=0)

    @property
    def active(self) -> bool:
        """Whether anything differs from an axis as the analysis assumes it."""
        return self != RoughTorqueSpec()
