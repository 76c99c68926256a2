"""Parameters of a drive that command motion, and parameters on which a motion relies."""

from __future__ import annotations

from profiles.schema import Profile

#: Roles that command motion; they are never marked as changed but not saved.
_COMMAND_ROLES = frozenset({
    "control_word", "mode", "position_target", "position_offset", "velocity_target",
    "velocity_offset", "torque_target", "torque_offset",
})  # fmt: skip

#: Roles that a motion sets for its duration, or that change the meaning of its values.
_MOTION_ROLES = frozenset({
    "profile_velocity", "profile_acceleration", "profile_deceleration", "max_torque",
    "torque_limit_positive", "torque_limit_negative", "home_offset", "quick_stop_deceleration",
})  # fmt: skip


def command_keys(profile: Profile) -> frozenset[str]:
    """Keys whose write commands motion or a procedure immediately."""
    return frozenset(
        {signal.key for signal in profile.signals if signal.role in _COMMAND_ROLES}
        | {step.key for proc in profile.procedures for step in proc.steps if step.do == "write"}
    )


def motion_keys(profile: Profile) -> frozenset[str]:
    """Keys that must stay as they are while a motion is under way.

    These are commands, gearing, unit switches, and the values that a motion sets for its duration:
    ramps and torque limits. Gains may be changed while the axis moves.
    """
    return (
        command_keys(profile)
        | {s.key for s in profile.signals if s.role in _MOTION_ROLES}
        | profile.unit_keys
        | {"607E:00"}  # polarity (CiA 402-2 clause 7)
        | {q.key for q in profile.quirks if q.kind == "unit_switch" and q.key is not None}
    )
