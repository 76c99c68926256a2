"""Writing an electronic gear as one step: all values are written, or all are restored."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from backend.axes.axis.axis import Axis
from backend.axes.axis.restoring import CLEANUP_TIMEOUT_S, shielded
from backend.axes.scales.gear_calculator import GearPlan, GearValue, Mechanics, plan_gear
from backend.axes.scales.units import encoder_counts
from drivers.cia402 import State
from drivers.errors import DriveError, NotAllowed, Rejected
from drivers.texts.message import Text, joined, text
from profiles.schema import Raw

#: Roles whose values stay the same and so change their meaning with the gear.
_COUNTED_ROLES = (
    "software_limit_min", "software_limit_max", "home_offset", "following_error_window",
    "profile_velocity", "profile_acceleration", "profile_deceleration",
    "quick_stop_deceleration", "homing_speed_switch", "homing_speed_zero",
    "homing_acceleration",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class GearChange:
    """A written gear.

    ``before``: raw values that undo it, by key. ``waits``: keys not in effect yet, each with the
    action it waits for.
    """

    before: dict[str, int]
    waits: dict[str, str]


async def plan(axis: Axis, mechanics: Mechanics) -> GearPlan:
    """Gear parameters for these mechanics, with the encoder that the drive reports.

    Raises:
        OutOfRange: the mechanics do not fit the drive's parameters.
        DriveError: the encoder's resolution cannot be read.
    """
    return plan_gear(axis.drive.profile, mechanics, await encoder_counts(axis.drive))


def counted_in_increments(axis: Axis) -> list[str]:
    """Keys of parameters whose values have another meaning under another gear."""
    drive = axis.drive
    found = []
    for role in _COUNTED_ROLES:
        parameter = drive.profile.by_role.get(role)
        if parameter is not None and ("inc" in parameter.unit or parameter.unit == "pulse"):
            found.append(parameter.key)
    return found


async def write_gear(axis: Axis, values: Sequence[GearValue]) -> GearChange:
    """Write all values, each read back; on a failure those already written are restored.

    Raises:
        NotAllowed: the axis is enabled.
        Rejected: the drive keeps another value.
        DriveError: a write failed; the message states what could not be restored.
    """
    drive = axis.drive
    if await axis.state() is State.OPERATION_ENABLED:
        raise NotAllowed("functions.gear-changes-position-means", drive=drive.name)
    before: dict[str, int] = {}
    for value in values:
        before[value.parameter.key] = await drive.raw(value.parameter.key)
    done: list[str] = []
    # On the restore list in case this server is killed with half of the gear written.
    with drive.pending_restores.temporary(before):
        try:
            await _write_all(axis, values, before, done)
        except BaseException as error:
            # Half of a gear is another scale: the next move would go to a wrong position.
            taken_back = _put_back(axis, {key: before[key] for key in reversed(done)}, error)
            await shielded(lambda: taken_back, CLEANUP_TIMEOUT_S, drive.name)
            raise
        finally:
            axis.forget()
    waits = {key: why for key, why in drive.pending.items() if key in done}
    return GearChange({key: before[key] for key in done}, waits)


async def _write_all(
    axis: Axis, values: Sequence[GearValue], before: dict[str, int], done: list[str]
) -> None:
    """Write the values; the key of every write is added to ``done`` before it is sent."""
    drive = axis.drive
    for value in values:
        key = value.parameter.key
        if before[key] == value.raw:
            continue
        done.append(key)
        kept: Raw | None = (await drive.write(key, value.raw)).raw
        if kept != value.raw:
            raise Rejected(
                "functions.keeps-instead",
                abort_code=0,
                drive=drive.name,
                parameter=key,
                value=value.raw,
                key=value.parameter.name,
                kept=kept,
            )


async def _put_back(axis: Axis, before: dict[str, int], error: BaseException) -> None:
    left: list[Text] = []
    for key, raw in before.items():
        try:
            await axis.drive.write(key, raw)
        except DriveError as other:
            left.append(text("functions.value-not-restored", key=key, raw=raw, cause=other.text))
            axis.drive.pending_restores.add({key: raw})
    if left and isinstance(error, DriveError):
        error.text = text("functions.not-restored", cause=error.text, left=joined(left))
