"""Times in requests."""

from __future__ import annotations

from datetime import UTC, datetime

from drivers.errors import OutOfRange


def in_utc(moment: datetime | None) -> datetime | None:
    """Convert a time to UTC; one without a zone is treated as UTC.

    Raises:
        OutOfRange: there is no such time in UTC (at the ends of the calendar).
    """
    if moment is None:
        return None
    if moment.tzinfo is None:
        return moment.replace(tzinfo=UTC)
    try:
        return moment.astimezone(UTC)
    except OverflowError as error:
        raise OutOfRange("api.no-time-utc", value=str(moment), moment=str(moment)) from error
