"""Scales of an axis as stated by a person: after a small move, or from a data sheet."""

from __future__ import annotations

from backend.axes.axis.axis import Axis
from backend.axes.scales.resolve import read_reported
from backend.axes.scales.taught import Taught
from backend.axes.scales.units_found import nearest_unit
from drivers.errors import NotAllowed, OutOfRange
from drivers.texts import limits

#: Smallest travel that a person can estimate by eye [rev].
_LEAST_REV = 0.05
_MOST_REV = 1e6


async def confirmed(axis: Axis, turned_rev: float) -> Taught:
    """The scales after the last small move, for which a person states how far the shaft turned.

    The unit of speed is the usual unit that fits 606Ch during the move. Where 606Ch showed nothing,
    or its factor fits no usual unit, the unit stays as it was.

    Raises:
        NotAllowed: no small move was made with the scales that the drive has now, or 606Ch has
            the opposite sign of 6064h.
        OutOfRange: too short to be estimated by eye, or too long.
    """
    # A small move made with other increments than the present ones does not count.
    await axis.read_scales()
    drive, last = axis.drive, axis.small_moves
    if last is None:
        raise NotAllowed("axis.no-small-move-made", drive=drive.name)
    if not _LEAST_REV <= abs(turned_rev) <= _MOST_REV:
        raise OutOfRange(
            "axis.rev-cannot-reported-eye",
            drive=drive.name,
            value=turned_rev,
            limit=limits.at_least(_LEAST_REV, "rev"),
        )
    if last.raw_per_inc_s is not None and last.raw_per_inc_s < 0:
        raise NotAllowed("axis.606ch-6064h-opposite-signs", drive=drive.name, parameter="606C:00")
    counts = abs(last.moved / turned_rev)
    before = axis.taught
    per_rpm = before.raw_per_rpm if before is not None else None
    unit = None if last.raw_per_inc_s is None else nearest_unit(last.raw_per_inc_s, counts)
    if unit is not None:
        per_rpm = unit[0]
    return Taught(
        counts_per_rev=counts,
        raw_per_rpm=per_rpm,
        raw_per_rpm_s=before.raw_per_rpm_s if before is not None else None,
        velocity_origin="user" if unit is None else "measured",
        bound_to=dict((await read_reported(drive)).raws),
    )


async def stated(
    axis: Axis,
    counts_per_rev: float | None,
    raw_per_rpm: float | None,
    raw_per_rpm_s: float | None,
) -> Taught:
    """Scales from a data sheet; a scale that is None stays as stated before.

    Raises:
        OutOfRange: a scale is not a positive number.
        DriveError: the objects of the scales cannot be read.
    """
    before = axis.taught or Taught()
    for name, value in (
        ("counts_per_rev", counts_per_rev),
        ("raw_per_rpm", raw_per_rpm),
        ("raw_per_rpm_s", raw_per_rpm_s),
    ):
        if value is not None and not 0 < value < 1e12:
            raise OutOfRange(
                "axis.detail",
                drive=axis.drive.name,
                value=value,
                limit=limits.above_zero(),
                name=name,
            )
    return Taught(
        counts_per_rev=counts_per_rev or before.counts_per_rev,
        raw_per_rpm=raw_per_rpm or before.raw_per_rpm,
        raw_per_rpm_s=raw_per_rpm_s or before.raw_per_rpm_s,
        velocity_origin="user" if raw_per_rpm is not None else before.velocity_origin,
        bound_to=dict((await read_reported(axis.drive)).raws),
    )
